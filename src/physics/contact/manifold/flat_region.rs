//! Where the flat and nearly flat parts of a general shape's skin carry: a rounded edge is no sharp one, so that its face
//! needs points of its own.
//!
//! A flat face carries at its outline, where it goes over into a rounding. What is nearly flat has a lowest point that
//! moves, which counts the less the flatter it is (see [`super::field`]); points spread over it count for the rest.

use super::{POINT_AREA, feature_extraction::onto};
use crate::geometry::{Vec3, orthonormal_basis, shape::Shape};

/// Curvature from which the moving lowest point carries alone, 1/m: 1/250 mm.
pub(super) const CURVED: f64 = 4.0;
/// Curvature below which seeds may form a flat face, 1/m.
const PLANE: f64 = 0.1;
/// Seeds lie in one plane if their normals differ by less than this, rad, …
const SAME_TURN: f64 = 1e-3;
/// … and their heights by less than this, m.
const SAME_HEIGHT: f64 = 5e-6;
/// The outline of a face is where its normal has turned by this much, rad: 40 µm into a rounding of 20 mm.
const LEAVES: f64 = 2e-3;
/// Seeds that a face has at least: smaller ones are facets of something curved.
const LEAST: usize = 3;
/// Directions in which the outline is looked for: that of a disc is off by at most 0.2 %.
const DIRECTIONS: u32 = 48;
/// Points of an outline nearer to each other than this share of the distance of seeds are one: more, and a corner would be cut
/// by as much.
const SAME_POINT: f64 = 0.02;
/// Share of the distance of seeds at which the skin's bend is looked at.
const PROBE: f64 = 0.1;
/// Points spread over a face are this many distances of seeds apart.
const SPREAD: f64 = 3.0;

/// A point of a flat or nearly flat part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlatSample {
    /// Place on the skin, m.
    pub p: Vec3,
    /// Area that it carries with, m².
    pub area: f64,
}

/// A place on the skin that bends little.
struct Seed {
    p: Vec3,
    normal: Vec3,
    /// Largest curvature, 1/m.
    bend: f64,
}

/// Seeds in one plane.
struct Face<'a> {
    shape: &'a Shape,
    origin: Vec3,
    normal: Vec3,
    seeds: Vec<Vec3>,
}

/// The spots of a shape from places `starts` on its skin that lie about `step` (m) apart. Those of an outline are whole point
/// contacts: a softer edge would let a body tip too early. The others have at most `area` (m²). A face that ends at the
/// `sharp` edges needs none.
pub(super) fn spots(shape: &Shape, starts: &[Vec3], step: f64, sharp: &[Vec3], area: f64) -> Vec<FlatSample> {
    let seeds: Vec<Seed> = starts.iter().filter_map(|p| Seed::at(shape, p, PROBE * step)).collect();
    let mut spots = Vec::new();
    let is_free = |p: &Vec3, taken: &[FlatSample], apart: f64| taken.iter().all(|q| (q.p - p).norm() > apart);
    let mut inner: Vec<(Vec3, f64)> =
        seeds.iter().filter(|seed| seed.bend >= PLANE).map(|seed| (seed.p, seed.bend)).collect();
    for face in faces(shape, &seeds) {
        let first = spots.len();
        // A fine rounding that counts as an edge lies off the face and does not carry it.
        let edges: Vec<&Vec3> = sharp.iter().filter(|q| face.height(q).abs() < SAME_HEIGHT).collect();
        for p in face.outline(step) {
            if is_free(&p, &spots[first..], SAME_POINT * step) && edges.iter().all(|q| (*q - p).norm() > step)
            {
                spots.push(FlatSample { p, area: POINT_AREA });
            }
        }
        if spots.len() > first {
            inner.extend(face.seeds.iter().map(|p| (*p, 0.0)));
        }
    }
    let first = spots.len();
    let most = area.min((SPREAD * step).powi(2));
    for (p, bend) in inner {
        if is_free(&p, &spots[first..], SPREAD * step) {
            spots.push(FlatSample { p, area: most * (1.0 - bend / CURVED) });
        }
    }
    spots
}

