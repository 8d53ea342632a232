//! Samples of the flat and nearly flat regions of a general shape.
//!
//! A face that ends in rounded edges has no sharp edges to carry it, so it needs points of its own. A flat face
//! carries at its outline, where it passes into a rounding. A nearly flat region has a moving lowest point, which
//! counts less the flatter the region is (see [`super::field`]); samples spread over it count for the rest.

use serde::{Deserialize, Serialize};

use super::POINT_AREA;
use softvt_geometry::{Vec3, orthonormal_basis, shape::Shape};

/// Curvature from which the moving lowest point carries alone, 1/m: a radius of 250 mm.
pub(super) const MAX_FLAT_CURVATURE: f64 = 4.0;
/// Curvature below which seeds may form a plane face, 1/m.
const MAX_PLANE_CURVATURE: f64 = 0.1;
/// Difference of normals below which two seeds are in one plane, rad.
const PLANE_ANGLE: f64 = 1e-3;
/// Difference of heights below which two seeds are in one plane, m.
const PLANE_HEIGHT: f64 = 5e-6;
/// Rotation of the normal at the outline of a face, rad: 40 µm into a rounding of 20 mm.
const OUTLINE_ANGLE: f64 = 2e-3;
/// Smallest number of seeds of a face; regions with fewer are facets of a curved surface.
const MIN_FACE_SEEDS: usize = 3;
/// Directions in which the outline is searched: the error for a disc is at most 0.2 %.
const OUTLINE_DIRECTIONS: u32 = 48;
/// Distance below which two outline points are merged, in seed spacings. A larger value would cut corners by as much.
const MERGE_DISTANCE: f64 = 0.02;
/// Distance at which curvature is measured, in seed spacings.
const CURVATURE_DISTANCE: f64 = 0.1;
/// Distance between the samples spread over a face, in seed spacings.
const SAMPLE_DISTANCE: f64 = 3.0;

/// A contact sample of a flat or nearly flat region.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(in super::super) struct FlatSample {
    /// Position on the surface, m.
    pub p: Vec3,
    /// Area that it represents in contact, m².
    pub area: f64,
}

/// A point of the surface with little curvature.
struct RegionStart {
    p: Vec3,
    normal: Vec3,
    /// Largest curvature, 1/m.
    curvature: f64,
}

/// Seeds in one plane.
struct PlaneFace<'a> {
    shape: &'a Shape,
    origin: Vec3,
    normal: Vec3,
    seeds: Vec<Vec3>,
}

/// Flat samples of a shape, found from points `starts` on its surface that are about `step` (m) apart.
///
/// Samples of an outline are full point contacts: a softer edge would let a body tip too early. The others have at
/// most `area` (m²). A face that ends at `sharp` edges needs none.
pub(super) fn flat_samples(
    shape: &Shape,
    starts: &[Vec3],
    step: f64,
    sharp: &[Vec3],
    area: f64,
) -> Vec<FlatSample> {
    let seeds: Vec<RegionStart> =
        starts.iter().filter_map(|p| RegionStart::at(shape, p, CURVATURE_DISTANCE * step)).collect();
    let mut samples = Vec::new();
    let is_free = |p: &Vec3, taken: &[FlatSample], apart: f64| taken.iter().all(|q| (q.p - p).norm() > apart);
    let mut inner: Vec<(Vec3, f64)> = seeds
        .iter()
        .filter(|seed| seed.curvature >= MAX_PLANE_CURVATURE)
        .map(|seed| (seed.p, seed.curvature))
        .collect();
    for face in plane_faces(shape, &seeds) {
        let first = samples.len();
        // Seeds on a small fillet are skipped: the fillet is treated as an edge and lies off the face.
        let edges: Vec<&Vec3> = sharp.iter().filter(|q| face.height(q).abs() < PLANE_HEIGHT).collect();
        for p in face.outline(step) {
            if is_free(&p, &samples[first..], MERGE_DISTANCE * step)
                && edges.iter().all(|q| (*q - p).norm() > step)
            {
                samples.push(FlatSample { p, area: POINT_AREA });
            }
        }
        if samples.len() > first {
            inner.extend(face.seeds.iter().map(|p| (*p, 0.0)));
        }
    }
    let first = samples.len();
    let max_area = area.min((SAMPLE_DISTANCE * step).powi(2));
    for (p, curvature) in inner {
        if is_free(&p, &samples[first..], SAMPLE_DISTANCE * step) {
            samples.push(FlatSample { p, area: max_area * (1.0 - curvature / MAX_FLAT_CURVATURE) });
        }
    }
    samples
}

