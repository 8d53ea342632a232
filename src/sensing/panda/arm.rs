//! Base and arm. Every shape stands in its link's frame (modified Denavit–Hartenberg, as [`crate::robot::panda`]); radii,
//! centres and lengths follow the capsules of Franka's public self-collision model (`franka_description`, Apache-2.0),
//! the seams between links its drawings (Panda datasheet: 333, 316, 82.5, 384, 88 and 107 mm between the axes).

use super::{
    DARK, GREY, METAL, Part, SHELL,
    solid::{blended, block, case, drum, flat_below, limb, ring},
};
use crate::{geometry::Pose, sensing::camera::RenderSolid};

/// Edge of the cells of the shells, m.
const CELL: f64 = 8.5e-3;
/// The same for the more winding ones from the forearm on, m.
const FINE: f64 = 7.5e-3;
/// Radius of the tubes, m.
const TUBE: f64 = 0.057;
/// Rounding of the shells' ends, which collars cover, m.
const RIM: f64 = 6e-3;
/// Radius of the dark necks that show in the seams, m.
const NECK: f64 = 0.0535;
/// Radius of the drums that turn about a cross axis, m.
const DRUM: f64 = 0.0625;

/// The base: a foot that runs out backwards to the connector box, and the column under the first joint.
pub(super) fn base() -> Part {
    let column = drum([0.0, 0.0, 0.01], [0.0, 0.0, 0.133], 0.0585, RIM);
    let heel = limb([-0.082, 0.0, 0.034], [-0.02, 0.0, 0.062], 0.050);
    let foot = block([-0.034, 0.0, 0.010], [0.100, 0.086, 0.014], 10e-3);
    let toe = |side: f64| drum([0.040, side * 0.062, -0.01], [0.040, side * 0.062, 0.026], 0.032, 8e-3);
    let body = blended(vec![column, heel, foot, toe(-1.0), toe(1.0)], 0.036);
    let plugs = Pose::translation(-0.122, 0.0, 0.038);
    Part {
        link: None,
        name: "base",
        solids: vec![
            RenderSolid::new(flat_below(body), FINE, SHELL),
            case(&plugs, [0.024, 0.046, 0.036], 4e-3, 4e-3, DARK),
            collar([0.0, 0.0, 0.122], [0.0, 0.0, 0.139], 0.0585),
            ring([0.0, 0.0, 0.120], [0.0, 0.0, 0.160], NECK, 2e-3, GREY),
        ],
    }
}

/// The clean rim of a shell at a seam, from inside of the shell to the seam.
fn collar(from: [f64; 3], to: [f64; 3], radius: f64) -> RenderSolid {
    ring(from, to, radius + 1e-3, 2.5e-3, SHELL)
}

/// Links 1 to 7.
pub(super) fn links() -> Vec<Part> {
    vec![shoulder(), upper_arm(), elbow_above(), elbow_below(), forearm(), wrist(), flange()]
}

fn part(link: usize, name: &'static str, solids: Vec<RenderSolid>) -> Part {
    Part { link: Some(link), name, solids }
}

/// Link 1: the column that bulges into the shoulder's drum.
fn shoulder() -> Part {
    let column = drum([0.0, 0.0, -0.185], [0.0, 0.0, -0.03], TUBE, RIM);
    let bulge = drum([0.0, -0.063, 0.0], [0.0, 0.063, 0.0], DRUM - 1.5e-3, 20e-3);
    let cap = |side: f64| ring([0.0, side * 0.050, 0.0], [0.0, side * 0.0715, 0.0], 0.0385, 3e-3, GREY);
    let shell = blended(vec![column, bulge], 0.032);
    let rim = collar([0.0, 0.0, -0.175], [0.0, 0.0, -0.191], TUBE);
    part(0, "shoulder", vec![RenderSolid::new(shell, CELL, SHELL), rim, cap(-1.0), cap(1.0)])
}

/// Link 2: the upper arm, along −y of its frame.
fn upper_arm() -> Part {
    let tube = drum([0.0, -0.03, 0.0], [0.0, -0.185, 0.0], TUBE, RIM);
    let core = drum([0.0, 0.0, -0.045], [0.0, 0.0, 0.045], DRUM + 2.5e-3, 5e-3);
    let shell = blended(vec![tube, core], 0.032);
    let rim = collar([0.0, -0.175, 0.0], [0.0, -0.191, 0.0], TUBE);
    let seam = ring([0.0, -0.175, 0.0], [0.0, -0.212, 0.0], NECK, 2e-3, GREY);
    part(1, "upper arm", vec![RenderSolid::new(shell, CELL, SHELL), rim, seam])
}

