//! Mesh simplification that preserves appearance.
//!
//! Edges are collapsed in the order of their cost, which quadrics measure in the space of positions, normals and
//! materials together (Garland & Heckbert, Simplifying Surfaces with Color and Texture using Quadric Error Metrics,
//! IEEE Visualization 1998). A vertex only ever moves onto a neighbour, so no normal or material has to be
//! interpolated. Vertices at creases and open borders stay.
//!
//! The `meshopt` crate simplifies with attributes, too, but binds a C++ library whose rounding depends on its
//! compiler. Images must be byte-identical on every machine, and hence the meshes: this is plain `f64` arithmetic
//! in a fixed order.

use std::{cmp::Reverse, collections::BinaryHeap};

use super::lod::Lod;
use crate::camera::{math::V3, shade::pattern::SKY_VISIBILITY};

/// Number of components of position, normal and material.
const ALL_DIMENSIONS: usize = 12;
/// Number of those that change over a surface of one material: position, normal and visibility of the sky.
const UNIFORM_DIMENSIONS: usize = 7;
/// Deviation of a normal that costs as much as a displacement by the tolerance, rad.
const NORMAL_TOLERANCE: f64 = 0.15;
/// Deviation of a material component that costs as much.
const MATERIAL_TOLERANCE: f64 = 0.005;
/// Cost, in squares of the tolerance, at which a surface is off by about the tolerance. A quadric sums squared
/// distances over all triangles it represents, and removed vertices are farther off than the middles of edges.
const MAX_COST: f64 = 64.0;
/// Minimum cosine by which a collapse may turn a triangle.
const MIN_TURN_COSINE: f32 = 0.5;
/// Minimum ratio of twice the area of a triangle to the square of its longest edge after a collapse.
const MIN_ASPECT: f32 = 0.02;

type Point<const D: usize> = [f64; D];

/// xᵀ A x + 2 b · x + c: a weighted sum of squared distances from planes.
#[derive(Clone)]
struct Quadric<const D: usize> {
    a: [Point<D>; D],
    b: Point<D>,
    c: f64,
}

fn dot<const D: usize>(a: &Point<D>, b: &Point<D>) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Returns `a − scale · b`.
fn subtract_scaled<const D: usize>(a: &Point<D>, b: &Point<D>, scale: f64) -> Point<D> {
    std::array::from_fn(|i| a[i] - b[i] * scale)
}

impl<const D: usize> Quadric<D> {
    const ZERO: Self = Self { a: [[0.0; D]; D], b: [0.0; D], c: 0.0 };

    /// The squared distance from the plane through three points; `None` if they are collinear.
    fn from_triangle([p, q, r]: [&Point<D>; 3], weight: f64) -> Option<Self> {
        let normalized = |v: Point<D>| {
            let length = dot(&v, &v).sqrt();
            (length > 1e-12).then(|| v.map(|x| x / length))
        };
        let e = normalized(subtract_scaled(q, p, 1.0))?;
        let side = subtract_scaled(r, p, 1.0);
        let f = normalized(subtract_scaled(&side, &e, dot(&side, &e)))?;
        let (p_e, p_f) = (dot(p, &e), dot(p, &f));
        let a = |i: usize, j: usize| f64::from(i == j) - e[i] * e[j] - f[i] * f[j];
        Some(Self {
            a: std::array::from_fn(|i| std::array::from_fn(|j| weight * a(i, j))),
            b: std::array::from_fn(|i| weight * (p_e * e[i] + p_f * f[i] - p[i])),
            c: weight * (dot(p, p) - p_e * p_e - p_f * p_f),
        })
    }

    fn add(&mut self, other: &Self) {
        for (own, row) in self.a.iter_mut().zip(&other.a) {
            own.iter_mut().zip(row).for_each(|(own, x)| *own += x);
        }
        self.b.iter_mut().zip(&other.b).for_each(|(own, x)| *own += x);
        self.c += other.c;
    }

    fn cost(&self, x: &Point<D>) -> f64 {
        let square: f64 = self.a.iter().zip(x).map(|(row, xi)| xi * dot(row, x)).sum();
        (square + 2.0 * dot(&self.b, x) + self.c).max(0.0)
    }
}

