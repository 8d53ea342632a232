//! Meshes, frames and point clouds of the states.

use std::collections::{BTreeMap, BTreeSet};

use foxglove::messages::{
    Color, FrameTransform, FrameTransforms, PackedElementField, Point3, PointCloud, SceneEntity, SceneUpdate,
    TriangleListPrimitive, packed_element_field::NumericType,
};

use super::messages::{pose, rotation, timestamp, translation};
use softvt_geometry::{Pose, Quat, Vec3};
use softvt_physics::{BodyId, SoftId, world::WorldSnapshot};
use softvt_policy::RobotState;
use softvt_rollout::{SensingError, Sensors, strain_colour};
use softvt_sensing::camera::DisplayMesh;

/// The frame of everything else.
const WORLD: &str = "world";
/// The frame between the fingers.
const TOOL: &str = "tool";
pub(super) const PAD_FRAMES: [&str; 2] = ["pad_left", "pad_right"];
/// Size of a pixel of the viewer on rigid objects, m, which are written once.
const PIXEL: f32 = 1e-3;
/// The same on soft bodies, which are written in every state in which they move.
const SOFT_PIXEL: f32 = 4e-3;

/// The objects of a scene as viewers draw them.
pub(super) struct SceneGeometry {
    objects: Vec<RenderedObject>,
    /// Names of the soft bodies, by id.
    soft_names: BTreeMap<usize, String>,
}

struct RenderedObject {
    name: String,
    body: BodyId,
    pose_in_body: Pose,
    mesh: DisplayMesh,
}

impl SceneGeometry {
    pub(super) fn new(sensors: &mut Sensors) -> Result<Self, SensingError> {
        let (mut objects, mut soft_names) = (Vec::new(), BTreeMap::new());
        let reserved = [WORLD, TOOL].into_iter().chain(PAD_FRAMES);
        let cameras = sensors.cameras().iter().map(|camera| camera.name.clone());
        let mut known: BTreeSet<String> = reserved.map(str::to_owned).chain(cameras).collect();
        for object in sensors.render_scene()?.objects() {
            let pixel = if matches!(object.body, BodyId::Soft(_)) { SOFT_PIXEL } else { PIXEL };
            let name = unique_name(&object.name, &known);
            known.insert(name.clone());
            if let BodyId::Soft(id) = object.body {
                soft_names.insert(id.index(), name.clone());
            }
            let mesh = object.mesh.display_mesh(pixel)?;
            objects.push(RenderedObject { name, body: object.body, pose_in_body: object.pose_in_body, mesh });
        }
        Ok(Self { objects, soft_names })
    }

    /// Names of the soft bodies, in the order of their ids.
    pub(super) fn soft_names(&self) -> impl Iterator<Item = &String> {
        self.soft_names.values()
    }

    pub(super) fn transforms(
        &self,
        sensors: &Sensors,
        frame: &WorldSnapshot,
        robot: &RobotState,
        time_ns: u64,
    ) -> FrameTransforms {
        let tool_w = sensors.base_w() * robot.tool_b();
        // Cameras look along -z, and the frames of Foxglove's along z.
        let optical = Pose::from_parts(
            Vec3::zeros().into(),
            Quat::from_axis_angle(&Vec3::x_axis(), std::f64::consts::PI),
        );
        let cameras = sensors.cameras().iter().map(|camera| camera.name.as_str());
        let cameras =
            cameras.zip(sensors.cameras_w(frame)).map(|(name, camera_w)| (name, camera_w * optical));
        let objects = self.objects.iter().filter_map(|object| {
            let body_w = match object.body {
                BodyId::Rigid(id) => frame.rigid(id),
                BodyId::Link(id) => frame.link(id),
                BodyId::World | BodyId::Kinematic(_) | BodyId::Soft(_) => return None,
            };
            Some((object.name.as_str(), body_w * object.pose_in_body))
        });
        let transform = |(name, pose_w): (&str, Pose)| FrameTransform {
            timestamp: timestamp(time_ns),
            parent_frame_id: WORLD.to_owned(),
            child_frame_id: name.to_owned(),
            translation: Some(translation(&pose_w)),
            rotation: Some(rotation(&pose_w)),
        };
        let robot = [(TOOL, tool_w)].into_iter().chain(PAD_FRAMES.into_iter().zip(sensors.pads_w(frame)));
        FrameTransforms { transforms: robot.chain(cameras).chain(objects).map(transform).collect() }
    }

    /// The objects that differ from the state before; all without one.
    pub(super) fn update(
        &self,
        sensors: &Sensors,
        frame: &WorldSnapshot,
        before: Option<&WorldSnapshot>,
        time_ns: u64,
    ) -> Option<SceneUpdate> {
        let entity = |object: &RenderedObject| {
            let soft = match (object.body, before) {
                (BodyId::Soft(id), Some(before)) if before.soft(id) == frame.soft(id) => return None,
                (BodyId::Soft(id), _) => Some(id),
                (_, Some(_)) => return None,
                (_, None) => None,
            };
            let (frame_id, object_pose) = match object.body {
                BodyId::Rigid(_) | BodyId::Link(_) => (object.name.as_str(), Pose::identity()),
                BodyId::Soft(_) => (WORLD, Pose::identity()),
                BodyId::World | BodyId::Kinematic(_) => (WORLD, object.pose_in_body),
            };
            let skin = soft.map(|id| SoftSkin::new(sensors, frame, id));
            Some(SceneEntity {
                timestamp: timestamp(time_ns),
                frame_id: frame_id.to_owned(),
                id: object.name.clone(),
                frame_locked: true,
                triangles: vec![object.triangles(&object_pose, skin.as_ref())],
                ..SceneEntity::default()
            })
        };
        let entities: Vec<SceneEntity> = self.objects.iter().filter_map(entity).collect();
        (!entities.is_empty()).then(|| SceneUpdate { entities, deletions: Vec::new() })
    }
}

