//! Contact points of two primitives by the overlap of their features along a common normal.

use super::{
    ManifoldPoint, NON_MATERIAL, POINT_AREA, Placed, Primitive,
    clip::{self, ClippedEnd, Corner},
    feature::{Face, FaceCorner, FacingFeatures, Line, facing_features},
    separating_axis::{ContactNormal, contact_normal, support},
};
use softvt_geometry::{Pose, Vec3, hex8, orthonormal_basis};

/// Distance up to which features count as overlapping, m: above the rounding of a refined normal.
const SLACK_M: f64 = 1e-6;
/// Angle (sine) from which two lines touch at their crossing; more nearly parallel ones touch along their overlap.
const MIN_CROSSING_SINE: f64 = 0.05;
/// Height over the deepest point of a pair up to which a point counts as deepest in full, and from which it does not,
/// m. If the deepest points have less than the area of a point contact, the closest points get the difference.
const DEEPEST_M: [f64; 2] = [1e-5, 5e-5];
/// Length of a line contact below which its weight fades from two points to one (at length zero), m.
const SHORT_LINE_M: f64 = 1e-3;
/// Overlap area above which two faces carry at least one point contact, m²: a body on a sliver of its edge is no softer
/// than one on a corner.
const SLIVER_M2: f64 = 1e-6;
/// Flag in the identifier of a feature of the second primitive.
const OF_B: u32 = 1 << 28;
/// Identifier of the closest points.
const WITNESS: u32 = NON_MATERIAL | 3 << 28;

/// A plane perpendicular to the contact normal, onto which features are projected.
struct ProjectionPlane {
    origin: Vec3,
    n: Vec3,
    u: Vec3,
    v: Vec3,
}

impl ProjectionPlane {
    fn new(origin: Vec3, n: Vec3) -> Self {
        let [u, v] = orthonormal_basis(&n);
        Self { origin, n, u, v }
    }

    /// Coordinates of the projection of a point, m.
    fn project(&self, p: &Vec3) -> [f64; 2] {
        let r = p - self.origin;
        [self.u.dot(&r), self.v.dot(&r)]
    }

    /// Height of a point over the plane, m.
    fn height(&self, p: &Vec3) -> f64 {
        self.n.dot(&(p - self.origin))
    }

    /// Height of a face over the point `q` of the plane, m.
    fn height_of_face(&self, face: &Face, q: &[f64; 2]) -> f64 {
        let foot = self.origin + self.u * q[0] + self.v * q[1];
        face.normal.dot(&(face.origin - foot)) / face.normal.dot(&self.n)
    }

    /// Corners of a projected face, counter-clockwise, with `owner` added to their identifiers.
    fn polygon(&self, face: &Face, owner: u32) -> Vec<Corner> {
        let corner = |c: &FaceCorner| Corner {
            p: self.project(&c.position_w),
            feature: c.feature | owner,
            edge: c.edge,
        };
        let mut corners: Vec<Corner> = face.corners.iter().map(corner).collect();
        if clip::area2(&corners) < 0.0 {
            corners.reverse();
            // A corner stores its outgoing edge, which after the reversal is the former incoming one.
            let incoming: Vec<u32> = corners.iter().map(|c| c.edge).collect();
            let count = corners.len();
            (0..count).for_each(|i| corners[i].edge = incoming[(i + 1) % count]);
        }
        corners
    }
}

/// A point of the overlap of two features.
struct FeatureOverlap {
    /// Position in the plane, m.
    q: [f64; 2],
    /// Height of the first primitive, m.
    height_a: f64,
    /// Height of the second primitive, m.
    height_b: f64,
    /// Area, m².
    area: f64,
    feature: u32,
}