/// A candidate collapse. The derived order sorts by cost, then by vertices, which makes the sequence unique.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Collapse {
    /// Bits of the cost, which sort like non-negative numbers.
    cost_bits: u64,
    from: u32,
    to: u32,
    /// Sum of the revisions of both vertices when the candidate was queued.
    revision: u32,
}

/// A mesh while it loses vertices.
struct Simplifier<'a, const D: usize> {
    lod: &'a Lod,
    points: Vec<Point<D>>,
    quadrics: Vec<Quadric<D>>,
    triangles: Vec<[u32; 3]>,
    is_alive: Vec<bool>,
    /// Triangles adjacent to each vertex.
    adjacent: Vec<Vec<u32>>,
    /// True for vertices that must stay.
    is_pinned: Vec<bool>,
    /// Number of changes of each vertex's quadric.
    revisions: Vec<u32>,
    queue: BinaryHeap<Reverse<Collapse>>,
    /// Collapses that cost more are not queued.
    max_cost: f64,
    /// Square of the length up to which edges may grow, m².
    max_edge2: f32,
}

/// Returns a level of detail with as few triangles as look the same within `tolerance`. No edge grows beyond
/// `max_edge`. Both m.
pub(crate) fn simplify(lod: &Lod, tolerance: f32, max_edge: f32) -> Lod {
    if lod.is_uniform {
        Simplifier::<UNIFORM_DIMENSIONS>::new(lod, f64::from(tolerance), max_edge).run(tolerance)
    } else {
        Simplifier::<ALL_DIMENSIONS>::new(lod, f64::from(tolerance), max_edge).run(tolerance)
    }
}

impl<'a, const D: usize> Simplifier<'a, D> {
    fn new(lod: &'a Lod, tolerance: f64, max_edge: f32) -> Self {
        let point = |v: usize| {
            let (p, n, material) = (lod.positions[v], lod.normals[v], &lod.materials[v]);
            let mut x = [0.0; D];
            for axis in 0..3 {
                x[axis] = f64::from(p[axis]);
                x[3 + axis] = f64::from(n[axis]) * tolerance / NORMAL_TOLERANCE;
            }
            let first = if D == UNIFORM_DIMENSIONS { SKY_VISIBILITY } else { 0 };
            for (x, &value) in x[6..].iter_mut().zip(material.iter().skip(first)) {
                *x = f64::from(value) * tolerance / MATERIAL_TOLERANCE;
            }
            x
        };
        let count = lod.positions.len();
        let mut simplifier = Self {
            lod,
            points: (0..count).map(point).collect(),
            quadrics: vec![Quadric::ZERO; count],
            triangles: lod.triangles.clone(),
            is_alive: vec![true; lod.triangles.len()],
            adjacent: vec![Vec::new(); count],
            is_pinned: vec![false; count],
            revisions: vec![0; count],
            queue: BinaryHeap::new(),
            max_cost: MAX_COST * tolerance * tolerance,
            max_edge2: max_edge * max_edge,
        };
        let area = |t: &[u32; 3]| f64::from(simplifier.area_normal(t).norm());
        let mean = lod.triangles.iter().map(area).sum::<f64>() / lod.triangles.len().max(1) as f64;
        let weights: Vec<f64> = lod.triangles.iter().map(|t| (area(t) / mean).min(1.0)).collect();
        for (i, t) in lod.triangles.iter().enumerate() {
            t.iter().for_each(|&v| simplifier.adjacent[v as usize].push(i as u32));
            let corners = t.map(|v| &simplifier.points[v as usize]);
            if let Some(quadric) = Quadric::from_triangle(corners, weights[i]) {
                t.iter().for_each(|&v| simplifier.quadrics[v as usize].add(&quadric));
            }
        }
        for v in 0..count {
            simplifier.is_pinned[v] = simplifier.is_at_border(v as u32);
        }
        simplifier
    }

    /// Collapses edges, the cheapest first.
    fn run(mut self, tolerance: f32) -> Lod {
        for v in 0..self.points.len() as u32 {
            self.queue_collapses(v, |other| other > v);
        }
        while let Some(Reverse(Collapse { from, to, revision, .. })) = self.queue.pop() {
            let current = self.revisions[from as usize] + self.revisions[to as usize];
            if current == revision && self.is_valid(from, to) {
                self.collapse(from, to);
            }
        }
        self.finish(tolerance)
    }

