//! Where a general shape can touch another: its sharp corners and edges, its rims, and starts on its smooth parts.

use nalgebra::SymmetricEigen;

use super::{
    POINT_AREA, Primitive,
    flat_region::{FlatSample, spots},
};
use crate::geometry::{
    Mat3, Pose, Vec3, hex8, orthonormal_basis,
    shape::{Polygon, Shape},
};

/// Grid cells along the longest side of a shape in the search for its sharp edges.
const EDGE_CELLS: f64 = 24.0;
/// The same in the choice of starts on its smooth parts.
const SEED_CELLS: f64 = 8.0;
/// Two faces make an edge if their normals differ by more than about 30°: then the second eigenvalue of the sum of
/// n nᵀ is above tan²(15°) of the first.
const SHARP: f64 = 0.07;
/// The convex turn (sine) at a profile's corner from which its ring is a rim: 20°.
const RIM_TURN: f64 = 0.34;
/// The same for a corner on which the solid stands, though it is part of a rounding.
const FOOT_TURN: f64 = 5e-3;
/// An edge is truly sharp if the normals differ by more than `SHARP_TURN` (chord of the unit circle, 20°) this far aside of
/// it, m: a rounding of less than 0.5 mm is an edge.
const SHARP_ASIDE: f64 = 1e-4;
/// See [`SHARP_ASIDE`].
const SHARP_TURN: f64 = 0.35;
/// Area of a sample on a sharp edge, m²: several of them carry together what one point contact does.
pub(super) const SAMPLE_AREA: f64 = 0.25 * POINT_AREA;

/// A convex circle about the z axis of `frame_o`, in its plane z = 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ring {
    /// Frame of the circle in the object frame.
    pub frame_o: Pose,
    /// Radius, m.
    pub radius: f64,
    /// Whether it is an edge, and not the lowest circle of a rounding.
    pub sharp: bool,
}

/// The places of a shape's skin that are watched for contact, object frame, m.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SkinSamples {
    /// On sharp convex corners and edges.
    pub fixed: Vec<Vec3>,
    /// Convex circles.
    pub rings: Vec<Ring>,
    /// On flat and nearly flat faces, and on edges that are finely rounded.
    pub spots: Vec<FlatSample>,
    /// Spread over the whole surface: where the search for the lowest point of a smooth part starts.
    pub seeds: Vec<Vec3>,
    /// Distance between neighbouring seeds, m.
    pub spacing: f64,
}

/// Chooses the samples of a shape. Boxes, cylinders and lathes are known exactly; of anything else the sharp edges and flat
/// faces are found on a grid of 1/24 of its longest side.
pub fn skin_samples(shape: &Shape) -> SkinSamples {
    let mut samples = SkinSamples::default();
    edges(shape, &Pose::identity(), &mut samples);
    let size = shape.bounds().size().max();
    samples.spacing = size / SEED_CELLS;
    samples.seeds =
        Grid::over(shape, samples.spacing).crossed().map(|cell| onto(shape, cell.mean())).collect();
    samples
}

/// A shape as primitive primitives with their frames in the object frame, or `None` if it is not wholly made of them.
pub fn primitives(shape: &Shape) -> Option<Vec<(Primitive, Pose)>> {
    let one = |primitive| Some(vec![(primitive, Pose::identity())]);
    match shape {
        Shape::Box { half } => one(Primitive::Box { half: *half }),
        Shape::Sphere { radius } => one(Primitive::Sphere { radius: *radius }),
        Shape::Cylinder { radius, half_height } => {
            one(Primitive::Cylinder { radius: *radius, half_height: *half_height })
        }
        Shape::Capsule { radius, half_length } => {
            one(Primitive::Capsule { radius: *radius, half_height: *half_length })
        }
        Shape::Placed { shape, pose } => {
            Some(primitives(shape)?.into_iter().map(|(primitive, frame)| (primitive, pose * frame)).collect())
        }
        Shape::Paint { shape, .. } => primitives(shape),
        Shape::Union(parts) => {
            let parts: Option<Vec<_>> = parts.iter().map(primitives).collect();
            Some(parts?.into_iter().flatten().collect())
        }
        _ => None,
    }
}

