//! Contact points of the surface features of a general shape in the distance field of another.

use std::f64::consts::TAU;

use super::{
    ManifoldPoint, NON_MATERIAL, POINT_AREA,
    feature::RIM_POINTS,
    feature_extraction::{Rim, SAMPLE_AREA, SurfaceFeatures},
    field_probe::{SdfProbe, golden_minimum},
};
use softvt_geometry::{Aabb, Pose, shape::Shape};

/// Tilt (sine) of a rim up to which all of it carries, and from which only its lowest point does.
const FLAT_RIM_TILT: [f64; 2] = [0.05, 0.1];
/// Tilt (sine) from which a rim's lowest point counts in full; on a flat rim its position is undefined.
const MIN_RIM_TILT: f64 = 1e-3;
/// First identifier of rim points, 64 per rim.
const RIM_FEATURES: u32 = 1 << 20;
/// First identifier of flat samples.
const FLAT_FEATURES: u32 = 1 << 23;

/// Surface of body a in the distance field of body b.
pub(in super::super) struct SurfaceInSdf<'a> {
    pub(super) features: &'a SurfaceFeatures,
    pub(super) shape: &'a Shape,
    pub(super) probe: SdfProbe<'a>,
}

impl<'a> SurfaceInSdf<'a> {
    /// The surface of `shape` with its features in the field of shape b.
    ///
    /// Normals point from a to b. Two general bodies meet both ways, with the normals of one flipped: first
    /// [`SurfaceInSdf::fixed`] of both, then [`SurfaceInSdf::lowest`].
    pub(in super::super) fn new(
        features: &'a SurfaceFeatures,
        shape: &'a Shape,
        pose_a: &Pose,
        shape_b: &'a Shape,
        bounds_b: &'a Aabb,
        pose_b: &'a Pose,
    ) -> Self {
        let probe = SdfProbe { shape_b, bounds_b, a_in_b: pose_b.inv_mul(pose_a), pose_b };
        Self { features, shape, probe }
    }

    /// Appends points on corners, edges, flat faces and rims, with the moving lowest point of each rim, whose gap
    /// is below `margin` (m).
    pub(in super::super) fn fixed(&self, margin: f64, out: &mut Vec<ManifoldPoint>) {
        let fixed = self.features.corners.iter().map(|p| (p, SAMPLE_AREA)).zip(0..);
        let spots = self.features.flat_samples.iter().map(|spot| (&spot.p, spot.area)).zip(FLAT_FEATURES..);
        for ((p_a, area), feature) in fixed.chain(spots) {
            if self.probe.is_beyond(p_a, margin) {
                continue;
            }
            let point = self.probe.contact(p_a, area, feature);
            if point.gap < margin {
                out.push(point);
            }
        }
        for (index, rim) in self.features.rims.iter().enumerate() {
            rim_points(&self.probe, rim, RIM_FEATURES + 64 * index as u32, margin, out);
        }
    }
}

