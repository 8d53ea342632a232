//! Contact points of a general shape against the distance field of another.

use std::f64::consts::TAU;

use super::{
    ManifoldPoint, NON_MATERIAL, POINT_AREA,
    closest_points::lowest_points,
    feature::RIM,
    feature_extraction::{Ring, SAMPLE_AREA, SkinSamples},
};
use crate::geometry::{Aabb, Pose, Vec3, shape::Shape};

/// Tilt (sine) of a ring up to which all of it carries, and from which only its lowest point does.
const RING_FLAT: [f64; 2] = [0.05, 0.1];
/// Tilt (sine) from which a ring's lowest point counts in full; on a flat ring it has no place.
const RING_TILTED: f64 = 1e-3;
/// First of the names of ring points (64 a ring) and of spots.
const RINGS: u32 = 1 << 20;
const SPOTS: u32 = 1 << 23;

/// A point of the first body's skin in the field of the second.
pub(super) struct Probe<'a> {
    shape_b: &'a Shape,
    bounds_b: &'a Aabb,
    /// The first body's frame in the second's.
    a_in_b: Pose,
    pose_b: &'a Pose,
}

impl Probe<'_> {
    /// Whether `p_a` is surely farther than `reach` (m) from the second body.
    pub(super) fn is_beyond(&self, p_a: &Vec3, reach: f64) -> bool {
        let p_b = self.a_in_b * nalgebra::Point3::from(*p_a);
        !self.bounds_b.loosened(reach).contains(&p_b.coords)
    }

    /// Gap at `p_a` (first body's frame).
    pub(super) fn gap(&self, p_a: &Vec3) -> f64 {
        self.shape_b.distance_and_normal(&(self.a_in_b * nalgebra::Point3::from(*p_a)).coords).0
    }

    /// Gap at `p_a` and its gradient, in the first body's frame.
    pub(super) fn slope(&self, p_a: &Vec3) -> (f64, Vec3) {
        let (phi, n_b) =
            self.shape_b.distance_and_normal(&(self.a_in_b * nalgebra::Point3::from(*p_a)).coords);
        (phi, self.a_in_b.rotation.inverse_transform_vector(&n_b))
    }

    pub(super) fn contact(&self, p_a: &Vec3, area: f64, feature: u32) -> ManifoldPoint {
        let p_b = self.a_in_b * nalgebra::Point3::from(*p_a);
        let (phi, n_b) = self.shape_b.distance_and_normal(&p_b.coords);
        let n_w = -(self.pose_b.rotation * n_b);
        // The sample lies on the first body, the other surface a gap further along the normal.
        let p_w = (self.pose_b * p_b).coords + n_w * (0.5 * phi);
        ManifoldPoint { p_w, n_w, phi, area, feature }
    }
}

/// Body a's skin over the field of body b.
pub struct Skin<'a> {
    samples: &'a SkinSamples,
    shape: &'a Shape,
    probe: Probe<'a>,
}

impl<'a> Skin<'a> {
    /// The skin of `shape_a`, whose samples are given, and shape b with its bounds.
    ///
    /// The normals of its points are from a to b. Two general bodies meet both ways (flip the normals of one): first
    /// [`Skin::fixed`] of both, then [`Skin::lowest`].
    pub fn new(
        (samples, shape): (&'a SkinSamples, &'a Shape),
        pose_a: &Pose,
        (shape_b, bounds_b): (&'a Shape, &'a Aabb),
        pose_b: &'a Pose,
    ) -> Self {
        let probe = Probe { shape_b, bounds_b, a_in_b: pose_b.inv_mul(pose_a), pose_b };
        Self { samples, shape, probe }
    }