/// Adds the sharp features of `shape`, which sits at `frame_o`.
fn edges(shape: &Shape, frame_o: &Pose, samples: &mut SkinSamples) {
    let ring = |z: f64, radius: f64, sharp: bool| Ring {
        frame_o: frame_o * nalgebra::Translation3::new(0.0, 0.0, z),
        radius,
        sharp,
    };
    match shape {
        Shape::Box { half } => samples.fixed.extend((0..8).map(|corner| {
            let sign = hex8::corner_sign(corner);
            (frame_o * nalgebra::Point3::from(half.component_mul(&sign))).coords
        })),
        Shape::Cylinder { radius, half_height } => {
            samples.rings.extend([ring(-half_height, *radius, true), ring(*half_height, *radius, true)]);
        }
        Shape::Lathe(profile) => {
            for ([r, z], sharp) in rims(profile) {
                if r > 1e-6 {
                    samples.rings.push(ring(z, r, sharp));
                } else if sharp {
                    samples.fixed.push((frame_o * nalgebra::Point3::new(0.0, 0.0, z)).coords);
                }
            }
        }
        Shape::Placed { shape, pose } => edges(shape, &(frame_o * pose), samples),
        Shape::Paint { shape, .. } => edges(shape, frame_o, samples),
        Shape::Torus { major, minor } => {
            samples.rings.extend([ring(-minor, *major, false), ring(*minor, *major, false)]);
        }
        Shape::Sphere { .. } | Shape::Capsule { .. } | Shape::Ellipsoid { .. } => {}
        _ => general(shape, frame_o, samples),
    }
}

/// Adds what a grid finds on a shape of any kind.
fn general(shape: &Shape, frame_o: &Pose, samples: &mut SkinSamples) {
    let step = shape.bounds().size().max() / EDGE_CELLS;
    let cells: Vec<Cell> = Grid::over(shape, step).crossed().collect();
    let edges = cells.iter().filter_map(|cell| cell.sharp_point(shape, step));
    let (sharp, blunt): (Vec<Vec3>, Vec<Vec3>) = edges.partition(|p| is_sharp(shape, p));
    let starts: Vec<Vec3> = cells.iter().map(Cell::mean).collect();
    let to_object = |p: &Vec3| (frame_o * nalgebra::Point3::from(*p)).coords;
    let blunt = blunt.into_iter().map(|p| FlatSample { p, area: SAMPLE_AREA });
    let all = spots(shape, &starts, step, &sharp, SAMPLE_AREA).into_iter().chain(blunt);
    samples.spots.extend(all.map(|spot| FlatSample { p: to_object(&spot.p), ..spot }));
    samples.fixed.extend(sharp.iter().map(to_object));
}

/// Whether the skin has an edge at `p`, and not a rounding.
fn is_sharp(shape: &Shape, p: &Vec3) -> bool {
    let normal = shape.distance_and_normal(p).1;
    let [u, v] = orthonormal_basis(&normal);
    let (s, d) = ((u + v).normalize(), (u - v).normalize());
    // Inwards too: on an edge itself the normal is one face's, and what lies off the other leads back to the edge.
    let ways = [u, -u, v, -v, s, -s, d, -d, -normal];
    let normals = ways.map(|way| shape.distance_and_normal(&onto(shape, p + way * SHARP_ASIDE)).1);
    (0..ways.len()).any(|i| normals[i + 1..].iter().any(|n| (n - normals[i]).norm() > SHARP_TURN))
}

/// The convex corners of a revolved profile, (r, z), and whether they are sharp; those on the axis only if they are tips,
/// blunt ones only if the solid can stand on them.
fn rims(profile: &Polygon) -> impl Iterator<Item = ([f64; 2], bool)> + '_ {
    let points = profile.points();
    let count = points.len();
    (0..count).filter_map(move |i| {
        let (before, here, after) = (points[(i + count - 1) % count], points[i], points[(i + 1) % count]);
        let (ar, az) = (here[0] - before[0], here[1] - before[1]);
        let (br, bz) = (after[0] - here[0], after[1] - here[1]);
        let sine = (ar * bz - az * br) / (ar.hypot(az) * br.hypot(bz));
        // A flat end's middle is a corner of the polygon with its axis, but no corner of the solid.
        let tip =
            here[0] > 1e-6 || az.abs().max(bz.abs()) > RIM_TURN * ar.abs().max(br.abs()) && ar * br < 0.0;
        let sharp = sine > RIM_TURN;
        let foot = sine > FOOT_TURN && here[0] > 1e-6 && az * bz <= 1e-9 * ar.hypot(az) * br.hypot(bz);
        (sharp && tip || foot).then_some((here, sharp))
    })
}

