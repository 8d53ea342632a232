//! Extraction of the surface features of a shape that can touch another: sharp corners and edges, rims, flat regions,
//! and seeds on its smooth parts.

use std::collections::HashMap;

use nalgebra::SymmetricEigen;
use serde::{Deserialize, Serialize};

use super::{
    POINT_AREA, Placed, Primitive,
    flat_region::{FlatSample, flat_samples, project_to_surface},
};
use softvt_geometry::{
    Mat3, Pose, Vec3, hex8,
    mesh::Mesh,
    orthonormal_basis,
    shape::{Polygon, Shape},
};

/// Grid cells along the longest side of a shape in the search for its sharp edges.
const EDGE_CELLS: f64 = 24.0;
/// Grid cells along the longest side in the choice of seeds on its smooth parts.
const SEED_CELLS: f64 = 8.0;
/// Two faces form an edge if their normals differ by more than about 30°: then the second eigenvalue of the sum of n
/// nᵀ is above tan²(15°) times the first.
const MIN_EIGENVALUE_RATIO: f64 = 0.07;
/// Convex turn (sine) at the corner of a profile from which its circle is a rim: 20°.
const RIM_TURN: f64 = 0.34;
/// The same for a corner on which the solid can stand, though it is part of a rounding.
const FOOT_TURN: f64 = 5e-3;
/// Slope of the edges of a profile from which they form a tip on the axis.
const TIP_SLOPE: f64 = 0.34;
/// Radius up to which a point of a profile is on the axis, m.
const ON_AXIS: f64 = 1e-6;
/// Distance from an edge at which its normals are compared, m: a rounding of less than 0.5 mm counts as an edge.
const SHARP_DISTANCE: f64 = 1e-4;
/// Difference of these normals (chord of the unit circle, 20°) beyond which the edge is sharp.
const SHARP_TURN: f64 = 0.35;
/// Slope of an edge at a vertex of a mesh from which it descends from there.
const VERTEX_SLOPE: f64 = 1e-4;
/// Distance of a vertex from a sample on a sharp edge up to which they are one, m.
const SAME_POINT: f64 = 1e-5;
/// Area of a sample on a sharp edge, m²: several of them together carry as one point contact.
pub(super) const SAMPLE_AREA: f64 = 0.25 * POINT_AREA;

/// A convex circle of the surface, about the z axis of `frame_o` in its plane z = 0.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(in super::super) struct Rim {
    /// Frame of the circle in the object frame.
    pub frame_o: Pose,
    /// Radius, m.
    pub radius: f64,
    /// True if it is an edge, false if it is the lowest circle of a rounding.
    pub is_sharp: bool,
}

/// Features of a surface that are tested for contact, object frame, m.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SurfaceFeatures {
    /// Points on sharp convex corners and edges.
    pub(in super::super) corners: Vec<Vec3>,
    /// Circular edges of convex solids.
    pub(in super::super) rims: Vec<Rim>,
    /// Samples of flat and nearly flat regions, and of finely rounded edges, and vertices of meshes.
    pub(in super::super) flat_samples: Vec<FlatSample>,
    /// Points spread over the whole surface, at which the search for the lowest point of a smooth part starts.
    pub(in super::super) seeds: Vec<Vec3>,
    /// Distance between neighbouring seeds, m.
    pub(in super::super) spacing: f64,
    /// True if the shape has vertices of meshes.
    pub(in super::super) has_vertices: bool,
}

impl SurfaceFeatures {
    /// Extracts the features of a shape. Those of boxes, cylinders and lathes are known exactly; the sharp edges and
    /// flat regions of other shapes are found on a grid of 1/24 of the longest side.
    ///
    /// A mesh touches with its vertices (Guendelman, Bridson & Fedkiw, SIGGRAPH 2003), which stay the same from step to
    /// step. Facets that are smaller than the distance of the seeds have no seeds.
    pub fn of(shape: &Shape) -> Self {
        let mut features = Self::default();
        add_features(shape, &Pose::identity(), &mut features);
        let vertices = mesh_vertices(shape);
        features.has_vertices = !vertices.is_empty();
        let is_new = |p: &Vec3, known: &[Vec3]| known.iter().all(|q| (p - q).norm() > SAME_POINT);
        let convex = vertices.iter().filter(|v| v.is_convex && is_new(&v.p, &features.corners));
        features.flat_samples.extend(convex.map(|v| FlatSample { p: v.p, area: POINT_AREA }));
        let size = shape.bounds().size().max();
        features.spacing = size / SEED_CELLS;
        let is_on =
            |p: &Vec3, v: &MeshVertex| v.longest_edge < features.spacing && (p - v.p).norm() < v.longest_edge;
        features.seeds = FeatureGrid::over(shape, features.spacing)
            .crossed()
            .map(|cell| project_to_surface(shape, cell.mean()))
            .filter(|p| !vertices.iter().any(|v| is_on(p, v)))
            .collect();
        features
    }
}