impl Seed {
    /// The skin at `p`, if it is nearly flat as far as `aside` (m) of it.
    fn at(shape: &Shape, p: &Vec3, aside: f64) -> Option<Self> {
        let p = onto(shape, *p);
        let (gap, normal) = shape.distance_and_normal(&p);
        let [u, v] = orthonormal_basis(&normal);
        let mut bend = 0.0;
        for way in [u, -u, v, -v] {
            let turn = (shape.distance_and_normal(&(p + way * aside)).1 - normal).norm();
            bend = f64::max(bend, turn / aside);
            if bend > CURVED {
                return None;
            }
        }
        (gap.abs() < SAME_HEIGHT).then_some(Self { p, normal, bend })
    }
}

/// The flat faces among the seeds. Feet in one plane are one face.
fn faces<'a>(shape: &'a Shape, seeds: &[Seed]) -> Vec<Face<'a>> {
    let mut faces: Vec<Face> = Vec::new();
    for seed in seeds.iter().filter(|seed| seed.bend < PLANE) {
        let same = faces.iter_mut().find(|face| {
            (face.normal - seed.normal).norm() < SAME_TURN && face.height(&seed.p).abs() < SAME_HEIGHT
        });
        match same {
            Some(face) => face.seeds.push(seed.p),
            None => faces.push(Face { shape, origin: seed.p, normal: seed.normal, seeds: vec![seed.p] }),
        }
    }
    faces.retain(|face| face.seeds.len() >= LEAST);
    faces
}

impl Face<'_> {
    /// The extreme points of the face in directions all around.
    fn outline(&self, step: f64) -> Vec<Vec3> {
        let [u, v] = orthonormal_basis(&self.normal);
        (0..DIRECTIONS)
            .filter_map(|k| {
                let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / f64::from(DIRECTIONS)).sin_cos();
                let way = u * cos + v * sin;
                let start = self.seeds.iter().max_by(|p, q| way.dot(p).total_cmp(&way.dot(q)))?;
                Some(self.extreme(*start, &way, step))
            })
            .collect()
    }

    /// Height of a point over its plane, m.
    fn height(&self, p: &Vec3) -> f64 {
        self.normal.dot(&(p - self.origin))
    }

    fn holds(&self, p: &Vec3) -> bool {
        let (gap, normal) = self.shape.distance_and_normal(p);
        gap.abs() < SAME_HEIGHT && (normal - self.normal).norm() < LEAVES
    }

    /// The last point of the face from `start` straight along `way`.
    fn end(&self, start: Vec3, way: &Vec3, step: f64) -> Vec3 {
        let (mut inside, mut outside) = (0.0, 0.5 * step);
        while self.holds(&(start + way * outside)) && outside < 100.0 * step {
            (inside, outside) = (outside, outside + 0.5 * step);
        }
        for _ in 0..14 {
            let middle = 0.5 * (inside + outside);
            if self.holds(&(start + way * middle)) { inside = middle } else { outside = middle }
        }
        start + way * inside
    }

    /// The farthest point of the face along `way`, from `start` on: to the outline, then along it.
    fn extreme(&self, start: Vec3, way: &Vec3, step: f64) -> Vec3 {
        let aside = self.normal.cross(way);
        let mut best = self.end(start, way, step);
        let (mut stride, mut tries) = (step, 0);
        while stride > step / 100.0 && tries < 60 {
            tries += 1;
            let next = [aside, -aside].into_iter().find_map(|turn| {
                let from = best + (turn - way) * stride;
                let end = self.holds(&from).then(|| self.end(from, way, step))?;
                (way.dot(&(end - best)) > 1e-3 * stride).then_some(end)
            });
            match next {
                Some(end) => best = end,
                None => stride *= 0.5,
            }
        }
        best
    }
}