    /// Normal of a triangle, twice as long as its area.
    fn area_normal(&self, t: &[u32; 3]) -> V3 {
        let [a, b, c] = t.map(|v| self.lod.positions[v as usize]);
        (b - a).cross(&(c - a))
    }

    /// Neighbours of a vertex, sorted, once for each triangle that both share.
    fn neighbours(&self, v: u32) -> Vec<u32> {
        let corners = self.adjacent[v as usize].iter().flat_map(|&t| self.triangles[t as usize]);
        let mut neighbours: Vec<u32> = corners.filter(|&other| other != v).collect();
        neighbours.sort_unstable();
        neighbours
    }

    /// True if the surface ends at a vertex, as it also does at creases.
    fn is_at_border(&self, v: u32) -> bool {
        self.neighbours(v).chunk_by(|a, b| a == b).any(|same| same.len() != 2)
    }

    /// Queues the collapses along the edges from a vertex to neighbours that are `selected`, in both directions.
    fn queue_collapses(&mut self, v: u32, selected: impl Fn(u32) -> bool) {
        let mut neighbours = self.neighbours(v);
        neighbours.dedup();
        for other in neighbours.into_iter().filter(|&other| selected(other)) {
            for (from, to) in [(v, other), (other, v)] {
                if self.is_pinned[from as usize] {
                    continue;
                }
                let x = &self.points[to as usize];
                let cost = self.quadrics[from as usize].cost(x) + self.quadrics[to as usize].cost(x);
                if cost > self.max_cost {
                    continue;
                }
                let revision = self.revisions[from as usize] + self.revisions[to as usize];
                self.queue.push(Reverse(Collapse { cost_bits: cost.to_bits(), from, to, revision }));
            }
        }
    }

    /// True if the surface stays a manifold and no triangle flips, degenerates or grows too long when `from` moves onto
    /// `to`.
    fn is_valid(&self, from: u32, to: u32) -> bool {
        let (mut own, mut other) = (self.neighbours(from), self.neighbours(to));
        own.dedup();
        other.dedup();
        if own.iter().filter(|v| other.binary_search(v).is_ok()).count() != 2 {
            return false;
        }
        self.adjacent[from as usize].iter().map(|&t| self.triangles[t as usize]).all(|t| {
            if t.contains(&to) {
                return true;
            }
            let moved = t.map(|v| if v == from { to } else { v });
            let (before, after) = (self.area_normal(&t), self.area_normal(&moved));
            let [a, b, c] = moved.map(|v| self.lod.positions[v as usize]);
            let longest2 = (b - a).norm_squared().max((c - b).norm_squared()).max((a - c).norm_squared());
            before.dot(&after) > MIN_TURN_COSINE * before.norm() * after.norm()
                && after.norm() > MIN_ASPECT * longest2
                && longest2 <= self.max_edge2
        })
    }

    fn collapse(&mut self, from: u32, to: u32) {
        for t in std::mem::take(&mut self.adjacent[from as usize]) {
            let triangle = &mut self.triangles[t as usize];
            if triangle.contains(&to) {
                self.is_alive[t as usize] = false;
                for v in triangle.iter().filter(|&&v| v != from) {
                    self.adjacent[*v as usize].retain(|&other| other != t);
                }
            } else {
                triangle.iter_mut().filter(|v| **v == from).for_each(|v| *v = to);
                self.adjacent[to as usize].push(t);
            }
        }
        let quadric = std::mem::replace(&mut self.quadrics[from as usize], Quadric::ZERO);
        self.quadrics[to as usize].add(&quadric);
        self.revisions[from as usize] += 1;
        self.revisions[to as usize] += 1;
        self.queue_collapses(to, |_| true);
    }