/// Link 3: from the upper arm out to the elbow's axis at x = 82.5 mm.
fn elbow_above() -> Part {
    let tube = drum([0.0, 0.0, -0.1155], [0.0, 0.0, -0.01], TUBE, RIM);
    let crown = limb([0.0, 0.0, -0.012], [0.05, 0.0, 0.0], 0.054);
    let bulge = drum([0.0825, -0.060, 0.0], [0.0825, 0.060, 0.0], 0.058, 16e-3);
    let shell = blended(vec![tube, crown, bulge], 0.03);
    let cap = |side: f64| ring([0.0825, side * 0.04, 0.0], [0.0825, side * 0.0690, 0.0], 0.0460, 5e-3, DARK);
    let rim = collar([0.0, 0.0, -0.105], [0.0, 0.0, -0.1215], TUBE);
    part(2, "elbow", vec![RenderSolid::new(shell, CELL, SHELL), rim, cap(-1.0), cap(1.0)])
}

/// Link 4: from the elbow's axis back to the forearm's at x = −82.5 mm.
fn elbow_below() -> Part {
    let core = drum([0.0, 0.0, -0.040], [0.0, 0.0, 0.040], 0.0595, 6e-3);
    let crown = limb([-0.05, 0.0, 0.0], [-0.0825, 0.015, 0.0], 0.054);
    let tube = drum([-0.0825, 0.01, 0.0], [-0.0825, 0.1135, 0.0], TUBE, RIM);
    let shell = blended(vec![core, crown, tube], 0.035);
    let seam = ring([-0.0825, 0.105, 0.0], [-0.0825, 0.142, 0.0], NECK, 2e-3, DARK);
    let rim = collar([-0.0825, 0.103, 0.0], [-0.0825, 0.1195, 0.0], TUBE);
    part(3, "elbow, lower half", vec![RenderSolid::new(shell, CELL, SHELL), rim, seam])
}

/// Link 5: the slanted forearm, which leaves its axis for y = 80 mm and holds the wrist from there.
fn forearm() -> Part {
    let tube = drum([0.0, 0.0, -0.2555], [0.0, 0.0, -0.212], TUBE, RIM);
    let dome = limb([0.0, 0.0, -0.232], [0.0, 0.008, -0.204], 0.0510);
    let slant = limb([0.0, 0.012, -0.19], [0.0, 0.066, -0.055], 0.042);
    let back = limb([0.0, 0.055, -0.16], [0.0, 0.088, -0.02], 0.027);
    let hub = drum([0.0, 0.058, 0.0], [0.0, 0.112, 0.0], 0.051, 14e-3);
    let shell = blended(vec![tube, dome, slant, back, hub], 0.040);
    let cap = ring([0.0, 0.095, 0.0], [0.0, 0.1175, 0.0], 0.036, 4e-3, DARK);
    let rim = collar([0.0, 0.0, -0.245], [0.0, 0.0, -0.2615], TUBE);
    part(4, "forearm", vec![RenderSolid::new(shell, FINE, SHELL), rim, cap])
}

/// Link 6: the wrist, from the drum about its axis to the housing of the last joint at x = 88 mm.
fn wrist() -> Part {
    let core = drum([0.0, 0.0, -0.0575], [0.0, 0.0, 0.048], 0.050, 10e-3);
    let bridge = limb([0.02, 0.0, 0.002], [0.088, 0.0, 0.0], 0.040);
    let housing = drum([0.088, 0.056, 0.0], [0.088, -0.0455, 0.0], 0.0465, 7.5e-3);
    let shell = blended(vec![core, bridge, housing], 0.026);
    let cap = ring([0.0, 0.0, 0.036], [0.0, 0.0, 0.0535], 0.036, 4e-3, DARK);
    let pilot = ring([0.088, 0.040, 0.0], [0.088, 0.0620, 0.0], 0.033, 3e-3, DARK);
    let seam = ring([0.088, -0.038, 0.0], [0.088, -0.068, 0.0], 0.0420, 2e-3, GREY);
    let rim = collar([0.088, -0.034, 0.0], [0.088, -0.0512, 0.0], 0.0478);
    part(5, "wrist", vec![RenderSolid::new(shell, FINE, SHELL), rim, cap, pilot, seam])
}

/// Link 7: the last body with its grip lobe, and the flange.
fn flange() -> Part {
    let body = ring([0.0, 0.0, 0.0530], [0.0, 0.0, 0.0975], 0.0465, 6e-3, SHELL);
    let lobe = limb([0.020, 0.0, 0.076], [0.060, 0.0, 0.076], 0.0200);
    let face = ring([0.0, 0.0, 0.080], [0.0, 0.0, 0.107], 0.0315, 1e-3, METAL);
    let button = ring([0.066, 0.0, 0.076], [0.0820, 0.0, 0.076], 0.011, 3e-3, DARK);
    part(6, "flange", vec![body, RenderSolid::new(lobe, 6e-3, SHELL), face, button])
}
