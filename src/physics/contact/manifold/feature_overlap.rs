//! Contact points of two primitives whose features meet along a common normal.

use super::{
    ManifoldPoint, NON_MATERIAL, POINT_AREA, Primitive,
    clip::{self, Corner},
    feature::{Face, Features, Line, facing},
    separating_axis::{Axis, contact_axis, support},
};
use crate::geometry::{Pose, Vec3, orthonormal_basis};

/// Features overlap if they miss each other by less than this, m: above the rounding of a refined normal.
const SLACK_M: f64 = 1e-6;
/// Lines crossing at a larger angle (sine) touch at their crossing, lines more nearly parallel along their overlap.
const CROSSING: f64 = 0.05;
/// A point counts as the deepest of its pair in full up to the first of these, m, and not at all from the second on.
/// What the deepest points lack of the area of one point contact is given to the closest points.
const DEEPEST_M: [f64; 2] = [1e-5, 5e-5];
/// A shorter line of contact, m, counts less than two points, down to one for none.
const SHORT_LINE_M: f64 = 1e-3;
/// From this overlap of two faces on, m², it counts as at least a point contact: a body on a sliver of its edge is no
/// softer than one on a corner.
const SLIVER_M2: f64 = 1e-6;
/// Set in the name of a feature of the second primitive.
const OF_B: u32 = 1 << 28;
/// The name of the closest points.
const WITNESS: u32 = NON_MATERIAL | 3 << 28;

/// A plane across the contact normal, in which features are laid over each other.
struct Cross {
    origin: Vec3,
    n: Vec3,
    u: Vec3,
    v: Vec3,
}

impl Cross {
    fn new(origin: Vec3, n: Vec3) -> Self {
        let [u, v] = orthonormal_basis(&n);
        Self { origin, n, u, v }
    }

    fn flat(&self, p: &Vec3) -> [f64; 2] {
        let r = p - self.origin;
        [self.u.dot(&r), self.v.dot(&r)]
    }

    fn height(&self, p: &Vec3) -> f64 {
        self.n.dot(&(p - self.origin))
    }

    /// How high a face's plane is over the point `q`.
    fn height_of(&self, face: &Face, q: &[f64; 2]) -> f64 {
        let foot = self.origin + self.u * q[0] + self.v * q[1];
        face.normal.dot(&(face.origin - foot)) / face.normal.dot(&self.n)
    }

    /// A face's corners in the plane, counter-clockwise; `owner` is put into their names.
    fn polygon(&self, face: &Face, owner: u32) -> Vec<Corner> {
        let corner =
            |&(p, name, edge): &(Vec3, u32, u32)| Corner { p: self.flat(&p), name: name | owner, edge };
        let mut corners: Vec<Corner> = face.corners.iter().map(corner).collect();
        if clip::area2(&corners) < 0.0 {
            corners.reverse();
            // A corner names the edge that leaves it, which now is the one that used to arrive.
            let arriving: Vec<u32> = corners.iter().map(|c| c.edge).collect();
            let count = corners.len();
            (0..count).for_each(|i| corners[i].edge = arriving[(i + 1) % count]);
        }
        corners
    }
}

/// Where features overlap: place in the plane, heights of the first and second primitive, area and name.
type FeatureOverlap = ([f64; 2], f64, f64, f64, u32);

/// Appends the contact points of two primitives in rank order.
pub(super) fn features(
    a: &Primitive,
    pose_a: &Pose,
    b: &Primitive,
    pose_b: &Pose,
    margin: f64,
    out: &mut Vec<ManifoldPoint>,
) {
    let Some(axis) = contact_axis(a, pose_a, b, pose_b, margin) else { return };
    let cross = Cross::new(pose_b.translation.vector, axis.n_w);
    let (on_a, on_b) = (facing(a, pose_a, &axis.n_w), facing(b, pose_b, &-axis.n_w));
    let mut carried = 0.0;
    for (q, height_a, height_b, area, feature) in feature_overlaps(&cross, &on_a, &on_b) {
        let phi = height_b - height_a;
        carried +=
            area * (1.0 - ((phi - axis.gap - DEEPEST_M[0]) / (DEEPEST_M[1] - DEEPEST_M[0])).clamp(0.0, 1.0));
        if phi < margin && area > 0.0 {
            let p_w =
                cross.origin + cross.u * q[0] + cross.v * q[1] + cross.n * (0.5 * (height_a + height_b));
            out.push(ManifoldPoint { p_w, n_w: axis.n_w, phi, area, feature });
        }
    }
    let lacking = POINT_AREA - carried;
    if lacking > 0.0 && (axis.closest.is_some() || carried == 0.0) && axis.true_gap {
        out.push(ManifoldPoint { area: lacking, ..witness(a, pose_a, b, pose_b, &axis) });
    }
}

/// The closest points themselves, where no overlap of features holds them (a rim against an edge, end against end).
fn witness(a: &Primitive, pose_a: &Pose, b: &Primitive, pose_b: &Pose, axis: &Axis) -> ManifoldPoint {
    let p_w = match axis.closest {
        Some(touch) => 0.5 * (touch.a_w + touch.b_w),
        None => 0.5 * (support(a, pose_a, &axis.n_w) + support(b, pose_b, &-axis.n_w)),
    };
    ManifoldPoint { p_w, n_w: axis.n_w, phi: axis.gap, area: POINT_AREA, feature: WITNESS }
}