    fn finish(self, tolerance: f32) -> Lod {
        let lod = self.lod;
        let mut new_index = vec![u32::MAX; lod.positions.len()];
        let used: Vec<usize> = (0..new_index.len()).filter(|&v| !self.adjacent[v].is_empty()).collect();
        used.iter().enumerate().for_each(|(i, &v)| new_index[v] = i as u32);
        let alive = || (0..self.triangles.len()).filter(|&t| self.is_alive[t]);
        Lod {
            positions: used.iter().map(|&v| lod.positions[v]).collect(),
            normals: used.iter().map(|&v| lod.normals[v]).collect(),
            materials: used.iter().map(|&v| lod.materials[v]).collect(),
            triangles: alive().map(|t| self.triangles[t].map(|v| new_index[v as usize])).collect(),
            smoothing_groups: alive().map(|t| lod.smoothing_groups[t]).collect(),
            vertex_spacing: lod.vertex_spacing,
            is_uniform: lod.is_uniform,
            geometric_error: lod.geometric_error + tolerance,
            missing_relief: lod.missing_relief,
            ..Lod::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::mesh::lod::bake_vertices;
    use softvt_geometry::{mesh::Mesh, shape::Shape, surface_mesh::SurfaceMesh};
    use softvt_scene::{Mask, Visual, VisualLayer};

    fn fine_level(shape: &Shape, cell: f64, visual: Visual) -> Lod {
        let mesh = SurfaceMesh::from_shape(shape, cell).mesh;
        let material_ids = vec![0; mesh.triangles.len()];
        bake_vertices(&mesh, &material_ids, &[visual], cell as f32, Some(shape))
    }

    #[test]
    fn a_simplified_ball_stays_closed_and_within_the_tolerance() {
        let (radius, tolerance) = (0.05, 2e-4);
        let fine = fine_level(&Shape::Sphere { radius }, 2e-3, Visual::default());
        let coarse = simplify(&fine, tolerance as f32, f32::MAX);
        assert!(5 * coarse.triangles.len() < fine.triangles.len(), "{}", coarse.triangles.len());
        for t in &coarse.triangles {
            let middle = t.iter().map(|&v| coarse.positions[v as usize]).sum::<V3>() / 3.0;
            let depth = radius - f64::from(middle.norm());
            assert!(depth.abs() < 3.0 * tolerance, "a triangle lies {depth} m inside");
        }
        let vertices = coarse.positions.iter().map(|p| p.cast()).collect();
        let mesh = Mesh { vertices, triangles: coarse.triangles, uvs: Vec::new() };
        assert_eq!(mesh.validate_closed(), Ok(()));
    }

    #[test]
    fn edges_of_a_flat_face_grow_up_to_the_limit() {
        let fine = fine_level(&Shape::Box { half: [0.04; 3].into() }, 2e-3, Visual::default());
        let coarse = simplify(&fine, 2e-4, 0.01);
        let edges = || {
            coarse
                .triangles
                .iter()
                .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)])
                .map(|(a, b)| (coarse.positions[a as usize] - coarse.positions[b as usize]).norm())
        };
        let longest = edges().fold(0.0, f32::max);
        assert!((0.006..=0.01).contains(&longest), "{longest}");
        assert!(4 * coarse.triangles.len() < fine.triangles.len(), "{}", coarse.triangles.len());
    }

    #[test]
    fn triangles_are_kept_at_the_border_of_a_pattern_and_removed_elsewhere() {
        let shape = Shape::Cylinder { radius: 0.08, half_height: 0.01 };
        let spot = Mask::Inside { shape: Shape::Sphere { radius: 0.03 }.into(), soft_m: 0.004 };
        let dark = VisualLayer { mask: spot, albedo: [0.02; 3], roughness: 0.5, opacity: 1.0, relief_m: 0.0 };
        let fine = fine_level(&shape, 3e-3, Visual::plain([0.8; 3], 0.5, 0.0).with(dark));
        let coarse = simplify(&fine, 2e-4, f32::MAX);
        let count_in_ring = |lod: &Lod, from: f32, to: f32| {
            let is_in_ring = |p: &&V3| p.z > 0.009 && (from..to).contains(&p.xy().norm());
            lod.positions.iter().filter(is_in_ring).count()
        };
        let [edge, plain] = [[0.025, 0.033], [0.04, 0.07]]
            .map(|[a, b]| (count_in_ring(&coarse, a, b), count_in_ring(&fine, a, b)));
        assert!(2 * edge.0 > edge.1, "{edge:?} vertices at the border of the pattern");
        assert!(10 * plain.0 < plain.1, "{plain:?} vertices where the surface is plain");
    }
}
