//! Finger tips: the domed gel pads of the GelSight Mini as contact surfaces, and the collision boxes of the fingers.
//!
//! **Pad frame** (`_p`): origin at the gel's apex, +z out of the gel (towards the other finger), x along the finger
//! *towards the hand*, y completing a right-handed frame. Consequently y points to the hand's +x on the left finger and
//! to its −x on the right one. The long side of the pad (25.25 mm) lies along x.
//!
//! Gel geometry: footprint 25.25 × 20.75 mm with corner radius 1.5 mm, 4.00 mm thick at the apex, radii of curvature
//! 206 mm (long side) and 121 mm (short side), measured on the manufacturer's pad model as published with FEATS
//! (Helmut et al., Learning Force Distribution Estimation for the GelSight Mini Optical Tactile Sensor Based on
//! Finite Element Analysis, arXiv 2411.03315).

use std::sync::Arc;

use nalgebra::Quaternion;

use super::{spec::Side, tactile::GelSpec};
use softvt_geometry::{Aabb, Mat3, Pose, Quat, Vec3, shape::SampleContact};
use softvt_physics::{
    contact::{Collider, CollisionGeometry, ContactSurface, ElasticLayer, Friction, GelSample},
    ids::BodyId,
};

/// Height of the gel's apex above the finger frame, m; equal to that of Franka's own finger tips.
pub(super) const APEX_Z: f64 = 0.045;

/// Half extents of the sensor's case, finger axes, m: 28 mm across, 24 mm deep, 32 mm along the finger.
pub const CASE_HALF: Vec3 = Vec3::new(0.014, 0.012, 0.016);

/// Geometry of a gel pad: a paraboloid dome z = h(x, y) over a rounded rectangle, in the pad frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PadSurface {
    /// Extent of the footprint along x, m.
    pub length: f64,
    /// Extent of the footprint along y, m.
    pub width: f64,
    /// Corner radius of the footprint, m.
    pub corner: f64,
    /// Thickness of the gel at the apex, m.
    pub thickness: f64,
    /// Radius of curvature along x, m.
    pub radius_x: f64,
    /// Radius of curvature along y, m.
    pub radius_y: f64,
}

impl Default for PadSurface {
    /// The gel of a GelSight Mini.
    fn default() -> Self {
        Self {
            length: 25.25e-3,
            width: 20.75e-3,
            corner: 1.5e-3,
            thickness: 4.0e-3,
            radius_x: 0.206,
            radius_y: 0.121,
        }
    }
}

impl PadSurface {
    /// Height of the dome at (x, y) (m, pad frame) relative to its apex, m; 0 at the apex, negative elsewhere. The
    /// paraboloid differs from a torus of the same radii by less than 3 µm over the pad.
    pub fn height(&self, x: f64, y: f64) -> f64 {
        -0.5 * (x * x / self.radius_x + y * y / self.radius_y)
    }

    /// Signed distance of (x, y) (m, pad frame) to the edge of the footprint, m; negative inside.
    pub fn edge_distance(&self, x: f64, y: f64) -> f64 {
        let beyond_x = x.abs() - self.length / 2.0 + self.corner;
        let beyond_y = y.abs() - self.width / 2.0 + self.corner;
        beyond_x.max(0.0).hypot(beyond_y.max(0.0)) + beyond_x.max(beyond_y).min(0.0) - self.corner
    }

    /// Contact of the point `p_p` (pad frame, m) with the gel, in the pad frame. The point represents a patch
    /// about `spacing` (m) wide.
    ///
    /// The coverage falls from 1 to 0 over one spacing across the edge of the footprint, so that forces stay continuous
    /// as a pad moves. It is 0 below the gel's base, where a point belongs to the sensor's case.
    pub fn contact(&self, p_p: &Vec3, spacing: f64) -> SampleContact {
        let gradient = Vec3::new(p_p.x / self.radius_x, p_p.y / self.radius_y, 1.0);
        let steepness = gradient.norm();
        let coverage = if p_p.z < -self.thickness {
            0.0
        } else {
            (0.5 - self.edge_distance(p_p.x, p_p.y) / spacing).clamp(0.0, 1.0)
        };
        SampleContact {
            gap: (p_p.z - self.height(p_p.x, p_p.y)) / steepness,
            normal: gradient / steepness,
            coverage,
        }
    }

