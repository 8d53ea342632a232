//! Fewer triangles for the same look: edges are collapsed in the order of what that changes, measured by quadrics in the
//! space of places, normals and looks together (Garland & Heckbert, Simplifying Surfaces with Color and Texture using
//! Quadric Error Metrics, IEEE Visualization 1998). A vertex is only ever moved onto one of its neighbours, so that no look
//! or normal has to be invented; vertices at creases and open borders stay.

use std::{cmp::Reverse, collections::BinaryHeap};

use crate::sensing::camera::{V3, mesh::render_mesh::Lod};

/// Place, normal, albedo, roughness, metalness and openness.
const DIMENSIONS: usize = 12;
/// A normal that is off by this much (rad), or a look by this much, counts as a place that is off by the tolerance.
const NORMAL: f64 = 0.15;
const LOOK: f64 = 0.005;
/// A quadric adds up the squares of the distances from the planes of all triangles that it stands for, and those of a
/// vertex that leaves are farther than the middles of its edges: so many squares of the tolerance are what a surface as far
/// off as that has.
const SQUARES: f64 = 64.0;
/// No triangle turns by more than this (cosine) in one collapse.
const TURN: f32 = 0.5;
/// Nor becomes narrower than this: twice its area in squares of its longest edge.
const NARROW: f32 = 0.02;

type Point = [f64; DIMENSIONS];

/// xᵀ A x + 2 b · x + c: the square of the distance from planes.
#[derive(Clone)]
struct Quadric {
    a: [Point; DIMENSIONS],
    b: Point,
    c: f64,
}

fn dot(a: &Point, b: &Point) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// `a − b · by`.
fn less(a: &Point, b: &Point, by: f64) -> Point {
    std::array::from_fn(|i| a[i] - b[i] * by)
}

impl Quadric {
    const ZERO: Self = Self { a: [[0.0; DIMENSIONS]; DIMENSIONS], b: [0.0; DIMENSIONS], c: 0.0 };

    /// That of the plane through three points; none if they lie on a line.
    fn of([p, q, r]: [&Point; 3], weight: f64) -> Option<Self> {
        let unit = |v: Point| {
            let length = dot(&v, &v).sqrt();
            (length > 1e-12).then(|| v.map(|x| x / length))
        };
        let e = unit(less(q, p, 1.0))?;
        let side = less(r, p, 1.0);
        let f = unit(less(&side, &e, dot(&side, &e)))?;
        let (along, across) = (dot(p, &e), dot(p, &f));
        let a = |i: usize, j: usize| f64::from(i == j) - e[i] * e[j] - f[i] * f[j];
        Some(Self {
            a: std::array::from_fn(|i| std::array::from_fn(|j| weight * a(i, j))),
            b: std::array::from_fn(|i| weight * (along * e[i] + across * f[i] - p[i])),
            c: weight * (dot(p, p) - along * along - across * across),
        })
    }

    fn add(&mut self, other: &Self) {
        for (own, row) in self.a.iter_mut().zip(&other.a) {
            own.iter_mut().zip(row).for_each(|(own, x)| *own += x);
        }
        self.b.iter_mut().zip(&other.b).for_each(|(own, x)| *own += x);
        self.c += other.c;
    }

    fn at(&self, x: &Point) -> f64 {
        let square: f64 = self.a.iter().zip(x).map(|(row, xi)| xi * dot(row, x)).sum();
        (square + 2.0 * dot(&self.b, x) + self.c).max(0.0)
    }
}

/// A mesh that is losing vertices.
struct Work<'a> {
    level: &'a Lod,
    points: Vec<Point>,
    quadrics: Vec<Quadric>,
    triangles: Vec<[u32; 3]>,
    alive: Vec<bool>,
    /// Triangles around each vertex.
    around: Vec<Vec<u32>>,
    kept: Vec<bool>,
    /// Grows whenever a vertex's quadric changes.
    stamps: Vec<u32>,
    /// Cost (its bits sort as it does), edge from and to, and their stamps.
    queue: BinaryHeap<Reverse<(u64, u32, u32, u32)>>,
}

/// A level with as few triangles as look the same but for `tolerance`, m.
pub(crate) fn decimated(level: &Lod, tolerance: f32) -> Lod {
    let mut work = Work::new(level, f64::from(tolerance));
    let most = SQUARES * f64::from(tolerance).powi(2);
    for v in 0..level.positions.len() as u32 {
        work.offer(v);
    }
    while let Some(Reverse((cost, from, to, stamp))) = work.queue.pop() {
        if f64::from_bits(cost) > most {
            break;
        }
        if work.stamps[from as usize] + work.stamps[to as usize] == stamp && work.fits(from, to) {
            work.collapse(from, to);
        }
    }
    work.finish(tolerance)
}

