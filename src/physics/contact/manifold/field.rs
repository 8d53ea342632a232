//! Contact points of a general shape against the distance field of another.

use std::f64::consts::TAU;

use super::{
    ContactPoint, MOVING, POINT_AREA,
    feature::RIM,
    skin::{Ring, SkinSamples, onto},
};
use crate::geometry::{Pose, Vec3, shape::Shape};

/// Area of a sample on a sharp edge, m²: several of them carry together what one point contact does.
const SAMPLE_AREA: f64 = 0.25 * POINT_AREA;
/// Tilt (sine) of a ring up to which all of it carries, and from which only its lowest point does.
const RING_FLAT: [f64; 2] = [0.05, 0.1];
/// Tilt (sine) from which a ring's lowest point counts in full; on a flat ring it has no place.
const RING_TILTED: f64 = 1e-3;
/// How far aside of a lowest point the rise of the gap is looked at, m.
const ASIDE: f64 = 1e-3;
/// A lowest point counts in full if the gap rises by this much aside of it, m: that of a curvature of 1/250 mm. On a flat
/// it has no place, and corners and rims carry.
const RISE: f64 = 2e-6;
/// Lowest points looked for on one body.
const WITNESSES: usize = 4;
/// First of the names of ring points (64 a ring) and of lowest points.
const RINGS: u32 = 1 << 20;
const LOWEST: u32 = 1 << 24;

/// A point of the first body's skin in the field of the second.
struct Probe<'a> {
    shape_b: &'a Shape,
    /// The first body's frame in the second's.
    a_in_b: Pose,
    pose_b: &'a Pose,
}

impl Probe<'_> {
    /// Gap at `p_a` (first body's frame).
    fn gap(&self, p_a: &Vec3) -> f64 {
        self.shape_b.distance_and_normal(&(self.a_in_b * nalgebra::Point3::from(*p_a)).coords).0
    }

    /// Gap at `p_a` and its gradient, in the first body's frame.
    fn slope(&self, p_a: &Vec3) -> (f64, Vec3) {
        let (phi, n_b) =
            self.shape_b.distance_and_normal(&(self.a_in_b * nalgebra::Point3::from(*p_a)).coords);
        (phi, self.a_in_b.rotation.inverse_transform_vector(&n_b))
    }

    fn contact(&self, p_a: &Vec3, area: f64, feature: u32) -> ContactPoint {
        let p_b = self.a_in_b * nalgebra::Point3::from(*p_a);
        let (phi, n_b) = self.shape_b.distance_and_normal(&p_b.coords);
        let n_w = -(self.pose_b.rotation * n_b);
        // The sample lies on the first body, the other surface a gap further along the normal.
        let p_w = (self.pose_b * p_b).coords + n_w * (0.5 * phi);
        ContactPoint { p_w, n_w, phi, area, feature }
    }
}

/// Appends the contact points of body a's samples with the field of shape b whose gap is below `margin` (m): corners
/// and edges, rims with their moving lowest point, and the lowest points of smooth parts.
///
/// The normals point from a to b. For two general bodies call it both ways (and flip the normals of one).
pub fn samples_vs_field(
    samples: &SkinSamples,
    shape_a: &Shape,
    pose_a: &Pose,
    shape_b: &Shape,
    pose_b: &Pose,
    margin: f64,
    out: &mut Vec<ContactPoint>,
) {
    let probe = Probe { shape_b, a_in_b: pose_b.inv_mul(pose_a), pose_b };
    for (index, p_a) in samples.fixed.iter().enumerate() {
        let point = probe.contact(p_a, SAMPLE_AREA, index as u32);
        if point.phi < margin {
            out.push(point);
        }
    }
    for (index, ring) in samples.rings.iter().enumerate() {
        ring_points(&probe, ring, RINGS + 64 * index as u32, margin, out);
    }
    lowest_points(&probe, samples, shape_a, margin, out);
}

/// The fixed points of a nearly flat ring and its moving lowest point.
fn ring_points(probe: &Probe, ring: &Ring, name: u32, margin: f64, out: &mut Vec<ContactPoint>) {
    let at = |angle: f64| {
        let (sin, cos) = angle.sin_cos();
        (ring.frame_o * nalgebra::Point3::new(ring.radius * cos, ring.radius * sin, 0.0)).coords
    };
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
    let point = probe.contact(&at(angle), POINT_AREA * (tilt / RING_TILTED).min(1.0), MOVING | (name + RIM));
    if point.phi < margin && point.area > 0.0 {
        out.push(point);
    }
}