/// Appends the points of a nearly flat rim and its moving lowest point.
fn rim_points(probe: &SdfProbe, rim: &Rim, feature: u32, margin: f64, out: &mut Vec<ManifoldPoint>) {
    let at = |angle: f64| {
        let (sin, cos) = angle.sin_cos();
        (rim.frame_o * nalgebra::Point3::new(rim.radius * cos, rim.radius * sin, 0.0)).coords
    };
    if probe.is_beyond(&rim.frame_o.translation.vector, margin + rim.radius) {
        return;
    }
    let step = TAU / f64::from(RIM_POINTS);
    let gaps: Vec<f64> = (0..RIM_POINTS).map(|k| probe.gap(&at(step * f64::from(k)))).collect();
    let (mut least, mut most) = (0, 0);
    for k in 0..gaps.len() {
        least = if gaps[k] < gaps[least] { k } else { least };
        most = if gaps[k] > gaps[most] { k } else { most };
    }
    if gaps[least] > margin + rim.radius * step {
        return;
    }
    let tilt = (gaps[most] - gaps[least]) / (2.0 * rim.radius);
    let flat = ((FLAT_RIM_TILT[1] - tilt) / (FLAT_RIM_TILT[1] - FLAT_RIM_TILT[0])).clamp(0.0, 1.0);
    for k in 0..RIM_POINTS {
        if flat > 0.0 && gaps[k as usize] < margin {
            out.push(probe.contact(&at(step * f64::from(k)), SAMPLE_AREA * flat, feature + k));
        }
    }
    let angle = golden_minimum(|angle| probe.gap(&at(angle)), step * (least as f64 - 1.0), 2.0 * step);
    let point = probe.contact(
        &at(angle),
        POINT_AREA * (tilt / MIN_RIM_TILT).min(1.0),
        NON_MATERIAL | (feature + RIM_POINTS),
    );
    if point.gap < margin && point.area > 0.0 {
        out.push(point);
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::{
        super::{Primitive, primitives, tests::is_non_material},
        *,
    };
    use softvt_geometry::{Quat, Vec3};

    fn touch(a: &Shape, pose_a: &Pose, b: &Shape, pose_b: &Pose, margin: f64) -> Vec<ManifoldPoint> {
        let mut out = Vec::new();
        let (features, bounds) = (SurfaceFeatures::of(a), b.bounds());
        let surface = SurfaceInSdf::new(&features, a, pose_a, b, &bounds, pose_b);
        surface.fixed(margin, &mut out);
        surface.lowest(margin, &mut out);
        out
    }

    fn floor() -> (Shape, Pose) {
        (Shape::cuboid(Vec3::new(1.0, 1.0, 0.04)), Pose::translation(0.0, 0.0, -0.02))
    }

    /// A bowl of 2 mm wall: foot ring of 25 mm, rim of 50 mm, 40 mm high; corners of the profile
    /// from the axis outwards.
    fn bowl() -> Shape {
        let corners = vec![
            [0.0, 0.003],
            [0.022, 0.003],
            [0.022, 0.0],
            [0.025, 0.0],
            [0.025, 0.003],
            [0.05, 0.04],
            [0.047, 0.04],
            [0.022, 0.006],
            [0.0, 0.006],
        ];
        Shape::lathe(corners).expect("a bowl")
    }

    #[test]
    fn the_lowest_point_of_a_smooth_body_is_found_to_a_micron() {
        let (ground, ground_w) = floor();
        let egg = Shape::Ellipsoid { radii: Vec3::new(0.02, 0.025, 0.035) };
        let ball = Shape::Sphere { radius: 0.03 };
        for (shape, radii) in [(ball, Vec3::repeat(0.03)), (egg, Vec3::new(0.02, 0.025, 0.035))] {
            for k in 0..20 {
                let turn = Quat::from_scaled_axis(Vec3::new(0.4, 0.3, -0.2) * f64::from(k));
                // Support of an ellipsoid: its point R² d / |R d| for a direction d.
                let d = turn.inverse() * -Vec3::z();
                let lowest = radii.component_mul(&radii).component_mul(&d) / radii.component_mul(&d).norm();
                let height = -(turn * lowest).z - 5e-5;
                let pose = Pose::from_parts(nalgebra::Translation3::new(0.1, 0.2, height), turn);
                let points = touch(&shape, &pose, &ground, &ground_w, 0.001);
                let point = points.iter().min_by(|p, q| p.gap.total_cmp(&q.gap)).expect("a lowest point");
                assert!((point.gap + 5e-5).abs() < 1e-9, "{shape:?}, turn {k}: gap {}", point.gap);
                let aside = (point.position_w - (turn * lowest + pose.translation.vector)).xy().norm();
                assert!(aside < 1e-6 && is_non_material(point), "{shape:?}, turn {k}: {aside} m aside");
                assert!(
                    (point.normal_w + Vec3::z()).norm() < 1e-12 && (point.area - POINT_AREA).abs() < 1e-12
                );
                assert_eq!(points.len(), 1, "{points:?}");
            }
        }
    }

    #[test]
    fn a_bowl_stands_on_its_foot_ring_and_tips_onto_its_exact_rims() {
        let ((ground, ground_w), bowl) = (floor(), bowl());
        let standing = touch(&bowl, &Pose::translation(0.0, 0.0, -1e-5), &ground, &ground_w, 0.001);
        let rims = [0.022, 0.025];
        assert_eq!(
            standing.len(),
            2 * RIM_POINTS as usize,
            "only the foot's two edges, no seeds under its hollow"
        );
        for p in &standing {
            assert!(
                (p.gap + 1e-5).abs() < 1e-12
                    && rims.iter().any(|r| (p.position_w.xy().norm() - r).abs() < 1e-9)
            );
        }
        for heading in [0.0f64, 0.13, 1.7] {
            let tilt = 0.5f64;
            let turn = Quat::from_scaled_axis(Vec3::new(-heading.sin(), heading.cos(), 0.0) * tilt);
            let points =
                touch(&bowl, &Pose::from_parts(Vec3::zeros().into(), turn), &ground, &ground_w, 0.02);
            let least = points.iter().map(|p| p.gap).fold(f64::INFINITY, f64::min);
            assert!((least + 0.025 * tilt.sin()).abs() < 1e-9, "{least}");
        }
    }

    #[test]
    fn a_lathe_can_on_its_side_rolls_on_the_moving_points_of_both_rims() {
        let ((ground, ground_w), profile) =
            (floor(), vec![[0.0, -0.05], [0.033, -0.05], [0.033, 0.05], [0.0, 0.05]]);
        let can = Shape::lathe(profile).expect("a can");
        for roll in [0.0, 0.05, 0.11] {
            let turn =
                Quat::from_scaled_axis(Vec3::y() * FRAC_PI_2) * Quat::from_scaled_axis(Vec3::z() * roll);
            let pose = Pose::from_parts(nalgebra::Translation3::new(0.0, 0.0, 0.033 - 1e-5), turn);
            let points = touch(&can, &pose, &ground, &ground_w, 5e-6);
            for end in [-0.05, 0.05] {
                let at_end = points.iter().filter(|p| (p.position_w.x - end).abs() < 1e-6);
                let carried: Vec<_> = at_end.filter(|p| (p.gap + 1e-5).abs() < 1e-9).collect();
                assert!(
                    carried.iter().any(|p| p.position_w.y.abs() < 1e-6 && is_non_material(p)),
                    "roll {roll}: {points:?}"
                );
            }
            // Nothing but that line: what carries elsewhere on it is true contact too.
            assert!(
                points.iter().all(|p| p.position_w.y.abs() < 1e-4 && p.gap >= -1e-5 - 1e-9),
                "{points:?}"
            );
        }
    }

    #[test]
    fn a_cone_on_its_side_lies_on_its_tip_and_the_lowest_point_of_its_rim() {
        let (ground, ground_w) = floor();
        for radius in [0.002, 0.01, 0.03] {
            let profile = [[0.0, -0.01], [radius, 0.01], [0.0, 0.01]];
            // The tip below, or above.
            let upside_down = profile.map(|[r, z]| [r, -z]).into_iter().rev().collect();
            for (profile, tip_z) in [(profile.to_vec(), -0.01), (upside_down, 0.01)] {
                let cone = Shape::lathe(profile).expect("a cone");
                let half_angle = f64::atan2(radius, 0.02);
                let turn = Quat::from_scaled_axis(Vec3::y() * (FRAC_PI_2 + half_angle * f64::signum(tip_z)));
                let tip = turn * Vec3::z() * tip_z;
                let pose = Pose::from_parts(nalgebra::Translation3::new(0.0, 0.0, -tip.z - 1e-5), turn);
                let points = touch(&cone, &pose, &ground, &ground_w, 5e-6);
                let side = 0.02_f64.hypot(radius);
                for distance in [0.0, side] {
                    let is_there = |p: &&ManifoldPoint| {
                        let from_tip = p.position_w.xy() - tip.xy();
                        (from_tip.norm() - distance).abs() < 1e-5 && (p.gap + 1e-5).abs() < 1e-7
                    };
                    let area: f64 = points.iter().filter(is_there).map(|p| p.area).sum();
                    assert!(area >= SAMPLE_AREA, "radius {radius}, tip at {tip_z}: {points:?}");
                }
            }
        }
    }

    #[test]
    fn flat_ends_and_pits_of_a_lathe_have_no_tips() {
        let can = vec![[0.0, -0.05], [0.033, -0.05], [0.033, 0.05], [0.0, 0.05]];
        let with_pits = vec![[0.0, -0.03], [0.033, -0.05], [0.033, 0.05], [0.0, 0.03]];
        let with_tips = vec![[0.0, -0.07], [0.033, -0.05], [0.033, 0.05], [0.0, 0.07]];
        for (profile, tips) in [(can, 0), (with_pits, 0), (with_tips, 2)] {
            let features = SurfaceFeatures::of(&Shape::lathe(profile).expect("a lathe"));
            assert_eq!((features.corners.len(), features.rims.len()), (tips, 2), "{features:?}");
        }
    }

    #[test]
    fn sharp_edges_of_a_general_solid_are_found_where_they_are() {
        // A block with a rectangular notch: 60 × 40 × 30 mm less 20 × 40+ × 10 mm from the top.
        let notch = Shape::cuboid(Vec3::new(0.02, 0.1, 0.02)).translated(Vec3::new(0.0, 0.0, 0.015));
        let block = Shape::cuboid(Vec3::new(0.06, 0.04, 0.03)).subtract(notch);
        let turned = block.rotated(Quat::from_scaled_axis(Vec3::new(0.2, 0.3, 0.1)));
        let Shape::Placed { shape, pose } = &turned else { panic!("a placed shape") };
        let samples = SurfaceFeatures::of(&turned).corners;
        let own: Vec<Vec3> =
            samples.iter().map(|p| pose.inverse_transform_point(&(*p).into()).coords).collect();
        let (distance_to_faces, step) = (
            |p: &Vec3| {
                let mut off = [
                    (p.x.abs() - 0.03).abs(),
                    (p.y.abs() - 0.02).abs(),
                    (p.z.abs() - 0.015).abs(),
                    // The notch's walls and floor.
                    (p.x.abs() - 0.01).abs(),
                    (p.z - 0.005).abs(),
                ];
                off.sort_by(f64::total_cmp);
                off[1]
            },
            0.06 / 24.0,
        );
        for p in &own {
            assert!(shape.distance_and_normal(p).0.abs() < 1e-9, "{p} is off the surface");
            assert!(distance_to_faces(p) < 1e-5, "{p} lies on no edge");
        }
        // Along the sharp upper edges next to the notch, no gap wider than two cells.
        for k in 0..=20 {
            let y = -0.018 + 0.036 * f64::from(k) / 20.0;
            for x in [-0.03, -0.01, 0.01, 0.03] {
                let edge = Vec3::new(x, y, 0.015);
                let near = own.iter().map(|p| (p - edge).norm()).fold(f64::INFINITY, f64::min);
                assert!(near < step, "nothing within {near} m of {edge}");
            }
        }
        let inner =
            own.iter().filter(|p| (p.z - 0.005).abs() < 1e-4 && p.x.abs() < 0.0101 && p.y.abs() < 0.019);
        assert_eq!(inner.count(), 0, "samples in the notch's inner corners, which nothing can touch first");
    }

    #[test]
    fn a_cube_in_a_bowl_is_stopped_by_the_inner_wall() {
        // Its lower corners reach the sloping wall: (0.022, 0.006) to (0.047, 0.04) in (r, z).
        let (bowl, cube) = (bowl(), Shape::cuboid(Vec3::repeat(0.036)));
        let corner_r = 0.018 * 2f64.sqrt();
        let wall_z = 0.006 + (corner_r - 0.022) * (0.034 / 0.025);
        let pose = Pose::translation(0.0, 0.0, wall_z + 0.018 - 1e-5);
        let points = touch(&cube, &pose, &bowl, &Pose::identity(), 0.0005);
        assert_eq!(points.len(), 4, "{points:?}");
        let slope = 0.025 / f64::hypot(0.034, 0.025);
        for p in &points {
            assert!(
                (p.gap + 1e-5 * slope).abs() < 1e-9 && (p.position_w.xy().norm() - corner_r).abs() < 1e-5
            );
            assert!((p.normal_w.z + slope).abs() < 1e-9, "from the cube into the wall: {}", p.normal_w);
        }
    }

    #[test]
    fn shapes_made_of_primitives_fall_into_pieces_and_others_do_not() {
        let wall = Shape::cuboid(Vec3::new(0.2, 0.01, 0.1)).translated(Vec3::new(0.0, 0.1, 0.05));
        let tray = Shape::cuboid(Vec3::new(0.2, 0.2, 0.01))
            .union(wall)
            .painted(2, None)
            .rotated(Quat::from_scaled_axis(Vec3::z()));
        let parts = primitives(&tray).expect("two boxes");
        assert_eq!(parts.len(), 2);
        let centre = Quat::from_scaled_axis(Vec3::z()) * Vec3::new(0.0, 0.1, 0.05);
        assert!((parts[1].pose.translation.vector - centre).norm() < 1e-15);
        assert_eq!(parts[1].shape, Primitive::Box { half: Vec3::new(0.1, 0.005, 0.05) });
        assert_eq!(primitives(&bowl()), None);
    }
}
