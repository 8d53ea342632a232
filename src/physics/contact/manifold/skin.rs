//! Where a general shape can touch another: its sharp corners and edges, its rims, and starts on its smooth parts.

use nalgebra::SymmetricEigen;

use super::Piece;
use crate::geometry::{
    Mat3, Pose, Vec3,
    shape::{Profile, Shape},
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

/// A sharp convex circle about the z axis of `frame_o`, in its plane z = 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ring {
    /// Frame of the circle in the object frame.
    pub frame_o: Pose,
    /// Radius, m.
    pub radius: f64,
}

/// The places of a shape's skin that are watched for contact, object frame, m.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SkinSamples {
    /// On sharp convex corners and edges.
    pub fixed: Vec<Vec3>,
    /// Sharp convex circles.
    pub rings: Vec<Ring>,
    /// Spread over the whole surface: where the search for the lowest point of a smooth part starts.
    pub seeds: Vec<Vec3>,
    /// Distance between neighbouring seeds, m.
    pub spacing: f64,
}

/// Chooses the samples of a shape. Boxes, cylinders and lathes are known exactly; of anything else the sharp edges are
/// found on a grid of 1/24 of its longest side.
pub fn skin_samples(shape: &Shape) -> SkinSamples {
    let mut samples = SkinSamples::default();
    edges(shape, &Pose::identity(), &mut samples);
    let size = shape.bounds().size().max();
    samples.spacing = size / SEED_CELLS;
    samples.seeds =
        Grid::over(shape, samples.spacing).crossed().map(|cell| onto(shape, cell.mean())).collect();
    samples
}

/// A shape as primitive pieces with their frames in the object frame, or `None` if it is not wholly made of them.
pub fn pieces(shape: &Shape) -> Option<Vec<(Piece, Pose)>> {
    let one = |piece| Some(vec![(piece, Pose::identity())]);
    match shape {
        Shape::Box { half } => one(Piece::Box { half: *half }),
        Shape::Sphere { radius } => one(Piece::Sphere { radius: *radius }),
        Shape::Cylinder { radius, half_height } => {
            one(Piece::Cylinder { radius: *radius, half_height: *half_height })
        }
        Shape::Capsule { radius, half_length } => {
            one(Piece::Capsule { radius: *radius, half_height: *half_length })
        }
        Shape::Placed { shape, pose } => {
            Some(pieces(shape)?.into_iter().map(|(piece, frame)| (piece, pose * frame)).collect())
        }
        Shape::Paint { shape, .. } => pieces(shape),
        Shape::Union(parts) => {
            let parts: Option<Vec<_>> = parts.iter().map(pieces).collect();
            Some(parts?.into_iter().flatten().collect())
        }
        _ => None,
    }
}

/// Adds the sharp features of `shape`, which sits at `frame_o`.
fn edges(shape: &Shape, frame_o: &Pose, samples: &mut SkinSamples) {
    let ring =
        |z: f64, radius: f64| Ring { frame_o: frame_o * nalgebra::Translation3::new(0.0, 0.0, z), radius };
    match shape {
        Shape::Box { half } => samples.fixed.extend((0..8).map(|corner| {
            let sign = Vec3::from_fn(|axis, _| if corner >> axis & 1 == 1 { 1.0 } else { -1.0 });
            (frame_o * nalgebra::Point3::from(half.component_mul(&sign))).coords
        })),
        Shape::Cylinder { radius, half_height } => {
            samples.rings.extend([ring(-half_height, *radius), ring(*half_height, *radius)]);
        }
        Shape::Lathe(profile) => {
            for [r, z] in rims(profile) {
                if r > 1e-6 {
                    samples.rings.push(ring(z, r));
                } else {
                    samples.fixed.push((frame_o * nalgebra::Point3::new(0.0, 0.0, z)).coords);
                }
            }
        }
        Shape::Placed { shape, pose } => edges(shape, &(frame_o * pose), samples),
        Shape::Paint { shape, .. } => edges(shape, frame_o, samples),
        Shape::Sphere { .. } | Shape::Capsule { .. } | Shape::Ellipsoid { .. } | Shape::Torus { .. } => {}
        _ => {
            let step = shape.bounds().size().max() / EDGE_CELLS;
            let sharp = Grid::over(shape, step);
            let found = sharp.crossed().filter_map(|cell| cell.sharp_point(shape, step));
            samples.fixed.extend(found.map(|p| (frame_o * nalgebra::Point3::from(p)).coords));
        }
    }
}

/// The convex corners of a revolved profile, (r, z); those on the axis only if they are tips.
fn rims(profile: &Profile) -> impl Iterator<Item = [f64; 2]> + '_ {
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
        (sine > RIM_TURN && tip).then_some(here)
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
