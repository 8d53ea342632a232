//! The lowest points of the smooth parts of a body in the field of another, and the lines in which such parts touch.
//!
//! Where a part bends in one direction alone (the side of a can, the rounded edge of a box) it touches along a line, whose
//! lowest point has no place: the ends of the line carry instead. Where corners, rims or spots of a flat touch as deep as a
//! lowest point, they carry alone: a second support beside them, on the side to which a body happens to lean, would make it
//! rock for ever.

use std::f64::consts::{FRAC_PI_4, TAU};

use super::{
    ManifoldPoint, NON_MATERIAL, POINT_AREA,
    feature_extraction::{Ring, SAMPLE_AREA, SkinSamples, onto},
    field::{Probe, golden_minimum},
    flat_region::CURVED,
};
use crate::geometry::{Vec3, orthonormal_basis, shape::Shape};

/// How far aside of a lowest point the rise of the gap is looked at, m; on small bodies this share of the distance of seeds.
const ASIDE: f64 = 1e-3;
/// See [`ASIDE`].
const ASIDE_SHARE: f64 = 1.0 / 6.0;
/// Lowest points looked for on one body.
const WITNESSES: usize = 6;
/// First of the names of lowest points, four for each: the point, two ends of its line.
const LOWEST: u32 = 1 << 24;
/// Other points that lie higher than a lowest point by up to the first of these, m, carry instead of it, from the second on
/// they do not.
const AS_DEEP_M: [f64; 2] = [2e-6, 1e-5];
/// They do so if their normals agree (cosine) by at least this.
const SAME_SIDE: f64 = 0.9;
/// A line ends where the normal has turned by this much, rad, …
const LINE_TURN: f64 = 5e-3;
/// … or the gap or the skin has risen by this much over its lowest point, m.
const LINE_RISE: f64 = 2e-5;

/// The first body's smooth skin over the second.
struct Smooth<'a> {
    probe: &'a Probe<'a>,
    samples: &'a SkinSamples,
    shape: &'a Shape,
    /// How far aside of a point its surroundings are looked at, m.
    aside: f64,
    /// A lowest point has a place if the gap rises by this much aside of it, m: that of a curvature of [`CURVED`].
    rise: f64,
}

/// Appends the lowest points of the smooth parts of body a in the field of b; `out` holds what touches already.
pub(super) fn lowest_points(
    probe: &Probe,
    samples: &SkinSamples,
    shape: &Shape,
    margin: f64,
    out: &mut Vec<ManifoldPoint>,
) {
    let aside = ASIDE.min(ASIDE_SHARE * samples.spacing);
    let smooth = Smooth { probe, samples, shape, aside, rise: 0.5 * CURVED * aside * aside };
    let reach = margin + samples.spacing;
    let near = samples.seeds.iter().filter(|p| !probe.is_beyond(p, reach));
    let mut starts: Vec<(f64, Vec3)> = near.map(|p| (probe.gap(p), *p)).collect();
    starts.retain(|(gap, _)| *gap < reach);
    starts.sort_by(|a, b| a.0.total_cmp(&b.0));
    let others = out.clone();
    let (mut used, mut found): (Vec<Vec3>, Vec<[Vec3; 2]>) = (Vec::new(), Vec::new());
    for (_, start) in starts {
        if used.len() == WITNESSES {
            break;
        }
        let is_known = |p: &Vec3, apart: f64| found.iter().any(|line| from_segment(p, line) < apart);
        if used.iter().any(|p| (p - start).norm() < samples.spacing) || is_known(&start, samples.spacing) {
            continue;
        }
        used.push(start);
        let lowest = descend(probe, shape, start, samples.spacing);
        if is_known(&lowest, 0.5 * samples.spacing) {
            continue;
        }
        let name = NON_MATERIAL | (LOWEST + 4 * used.len() as u32);
        found.push(smooth.points(&lowest, name, (&others, margin), out));
    }
}