/// The minimum of a function with one in `start..start + width`: golden sections, then the parabola through the last
/// three points, whose error is far below their distance.
fn golden_minimum(f: impl Fn(f64) -> f64, start: f64, width: f64) -> f64 {
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

/// The lowest points of the smooth parts of body a in the field of b.
fn lowest_points(
    probe: &Probe,
    samples: &SkinSamples,
    shape_a: &Shape,
    margin: f64,
    out: &mut Vec<ContactPoint>,
) {
    let mut starts: Vec<(f64, Vec3)> = samples.seeds.iter().map(|p| (probe.gap(p), *p)).collect();
    starts.retain(|(gap, _)| *gap < margin + samples.spacing);
    starts.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut used, mut found): (Vec<Vec3>, Vec<Vec3>) = (Vec::new(), Vec::new());
    for (_, start) in starts {
        if used.len() == WITNESSES {
            break;
        }
        if used.iter().chain(&found).any(|p| (p - start).norm() < 2.0 * samples.spacing) {
            continue;
        }
        used.push(start);
        let lowest = descend(probe, shape_a, start, samples.spacing);
        if found.iter().any(|p| (p - lowest).norm() < 0.5 * samples.spacing) {
            continue;
        }
        found.push(lowest);
        let fade =
            (rise(probe, shape_a, &lowest) / RISE).min(aside(samples, &lowest) / ASIDE).clamp(0.0, 1.0);
        let area = POINT_AREA * fade;
        let point = probe.contact(&lowest, area, MOVING | (LOWEST + used.len() as u32));
        if point.phi < margin && area > 0.0 {
            out.push(point);
        }
    }
}

/// How much the gap rises `ASIDE` of a point of the surface, m, in the direction of the steepest rise.
fn rise(probe: &Probe, shape_a: &Shape, p: &Vec3) -> f64 {
    let (here, normal) = (probe.gap(p), shape_a.distance_and_normal(p).1);
    let u = Vec3::ith(normal.iamin(), 1.0).cross(&normal).normalize();
    let v = normal.cross(&u);
    // Both ways, since a slope is no rise.
    [u, v, (u + v).normalize(), (u - v).normalize()]
        .map(|d| [d, -d].map(|d| probe.gap(&onto(shape_a, p + d * ASIDE)) - here))
        .into_iter()
        .fold(0.0, |most, [ahead, behind]| f64::max(most, ahead.min(behind)))
}

/// Distance of `p` from the nearest corner, edge sample or rim, m: at one of those it is that which carries.
fn aside(samples: &SkinSamples, p: &Vec3) -> f64 {
    let to_ring = |ring: &Ring| {
        let q = ring.frame_o.inverse_transform_point(&nalgebra::Point3::from(*p));
        (q.x.hypot(q.y) - ring.radius).hypot(q.z)
    };
    let to_fixed = samples.fixed.iter().map(|q| (p - q).norm());
    to_fixed.chain(samples.rings.iter().map(to_ring)).fold(f64::INFINITY, f64::min)
}

/// Slides along the surface of a to where b's field is least: steepest descent with steps after Barzilai & Borwein
/// (IMA J. Numer. Anal. 8, 1988), halved where they do not descend.
fn descend(probe: &Probe, shape_a: &Shape, start: Vec3, spacing: f64) -> Vec3 {
    let downhill = |p: &Vec3| {
        let ((gap, gradient), normal) = (probe.slope(p), shape_a.distance_and_normal(p).1);
        (gap, normal * normal.dot(&gradient) - gradient)
    };
    let (mut p, mut step) = (start, spacing);
    let (mut gap, mut way) = downhill(&p);
    for _ in 0..40 {
        let length = (step * way.norm()).min(spacing);
        if length < 1e-8 {
            break;
        }
        let next = onto(shape_a, p + way.normalize() * length);
        let (next_gap, next_way) = downhill(&next);
        if next_gap >= gap {
            step *= 0.5;
            continue;
        }
        let (moved, changed) = (next - p, way - next_way);
        let curvature = moved.dot(&changed);
        step = if curvature > 0.0 { moved.norm_squared() / curvature } else { 2.0 * step };
        (p, gap, way) = (next, next_gap, next_way);
    }
    p
}