    /// Appends the points whose gap is below `margin` (m) of corners and edges, flat faces, and rims with their moving lowest
    /// point.
    pub fn fixed(&self, margin: f64, out: &mut Vec<ManifoldPoint>) {
        let fixed = self.samples.fixed.iter().map(|p| (p, SAMPLE_AREA)).zip(0..);
        let spots = self.samples.spots.iter().map(|spot| (&spot.p, spot.area)).zip(SPOTS..);
        for ((p_a, area), name) in fixed.chain(spots) {
            if self.probe.is_beyond(p_a, margin) {
                continue;
            }
            let point = self.probe.contact(p_a, area, name);
            if point.phi < margin {
                out.push(point);
            }
        }
        for (index, ring) in self.samples.rings.iter().enumerate() {
            ring_points(&self.probe, ring, RINGS + 64 * index as u32, margin, out);
        }
    }

    /// Appends the lowest points and lines of smooth parts whose gap is below `margin` (m), as far as the points that are in
    /// `out` already do not carry there.
    pub fn lowest(&self, margin: f64, out: &mut Vec<ManifoldPoint>) {
        lowest_points(&self.probe, self.samples, self.shape, margin, out);
    }
}

/// The fixed points of a nearly flat ring and its moving lowest point.
fn ring_points(probe: &Probe, ring: &Ring, name: u32, margin: f64, out: &mut Vec<ManifoldPoint>) {
    let at = |angle: f64| {
        let (sin, cos) = angle.sin_cos();
        (ring.frame_o * nalgebra::Point3::new(ring.radius * cos, ring.radius * sin, 0.0)).coords
    };
    if probe.is_beyond(&ring.frame_o.translation.vector, margin + ring.radius) {
        return;
    }
    let step = TAU / f64::from(RIM);
    let gaps: Vec<f64> = (0..RIM).map(|k| probe.gap(&at(step * f64::from(k)))).collect();
    let (mut least, mut most) = (0, 0);
    for k in 0..gaps.len() {
        least = if gaps[k] < gaps[least] { k } else { least };
        most = if gaps[k] > gaps[most] { k } else { most };
    }
    if gaps[least] > margin + ring.radius * step {
        return;
    }
    let tilt = (gaps[most] - gaps[least]) / (2.0 * ring.radius);
    let flat = ((RING_FLAT[1] - tilt) / (RING_FLAT[1] - RING_FLAT[0])).clamp(0.0, 1.0);
    for k in 0..RIM {
        if flat > 0.0 && gaps[k as usize] < margin {
            out.push(probe.contact(&at(step * f64::from(k)), SAMPLE_AREA * flat, name + k));
        }
    }
    let angle = golden_minimum(|angle| probe.gap(&at(angle)), step * (least as f64 - 1.0), 2.0 * step);
    let point =
        probe.contact(&at(angle), POINT_AREA * (tilt / RING_TILTED).min(1.0), NON_MATERIAL | (name + RIM));
    if point.phi < margin && point.area > 0.0 {
        out.push(point);
    }
}

/// The minimum of a function with one in `start..start + width`: golden sections, then the parabola through the last
/// three points, whose error is far below their distance.
pub(super) fn golden_minimum(f: impl Fn(f64) -> f64, start: f64, width: f64) -> f64 {
    const SHARE: f64 = 0.381_966_011_250_105;
    let (mut low, mut high) = (start, start + width);
    let (mut x, mut y) = (low + SHARE * width, high - SHARE * width);
    let (mut fx, mut fy) = (f(x), f(y));
    for _ in 0..14 {
        if fx < fy {
            (high, y, fy) = (y, x, fx);
            x = low + SHARE * (high - low);
            fx = f(x);
        } else {
            (low, x, fx) = (x, y, fy);
            y = high - SHARE * (high - low);
            fy = f(y);
        }
    }
    let (middle, h) = (0.5 * (low + high), 0.1 * width);
    let (before, here, after) = (f(middle - h), f(middle), f(middle + h));
    let bend = before - 2.0 * here + after;
    let shift = if bend > 0.0 { 0.5 * h * (before - after) / bend } else { 0.0 };
    middle + if f(middle + shift) < here { shift } else { 0.0 }
}