impl Smooth<'_> {
    /// Appends the point `p` as far as it has a place, and the ends of its line as far as it has none on that; the line.
    fn points(
        &self,
        p: &Vec3,
        name: u32,
        (others, margin): (&[ManifoldPoint], f64),
        out: &mut Vec<ManifoldPoint>,
    ) -> [Vec3; 2] {
        let lacking = lacking(&self.probe.contact(p, 0.0, name), others);
        let mut push = |p: &Vec3, share: f64, name: u32| {
            let area = POINT_AREA * lacking.min(self.off_edges(p)) * share;
            let point = self.probe.contact(p, area, name);
            if point.phi < margin && area > 0.0 {
                out.push(point);
            }
        };
        if lacking == 0.0 {
            return [*p; 2];
        }
        let rises = self.rises(p);
        let opposite = |k: usize| rises[k].min(rises[k + 4]);
        let bent = ((0..4).map(opposite).fold(0.0, f64::max) / self.rise).clamp(0.0, 1.0);
        let least = (0..8).fold(0, |least, k| if rises[k] < rises[least] { k } else { least });
        if bent == 0.0 || rises[least] >= self.rise {
            push(p, 1.0, name);
            return [*p; 2];
        }
        let (way, along) = self.line_way(p, least);
        let ends = [self.line_end(p, way), self.line_end(p, -way)];
        let line = bent * (1.0 - along);
        push(p, 1.0 - line, name);
        push(&ends[0], line, name + 1);
        push(&ends[1], line, name + 2);
        ends
    }

    /// How much the gap rises aside of a point, m, in eight directions.
    fn rises(&self, p: &Vec3) -> [f64; 8] {
        let here = self.probe.gap(p);
        let [u, v] = orthonormal_basis(&self.shape.distance_and_normal(p).1);
        let ways = [u, v, (u + v).normalize(), (u - v).normalize()];
        std::array::from_fn(|k| {
            let way = if k < 4 { ways[k] } else { -ways[k - 4] };
            self.probe.gap(&onto(self.shape, p + way * self.aside)) - here
        })
    }

    /// The direction near the given one of eight in which the gap rises least, and how far the rise along it, ahead or
    /// behind, is that of a point (1) or of a line (0).
    fn line_way(&self, p: &Vec3, eighth: usize) -> (Vec3, f64) {
        let [u, v] = orthonormal_basis(&self.shape.distance_and_normal(p).1);
        // The order of `rises`: along u, v and the two between them, then the opposite ones.
        let angle = [0.0, 2.0, 1.0, -1.0, 4.0, 6.0, 5.0, 3.0][eighth] * FRAC_PI_4;
        let at = |angle: f64| u * angle.cos() + v * angle.sin();
        let gap = |way: &Vec3| self.probe.gap(&onto(self.shape, p + way * self.aside));
        let way = at(golden_minimum(|angle| gap(&at(angle)), angle - FRAC_PI_4, 0.25 * TAU));
        let rise = gap(&way).min(gap(&-way)) - self.probe.gap(p);
        (way, (rise / self.rise).clamp(0.0, 1.0))
    }

    /// Where the straight line along `way` from the lowest point `p` leaves the skin or the other body.
    fn line_end(&self, p: &Vec3, way: Vec3) -> Vec3 {
        let (gap, normal) = (self.probe.gap(p), self.shape.distance_and_normal(p).1);
        let holds = |length: f64| {
            let q = p + way * length;
            let (off, turned) = self.shape.distance_and_normal(&q);
            off.abs() < LINE_RISE
                && (turned - normal).norm() < LINE_TURN
                && self.probe.gap(&q) - gap < LINE_RISE
        };
        let (mut inside, mut outside) = (0.0, self.samples.spacing);
        while holds(outside) && outside < 100.0 * self.samples.spacing {
            (inside, outside) = (outside, outside + self.samples.spacing);
        }
        for _ in 0..14 {
            let middle = 0.5 * (inside + outside);
            if holds(middle) { inside = middle } else { outside = middle }
        }
        onto(self.shape, p + way * inside)
    }

    /// 0 on a sharp corner, edge or rim, where it is that which carries, to 1 well off them.
    fn off_edges(&self, p: &Vec3) -> f64 {
        let to_ring = |ring: &Ring| {
            let q = ring.frame_o.inverse_transform_point(&nalgebra::Point3::from(*p));
            (q.x.hypot(q.y) - ring.radius).hypot(q.z)
        };
        let to_fixed = self.samples.fixed.iter().map(|q| (p - q).norm());
        let to_rings = self.samples.rings.iter().filter(|ring| ring.sharp).map(to_ring);
        (to_fixed.chain(to_rings).fold(f64::INFINITY, f64::min) / self.aside).min(1.0)
    }
}

/// The share of a point contact that `lowest` must carry, for want of others as deep as it on its side.
fn lacking(lowest: &ManifoldPoint, others: &[ManifoldPoint]) -> f64 {
    let same_side = others.iter().filter(|point| point.n_w.dot(&lowest.n_w) > SAME_SIDE);
    let carried = same_side.map(|point| {
        let higher = (point.phi - lowest.phi - AS_DEEP_M[0]) / (AS_DEEP_M[1] - AS_DEEP_M[0]);
        (1.0 - higher).clamp(0.0, 1.0) * (point.area / SAMPLE_AREA).min(1.0)
    });
    (1.0 - carried.sum::<f64>()).max(0.0)
}

/// Distance of a point from a segment, m.
fn from_segment(p: &Vec3, [from, to]: &[Vec3; 2]) -> f64 {
    let span = to - from;
    let square = span.norm_squared();
    let share = if square > 0.0 { (span.dot(&(p - from)) / square).clamp(0.0, 1.0) } else { 0.0 };
    (p - from - span * share).norm()
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