/// Appends the contact points of two primitives in rank order.
pub(super) fn features(
    a: &Placed<Primitive>,
    b: &Placed<Primitive>,
    margin: f64,
    out: &mut Vec<ManifoldPoint>,
) {
    let Some(axis) = contact_normal(a, b, margin) else { return };
    let plane = ProjectionPlane::new(b.pose.translation.vector, axis.normal_w);
    let (on_a, on_b) = (facing_features(a, &axis.normal_w), facing_features(b, &-axis.normal_w));
    let mut carried = 0.0;
    for FeatureOverlap { q, height_a, height_b, area, feature } in feature_overlaps(&plane, &on_a, &on_b) {
        let gap = height_b - height_a;
        carried +=
            area * (1.0 - ((gap - axis.gap - DEEPEST_M[0]) / (DEEPEST_M[1] - DEEPEST_M[0])).clamp(0.0, 1.0));
        if gap < margin && area > 0.0 {
            let position_w =
                plane.origin + plane.u * q[0] + plane.v * q[1] + plane.n * (0.5 * (height_a + height_b));
            out.push(ManifoldPoint { position_w, normal_w: axis.normal_w, gap, area, feature });
        }
    }
    let uncarried = POINT_AREA - carried;
    if uncarried > 0.0 && (axis.closest.is_some() || carried == 0.0) && axis.is_attained {
        out.push(ManifoldPoint { area: uncarried, ..witness(a, b, &axis) });
    }
}

/// The closest points, for contacts that no overlap of features represents (a rim against an edge, end against end).
fn witness(a: &Placed<Primitive>, b: &Placed<Primitive>, axis: &ContactNormal) -> ManifoldPoint {
    let position_w = match axis.closest {
        Some(touch) => 0.5 * (touch.on_a_w + touch.on_b_w),
        None => 0.5 * (support(a, &axis.normal_w) + support(b, &-axis.normal_w)),
    };
    ManifoldPoint { position_w, normal_w: axis.normal_w, gap: axis.gap, area: POINT_AREA, feature: WITNESS }
}

fn feature_overlaps(plane: &ProjectionPlane, a: &FacingFeatures, b: &FacingFeatures) -> Vec<FeatureOverlap> {
    let mut found = Vec::new();
    if let (Some(a), Some(b)) = (&a.face, &b.face) {
        face_face(plane, a, b, &mut found);
    }
    if let (Some(face), Some(line)) = (&a.face, &b.line) {
        line_face(plane, line, face, true, &mut found);
    }
    if let (Some(line), Some(face)) = (&a.line, &b.face) {
        line_face(plane, line, face, false, &mut found);
    }
    if let (Some(a), Some(b)) = (&a.line, &b.line) {
        line_line(plane, a, b, &mut found);
    }
    found
}

fn face_face(plane: &ProjectionPlane, a: &Face, b: &Face, found: &mut Vec<FeatureOverlap>) {
    let polygon = match (a.corners.is_empty(), b.corners.is_empty()) {
        (true, true) => return,
        (true, false) => plane.polygon(b, OF_B),
        (false, true) => plane.polygon(a, 0),
        (false, false) => clip::overlap(&plane.polygon(a, 0), &plane.polygon(b, OF_B)),
    };
    let overlap = 0.5 * clip::area2(&polygon);
    let area = overlap.max(POINT_AREA * (overlap / SLIVER_M2).min(1.0)) * a.weight * b.weight;
    for (corner, share) in polygon.iter().zip(clip::shares(&polygon)) {
        found.push(FeatureOverlap {
            q: corner.p,
            height_a: plane.height_of_face(a, &corner.p),
            height_b: plane.height_of_face(b, &corner.p),
            area: area * share,
            feature: corner.feature,
        });
    }
}

/// The ends of the part of a side line over a face; `face_is_a` is true if the face is one of the first primitive.
fn line_face(
    plane: &ProjectionPlane,
    line: &Line,
    face: &Face,
    face_is_a: bool,
    found: &mut Vec<FeatureOverlap>,
) {
    let (face_owner, line_owner) = if face_is_a { (0, OF_B) } else { (OF_B, 0) };
    let polygon = plane.polygon(face, face_owner);
    let ends = line.ends.map(|end| plane.project(&end));
    let heights = line.ends.map(|end| plane.height(&end));
    let Some(part) = clip::clip_line(&ends, &polygon, SLACK_M) else { return };
    let along = (ends[1][0] - ends[0][0]).hypot(ends[1][1] - ends[0][1]);
    let length = (part[1].t - part[0].t).max(0.0) * along;
    let area = POINT_AREA * line.weight * face.weight * 0.5 * (1.0 + (length / SHORT_LINE_M).min(1.0));
    for (end, ClippedEnd { t, edge }) in part.into_iter().enumerate() {
        let q = clip::between(&ends[0], &ends[1], t);
        let on_line = heights[0] + (heights[1] - heights[0]) * t;
        let on_face = plane.height_of_face(face, &q);
        let feature = match edge {
            None => line.end_features[end] | line_owner,
            Some(edge) if face_is_a => clip::crossing(polygon[edge].edge, line.feature),
            Some(edge) => clip::crossing(line.feature, polygon[edge].edge),
        };
        let (height_a, height_b) = if face_is_a { (on_face, on_line) } else { (on_line, on_face) };
        found.push(FeatureOverlap { q, height_a, height_b, area, feature });
    }
}