/// A vertex of a mesh.
struct MeshVertex {
    /// Position, m.
    p: Vec3,
    /// Length of the longest edge at it, m.
    longest_edge: f64,
    /// True if an edge descends from it; false on a flat and in a hollow.
    is_convex: bool,
}

/// The vertices of the meshes that a shape is composed of.
fn mesh_vertices(shape: &Shape) -> Vec<MeshVertex> {
    match shape {
        Shape::Placed { shape, pose } => {
            let placed = |v: MeshVertex| MeshVertex { p: (pose * nalgebra::Point3::from(v.p)).coords, ..v };
            mesh_vertices(shape).into_iter().map(placed).collect()
        }
        Shape::Scaled { shape, scale } => {
            let scaled = |v: MeshVertex| MeshVertex {
                p: scale.component_mul(&v.p),
                longest_edge: scale.max() * v.longest_edge,
                ..v
            };
            mesh_vertices(shape).into_iter().map(scaled).collect()
        }
        Shape::Paint { shape, .. } => mesh_vertices(shape),
        Shape::Union(parts) => {
            let is_outside = |v: &MeshVertex| shape.distance(&v.p) > -SAME_POINT;
            parts.iter().flat_map(mesh_vertices).filter(is_outside).collect()
        }
        Shape::Mesh(solid) => {
            let Mesh { vertices, triangles, .. } = solid.mesh();
            let mut normals = vec![Vec3::zeros(); vertices.len()];
            let corners = |t: &[u32; 3]| t.map(|v| (v as usize, vertices[v as usize]));
            for [a, b, c] in triangles.iter().map(corners) {
                let normal = (b.1 - a.1).cross(&(c.1 - a.1)).try_normalize(0.0).unwrap_or_default();
                [a, b, c].into_iter().for_each(|(v, _)| normals[v] += normal);
            }
            let vertex = |p: &Vec3| MeshVertex { p: *p, longest_edge: 0.0, is_convex: false };
            let mut out: Vec<MeshVertex> = vertices.iter().map(vertex).collect();
            for [a, b, c] in triangles.iter().map(corners) {
                for ((v, from), (_, to)) in [(a, b), (b, c), (c, a)] {
                    let (edge, length) = (to - from, (to - from).norm());
                    out[v].longest_edge = out[v].longest_edge.max(length);
                    out[v].is_convex |= normals[v].dot(&edge) < -VERTEX_SLOPE * normals[v].norm() * length;
                }
            }
            out
        }
        _ => Vec::new(),
    }
}

/// The convex primitives that a shape is composed of, with their frames in the object frame. `None` if
/// it has other parts.
pub(in super::super) fn primitives(shape: &Shape) -> Option<Vec<Placed<Primitive>>> {
    let primitive = match shape {
        Shape::Box { half } => Primitive::Box { half: *half },
        Shape::Sphere { radius } => Primitive::Sphere { radius: *radius },
        Shape::Cylinder { radius, half_height } => {
            Primitive::Cylinder { radius: *radius, half_height: *half_height }
        }
        Shape::Capsule { radius, half_length } => {
            Primitive::Capsule { radius: *radius, half_height: *half_length }
        }
        Shape::Placed { shape, pose } => {
            let mut parts = primitives(shape)?;
            parts.iter_mut().for_each(|part| part.pose = pose * part.pose);
            return Some(parts);
        }
        Shape::Paint { shape, .. } => return primitives(shape),
        Shape::Union(parts) => {
            let parts: Option<Vec<_>> = parts.iter().map(primitives).collect();
            return Some(parts?.into_iter().flatten().collect());
        }
        _ => return None,
    };
    Some(vec![Placed { shape: primitive, pose: Pose::identity() }])
}