fn feature_overlaps(cross: &Cross, a: &Features, b: &Features) -> Vec<FeatureOverlap> {
    let mut found = Vec::new();
    if let (Some(a), Some(b)) = (&a.face, &b.face) {
        face_face(cross, a, b, &mut found);
    }
    if let (Some(face), Some(line)) = (&a.face, &b.line) {
        line_face(cross, line, face, true, &mut found);
    }
    if let (Some(line), Some(face)) = (&a.line, &b.face) {
        line_face(cross, line, face, false, &mut found);
    }
    if let (Some(a), Some(b)) = (&a.line, &b.line) {
        line_line(cross, a, b, &mut found);
    }
    found
}

fn face_face(cross: &Cross, a: &Face, b: &Face, found: &mut Vec<FeatureOverlap>) {
    let polygon = match (a.corners.is_empty(), b.corners.is_empty()) {
        (true, true) => return,
        (true, false) => cross.polygon(b, OF_B),
        (false, true) => cross.polygon(a, 0),
        (false, false) => clip::overlap(&cross.polygon(a, 0), &cross.polygon(b, OF_B)),
    };
    let overlap = 0.5 * clip::area2(&polygon);
    let area = overlap.max(POINT_AREA * (overlap / SLIVER_M2).min(1.0)) * a.weight * b.weight;
    for (corner, share) in polygon.iter().zip(clip::shares(&polygon)) {
        let heights = (cross.height_of(a, &corner.p), cross.height_of(b, &corner.p));
        found.push((corner.p, heights.0, heights.1, area * share, corner.name));
    }
}

/// The ends of the part of a side line that lies over a face; `face_is_a` says which primitive owns the face.
fn line_face(cross: &Cross, line: &Line, face: &Face, face_is_a: bool, found: &mut Vec<FeatureOverlap>) {
    let (face_owner, line_owner) = if face_is_a { (0, OF_B) } else { (OF_B, 0) };
    let polygon = cross.polygon(face, face_owner);
    let ends = line.ends.map(|end| cross.flat(&end));
    let heights = line.ends.map(|end| cross.height(&end));
    let Some(part) = clip::inside(&ends, &polygon, SLACK_M) else { return };
    let along = (ends[1][0] - ends[0][0]).hypot(ends[1][1] - ends[0][1]);
    let length = (part[1].0 - part[0].0).max(0.0) * along;
    let area = POINT_AREA * line.weight * face.weight * 0.5 * (1.0 + (length / SHORT_LINE_M).min(1.0));
    for (end, (t, cut)) in part.into_iter().enumerate() {
        let q = clip::between(&ends[0], &ends[1], t);
        let on_line = heights[0] + (heights[1] - heights[0]) * t;
        let on_face = cross.height_of(face, &q);
        let name = match cut {
            None => line.names[end] | line_owner,
            Some(edge) if face_is_a => clip::crossing(polygon[edge].edge, line.name),
            Some(edge) => clip::crossing(line.name, polygon[edge].edge),
        };
        found.push(if face_is_a {
            (q, on_face, on_line, area, name)
        } else {
            (q, on_line, on_face, area, name)
        });
    }
}

/// Two side lines: the point where they cross, or the ends of their overlap if they are nearly parallel; in between
/// one fades into the other.
fn line_line(cross: &Cross, a: &Line, b: &Line, found: &mut Vec<FeatureOverlap>) {
    let (flat_a, flat_b) = (a.ends.map(|p| cross.flat(&p)), b.ends.map(|p| cross.flat(&p)));
    let (height_a, height_b) = (a.ends.map(|p| cross.height(&p)), b.ends.map(|p| cross.height(&p)));
    let along = |e: &[[f64; 2]; 2]| nalgebra::Vector2::new(e[1][0] - e[0][0], e[1][1] - e[0][1]);
    let (along_a, along_b) = (along(&flat_a), along(&flat_b));
    let (length_a, length_b) = (along_a.norm(), along_b.norm());
    if length_a.min(length_b) < SLACK_M {
        return;
    }
    let det = along_a.perp(&along_b);
    let apart = nalgebra::Vector2::new(flat_b[0][0] - flat_a[0][0], flat_b[0][1] - flat_a[0][1]);
    let (ta, tb) = (apart.perp(&along_b) / det, apart.perp(&along_a) / det);
    let on = |t: f64, length: f64| (-SLACK_M / length..=1.0 + SLACK_M / length).contains(&t);
    let crossed = (det.abs() / (length_a * length_b) / CROSSING).min(1.0);
    let mut push = |ta: f64, tb: f64, weight: f64, name: u32| {
        let lerp = |h: &[f64; 2], t: f64| h[0] + (h[1] - h[0]) * t;
        let (on_a, on_b) =
            (clip::between(&flat_a[0], &flat_a[1], ta), clip::between(&flat_b[0], &flat_b[1], tb));
        let area = POINT_AREA * weight * a.weight * b.weight;
        found.push((clip::between(&on_a, &on_b, 0.5), lerp(&height_a, ta), lerp(&height_b, tb), area, name));
    };
    if crossed > 0.0 && on(ta, length_a) && on(tb, length_b) {
        push(ta, tb, crossed, clip::crossing(a.name, b.name));
    }
    if crossed < 1.0 {
        // Places along the mean direction, from a's first end.
        let same_way = along_a.dot(&along_b).signum();
        let mean = (along_a / length_a + along_b * (same_way / length_b)).normalize();
        let (span_a, start_b, span_b) = (mean.dot(&along_a), mean.dot(&apart), mean.dot(&along_b));
        let low = start_b.min(start_b + span_b).max(0.0);
        let high = start_b.max(start_b + span_b).min(span_a);
        for (place, end) in [(low, 0), (high, 1)].into_iter().filter(|_| low <= high) {
            push(place / span_a, (place - start_b) / span_b, 1.0 - crossed, a.names[end]);
        }
    }
}
