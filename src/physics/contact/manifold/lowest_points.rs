//! Lowest points of the smooth parts of a body in the distance field of another, and the lines in
//! which such parts touch.
//!
//! A part that is curved in one direction only (the side of a can, the rounded edge of a box) touches along a line,
//! on which the lowest point is undefined: the ends of the line carry instead. Where corners, rims or flat samples
//! touch as deep as a lowest point, they carry alone. A second support next to them, on the side to which a body
//! happens to lean, would make it rock indefinitely.
//!
//! On a mesh, a search ends at an edge between two facets as often as at a vertex, and elsewhere in the next step, so
//! that a support is missing in between: the body would rock as well. So it touches with its vertices, and no search
//! starts on small facets, nor on large ones next to a vertex or an edge that is deeper.

use std::f64::consts::{FRAC_PI_4, TAU};

use super::{
    ManifoldPoint, NON_MATERIAL, POINT_AREA,
    feature_extraction::{Rim, SAMPLE_AREA},
    field::SurfaceInSdf,
    field_probe::{SdfProbe, golden_minimum},
    flat_region::{MAX_FLAT_CURVATURE, project_to_surface},
};
use softvt_geometry::{Vec3, orthonormal_basis, shape::Shape};

/// Distance from a lowest point at which the rise of the gap is measured, m.
const PROBE_DISTANCE: f64 = 1e-3;
/// Its upper limit in seed spacings, for small bodies.
const PROBE_DISTANCE_RATIO: f64 = 1.0 / 6.0;
/// Distance from a deeper point up to which no search starts on a mesh, in seed spacings.
const CARRIED_DISTANCE: f64 = 2.0;
/// Largest number of lowest points of one body.
const MAX_LOWEST: usize = 6;
/// First identifier of lowest points, four for each: the point and the ends of its line.
const LOWEST_FEATURES: u32 = 1 << 24;
/// Other points that are higher than a lowest point by up to the first value, m, carry instead of it; from the second
/// value on they do not.
const SAME_DEPTH_M: [f64; 2] = [2e-6, 1e-5];
/// Smallest cosine between their normals for which they do so.
const SAME_SIDE: f64 = 0.9;
/// Rotation of the normal at which a line ends, rad.
const LINE_TURN: f64 = 5e-3;
/// Rise of the gap or the surface over the lowest point at which a line ends, m.
const LINE_RISE: f64 = 2e-5;

/// The smooth surface of the first body in the field of the second.
struct Smooth<'a> {
    surface: &'a SurfaceInSdf<'a>,
    /// Distance at which the rise of the gap is measured, m.
    distance: f64,
    /// Rise of the gap there from which a lowest point is well defined, m: that of [`MAX_FLAT_CURVATURE`].
    rise: f64,
}

impl SurfaceInSdf<'_> {
    /// Appends the lowest points and lines of smooth parts whose gap is below `margin` (m), as far as the points
    /// already in `out` do not carry there.
    pub(in super::super) fn lowest(&self, margin: f64, out: &mut Vec<ManifoldPoint>) {
        let Self { features, shape, probe } = self;
        let distance = PROBE_DISTANCE.min(PROBE_DISTANCE_RATIO * features.spacing);
        let smooth = Smooth { surface: self, distance, rise: 0.5 * MAX_FLAT_CURVATURE * distance * distance };
        let reach = margin + features.spacing;
        let near = features.seeds.iter().filter(|p| !probe.is_beyond(p, reach));
        let mut starts: Vec<(f64, Vec3)> = near.map(|p| (probe.gap(p), *p)).collect();
        starts.retain(|(gap, _)| *gap < reach);
        starts.sort_by(|a, b| a.0.total_cmp(&b.0));
        let others = out.clone();
        let apart = CARRIED_DISTANCE * features.spacing;
        let is_carried = |gap: f64, p: &Vec3| {
            let p_w = (probe.pose_b * (probe.a_in_b * nalgebra::Point3::from(*p))).coords;
            let carries = |q: &ManifoldPoint| q.gap < gap && (q.position_w - p_w).norm() < apart;
            features.has_vertices && others.iter().any(carries)
        };
        let (mut used, mut found): (Vec<Vec3>, Vec<[Vec3; 2]>) = (Vec::new(), Vec::new());
        for (gap, start) in starts {
            if used.len() == MAX_LOWEST {
                break;
            }
            let is_known =
                |p: &Vec3, apart: f64| found.iter().any(|line| distance_to_segment(p, line) < apart);
            if used.iter().any(|p| (p - start).norm() < features.spacing)
                || is_known(&start, features.spacing)
                || is_carried(gap, &start)
            {
                continue;
            }
            used.push(start);
            let lowest = descend(probe, shape, start, features.spacing);
            if is_known(&lowest, 0.5 * features.spacing) {
                continue;
            }
            let feature = NON_MATERIAL | (LOWEST_FEATURES + 4 * used.len() as u32);
            found.push(smooth.add_points(&lowest, feature, &others, margin, out));
        }
    }
}