/// Adds the features of `shape` at `frame_o`.
fn add_features(shape: &Shape, frame_o: &Pose, features: &mut SurfaceFeatures) {
    let rim = |z: f64, radius: f64, is_sharp: bool| Rim {
        frame_o: frame_o * nalgebra::Translation3::new(0.0, 0.0, z),
        radius,
        is_sharp,
    };
    match shape {
        Shape::Box { half } => features.corners.extend((0..8).map(|corner| {
            let sign = hex8::corner_sign(corner);
            (frame_o * nalgebra::Point3::from(half.component_mul(&sign))).coords
        })),
        Shape::Cylinder { radius, half_height } => {
            features.rims.extend([rim(-half_height, *radius, true), rim(*half_height, *radius, true)]);
        }
        Shape::Lathe(profile) => {
            for ProfileCorner { r, z, is_sharp } in convex_corners(profile) {
                if r > ON_AXIS {
                    features.rims.push(rim(z, r, is_sharp));
                } else if is_sharp {
                    features.corners.push((frame_o * nalgebra::Point3::new(0.0, 0.0, z)).coords);
                }
            }
        }
        Shape::Placed { shape, pose } => add_features(shape, &(frame_o * pose), features),
        Shape::Paint { shape, .. } => add_features(shape, frame_o, features),
        Shape::Torus { major, minor } => {
            features.rims.extend([rim(-minor, *major, false), rim(*minor, *major, false)]);
        }
        Shape::Sphere { .. } | Shape::Capsule { .. } | Shape::Ellipsoid { .. } => {}
        _ => add_general_features(shape, frame_o, features),
    }
}

/// Adds the features of a general shape, found on a grid.
fn add_general_features(shape: &Shape, frame_o: &Pose, features: &mut SurfaceFeatures) {
    let step = shape.bounds().size().max() / EDGE_CELLS;
    let cells: Vec<Cell> = FeatureGrid::over(shape, step).crossed().collect();
    let edges = cells.iter().filter_map(|cell| cell.sharp_point(shape, step));
    let (sharp, blunt): (Vec<Vec3>, Vec<Vec3>) = edges.partition(|p| is_sharp(shape, p));
    let starts: Vec<Vec3> = cells.iter().map(Cell::mean).collect();
    let to_object = |p: &Vec3| (frame_o * nalgebra::Point3::from(*p)).coords;
    let blunt = blunt.into_iter().map(|p| FlatSample { p, area: SAMPLE_AREA });
    let all = flat_samples(shape, &starts, step, &sharp, SAMPLE_AREA).into_iter().chain(blunt);
    features.flat_samples.extend(all.map(|spot| FlatSample { p: to_object(&spot.p), ..spot }));
    features.corners.extend(sharp.iter().map(to_object));
}

/// True if the surface has an edge at `p`, and not a rounding.
fn is_sharp(shape: &Shape, p: &Vec3) -> bool {
    let normal = shape.distance_and_normal(p).1;
    let [u, v] = orthonormal_basis(&normal);
    let (s, d) = ((u + v).normalize(), (u - v).normalize());
    // Inwards too: on the edge itself the normal is that of one face, and points off the other project
    // back to the edge.
    let directions = [u, -u, v, -v, s, -s, d, -d, -normal];
    let normals = directions.map(|direction| {
        shape.distance_and_normal(&project_to_surface(shape, p + direction * SHARP_DISTANCE)).1
    });
    (0..directions.len()).any(|i| normals[i + 1..].iter().any(|n| (n - normals[i]).norm() > SHARP_TURN))
}

/// A convex corner of a revolved profile.
struct ProfileCorner {
    r: f64,
    z: f64,
    is_sharp: bool,
}

/// The convex corners of a revolved profile: on the axis only tips, and blunt ones only if the solid can rest on them.
fn convex_corners(profile: &Polygon) -> impl Iterator<Item = ProfileCorner> + '_ {
    let points = profile.points();
    let count = points.len();
    (0..count).filter_map(move |i| {
        let (before, here, after) = (points[(i + count - 1) % count], points[i], points[(i + 1) % count]);
        let [a, b] = [[before, here], [here, after]].map(|[from, to]| [to[0] - from[0], to[1] - from[1]]);
        let lengths = a[0].hypot(a[1]) * b[0].hypot(b[1]);
        let sine = (a[0] * b[1] - a[1] * b[0]) / lengths;
        let (is_sharp, is_corner) = if here[0] <= ON_AXIS {
            let is_tip = is_tip(a, b);
            (is_tip, is_tip)
        } else {
            let is_foot = sine > FOOT_TURN && a[1] * b[1] <= 1e-9 * lengths;
            (sine > RIM_TURN, sine > RIM_TURN || is_foot)
        };
        is_corner.then_some(ProfileCorner { r: here[0], z: here[1], is_sharp })
    })
}

/// True if the edges `a` and `b` (r, z) of a profile meet on the axis in a convex tip of the solid. Of a solid
/// cone, one of them runs along the axis.
fn is_tip(a: [f64; 2], b: [f64; 2]) -> bool {
    // At the bottom of a pit, both edges run in the same direction along z; at the centre of a flat end, one does not.
    a[1] * b[1] < 0.0 && [a, b].iter().all(|[r, z]| z.abs() > TIP_SLOPE * r.abs())
}

