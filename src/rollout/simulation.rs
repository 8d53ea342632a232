//! A scene that moves: the world, the robot in it, and the objects by name.

use std::sync::Arc;

use super::{
    asset_cache::AssetCache,
    build::{self, BuildError},
    robot_instance::RobotInstance,
};
use crate::{
    benchmark::control::CONTROL_DT,
    geometry::{Aabb, Pose, Vec3},
    physics::{
        BodyId, ColliderId, ContactPartner, PhysicsParams, World, joints,
        world::{ContactSummary, StepFailure},
    },
    robot::RobotSpec,
    scene::{Asset, Joint, Scene},
};

/// What a part belongs to.
#[derive(Clone, Debug, PartialEq)]
pub struct ArticulatedPart {
    /// Index of the handle of the whole object.
    pub object: usize,
    /// Name within the object.
    pub name: String,
    /// What carries it.
    pub joint: Joint,
}

/// An object of the scene in the world.
#[derive(Clone, Debug)]
pub struct ObjectInstance {
    /// Name in the scene.
    pub name: String,
    /// What it is.
    pub asset: Arc<Asset>,
    /// Its body in the world.
    pub body: BodyId,
    /// Where it was put.
    pub start_w: Pose,
    /// Its colliders.
    pub colliders: Vec<ColliderId>,
    /// Bounds of its shape at rest, object frame (of a part: the whole object's with all joints at 0).
    pub bounds: Aabb,
    /// What it is a part of.
    pub part: Option<ArticulatedPart>,
}

impl ObjectInstance {
    /// Where things are put on it or in it: its lowest point on its centre line, object frame, m. An asset stands there by
    /// itself; a part is where it is in its object.
    pub fn foot_o(&self) -> Vec3 {
        match self.part {
            Some(_) => Vec3::new(self.bounds.centre().x, self.bounds.centre().y, self.bounds.min.z),
            None => Vec3::zeros(),
        }
    }
}

/// A running scene.
#[derive(Clone, Debug)]
pub struct Simulation {
    /// The scene it was built from.
    pub scene: Arc<Scene>,
    /// All bodies.
    pub world: World,
    /// The robot.
    pub robot: RobotInstance,
    /// The objects, in scene order, each followed by its parts.
    pub objects: Vec<ObjectInstance>,
}

impl Simulation {
    /// Builds the world of `scene`.
    ///
    /// # Errors
    /// An object that cannot be made, two of one name, or one that starts inside of another or of the robot.
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

    /// One physics step.
    ///
    /// # Errors
    /// The step failed; the run is invalid.
    pub fn step(&mut self) -> Result<(), StepFailure> {
        self.robot.advance(&mut self.world);
        self.world.step()
    }

    /// Speed of the fastest point of an object, m/s (of its centre and 0.1 m of lever for a rigid one).
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

    /// What a collider or soft body did to an object in the last step in which the object was awake; nothing to what
    /// never moves.
    pub fn contact(&self, object: &ObjectInstance, partner: ContactPartner) -> ContactSummary {
        self.world.contact(object.body, partner)
    }

    /// What the left and right pad did to an object.
    pub fn pad_contacts(&self, object: &ObjectInstance) -> [ContactSummary; 2] {
        self.robot.pads.map(|pad| self.contact(object, ContactPartner::Collider(pad)))
    }

    /// Object by name.
    pub fn object(&self, name: &str) -> Option<&ObjectInstance> {
        self.objects.iter().find(|o| o.name == name)
    }

    /// Centre of an object, m, world: the mean of a soft body's nodes, the centre of mass of a rigid one, the middle of a
    /// part's bounds.
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

    /// The parts of the object with handle `index`.
    pub fn parts(&self, index: usize) -> impl Iterator<Item = (&ObjectInstance, &ArticulatedPart)> {
        let parts = self.objects.iter().filter_map(|handle| Some((handle, handle.part.as_ref()?)));
        parts.filter(move |(_, part)| part.object == index)
    }

    /// Joint value of a part, m or rad.
    pub fn joint(&self, object: &ObjectInstance) -> Option<f64> {
        match object.body {
            BodyId::Link(link) => Some(self.world.articulation(link.articulation).state.q[link.index]),
            _ => None,
        }
    }

    /// Object frame in the world; of a soft body its mean rotation about its centre.
    pub fn pose(&self, object: &ObjectInstance) -> Pose {
        match object.body {
            BodyId::Soft(index) => {
                let body = &self.world.soft(index).state;
                let rotation = crate::geometry::Quat::from_matrix(&body.frame);
                let nodes = &body.model.mesh.nodes;
                let rest_centre = nodes.iter().sum::<Vec3>() / nodes.len() as f64;
                let at = self.centre(object) - rotation * rest_centre;
                Pose::from_parts(at.into(), rotation)
            }
            BodyId::Rigid(index) => self.world.rigid(index).state.object_w(),
            BodyId::Link(link) => self.world.link_pose(link) * joint_frame(object).inverse(),
            BodyId::World | BodyId::Kinematic(_) => object.start_w,
        }
    }
}

/// Frame of a part's joint in its object frame; the link frame of the mechanics coincides with it.
pub(super) fn joint_frame(object: &ObjectInstance) -> Pose {
    object.part.as_ref().map_or(Pose::identity(), |part| Pose::from(part.joint.origin_o))
}
