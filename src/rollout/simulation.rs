//! A simulated scene: the physics world, the robot and the objects by name.

use std::sync::Arc;

use sha2::{Digest, Sha256};

use super::{
    asset_cache::AssetCache,
    build,
    build_error::BuildError,
    object::{ArticulatedPart, ObjectInstance},
    robot_instance::RobotInstance,
};
use crate::{
    benchmark::CONTROL_DT,
    geometry::{Aabb, Pose, Vec3},
    physics::{
        BodyId, ContactPartner, PhysicsParams, World, joints,
        world::{ContactSummary, StepFailure},
    },
    robot::RobotSpec,
    scene::{Body, Scene},
};

/// A scene with its robot, simulated at the physics rate (60 Hz by default).
///
/// The builder places every object and the robot; [`settle`](Self::settle) lets the objects come to rest.
/// World frame: z up, z = 0 on the support surface. Stepping is deterministic: equal scenes and commands
/// give bitwise equal states.
#[derive(Clone, Debug)]
pub struct Simulation {
    /// The scene from which it was built.
    pub scene: Arc<Scene>,
    /// Bodies, joints and contacts.
    pub world: World,
    /// The robot and its controller.
    pub robot: RobotInstance,
    /// Objects in the order of the scene, each followed by its parts.
    pub objects: Vec<ObjectInstance>,
}

impl Simulation {
    /// Builds the world of a scene, with the robot in the joint configuration `scene.start_q`.
    ///
    /// # Errors
    /// An object cannot be built, two objects have one name, or objects overlap each other or the robot.
    pub fn new(
        scene: Arc<Scene>,
        params: &PhysicsParams,
        robot_spec: &RobotSpec,
        cache: &AssetCache,
    ) -> Result<Self, BuildError> {
        let mut world = World::new(params.clone(), scene.gravity);
        let objects = build::add_all(&mut world, &scene, cache)?;
        let robot = RobotInstance::new(&mut world, robot_spec, &scene.base_w, &scene.start_q, CONTROL_DT);
        build::check_overlap(&mut world, &scene)?;
        build::check_base(&scene)?;
        Ok(Self { scene, world, robot, objects })
    }

    /// Advances by one physics step.
    ///
    /// # Errors
    /// The solver failed; the state is no longer valid.
    pub fn step(&mut self) -> Result<(), StepFailure> {
        self.robot.advance(&mut self.world);
        self.world.step()
    }

    /// Speed of the fastest point of an object, m/s. For rigid bodies and parts: that of the centre plus 0.1 m
    /// times the angular velocity.
    pub fn speed(&self, object: &ObjectInstance) -> f64 {
        match object.body {
            BodyId::Soft(index) => self.world.soft(index).state.max_speed(),
            BodyId::Rigid(index) => {
                let body = &self.world.rigid(index).state;
                body.v.norm() + 0.1 * body.w.norm()
            }
            BodyId::Link(link) => {
                let articulation = self.world.articulation(link.articulation);
                let (tree, poses) = (articulation.tree(), articulation.poses());
                let velocity = joints::velocities(tree, poses, articulation.state.v.as_slice())[link.index];
                let centre = self.centre(object);
                velocity.at(&poses[link.index], &centre).norm() + 0.1 * velocity.angular.norm()
            }
            BodyId::World | BodyId::Kinematic(_) => 0.0,
        }
    }

    /// Contact of an object with a collider or soft body, in the last step in which the object was awake. Zero for
    /// objects that never move.
    pub fn contact(&self, object: &ObjectInstance, partner: ContactPartner) -> ContactSummary {
        self.world.contact(object.body, partner)
    }

    /// Contacts of an object with the left and right pad.
    pub fn pad_contacts(&self, object: &ObjectInstance) -> [ContactSummary; 2] {
        self.robot.pads.map(|pad| self.contact(object, ContactPartner::Collider(pad)))
    }

    /// The object of a name.
    pub fn object(&self, name: &str) -> Option<&ObjectInstance> {
        self.objects.iter().find(|o| o.name == name)
    }

    /// Centre of an object, m, world: mean of the nodes of a soft body, centre of mass of a rigid body, centre of the
    /// bounds of a part.
    pub fn centre(&self, object: &ObjectInstance) -> Vec3 {
        match object.body {
            BodyId::Soft(index) => {
                let x = &self.world.soft(index).state.x;
                x.iter().sum::<Vec3>() / x.len() as f64
            }
            BodyId::Rigid(index) => self.world.rigid(index).state.pose_w.translation.vector,
            BodyId::Link(_) => (self.pose(object) * nalgebra::Point3::from(object.bounds.centre())).coords,
            BodyId::World | BodyId::Kinematic(_) => object.start_w.translation.vector,
        }
    }

    /// Parts of the object of an index.
    pub fn parts(&self, index: usize) -> impl Iterator<Item = (&ObjectInstance, &ArticulatedPart)> {
        let parts = self.objects.iter().filter_map(|object| Some((object, object.part.as_ref()?)));
        parts.filter(move |(_, part)| part.object == index)
    }

    /// Joint position of a part, m or rad.
    pub fn joint(&self, object: &ObjectInstance) -> Option<f64> {
        match object.body {
            BodyId::Link(link) => Some(self.world.articulation(link.articulation).state.q[link.index]),
            _ => None,
        }
    }

    /// Pose of the object frame in the world. For a soft body: its mean rotation and translation.
    pub fn pose(&self, object: &ObjectInstance) -> Pose {
        match object.body {
            BodyId::Soft(index) => self.world.soft(index).state.mean_pose(),
            BodyId::Rigid(index) => self.world.rigid(index).state.object_w(),
            BodyId::Link(link) => self.world.link_pose(link) * object.joint_frame_o().inverse(),
            BodyId::World | BodyId::Kinematic(_) => object.start_w,
        }
    }

    /// Checks that every free body starts above another object.
    ///
    /// # Errors
    /// The first body with nothing below it.
    pub fn check_support(&self) -> Result<(), BuildError> {
        let boxes: Vec<Aabb> = self.objects.iter().map(|o| o.bounds.transformed(&o.start_w)).collect();
        for (object, own) in self.objects.iter().zip(&boxes) {
            let supports = |(other, below): (&ObjectInstance, &Aabb)| {
                let overlaps = (0..2).all(|i| below.min[i] < own.max[i] && own.min[i] < below.max[i]);
                other.name != object.name
                    && !matches!(other.asset.body, Body::Scenery)
                    && overlaps
                    && below.min.z < own.min.z
            };
            if object.body.is_free() && !self.objects.iter().zip(&boxes).any(supports) {
                let error = BuildError::NothingBelow(object.name.clone());
                let placed = self.scene.objects.iter().find(|placed| placed.name == object.name);
                return Err(match placed {
                    Some(placed) => error.of(placed),
                    None => error,
                });
            }
        }
        Ok(())
    }
}

/// Hash of all positions, 16 hexadecimal digits. Equal hashes mean bitwise equal states.
pub fn state_hash(sim: &Simulation) -> String {
    let mut hash = Sha256::new();
    let mut put = |x: f64| hash.update(x.to_bits().to_le_bytes());
    for soft in sim.world.soft_bodies() {
        soft.state.x.iter().flat_map(|x| x.iter()).for_each(|x| put(*x));
    }
    for rigid in sim.world.rigid_bodies() {
        rigid.state.pose_w.to_homogeneous().iter().for_each(|x| put(*x));
    }
    for articulation in sim.world.articulations() {
        articulation.state.q.iter().for_each(|x| put(*x));
    }
    hash.finalize().iter().take(8).map(|b| format!("{b:02x}")).collect()
}