/// A name of a frame that no other has: links of the robot may share a name, and objects may have a camera's.
fn unique_name(name: &str, known: &BTreeSet<String>) -> String {
    let numbered = (2..).map(|number| format!("{name}_{number}"));
    std::iter::once(name.to_owned()).chain(numbered).find(|name| !known.contains(name)).unwrap_or_default()
}

/// The nodes of a soft body in a state, and their colours by strain, if it has a stable strain.
struct SoftSkin<'a> {
    nodes: &'a [Vec3],
    colours: Vec<[f32; 3]>,
}

impl<'a> SoftSkin<'a> {
    fn new(sensors: &Sensors, frame: &'a WorldSnapshot, id: SoftId) -> Self {
        let nodes = frame.soft(id);
        let colours = sensors.strain_ratios(id.index(), nodes).into_iter().map(strain_colour).collect();
        Self { nodes, colours }
    }
}

impl RenderedObject {
    fn triangles(&self, object_pose: &Pose, skin: Option<&SoftSkin>) -> TriangleListPrimitive {
        let mesh = &self.mesh;
        let bindings = skin.map_or(&[][..], |_| &mesh.bindings);
        let weighted = |vertex: usize| {
            let binding = &bindings[vertex];
            binding.nodes.iter().map(|&node| node as usize).zip(binding.weights)
        };
        let position = |vertex: usize| match skin {
            Some(skin) => weighted(vertex).map(|(node, w)| skin.nodes[node] * f64::from(w)).sum(),
            None => Vec3::from(mesh.positions[vertex].map(f64::from)),
        };
        let colour = |vertex: usize| match skin.filter(|skin| !skin.colours.is_empty()) {
            Some(skin) => weighted(vertex).fold([0.0; 3], |sum, (node, w)| {
                std::array::from_fn(|channel| sum[channel] + w * skin.colours[node][channel])
            }),
            None => mesh.colours[vertex],
        };
        let vertices = 0..mesh.positions.len();
        TriangleListPrimitive {
            pose: pose(object_pose),
            points: vertices.clone().map(|vertex| point(&position(vertex))).collect(),
            colors: vertices.map(|vertex| shown_colour(colour(vertex))).collect(),
            indices: mesh.triangles.iter().flatten().copied().collect(),
            ..TriangleListPrimitive::default()
        }
    }
}

fn point(p: &Vec3) -> Point3 {
    Point3 { x: p.x, y: p.y, z: p.z }
}

/// A colour of linear RGB as viewers expect it, in sRGB.
fn shown_colour(linear: [f32; 3]) -> Color {
    let [r, g, b] = linear.map(|channel| {
        let channel = f64::from(channel.clamp(0.0, 1.0));
        if channel <= 0.003_130_8 { 12.92 * channel } else { 1.055 * channel.powf(1.0 / 2.4) - 0.055 }
    });
    Color { r, g, b, a: 1.0 }
}

/// The nodes of a soft body with their strain over the stable strain, 0 without one.
pub(super) fn node_cloud(sensors: &Sensors, frame: &WorldSnapshot, body: usize, time_ns: u64) -> PointCloud {
    let ratios = sensors.strain_ratios(body, &frame.nodes[body]);
    let points =
        frame.nodes[body].iter().enumerate().map(|(node, p)| (*p, ratios.get(node).copied().unwrap_or(0.0)));
    cloud(WORLD, "strain", points, time_ns)
}

/// The contact points of a pad in its frame, with their pressure.
pub(super) fn contact_cloud(frame: &WorldSnapshot, side: usize, time_ns: u64) -> PointCloud {
    let points = frame.patches.get(side).into_iter().flat_map(|patch| &patch.points);
    cloud(PAD_FRAMES[side], "pressure", points.map(|point| (point.p_p, point.pressure)), time_ns)
}

/// Points with one number each.
fn cloud(
    frame_id: &str,
    number: &str,
    points: impl Iterator<Item = (Vec3, f64)>,
    time_ns: u64,
) -> PointCloud {
    let bytes: Vec<u8> = points
        .flat_map(|(p, number)| [p.x, p.y, p.z, number])
        .flat_map(|x| (x as f32).to_le_bytes())
        .collect();
    let names = ["x", "y", "z", number];
    let field = |(index, name): (usize, &&str)| PackedElementField {
        name: (*name).to_owned(),
        offset: 4 * index as u32,
        r#type: NumericType::Float32.into(),
    };
    PointCloud {
        timestamp: timestamp(time_ns),
        frame_id: frame_id.to_owned(),
        pose: pose(&Pose::identity()),
        point_stride: 4 * names.len() as u32,
        fields: names.iter().enumerate().map(field).collect(),
        data: bytes.into(),
    }
}