impl<'a> Work<'a> {
    fn new(level: &'a Lod, tolerance: f64) -> Self {
        let point = |v: usize| {
            let (p, n, look) = (level.positions[v], level.normals[v], level.looks[v].numbers());
            let mut x = [0.0; DIMENSIONS];
            for axis in 0..3 {
                x[axis] = f64::from(p[axis]);
                x[3 + axis] = f64::from(n[axis]) * tolerance / NORMAL;
            }
            look.iter().enumerate().for_each(|(i, &value)| x[6 + i] = f64::from(value) * tolerance / LOOK);
            x
        };
        let count = level.positions.len();
        let mut work = Self {
            level,
            points: (0..count).map(point).collect(),
            quadrics: vec![Quadric::ZERO; count],
            triangles: level.triangles.clone(),
            alive: vec![true; level.triangles.len()],
            around: vec![Vec::new(); count],
            kept: vec![false; count],
            stamps: vec![0; count],
            queue: BinaryHeap::new(),
        };
        let area = |t: &[u32; 3]| f64::from(work.area(t).norm());
        let mean = level.triangles.iter().map(area).sum::<f64>() / level.triangles.len().max(1) as f64;
        let weights: Vec<f64> = level.triangles.iter().map(|t| (area(t) / mean).min(1.0)).collect();
        for (i, t) in level.triangles.iter().enumerate() {
            t.iter().for_each(|&v| work.around[v as usize].push(i as u32));
            let quadric = Quadric::of(t.map(|v| v as usize).map(|v| &work.points[v]), weights[i]);
            if let Some(quadric) = quadric {
                t.iter().for_each(|&v| work.quadrics[v as usize].add(&quadric));
            }
        }
        for v in 0..count {
            work.kept[v] = work.at_border(v as u32);
        }
        work
    }

    fn area(&self, t: &[u32; 3]) -> V3 {
        let [a, b, c] = t.map(|v| self.level.positions[v as usize]);
        (b - a).cross(&(c - a))
    }

    /// Neighbours of a vertex, each as often as triangles have it beside it, sorted.
    fn beside(&self, v: u32) -> Vec<u32> {
        let own = self.around[v as usize].iter().flat_map(|&t| self.triangles[t as usize]);
        let mut all: Vec<u32> = own.filter(|&other| other != v).collect();
        all.sort_unstable();
        all
    }

    /// Whether the surface ends at a vertex, as it also does at creases.
    fn at_border(&self, v: u32) -> bool {
        self.beside(v).chunk_by(|a, b| a == b).any(|same| same.len() != 2)
    }

    /// Puts the collapses of a vertex into the queue.
    fn offer(&mut self, v: u32) {
        let mut others = self.beside(v);
        others.dedup();
        for other in others {
            for (from, to) in [(v, other), (other, v)] {
                if self.kept[from as usize] {
                    continue;
                }
                let x = &self.points[to as usize];
                let cost = self.quadrics[from as usize].at(x) + self.quadrics[to as usize].at(x);
                let stamp = self.stamps[from as usize] + self.stamps[to as usize];
                self.queue.push(Reverse((cost.to_bits(), from, to, stamp)));
            }
        }
    }

    /// Whether the surface stays one, and faces where it faced, if `from` moves to `to`.
    fn fits(&self, from: u32, to: u32) -> bool {
        let (mut own, mut other) = (self.beside(from), self.beside(to));
        own.dedup();
        other.dedup();
        if own.iter().filter(|v| other.binary_search(v).is_ok()).count() != 2 {
            return false;
        }
        self.around[from as usize].iter().map(|&t| self.triangles[t as usize]).all(|t| {
            if t.contains(&to) {
                return true;
            }
            let moved = t.map(|v| if v == from { to } else { v });
            let (before, after) = (self.area(&t), self.area(&moved));
            let [a, b, c] = moved.map(|v| self.level.positions[v as usize]);
            let longest = (b - a).norm_squared().max((c - b).norm_squared()).max((a - c).norm_squared());
            before.dot(&after) > TURN * before.norm() * after.norm() && after.norm() > NARROW * longest
        })
    }

