//! The message with the objects of a scene: triangles and colours, and the body that each moves with.

use serde_json::{Value, json};

use crate::message::Message;
use softvt_geometry::Pose;
use softvt_media::d_axis::{D_ENDS, D_TICKS};
use softvt_physics::BodyId;
use softvt_rollout::{Episode, ObjectInstance, SensingError};
use softvt_scene::{Body, Camera, CameraMount, ROBOT_SEGMENTATION_ID};
use softvt_sensing::camera::DisplayMesh;

/// Size of a pixel of the page on an object, m: meshes look like the finest ones from about 0.5 m.
const PIXEL: f32 = 1e-3;

/// Numbers of a pose: position, m, and quaternion, x y z w.
pub(crate) fn pose_numbers(pose: &Pose) -> [f32; 7] {
    let (t, q) = (pose.translation.vector, pose.rotation.coords);
    [t.x, t.y, t.z, q.x, q.y, q.z, q.w].map(|x| x as f32)
}

/// An object that moves with a rigid body or a link.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MovingObject {
    pub(crate) body: BodyId,
    pub(crate) pose_in_body: Pose,
}

/// The message about the scene of an episode, and the objects whose poses each state has. `about` has further fields.
pub(crate) fn scene_message(
    episode: &mut Episode,
    about: Value,
) -> Result<(Vec<u8>, Vec<MovingObject>), SensingError> {
    let target = episode.sim.objects[episode.target()].name.clone();
    let soft: Vec<Value> = episode.sim.objects.iter().filter_map(soft_body).collect();
    let cameras: Vec<Value> = episode.spec().scene.cameras.iter().map(camera).collect();
    let mut message = Message::default();
    let (mut objects, mut moving) = (Vec::new(), Vec::new());
    for object in episode.render_scene()?.objects() {
        let mut entry = mesh_entry(&mut message, &object.mesh.display_mesh(PIXEL)?);
        entry["name"] = json!(object.name);
        entry["target"] = json!(object.name == target);
        entry["robot"] = json!(object.segmentation_id == ROBOT_SEGMENTATION_ID);
        match object.body {
            BodyId::Soft(id) => entry["soft"] = json!(id.index()),
            BodyId::World | BodyId::Kinematic(_) => {
                entry["pose"] = json!(pose_numbers(&object.pose_in_body));
            }
            BodyId::Rigid(_) | BodyId::Link(_) => {
                entry["moving"] = json!(moving.len());
                moving.push(MovingObject { body: object.body, pose_in_body: object.pose_in_body });
            }
        }
        objects.push(entry);
    }
    let mut content = about;
    content["type"] = json!("scene");
    content["d_axis"] = json!({ "ends": D_ENDS, "ticks": D_TICKS });
    content["objects"] = json!(objects);
    content["bodies"] = json!(soft);
    content["cameras"] = json!(cameras);
    Ok((message.finish(content), moving))
}

/// The soft bodies in the order of their ids, with the strain at which their material stops being stable.
fn soft_body(object: &ObjectInstance) -> Option<Value> {
    let (BodyId::Soft(_), Body::Soft(material)) = (object.body, &object.asset.body) else { return None };
    Some(json!({ "name": object.name, "stable_strain": material.stable_strain() }))
}

fn camera(camera: &Camera) -> Value {
    json!({
        "name": camera.name,
        "on_hand": camera.mount == CameraMount::Hand,
        "pose": pose_numbers(&camera.pose),
        "fovy": camera.fovy_rad,
    })
}

fn mesh_entry(message: &mut Message, mesh: &DisplayMesh) -> Value {
    // The square root keeps the steps of dark colours even, in a byte each.
    let colour = |c: &f32| (255.0 * c.clamp(0.0, 1.0).sqrt()).round() as u8;
    let mut entry = json!({
        "roughness": mesh.roughness,
        "positions": message.floats(mesh.positions.iter().flatten().copied()),
        "normals": message.floats(mesh.normals.iter().flatten().copied()),
        "colours": message.bytes(mesh.colours.iter().flatten().map(colour).collect()),
        "triangles": message.indices(mesh.triangles.iter().flatten().copied()),
    });
    if !mesh.bindings.is_empty() {
        entry["nodes"] = json!(message.indices(mesh.bindings.iter().flat_map(|vertex| vertex.nodes)));
        entry["weights"] = json!(message.floats(mesh.bindings.iter().flat_map(|vertex| vertex.weights)));
    }
    entry
}
