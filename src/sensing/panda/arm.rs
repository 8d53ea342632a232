//! Base and arm.
//!
//! Shapes are in the frames of their links (modified Denavit–Hartenberg, as [`softvt_robot::panda`]). Radii, centres
//! and lengths follow the capsules of Franka's public self-collision model (`franka_description`, Apache-2.0). The
//! seams between links follow its drawings (Panda datasheet: 333, 316, 82.5, 384, 88 and 107 mm between the axes).

use super::{
    BARE_METAL, BLACK_PLASTIC, GREY_PLASTIC, RobotPart, WHITE_SHELL,
    solid::{blended, box_solid, capsule, cylinder_solid, flat_below, rounded_box, rounded_cylinder},
};
use crate::camera::RenderSolid;
use softvt_geometry::Pose;

/// Edge of the mesher's cells on the shells of the base and upper arm, m.
const CELL: f64 = 8.5e-3;
/// The same for the more curved shells from the forearm on, m.
const FINE: f64 = 7.5e-3;
/// Radius of the tubular parts of the shells, m.
const TUBE: f64 = 0.057;
/// Rounding of the ends of the shells, which collars cover, m.
const RIM: f64 = 6e-3;
/// Radius of the dark necks visible in the seams, m.
const NECK: f64 = 0.0535;
/// Radius of the shoulder housings, whose axes cross the arm, m.
const DRUM: f64 = 0.0625;

/// The base: a foot that extends backwards to the connector box, and the column below the first joint.
pub(super) fn base() -> RobotPart {
    let column = rounded_cylinder([0.0, 0.0, 0.01], [0.0, 0.0, 0.133], 0.0585, RIM);
    let heel = capsule([-0.082, 0.0, 0.034], [-0.02, 0.0, 0.062], 0.050);
    let foot = rounded_box([-0.034, 0.0, 0.010], [0.100, 0.086, 0.014], 10e-3);
    let toe =
        |side: f64| rounded_cylinder([0.040, side * 0.062, -0.01], [0.040, side * 0.062, 0.026], 0.032, 8e-3);
    let body = blended(vec![column, heel, foot, toe(-1.0), toe(1.0)], 0.036);
    let plugs = Pose::translation(-0.122, 0.0, 0.038);
    RobotPart::new(
        None,
        "base",
        vec![
            RenderSolid::new(flat_below(body), FINE, WHITE_SHELL),
            box_solid(&plugs, [0.024, 0.046, 0.036], 4e-3, 4e-3, BLACK_PLASTIC),
            collar([0.0, 0.0, 0.122], [0.0, 0.0, 0.139], 0.0585),
            cylinder_solid([0.0, 0.0, 0.120], [0.0, 0.0, 0.160], NECK, 2e-3, GREY_PLASTIC),
        ],
    )
}

/// The rim of a shell at a seam; `from` is inside the shell, `to` at the seam.
fn collar(from: [f64; 3], to: [f64; 3], radius: f64) -> RenderSolid {
    cylinder_solid(from, to, radius + 1e-3, 2.5e-3, WHITE_SHELL)
}

/// Links 1 to 7.
pub(super) fn links() -> Vec<RobotPart> {
    vec![shoulder(), upper_arm(), elbow_above(), elbow_below(), forearm(), wrist(), flange()]
}

/// Link 1: a column that widens to the shoulder housing.
fn shoulder() -> RobotPart {
    let column = rounded_cylinder([0.0, 0.0, -0.185], [0.0, 0.0, -0.03], TUBE, RIM);
    let bulge = rounded_cylinder([0.0, -0.063, 0.0], [0.0, 0.063, 0.0], DRUM - 1.5e-3, 20e-3);
    let cap = |side: f64| {
        cylinder_solid([0.0, side * 0.050, 0.0], [0.0, side * 0.0715, 0.0], 0.0385, 3e-3, GREY_PLASTIC)
    };
    let shell = blended(vec![column, bulge], 0.032);
    let rim = collar([0.0, 0.0, -0.175], [0.0, 0.0, -0.191], TUBE);
    RobotPart::new(
        Some(0),
        "shoulder",
        vec![RenderSolid::new(shell, CELL, WHITE_SHELL), rim, cap(-1.0), cap(1.0)],
    )
}

/// Link 2: the upper arm, along −y of its frame.
fn upper_arm() -> RobotPart {
    let tube = rounded_cylinder([0.0, -0.03, 0.0], [0.0, -0.185, 0.0], TUBE, RIM);
    let core = rounded_cylinder([0.0, 0.0, -0.045], [0.0, 0.0, 0.045], DRUM + 2.5e-3, 5e-3);
    let shell = blended(vec![tube, core], 0.032);
    let rim = collar([0.0, -0.175, 0.0], [0.0, -0.191, 0.0], TUBE);
    let seam = cylinder_solid([0.0, -0.175, 0.0], [0.0, -0.212, 0.0], NECK, 2e-3, GREY_PLASTIC);
    RobotPart::new(Some(1), "upper arm", vec![RenderSolid::new(shell, CELL, WHITE_SHELL), rim, seam])
}