/// Direction of the line in which a smooth part touches.
struct LineDirection {
    direction: Vec3,
    /// 1 if the gap rises along it as at a point, 0 if it does not rise, as along a line.
    point_share: f64,
}

impl Smooth<'_> {
    /// Appends the point `p` as far as it is well defined, and the ends of its line as far as it is
    /// not. Returns the line.
    fn add_points(
        &self,
        p: &Vec3,
        feature: u32,
        others: &[ManifoldPoint],
        margin: f64,
        out: &mut Vec<ManifoldPoint>,
    ) -> [Vec3; 2] {
        let uncarried = uncarried_share(&self.surface.probe.contact(p, 0.0, feature), others);
        let mut push = |p: &Vec3, share: f64, feature: u32| {
            let area = POINT_AREA * uncarried.min(self.distance_from_edges(p)) * share;
            let point = self.surface.probe.contact(p, area, feature);
            if point.gap < margin && area > 0.0 {
                out.push(point);
            }
        };
        if uncarried == 0.0 {
            return [*p; 2];
        }
        let rises = self.rises(p);
        let opposite = |k: usize| rises[k].min(rises[k + 4]);
        let curved = ((0..4).map(opposite).fold(0.0, f64::max) / self.rise).clamp(0.0, 1.0);
        let least = (0..8).fold(0, |least, k| if rises[k] < rises[least] { k } else { least });
        if curved == 0.0 || rises[least] >= self.rise {
            push(p, 1.0, feature);
            return [*p; 2];
        }
        let LineDirection { direction, point_share: along } = self.line_direction(p, least);
        let ends = [self.line_end(p, direction), self.line_end(p, -direction)];
        let line = curved * (1.0 - along);
        push(p, 1.0 - line, feature);
        push(&ends[0], line, feature + 1);
        push(&ends[1], line, feature + 2);
        ends
    }

    /// Rise of the gap around a point, m, in eight directions.
    fn rises(&self, p: &Vec3) -> [f64; 8] {
        let here = self.surface.probe.gap(p);
        let [u, v] = orthonormal_basis(&self.surface.shape.distance_and_normal(p).1);
        let directions = [u, v, (u + v).normalize(), (u - v).normalize()];
        std::array::from_fn(|k| {
            let direction = if k < 4 { directions[k] } else { -directions[k - 4] };
            self.surface.probe.gap(&project_to_surface(self.surface.shape, p + direction * self.distance))
                - here
        })
    }

    /// The direction, near the given one of eight, in which the gap rises least.
    fn line_direction(&self, p: &Vec3, eighth: usize) -> LineDirection {
        let [u, v] = orthonormal_basis(&self.surface.shape.distance_and_normal(p).1);
        // The order of `rises`: along u, v and the two between them, then the opposite ones.
        let angle = [0.0, 2.0, 1.0, -1.0, 4.0, 6.0, 5.0, 3.0][eighth] * FRAC_PI_4;
        let at = |angle: f64| u * angle.cos() + v * angle.sin();
        let gap =
            |d: &Vec3| self.surface.probe.gap(&project_to_surface(self.surface.shape, p + d * self.distance));
        let direction = at(golden_minimum(|angle| gap(&at(angle)), angle - FRAC_PI_4, 0.25 * TAU));
        let rise = gap(&direction).min(gap(&-direction)) - self.surface.probe.gap(p);
        LineDirection { direction, point_share: (rise / self.rise).clamp(0.0, 1.0) }
    }

    /// End of the straight line along `direction` from the lowest point `p`, where it leaves the surface
    /// or the other body.
    fn line_end(&self, p: &Vec3, direction: Vec3) -> Vec3 {
        let (gap, normal) = (self.surface.probe.gap(p), self.surface.shape.distance_and_normal(p).1);
        let is_on_line = |length: f64| {
            let q = p + direction * length;
            let (off, turned) = self.surface.shape.distance_and_normal(&q);
            off.abs() < LINE_RISE
                && (turned - normal).norm() < LINE_TURN
                && self.surface.probe.gap(&q) - gap < LINE_RISE
        };
        let (mut inside, mut outside) = (0.0, self.surface.features.spacing);
        while is_on_line(outside) && outside < 100.0 * self.surface.features.spacing {
            (inside, outside) = (outside, outside + self.surface.features.spacing);
        }
        for _ in 0..14 {
            let middle = 0.5 * (inside + outside);
            if is_on_line(middle) { inside = middle } else { outside = middle }
        }
        project_to_surface(self.surface.shape, p + direction * inside)
    }

    /// 0 on a sharp corner, edge or rim, which carries there itself, to 1 away from them.
    fn distance_from_edges(&self, p: &Vec3) -> f64 {
        let to_rim = |rim: &Rim| {
            let q = rim.frame_o.inverse_transform_point(&nalgebra::Point3::from(*p));
            (q.x.hypot(q.y) - rim.radius).hypot(q.z)
        };
        let to_corners = self.surface.features.corners.iter().map(|q| (p - q).norm());
        let to_rims = self.surface.features.rims.iter().filter(|rim| rim.is_sharp).map(to_rim);
        (to_corners.chain(to_rims).fold(f64::INFINITY, f64::min) / self.distance).min(1.0)
    }
}