impl RegionStart {
    /// The surface at `p`, if it is nearly flat within `distance` (m).
    fn at(shape: &Shape, p: &Vec3, distance: f64) -> Option<Self> {
        let p = project_to_surface(shape, *p);
        let (gap, normal) = shape.distance_and_normal(&p);
        let [u, v] = orthonormal_basis(&normal);
        let mut curvature = 0.0;
        for direction in [u, -u, v, -v] {
            let turn = (shape.distance_and_normal(&(p + direction * distance)).1 - normal).norm();
            curvature = f64::max(curvature, turn / distance);
            if curvature > MAX_FLAT_CURVATURE {
                return None;
            }
        }
        (gap.abs() < PLANE_HEIGHT).then_some(Self { p, normal, curvature })
    }
}

/// Groups seeds into plane faces. Feet in one plane form one face.
fn plane_faces<'a>(shape: &'a Shape, seeds: &[RegionStart]) -> Vec<PlaneFace<'a>> {
    let mut faces: Vec<PlaneFace> = Vec::new();
    for seed in seeds.iter().filter(|seed| seed.curvature < MAX_PLANE_CURVATURE) {
        let same = faces.iter_mut().find(|face| {
            (face.normal - seed.normal).norm() < PLANE_ANGLE && face.height(&seed.p).abs() < PLANE_HEIGHT
        });
        match same {
            Some(face) => face.seeds.push(seed.p),
            None => faces.push(PlaneFace { shape, origin: seed.p, normal: seed.normal, seeds: vec![seed.p] }),
        }
    }
    faces.retain(|face| face.seeds.len() >= MIN_FACE_SEEDS);
    faces
}

impl PlaneFace<'_> {
    /// Extreme points of the face in [`OUTLINE_DIRECTIONS`] directions.
    fn outline(&self, step: f64) -> Vec<Vec3> {
        let [u, v] = orthonormal_basis(&self.normal);
        (0..OUTLINE_DIRECTIONS)
            .filter_map(|k| {
                let (sin, cos) =
                    (std::f64::consts::TAU * f64::from(k) / f64::from(OUTLINE_DIRECTIONS)).sin_cos();
                let direction = u * cos + v * sin;
                let start = self.seeds.iter().max_by(|p, q| direction.dot(p).total_cmp(&direction.dot(q)))?;
                Some(self.extreme(*start, &direction, step))
            })
            .collect()
    }

    /// Height of a point over its plane, m.
    fn height(&self, p: &Vec3) -> f64 {
        self.normal.dot(&(p - self.origin))
    }

    /// True if `p` is on the face.
    fn contains(&self, p: &Vec3) -> bool {
        let (gap, normal) = self.shape.distance_and_normal(p);
        gap.abs() < PLANE_HEIGHT && (normal - self.normal).norm() < OUTLINE_ANGLE
    }

    /// The last point of the face from `start` along `direction`.
    fn end(&self, start: Vec3, direction: &Vec3, step: f64) -> Vec3 {
        let (mut inside, mut outside) = (0.0, 0.5 * step);
        while self.contains(&(start + direction * outside)) && outside < 100.0 * step {
            (inside, outside) = (outside, outside + 0.5 * step);
        }
        for _ in 0..14 {
            let middle = 0.5 * (inside + outside);
            if self.contains(&(start + direction * middle)) { inside = middle } else { outside = middle }
        }
        start + direction * inside
    }

    /// The farthest point of the face along `direction`: from `start` to the outline, then along it.
    fn extreme(&self, start: Vec3, direction: &Vec3, step: f64) -> Vec3 {
        let aside = self.normal.cross(direction);
        let mut best = self.end(start, direction, step);
        let (mut stride, mut tries) = (step, 0);
        while stride > step / 100.0 && tries < 60 {
            tries += 1;
            let next = [aside, -aside].into_iter().find_map(|turn| {
                let from = best + (turn - direction) * stride;
                let end = self.contains(&from).then(|| self.end(from, direction, step))?;
                (direction.dot(&(end - best)) > 1e-3 * stride).then_some(end)
            });
            match next {
                Some(end) => best = end,
                None => stride *= 0.5,
            }
        }
        best
    }
}

/// Projects `p` onto the surface by a few steps along the normal.
pub(super) fn project_to_surface(shape: &Shape, mut p: Vec3) -> Vec3 {
    for _ in 0..3 {
        let (gap, n) = shape.distance_and_normal(&p);
        p -= n * gap;
    }
    p
}
