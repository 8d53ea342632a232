//! The message about the state after a control step.

use serde_json::{Value, json};

use crate::{
    geometry::{MovingObject, pose_numbers},
    message::Message,
};
use softvt_evaluation::{category::CRUSHED_PCT, verdict::TargetVerdict};
use softvt_geometry::Pose;
use softvt_media::jpeg::encode_jpeg;
use softvt_physics::{BodyId, fem::strain::node_strains};
use softvt_robot::Side;
use softvt_rollout::{Episode, SensingError, Sensors, StateDeformation};

/// Quality of the tactile pictures, 1 to 100.
const JPEG_QUALITY: u8 = 85;

/// The message about the present state.
pub(crate) fn state_message(episode: &mut Episode, moving: &[MovingObject]) -> Result<Vec<u8>, SensingError> {
    let mut message = Message::default();
    let mut tactile = Vec::new();
    for side in [Side::Left, Side::Right] {
        let reading = episode.tactile_reading(side)?;
        let markers = reading.markers.initial.iter().zip(&reading.markers.current);
        tactile.push(json!({
            "image": message.bytes(encode_jpeg(&reading.image, JPEG_QUALITY).unwrap_or_default()),
            "markers": message.floats(markers.flat_map(|(from, to)| [from[0], from[1], to[0], to[1]])),
        }));
    }
    let world = &episode.sim.world;
    let poses = moving.iter().map(|object| world.pose(object.body) * object.pose_in_body);
    let poses = message.floats(poses.flat_map(|pose| pose_numbers(&pose)));
    let mut soft = Vec::new();
    for object in &episode.sim.objects {
        let BodyId::Soft(id) = object.body else { continue };
        let state = &world.soft(id).state;
        let nodes = message.floats(state.x.iter().flat_map(|x| [x.x, x.y, x.z]).map(|x| x as f32));
        let strains =
            message.floats(node_strains(&state.model, &state.x).into_iter().map(|strain| strain as f32));
        soft.push(json!({ "nodes": nodes, "strains": strains }));
    }
    let contacts = message.floats(contact_points(episode));
    let base_w = episode.sim.robot.base_w;
    let cameras = episode.cameras_b().into_iter().map(|camera_b| base_w * camera_b);
    let content = json!({
        "type": "state",
        "tactile": tactile,
        "poses": poses,
        "soft": soft,
        "contacts": contacts,
        "cameras": cameras.map(|pose| pose_numbers(&pose)).collect::<Vec<_>>(),
        "commanded": commanded(episode).map(|pose| pose_numbers(&pose)),
        "measured": measured(episode),
    });
    Ok(message.finish(content))
}

/// Measurements of the judge and the robot.
fn measured(episode: &Episode) -> Value {
    // A record also has digests of all actions and of the state.
    let (trace, verdict) = (episode.trace(), episode.verdict());
    let now = episode.targets().iter().zip(&verdict.targets).map(|(&index, target)| {
        let name = &episode.sim.objects[index].name;
        let object = trace.objects.iter().find(|object| object.name == *name);
        (object.and_then(|object| object.d_pct), target.tau)
    });
    let now = StateDeformation::worst(now);
    let largest = |of: fn(&TargetVerdict) -> Option<f64>| verdict.largest_by(of).and_then(of);
    let collapsed_pct = largest(|target| target.collapsed_volume_pct);
    json!({
        "time_s": trace.time_s,
        "d_pct": now.map(|of| of.d_pct),
        "peak_over_tau": verdict.most_deformed().and_then(|target| target.ratio()),
        "tau_pct": now.and_then(|of| of.tau_pct),
        "pad_force_n": trace.pad_force_n,
        "slip_mm": verdict.slip_mm,
        "width_mm": 1e3 * trace.gripper_width_m,
        "closure": trace.closure,
        "grip_ratio": largest(|target| target.grip_ratio),
        "collapsed_pct": collapsed_pct,
        "is_crushed": collapsed_pct >= Some(CRUSHED_PCT),
        "no_drop": verdict.no_drop,
        "goal_parts": verdict.goal_parts,
    })
}

/// Positions of the contact points of both pads, world, m, each with its pressure, Pa.
fn contact_points(episode: &Episode) -> Vec<f32> {
    let world = &episode.sim.world;
    let mut numbers = Vec::new();
    for patch in Sensors::frame(&episode.sim).patches {
        let collider = world.collider(patch.collider);
        let collider_w = world.pose(collider.parent) * collider.pose_in_parent;
        for point in patch.points {
            let p = collider_w.translation.vector + collider_w.rotation * point.p_p;
            numbers.extend([p.x, p.y, p.z, point.pressure].map(|x| x as f32));
        }
    }
    numbers
}

/// Pose that the last action asks the tool for, world.
fn commanded(episode: &Episode) -> Option<Pose> {
    let action = episode.last_action()?;
    Some(episode.sim.robot.base_w * action.pose_b())
}
