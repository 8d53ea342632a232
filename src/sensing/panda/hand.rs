//! The hand and its two fingers, each with a GelSight Mini.

use super::{
    BARE_METAL, BLACK_PLASTIC, RobotPart, SENSOR_CASE, WHITE_SHELL,
    solid::{box_solid, cylinder_solid, plate_solid},
};
use crate::camera::RenderSolid;
use softvt_geometry::{Pose, Vec3, mesh::Mesh};
use softvt_robot::{
    Side, pads,
    panda::{HAND_LINK, finger_link, hand_in_link},
};

/// The hand's body, 204 × 63 mm in plan and 66 mm high, with shoulders that slope to rounded ends (Franka hand,
/// public product drawing), and the rail in which the fingers run.
pub(super) fn hand() -> RobotPart {
    const EDGE: f64 = 11e-3;
    // Counter-clockwise in (y, z), without the rounding of the edges.
    let outline = [
        [-0.0870, 0.0545],
        [-0.0915, 0.036],
        [-0.084, 0.0235],
        [-0.050, 0.0130],
        [0.050, 0.0130],
        [0.084, 0.0235],
        [0.0915, 0.036],
        [0.0870, 0.0545],
    ];
    let hand = hand_in_link();
    RobotPart::new(
        Some(HAND_LINK),
        "hand",
        vec![
            tapered(plate_solid(&outline, 0.0316, EDGE, WHITE_SHELL)).placed(&hand),
            cylinder_solid([0.0, 0.0, 0.0], [0.0, 0.0, 0.0105], 0.0265, 1e-3, BARE_METAL).placed(&hand),
            box_solid(
                &(hand * Pose::translation(0.0, 0.0, 0.060)),
                [0.0125, 0.088, 0.0082],
                4e-3,
                1e-3,
                BLACK_PLASTIC,
            ),
        ],
    )
}

/// Tapers the hand's body: it is as deep as the flange where it is mounted, and shallower at the fingers.
fn tapered(mut body: RenderSolid) -> RenderSolid {
    /// Heights at which the taper starts and ends, m.
    const START: f64 = 0.026;
    const END: f64 = 0.0655;
    /// Remaining fraction of the depth.
    const TAPER: f64 = 0.76;
    for v in &mut body.mesh.vertices {
        v.x *= 1.0 - (1.0 - TAPER) * ((v.z - START) / (END - START)).clamp(0.0, 1.0);
    }
    body.shape = body.shape.scaled(Vec3::new(TAPER, 1.0, 1.0));
    body
}

/// A finger: the bracket, the sensor's case with its bezel, and the visible part of its plug. Case and bracket are
/// the collision boxes ([`pads::finger_boxes`]) with rounded edges.
pub(super) fn finger(side: Side) -> RobotPart {
    let [body, bracket] = pads::finger_boxes(side);
    let out = body.pose.translation.vector.y.signum();
    let pad = pads::pad_pose_in_finger(side);
    // The bezel protrudes less than the gel, so that it is never in front of the contact.
    let bezel = pad * Pose::translation(0.0, 0.0, -pads::PadSurface::default().thickness);
    let plug = Pose::translation(0.0, out * 0.0285, 0.050);
    // In the pad's frame the case is long along x, wide along y and deep along z.
    let behind = pad * Pose::translation(0.0, 0.0, -body.pose.translation.vector.y.abs());
    let name = match side {
        Side::Left => "left finger",
        Side::Right => "right finger",
    };
    let [x, y, z] = [body.half.x, body.half.y, body.half.z];
    RobotPart::new(
        Some(finger_link(side)),
        name,
        vec![
            box_solid(&behind, [z, x, y], 3e-3, 1.5e-3, SENSOR_CASE),
            box_solid(&bracket.pose, bracket.half.into(), 2e-3, 0.5e-3, BLACK_PLASTIC),
            box_solid(&bezel, [0.0143, 0.0121, 0.0011], 2.4e-3, 0.6e-3, BLACK_PLASTIC),
            box_solid(&plug, [0.0050, 0.0022, 0.0018], 1e-3, 0.5e-3, BARE_METAL),
        ],
    )
}

/// The gel's dome and side walls in the finger's frame, sampled from [`pads::PadSurface`]: the drawn gel is the
/// one that makes contact.
pub(super) fn gel(side: Side) -> Mesh {
    const ALONG: usize = 14;
    const ACROSS: usize = 12;
    let pad = pads::PadSurface::default();
    let to_finger: Pose = pads::pad_pose_in_finger(side);
    let place = |x: f64, y: f64, z: f64| to_finger.transform_point(&Vec3::new(x, y, z).into()).coords;
    let [half_x, half_y] = [0.5 * pad.length, 0.5 * pad.width];
    let mut vertices = Vec::new();
    let mut triangles = Vec::new();
    for j in 0..=ACROSS {
        for i in 0..=ALONG {
            let [u, v] = [2.0 * i as f64 / ALONG as f64 - 1.0, 2.0 * j as f64 / ACROSS as f64 - 1.0];
            let [x, y] = rounded_corner([u * half_x, v * half_y], [half_x, half_y], pad.corner);
            vertices.push(place(x, y, pad.height(x, y)));
        }
    }
    let at = |i: usize, j: usize| (j * (ALONG + 1) + i) as u32;
    for j in 0..ACROSS {
        for i in 0..ALONG {
            triangles.extend([
                [at(i, j), at(i + 1, j), at(i + 1, j + 1)],
                [at(i, j), at(i + 1, j + 1), at(i, j + 1)],
            ]);
        }
    }
    // The side walls: around the edge, counter-clockwise seen from the front, and down to the case.
    let mut edge: Vec<u32> = (0..ALONG).map(|i| at(i, 0)).collect();
    edge.extend((0..ACROSS).map(|j| at(ALONG, j)));
    edge.extend((1..=ALONG).rev().map(|i| at(i, ACROSS)));
    edge.extend((1..=ACROSS).rev().map(|j| at(0, j)));
    let back = to_finger.rotation * Vec3::new(0.0, 0.0, -pad.thickness);
    let foot = vertices.len() as u32;
    for &v in &edge {
        vertices.push(vertices[v as usize] + back);
    }
    let count = edge.len() as u32;
    for k in 0..count {
        let next = (k + 1) % count;
        let [a, b] = [edge[k as usize], edge[next as usize]];
        triangles.extend([[a, foot + k, foot + next], [a, foot + next, b]]);
    }
    Mesh { vertices, triangles, uvs: Vec::new() }
}

/// Maps a point of a rectangle into the same rectangle with rounded corners.
fn rounded_corner([x, y]: [f64; 2], [half_x, half_y]: [f64; 2], corner: f64) -> [f64; 2] {
    let beyond = [x.abs() - half_x + corner, y.abs() - half_y + corner].map(|d| d.max(0.0));
    let length = beyond[0].hypot(beyond[1]);
    // Maps the square of a corner onto its quarter disc, along rays from the centre of the disc.
    let kept = if length > 0.0 { beyond[0].max(beyond[1]) / length } else { 1.0 };
    [
        x.signum() * (x.abs() - beyond[0] + beyond[0] * kept),
        y.signum() * (y.abs() - beyond[1] + beyond[1] * kept),
    ]
}