/// Link 3: from the upper arm to the elbow axis at x = 82.5 mm.
fn elbow_above() -> RobotPart {
    let tube = rounded_cylinder([0.0, 0.0, -0.1155], [0.0, 0.0, -0.01], TUBE, RIM);
    let crown = capsule([0.0, 0.0, -0.012], [0.05, 0.0, 0.0], 0.054);
    let bulge = rounded_cylinder([0.0825, -0.060, 0.0], [0.0825, 0.060, 0.0], 0.058, 16e-3);
    let shell = blended(vec![tube, crown, bulge], 0.03);
    let cap = |side: f64| {
        cylinder_solid([0.0825, side * 0.04, 0.0], [0.0825, side * 0.0690, 0.0], 0.0460, 5e-3, BLACK_PLASTIC)
    };
    let rim = collar([0.0, 0.0, -0.105], [0.0, 0.0, -0.1215], TUBE);
    RobotPart::new(
        Some(2),
        "elbow",
        vec![RenderSolid::new(shell, CELL, WHITE_SHELL), rim, cap(-1.0), cap(1.0)],
    )
}

/// Link 4: from the elbow axis back to the forearm axis at x = −82.5 mm.
fn elbow_below() -> RobotPart {
    let core = rounded_cylinder([0.0, 0.0, -0.040], [0.0, 0.0, 0.040], 0.0595, 6e-3);
    let crown = capsule([-0.05, 0.0, 0.0], [-0.0825, 0.015, 0.0], 0.054);
    let tube = rounded_cylinder([-0.0825, 0.01, 0.0], [-0.0825, 0.1135, 0.0], TUBE, RIM);
    let shell = blended(vec![core, crown, tube], 0.035);
    let seam = cylinder_solid([-0.0825, 0.105, 0.0], [-0.0825, 0.142, 0.0], NECK, 2e-3, BLACK_PLASTIC);
    let rim = collar([-0.0825, 0.103, 0.0], [-0.0825, 0.1195, 0.0], TUBE);
    RobotPart::new(Some(3), "elbow, lower half", vec![RenderSolid::new(shell, CELL, WHITE_SHELL), rim, seam])
}

/// Link 5: the slanted forearm, from its axis to y = 80 mm, where it holds the wrist.
fn forearm() -> RobotPart {
    let tube = rounded_cylinder([0.0, 0.0, -0.2555], [0.0, 0.0, -0.212], TUBE, RIM);
    let dome = capsule([0.0, 0.0, -0.232], [0.0, 0.008, -0.204], 0.0510);
    let slant = capsule([0.0, 0.012, -0.19], [0.0, 0.066, -0.055], 0.042);
    let back = capsule([0.0, 0.055, -0.16], [0.0, 0.088, -0.02], 0.027);
    let hub = rounded_cylinder([0.0, 0.058, 0.0], [0.0, 0.112, 0.0], 0.051, 14e-3);
    let shell = blended(vec![tube, dome, slant, back, hub], 0.040);
    let cap = cylinder_solid([0.0, 0.095, 0.0], [0.0, 0.1175, 0.0], 0.036, 4e-3, BLACK_PLASTIC);
    let rim = collar([0.0, 0.0, -0.245], [0.0, 0.0, -0.2615], TUBE);
    RobotPart::new(Some(4), "forearm", vec![RenderSolid::new(shell, FINE, WHITE_SHELL), rim, cap])
}

/// Link 6: the wrist, from the housing on its axis to the housing of the last joint at x = 88 mm.
fn wrist() -> RobotPart {
    let core = rounded_cylinder([0.0, 0.0, -0.0575], [0.0, 0.0, 0.048], 0.050, 10e-3);
    let bridge = capsule([0.02, 0.0, 0.002], [0.088, 0.0, 0.0], 0.040);
    let housing = rounded_cylinder([0.088, 0.056, 0.0], [0.088, -0.0455, 0.0], 0.0465, 7.5e-3);
    let shell = blended(vec![core, bridge, housing], 0.026);
    let cap = cylinder_solid([0.0, 0.0, 0.036], [0.0, 0.0, 0.0535], 0.036, 4e-3, BLACK_PLASTIC);
    let pilot = cylinder_solid([0.088, 0.040, 0.0], [0.088, 0.0620, 0.0], 0.033, 3e-3, BLACK_PLASTIC);
    let seam = cylinder_solid([0.088, -0.038, 0.0], [0.088, -0.068, 0.0], 0.0420, 2e-3, GREY_PLASTIC);
    let rim = collar([0.088, -0.034, 0.0], [0.088, -0.0512, 0.0], 0.0478);
    RobotPart::new(Some(5), "wrist", vec![RenderSolid::new(shell, FINE, WHITE_SHELL), rim, cap, pilot, seam])
}

/// Link 7: the last body with its guiding grip, and the flange.
fn flange() -> RobotPart {
    let body = cylinder_solid([0.0, 0.0, 0.0530], [0.0, 0.0, 0.0975], 0.0465, 6e-3, WHITE_SHELL);
    let lobe = capsule([0.020, 0.0, 0.076], [0.060, 0.0, 0.076], 0.0200);
    let face = cylinder_solid([0.0, 0.0, 0.080], [0.0, 0.0, 0.107], 0.0315, 1e-3, BARE_METAL);
    let button = cylinder_solid([0.066, 0.0, 0.076], [0.0820, 0.0, 0.076], 0.011, 3e-3, BLACK_PLASTIC);
    RobotPart::new(Some(6), "flange", vec![body, RenderSolid::new(lobe, 6e-3, WHITE_SHELL), face, button])
}