/// Signed distances on a grid that covers a shape.
struct FeatureGrid<'a> {
    shape: &'a Shape,
    origin: Vec3,
    step: f64,
    count: [usize; 3],
    gap: Vec<f64>,
}

/// Crossings of the surface with the edges of one grid cell.
struct Cell(Vec<Crossing>);

/// A point of the surface and its normal.
#[derive(Clone, Copy)]
struct Crossing {
    p: Vec3,
    normal: Vec3,
}

impl<'a> FeatureGrid<'a> {
    fn over(shape: &'a Shape, step: f64) -> Self {
        let bounds = shape.bounds();
        let cells = bounds.size().map(|size| (size / step).ceil() as usize + 2);
        // Shifting by an odd share of the step keeps flat faces off the planes of the grid.
        let spare = cells.map(|n| n as f64) * step - bounds.size();
        let origin = bounds.min - spare * 0.43;
        let count = [cells.x + 1, cells.y + 1, cells.z + 1];
        let mut grid = Self { shape, origin, step, count, gap: Vec::new() };
        grid.gap = (0..count.iter().product()).map(|i| shape.distance_and_normal(&grid.node(i)).0).collect();
        grid
    }

    fn node(&self, index: usize) -> Vec3 {
        let [nx, ny, _] = self.count;
        let at = Vec3::new((index % nx) as f64, (index / nx % ny) as f64, (index / nx / ny) as f64);
        self.origin + at * self.step
    }

    /// The cells that the surface crosses, x fastest.
    fn crossed(&self) -> impl Iterator<Item = Cell> + '_ {
        let [nx, ny, _] = self.count;
        // Up to four cells share an edge.
        let mut known: HashMap<[usize; 2], Crossing> = HashMap::new();
        let inner = move |i: usize| i % nx + 1 < nx && i / nx % ny + 1 < ny && i + nx * ny < self.gap.len();
        (0..self.gap.len()).filter(move |&i| inner(i)).filter_map(move |i| {
            let corner = move |c: usize| i + (c & 1) + nx * (c >> 1 & 1) + nx * ny * (c >> 2 & 1);
            let mut crossings = Vec::new();
            for (low, axis) in (0..8).flat_map(|c| (0..3).map(move |axis| (c, axis))) {
                let ends = [corner(low), corner(low | 1 << axis)];
                if low >> axis & 1 == 0 && (self.gap[ends[0]] < 0.0) != (self.gap[ends[1]] < 0.0) {
                    crossings.push(*known.entry(ends).or_insert_with(|| self.crossing(ends)));
                }
            }
            (!crossings.is_empty()).then_some(Cell(crossings))
        })
    }

    /// The crossing of the surface between two nodes on different sides of it.
    fn crossing(&self, [i, j]: [usize; 2]) -> Crossing {
        let (mut p, mut q, mut gap_p) = (self.node(i), self.node(j), self.gap[i]);
        for _ in 0..20 {
            let middle = 0.5 * (p + q);
            let gap = self.shape.distance_and_normal(&middle).0;
            if (gap < 0.0) == (gap_p < 0.0) { (p, gap_p) = (middle, gap) } else { q = middle }
        }
        Crossing { p, normal: self.shape.distance_and_normal(&p).1 }
    }
}

impl Cell {
    fn mean(&self) -> Vec3 {
        self.0.iter().map(|crossing| crossing.p).sum::<Vec3>() / self.0.len() as f64
    }

    /// The least-squares intersection of the planes of the crossings, if they belong to different faces that meet in
    /// a convex edge (the vertex of dual contouring: Ju, Losasso, Schaefer & Warren, SIGGRAPH 2002).
    fn sharp_point(&self, shape: &Shape, step: f64) -> Option<Vec3> {
        let mean = self.mean();
        let (mut normal, mut right) = (Mat3::zeros(), Vec3::zeros());
        let mut opening = 0.0;
        for Crossing { p, normal: n } in &self.0 {
            normal += n * n.transpose();
            right += n * n.dot(&(p - mean));
            opening += n.dot(&(p - mean));
        }
        let eigen = SymmetricEigen::new(normal);
        let largest = eigen.eigenvalues.max();
        let is_kept = |value: f64| value > MIN_EIGENVALUE_RATIO * largest;
        if opening <= 0.0 || eigen.eigenvalues.iter().filter(|&&value| is_kept(value)).count() < 2 {
            return None;
        }
        let mut point = mean;
        for (i, &value) in eigen.eigenvalues.iter().enumerate().filter(|&(_, &value)| is_kept(value)) {
            let direction = eigen.eigenvectors.column(i).into_owned();
            point += direction * (direction.dot(&right) / value);
        }
        let inside = (point - mean).norm() < step * 1.5;
        inside.then(|| project_to_surface(shape, point))
    }
}