    /// Samples of the dome: centres and normals (pad frame) of square patches about `spacing` (m) wide, with the area
    /// of each patch (m²) that lies over the footprint.
    pub fn samples(&self, spacing: f64) -> Vec<GelSample> {
        let count = |extent: f64| (extent / spacing).ceil().max(1.0) as usize;
        let (nx, ny) = (count(self.length), count(self.width));
        let (dx, dy) = (self.length / nx as f64, self.width / ny as f64);
        let at = |i: usize, n: usize, d: f64| (i as f64 + 0.5 - 0.5 * n as f64) * d;
        let cells = (0..nx * ny).map(|cell| (at(cell % nx, nx, dx), at(cell / nx, ny, dy)));
        cells
            .map(|(x, y)| {
                let p_p = Vec3::new(x, y, self.height(x, y));
                let contact = self.contact(&p_p, dx.max(dy));
                GelSample { p: p_p, normal: contact.normal, area: dx * dy * contact.coverage }
            })
            .filter(|sample| sample.area > 0.0)
            .collect()
    }
}

impl PadSurface {
    /// A collider of this pad on a body, at the pad's pose in its frame.
    pub fn collider(
        self,
        name: &str,
        parent: BodyId,
        pose_in_parent: Pose,
        friction: Friction,
        layer: &Arc<ElasticLayer>,
    ) -> Collider {
        Collider::new(name, parent, pose_in_parent, Arc::new(self), friction, layer.untouched())
            .with_layer(layer.clone())
    }

    /// The gel of this pad as an elastic layer.
    pub fn layer(&self, gel: &GelSpec) -> Arc<ElasticLayer> {
        Arc::new(ElasticLayer::new(&gel.layer(self), self.length, self.width))
    }
}

/// Spacing of the gel samples that meet hard shapes, m; equal to the spacing on grasped surfaces of soft bodies.
const GEL_SPACING: f64 = 0.75e-3;

impl ContactSurface for PadSurface {
    fn contact(&self, p: &Vec3, _facing: &Vec3, spacing: f64) -> SampleContact {
        Self::contact(self, p, spacing)
    }

    fn bounds(&self) -> Aabb {
        let half = Vec3::new(self.length, self.width, 0.0) * 0.5;
        Aabb { min: Vec3::new(-half.x, -half.y, -self.thickness), max: half }
    }

    fn collision_geometry(&self) -> Option<CollisionGeometry> {
        Some(CollisionGeometry::Gel(self.samples(GEL_SPACING)))
    }
}

/// Pad frame in the link frame of its finger.
pub fn pad_pose_in_finger(side: Side) -> Pose {
    let turn = match side {
        Side::Left => Quaternion::new(0.5, 0.5, 0.5, -0.5),
        Side::Right => Quaternion::new(0.5, -0.5, 0.5, 0.5),
    };
    Pose::from_parts(Vec3::new(0.0, 0.0, APEX_Z).into(), Quat::new_unchecked(turn))
}

/// Box that represents part of a link in collisions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CollisionBox {
    /// Half extents, m.
    pub half: Vec3,
    /// Frame of the centre in the link frame.
    pub pose: Pose,
}

/// Collision boxes of a finger besides its gel, in its link frame: the case of the sensor, and the
/// bracket that carries it.
pub fn finger_boxes(side: Side) -> [CollisionBox; 2] {
    let out = outward(side);
    let depth = PadSurface::default().thickness + CASE_HALF.y;
    let bracket_z = (APEX_Z - CASE_HALF.z) / 2.0;
    let at = |half, z| CollisionBox { half, pose: Pose::translation(0.0, out * depth, z) };
    [at(CASE_HALF, APEX_Z), at(Vec3::new(0.0105, 0.010, bracket_z), bracket_z)]
}