    fn collapse(&mut self, from: u32, to: u32) {
        for t in std::mem::take(&mut self.around[from as usize]) {
            let triangle = &mut self.triangles[t as usize];
            if triangle.contains(&to) {
                self.alive[t as usize] = false;
                for v in triangle.iter().filter(|&&v| v != from) {
                    self.around[*v as usize].retain(|&other| other != t);
                }
            } else {
                triangle.iter_mut().filter(|v| **v == from).for_each(|v| *v = to);
                self.around[to as usize].push(t);
            }
        }
        let quadric = std::mem::replace(&mut self.quadrics[from as usize], Quadric::ZERO);
        self.quadrics[to as usize].add(&quadric);
        self.stamps[from as usize] += 1;
        self.stamps[to as usize] += 1;
        self.offer(to);
    }

    fn finish(self, tolerance: f32) -> Lod {
        let level = self.level;
        let mut new = vec![u32::MAX; level.positions.len()];
        let used: Vec<usize> = (0..new.len()).filter(|&v| !self.around[v].is_empty()).collect();
        used.iter().enumerate().for_each(|(i, &v)| new[v] = i as u32);
        let left = || (0..self.triangles.len()).filter(|&t| self.alive[t]);
        Lod {
            positions: used.iter().map(|&v| level.positions[v]).collect(),
            normals: used.iter().map(|&v| level.normals[v]).collect(),
            looks: used.iter().map(|&v| level.looks[v]).collect(),
            triangles: left().map(|t| self.triangles[t].map(|v| new[v as usize])).collect(),
            facets: Vec::new(),
            places: Vec::new(),
            patches: left().map(|t| level.patches[t]).collect(),
            embedding: Vec::new(),
            spacing: level.spacing,
            plain: level.plain,
            flaw: level.flaw + tolerance,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        geometry::{shape::Shape, surface_mesh::SurfaceMesh},
        scene::{Mask, Visual, VisualLayer},
        sensing::camera::mesh::render_mesh::bake,
    };

    fn level(shape: &Shape, cell: f64, visual: Visual) -> Lod {
        let mesh = SurfaceMesh::from_shape(shape, cell).mesh;
        let materials = vec![0; mesh.triangles.len()];
        bake(&mesh, &materials, &[visual], cell as f32, Some(shape))
    }

    #[test]
    fn a_ball_with_few_triangles_stays_closed_and_within_the_tolerance() {
        let (radius, tolerance) = (0.05, 2e-4);
        let fine = level(&Shape::Sphere { radius }, 2e-3, Visual::default());
        let coarse = decimated(&fine, tolerance as f32);
        assert!(5 * coarse.triangles.len() < fine.triangles.len(), "{}", coarse.triangles.len());
        let mut balance = std::collections::BTreeMap::new();
        for t in &coarse.triangles {
            for i in 0..3 {
                let (a, b) = (t[i], t[(i + 1) % 3]);
                *balance.entry((a.min(b), a.max(b))).or_insert(0) += if a < b { 1 } else { -1 };
            }
            let middle = t.iter().map(|&v| coarse.positions[v as usize]).sum::<V3>() / 3.0;
            let depth = radius - f64::from(middle.norm());
            assert!(depth.abs() < 3.0 * tolerance, "a triangle lies {depth} m inside");
        }
        assert!(balance.values().all(|&sum| sum == 0), "every edge is passed once each way");
    }

    #[test]
    fn a_pattern_keeps_its_triangles_and_what_is_plain_does_not() {
        let shape = Shape::Cylinder { radius: 0.08, half_height: 0.01 };
        let spots = Mask::Inside { shape: Shape::Sphere { radius: 0.03 }.into(), soft_m: 0.004 };
        let dark =
            VisualLayer { mask: spots, albedo: [0.02; 3], roughness: 0.5, opacity: 1.0, relief_m: 0.0 };
        let fine = level(&shape, 3e-3, Visual::plain([0.8; 3], 0.5, 0.0).with(dark));
        let coarse = decimated(&fine, 2e-4);
        let near = |of: &Lod, from: f32, to: f32| {
            let ring = |p: &&V3| p.z > 0.009 && (from..to).contains(&p.xy().norm());
            of.positions.iter().filter(ring).count()
        };
        let [edge, plain] =
            [[0.025, 0.033], [0.04, 0.07]].map(|[a, b]| (near(&coarse, a, b), near(&fine, a, b)));
        assert!(2 * edge.0 > edge.1, "{edge:?} at the border of the pattern");
        assert!(10 * plain.0 < plain.1, "{plain:?} where nothing is");
    }
}