/// The point of the surface nearest to `p`, by a few steps along the normal.
pub(super) fn onto(shape: &Shape, mut p: Vec3) -> Vec3 {
    for _ in 0..3 {
        let (phi, n) = shape.distance_and_normal(&p);
        p -= n * phi;
    }
    p
}

/// Signed distances on a grid that covers a shape.
struct Grid<'a> {
    shape: &'a Shape,
    origin: Vec3,
    step: f64,
    count: [usize; 3],
    phi: Vec<f64>,
}

/// Where the surface crosses the edges of one grid cell, and its normals there.
struct Cell(Vec<(Vec3, Vec3)>);

impl<'a> Grid<'a> {
    fn over(shape: &'a Shape, step: f64) -> Self {
        let bounds = shape.bounds();
        let cells = bounds.size().map(|size| (size / step).ceil() as usize + 2);
        // A shift by an odd share of the step keeps flat faces off the grid's planes.
        let spare = cells.map(|n| n as f64) * step - bounds.size();
        let origin = bounds.min - spare * 0.43;
        let count = [cells.x + 1, cells.y + 1, cells.z + 1];
        let mut grid = Self { shape, origin, step, count, phi: Vec::new() };
        grid.phi = (0..count.iter().product()).map(|i| shape.distance_and_normal(&grid.node(i)).0).collect();
        grid
    }

    fn node(&self, index: usize) -> Vec3 {
        let [nx, ny, _] = self.count;
        let at = Vec3::new((index % nx) as f64, (index / nx % ny) as f64, (index / nx / ny) as f64);
        self.origin + at * self.step
    }

    /// The cells that the surface passes through, x fastest.
    fn crossed(&self) -> impl Iterator<Item = Cell> + '_ {
        let [nx, ny, _] = self.count;
        let inner = move |i: usize| i % nx + 1 < nx && i / nx % ny + 1 < ny && i + nx * ny < self.phi.len();
        (0..self.phi.len()).filter(move |&i| inner(i)).filter_map(move |i| {
            let corner = move |c: usize| i + (c & 1) + nx * (c >> 1 & 1) + nx * ny * (c >> 2 & 1);
            let mut crossings = Vec::new();
            for (low, axis) in (0..8).flat_map(|c| (0..3).map(move |axis| (c, axis))) {
                if low >> axis & 1 == 0 {
                    crossings.extend(self.crossing(corner(low), corner(low | 1 << axis)));
                }
            }
            (!crossings.is_empty()).then_some(Cell(crossings))
        })
    }

    fn crossing(&self, i: usize, j: usize) -> Option<(Vec3, Vec3)> {
        let (mut p, mut q, mut phi_p) = (self.node(i), self.node(j), self.phi[i]);
        if (phi_p < 0.0) == (self.phi[j] < 0.0) {
            return None;
        }
        for _ in 0..20 {
            let middle = 0.5 * (p + q);
            let phi = self.shape.distance_and_normal(&middle).0;
            if (phi < 0.0) == (phi_p < 0.0) { (p, phi_p) = (middle, phi) } else { q = middle }
        }
        Some((p, self.shape.distance_and_normal(&p).1))
    }
}

impl Cell {
    fn mean(&self) -> Vec3 {
        self.0.iter().map(|(p, _)| p).sum::<Vec3>() / self.0.len() as f64
    }

    /// The point where the planes of the crossings meet best, if they belong to different faces that meet in a convex
    /// edge (the vertex of dual contouring: Ju, Losasso, Schaefer & Warren, SIGGRAPH 2002).
    fn sharp_point(&self, shape: &Shape, step: f64) -> Option<Vec3> {
        let mean = self.mean();
        let (mut normal, mut right) = (Mat3::zeros(), Vec3::zeros());
        let mut opening = 0.0;
        for (p, n) in &self.0 {
            normal += n * n.transpose();
            right += n * n.dot(&(p - mean));
            opening += n.dot(&(p - mean));
        }
        let eigen = SymmetricEigen::new(normal);
        let largest = eigen.eigenvalues.max();
        let is_kept = |value: f64| value > SHARP * largest;
        if opening <= 0.0 || eigen.eigenvalues.iter().filter(|&&value| is_kept(value)).count() < 2 {
            return None;
        }
        let mut point = mean;
        for (i, &value) in eigen.eigenvalues.iter().enumerate().filter(|&(_, &value)| is_kept(value)) {
            let direction = eigen.eigenvectors.column(i).into_owned();
            point += direction * (direction.dot(&right) / value);
        }
        let inside = (point - mean).norm() < step * 1.5;
        inside.then(|| onto(shape, point))
    }
}