/// Half extents of the bounding box of a gel, finger axes, m.
pub(super) fn gel_half() -> Vec3 {
    let pad = PadSurface::default();
    Vec3::new(pad.width, pad.thickness, pad.length) / 2.0
}

/// Centre of the bounding box of a gel, in the link frame of the finger.
pub(super) fn gel_centre_in_finger(side: Side) -> Pose {
    Pose::translation(0.0, outward(side) * gel_half().y, APEX_Z)
}

/// Centre of mass (finger frame, m) and inertia about it (kg m²) of a finger with mass `mass` (kg), modelled as a
/// uniform box of the size of the sensor's case, which is nearly all of the mass.
pub(super) fn finger_mass(side: Side, mass: f64) -> (Vec3, Mat3) {
    let case = finger_boxes(side)[0];
    let square = case.half.component_mul(&case.half);
    let moments = Vec3::new(square.y + square.z, square.x + square.z, square.x + square.y) * (mass / 3.0);
    (case.pose.translation.vector, Mat3::from_diagonal(&moments))
}

/// Direction along the hand's y axis in which a finger opens, ±1.
pub(super) fn outward(side: Side) -> f64 {
    match side {
        Side::Left => 1.0,
        Side::Right => -1.0,
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn the_dome_has_the_measured_thicknesses() {
        let pad = PadSurface::default();
        for (x, y, thickness_mm) in
            [(0.0, 0.0, 4.0), (5.0, 0.0, 3.94), (10.0, 0.0, 3.75), (0.0, 5.0, 3.90), (0.0, 8.0, 3.73)]
        {
            let found = 1e3 * (pad.thickness + pad.height(x * 1e-3, y * 1e-3));
            assert!((found - thickness_mm).abs() < 0.01, "({x}, {y}) mm: {found} mm");
        }
    }

    #[test]
    fn pad_frames_face_each_other_with_x_towards_the_hand() {
        for (side, out) in [(Side::Left, 1.0), (Side::Right, -1.0)] {
            let pad = pad_pose_in_finger(side);
            let turned = |axis: Vec3| pad.rotation * axis;
            assert!((turned(Vec3::z()) - Vec3::new(0.0, -out, 0.0)).norm() < 1e-15);
            assert!((turned(Vec3::x()) - Vec3::new(0.0, 0.0, -1.0)).norm() < 1e-15);
            assert!((turned(Vec3::y()) - Vec3::new(out, 0.0, 0.0)).norm() < 1e-15);
        }
    }

    #[test]
    fn no_collision_box_of_a_finger_reaches_in_front_of_its_gel() {
        for side in Side::BOTH {
            let to_pad = pad_pose_in_finger(side).inverse();
            for part in finger_boxes(side) {
                let centre = to_pad * part.pose;
                let reach = centre.rotation.to_rotation_matrix().matrix().abs() * part.half;
                let front = centre.translation.vector.z + reach.z;
                assert!(front <= -PadSurface::default().thickness + 1e-15, "{side:?}: {front}");
            }
        }
    }

    /// Distance to the dome by Gauss–Newton iteration on the closest point.
    fn distance(pad: &PadSurface, p_p: &Vec3) -> f64 {
        let (mut x, mut y) = (p_p.x, p_p.y);
        for _ in 0..50 {
            let (slope_x, slope_y) = (-x / pad.radius_x, -y / pad.radius_y);
            let gap = pad.height(x, y) - p_p.z;
            x -= ((x - p_p.x) + gap * slope_x) / (1.0 + slope_x * slope_x - gap / pad.radius_x);
            y -= ((y - p_p.y) + gap * slope_y) / (1.0 + slope_y * slope_y - gap / pad.radius_y);
        }
        let foot = Vec3::new(x, y, pad.height(x, y));
        (p_p - foot).norm() * (p_p.z - foot.z).signum()
    }

    proptest! {
        #[test]
        fn gap_is_the_distance_to_the_dome(x in -12.6e-3..12.6e-3_f64, y in -10.3e-3..10.3e-3_f64, z in -3.0e-3..5.0e-3_f64) {
            let pad = PadSurface::default();
            let p_p = Vec3::new(x, y, z + pad.height(x, y));
            let found = pad.contact(&p_p, 0.75e-3).gap;
            let expected = distance(&pad, &p_p);
            prop_assert!((found - expected).abs() <= 5e-4 * expected.abs() + 1e-12, "{found} {expected}");
        }

        #[test]
        fn coverage_falls_smoothly_across_the_edge(angle in 0.0..std::f64::consts::TAU, step in 1e-6..1e-4_f64) {
            let (pad, spacing) = (PadSurface::default(), 0.75e-3);
            let at = |reach: f64| pad.contact(&Vec3::new(reach * angle.cos(), reach * angle.sin(), 0.0), spacing).coverage;
            let mut reach = 0.0;
            while reach < 0.02 {
                let (near, far) = (at(reach), at(reach + step));
                prop_assert!(far <= near && near - far <= step / spacing + 1e-12);
                reach += step.max(1e-5);
            }
            prop_assert_eq!((at(0.0), at(0.02)), (1.0, 0.0));
        }
    }

    #[test]
    fn the_covered_area_equals_the_footprint_at_any_sampling() {
        let pad = PadSurface::default();
        let footprint = pad.length * pad.width - (4.0 - std::f64::consts::PI) * pad.corner.powi(2);
        for (spacing, offset) in [(0.75e-3, 0.0), (0.75e-3, 0.31e-3), (0.5e-3, 0.13e-3)] {
            let count = (0.04_f64 / spacing) as i32;
            let at = |i: i32| f64::from(i) * spacing + offset;
            let area: f64 = (-count..count)
                .flat_map(|i| (-count..count).map(move |j| (i, j)))
                .map(|(i, j)| pad.contact(&Vec3::new(at(i), at(j), 0.0), spacing).coverage)
                .sum::<f64>()
                * spacing
                * spacing;
            assert!((area / footprint - 1.0).abs() < 2e-3, "{area} {footprint}");
        }
    }

    #[test]
    fn samples_cover_the_footprint_and_lie_on_the_dome() {
        let pad = PadSurface::default();
        let footprint = pad.length * pad.width - (4.0 - std::f64::consts::PI) * pad.corner.powi(2);
        let samples = pad.samples(0.75e-3);
        let area: f64 = samples.iter().map(|sample| sample.area).sum();
        assert!((area / footprint - 1.0).abs() < 2e-3, "{area} {footprint}");
        let mean = samples.iter().map(|sample| sample.p * sample.area).sum::<Vec3>() / area;
        assert!(mean.xy().norm() < 1e-12, "{mean}");
        for GelSample { p, normal, .. } in samples {
            let contact = pad.contact(&p, 1e-3);
            assert!(contact.gap.abs() < 1e-15 && (contact.normal - normal).norm() < 1e-15);
        }
    }

    #[test]
    fn a_point_below_the_base_of_the_gel_is_not_covered() {
        let pad = PadSurface::default();
        assert_eq!(pad.contact(&Vec3::new(0.0, 0.0, -0.03), 1e-3).coverage, 0.0);
        assert_eq!(pad.contact(&Vec3::new(0.0, 0.0, -0.001), 1e-3).coverage, 1.0);
    }

    #[test]
    fn normals_tilt_outwards_from_the_apex() {
        let contact = PadSurface::default().contact(&Vec3::new(0.01, 0.0, 0.0), 1e-3);
        assert!((contact.normal.x - 0.01 / 0.206 / (1.0 + (0.01_f64 / 0.206).powi(2)).sqrt()).abs() < 1e-15);
        assert_eq!(contact.normal.y, 0.0);
        assert!((contact.normal.norm() - 1.0).abs() < 1e-15);
    }
}