/// Share of a point contact that is not carried by other points as deep as `lowest` on its side.
fn uncarried_share(lowest: &ManifoldPoint, others: &[ManifoldPoint]) -> f64 {
    let same_side = others.iter().filter(|point| point.normal_w.dot(&lowest.normal_w) > SAME_SIDE);
    let carried = same_side.map(|point| {
        let higher = (point.gap - lowest.gap - SAME_DEPTH_M[0]) / (SAME_DEPTH_M[1] - SAME_DEPTH_M[0]);
        (1.0 - higher).clamp(0.0, 1.0) * (point.area / SAMPLE_AREA).min(1.0)
    });
    (1.0 - carried.sum::<f64>()).max(0.0)
}

/// Distance of a point from a segment, m.
fn distance_to_segment(p: &Vec3, [from, to]: &[Vec3; 2]) -> f64 {
    let span = to - from;
    let square = span.norm_squared();
    let share = if square > 0.0 { (span.dot(&(p - from)) / square).clamp(0.0, 1.0) } else { 0.0 };
    (p - from - span * share).norm()
}

/// Minimises b's field over the surface of a: steepest descent with the steps of Barzilai & Borwein (IMA J. Numer.
/// Anal. 8, 1988), halved where they do not descend.
fn descend(probe: &SdfProbe, shape_a: &Shape, start: Vec3, spacing: f64) -> Vec3 {
    let downhill = |p: &Vec3| {
        let ((gap, gradient), normal) = (probe.gap_and_gradient(p), shape_a.distance_and_normal(p).1);
        (gap, normal * normal.dot(&gradient) - gradient)
    };
    let (mut p, mut step) = (start, spacing);
    let (mut gap, mut direction) = downhill(&p);
    for _ in 0..40 {
        let length = (step * direction.norm()).min(spacing);
        if length < 1e-8 {
            break;
        }
        let next = project_to_surface(shape_a, p + direction.normalize() * length);
        let (next_gap, next_direction) = downhill(&next);
        if next_gap >= gap {
            step *= 0.5;
            continue;
        }
        let (moved, changed) = (next - p, direction - next_direction);
        let curvature = moved.dot(&changed);
        step = if curvature > 0.0 { moved.norm_squared() / curvature } else { 2.0 * step };
        (p, gap, direction) = (next, next_gap, next_direction);
    }
    p
}