/// Two side lines: their crossing, or the ends of their overlap if they are nearly parallel; in between, one
/// fades into the other.
fn line_line(plane: &ProjectionPlane, a: &Line, b: &Line, found: &mut Vec<FeatureOverlap>) {
    let (flat_a, flat_b) = (a.ends.map(|p| plane.project(&p)), b.ends.map(|p| plane.project(&p)));
    let (height_a, height_b) = (a.ends.map(|p| plane.height(&p)), b.ends.map(|p| plane.height(&p)));
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
    let crossed = (det.abs() / (length_a * length_b) / MIN_CROSSING_SINE).min(1.0);
    let mut push = |ta: f64, tb: f64, weight: f64, feature: u32| {
        let lerp = |h: &[f64; 2], t: f64| h[0] + (h[1] - h[0]) * t;
        let (on_a, on_b) =
            (clip::between(&flat_a[0], &flat_a[1], ta), clip::between(&flat_b[0], &flat_b[1], tb));
        let area = POINT_AREA * weight * a.weight * b.weight;
        found.push(FeatureOverlap {
            q: clip::between(&on_a, &on_b, 0.5),
            height_a: lerp(&height_a, ta),
            height_b: lerp(&height_b, tb),
            area,
            feature,
        });
    };
    if crossed > 0.0 && on(ta, length_a) && on(tb, length_b) {
        push(ta, tb, crossed, clip::crossing(a.feature, b.feature));
    }
    if crossed < 1.0 {
        // Positions along the mean direction, from a's first end.
        let same_way = along_a.dot(&along_b).signum();
        let mean = (along_a / length_a + along_b * (same_way / length_b)).normalize();
        let (span_a, start_b, span_b) = (mean.dot(&along_a), mean.dot(&apart), mean.dot(&along_b));
        let low = start_b.min(start_b + span_b).max(0.0);
        let high = start_b.max(start_b + span_b).min(span_a);
        for (place, end) in [(low, 0), (high, 1)].into_iter().filter(|_| low <= high) {
            push(place / span_a, (place - start_b) / span_b, 1.0 - crossed, a.end_features[end]);
        }
    }
}

/// Appends the corners of a box of half extents `half` within `margin` (m) of the plane of a half-space.
///
/// The area of a corner is a quarter of each of its faces, projected onto the half-space: for a box on a face they
/// add up to the face, for one on an edge they change smoothly from one face to the next.
pub(super) fn plane_box(
    plane_w: &Pose,
    half: &Vec3,
    box_w: &Pose,
    margin: f64,
    out: &mut Vec<ManifoldPoint>,
) {
    let normal_w = plane_w.rotation * Vec3::z();
    let down = -(box_w.rotation.inverse() * normal_w);
    let face = Vec3::new(half.y * half.z, half.x * half.z, half.x * half.y);
    for corner in 0..8u32 {
        let sign = hex8::corner_sign(corner as usize);
        let position_w = box_w * nalgebra::Point3::from(half.component_mul(&sign));
        let gap = normal_w.dot(&(position_w.coords - plane_w.translation.vector));
        let area = (0..3).map(|axis| face[axis] * (sign[axis] * down[axis]).max(0.0)).sum::<f64>();
        if gap < margin && area > 0.0 {
            out.push(ManifoldPoint {
                position_w: position_w.coords - normal_w * (0.5 * gap),
                normal_w,
                gap,
                area,
                feature: corner,
            });
        }
    }
}
