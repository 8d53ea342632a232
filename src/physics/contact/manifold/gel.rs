//! Contact points of a compliant skin with a hard shape: a bed of springs, one at each sample of the skin, pressed in as
//! deep as the sample lies inside of the shape (a Winkler foundation: Johnson, Contact Mechanics, 1985, 4.3).

use super::ManifoldPoint;
use crate::{
    geometry::{Aabb, Pose, shape::Shape},
    physics::contact::solid::GelSample,
};

/// A sample whose own normal agrees with the shape's by more than this has the shape behind its back.
const BEHIND: f64 = 0.3;

/// Appends the contact points of a skin at `pose_a` with `shape_b`, which lies within `bounds_b`, whose gap is below `margin` (m). A sample at the
/// shape's sharp edge counts with its covered share. The normals point from the skin to the shape.
pub fn gel_vs_shape(
    skin: &[GelSample],
    pose_a: &Pose,
    (shape_b, bounds_b): (&Shape, &Aabb),
    pose_b: &Pose,
    margin: f64,
    out: &mut Vec<ManifoldPoint>,
) {
    let a_in_b = pose_b.inv_mul(pose_a);
    for (index, sample) in skin.iter().enumerate() {
        let p_b = (a_in_b * nalgebra::Point3::from(sample.p)).coords;
        // A sample may lie beyond an edge and still cover it with half of its patch.
        let reach = margin + 0.5 * sample.area.sqrt();
        if !bounds_b.loosened(reach).contains(&p_b) {
            continue;
        }
        let facing = a_in_b.rotation * sample.normal;
        let felt = shape_b.contact(&p_b, &facing, sample.area.sqrt());
        if felt.phi >= margin || felt.coverage <= 0.0 || facing.dot(&felt.normal) > BEHIND {
            continue;
        }
        out.push(ManifoldPoint {
            p_w: (pose_b * nalgebra::Point3::from(p_b - felt.normal * (0.5 * felt.phi))).coords,
            n_w: -(pose_b.rotation * felt.normal),
            phi: felt.phi,
            area: sample.area * felt.coverage,
            feature: index as u32,
        });
    }
}
