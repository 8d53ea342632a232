//! A simulated scene: the physics world, the robot and the objects by name, and its settling before an episode begins.

use std::sync::Arc;

use sha2::{Digest, Sha256};

use super::{
    asset_cache::AssetCache,
    build,
    build_error::SceneBuildError,
    robot_instance::RobotInstance,
    settled_box::{SettledBox, lean},
};
use softvt_benchmark::{CONTROL_DT, settings::Settings};
use softvt_common::{cancel, text::hex};
use softvt_evaluation::deformation::ReferenceShape;
use softvt_geometry::{Aabb, Pose, Vec3};
use softvt_physics::{
    BodyId, ColliderId, ContactPartner, World,
    contact::Friction,
    fem::FemModel,
    joints,
    world::{ContactPatch, ContactSummary, StepFailure},
};
use softvt_scene::{Asset, Body, Joint, Scene};

/// Speed below which an object counts as settled, m/s.
const SETTLED_SPEED: f64 = 1e-3;
/// Time for which all objects must be settled, s.
const SETTLED_TIME: f64 = 0.5;
/// Time limit of settling, s.
const SETTLE_TIMEOUT: f64 = 3.0;
/// Drop below all fixed objects from which on an object counts as fallen out of the world, m.
const MIN_FALL: f64 = 0.5;

#[derive(Clone, Debug, PartialEq)]
pub struct ArticulatedPart {
    /// Index of the whole object in [`Simulation::objects`](super::Simulation::objects).
    pub object: usize,
    pub name: String,
    pub joint: Joint,
}

/// An object of the scene, or a part of one, in the world of a simulation.
#[derive(Clone, Debug)]
pub struct ObjectInstance {
    /// Name in the scene; for a part `object.part`.
    pub name: String,
    pub asset: Arc<Asset>,
    pub body: BodyId,
    /// Initial pose of the object frame, world.
    pub start_w: Pose,
    /// Colliders of the body; none for a soft body.
    pub colliders: Vec<ColliderId>,
    pub model: Option<Arc<FemModel>>,
    /// Bounds of the shape at rest, object frame. For a part: that of the whole object with all joints at 0.
    pub bounds: Aabb,
    /// Box about it, if it has tilted while it settled.
    pub settled: Option<SettledBox>,
    /// The part, if this is not a whole object.
    pub part: Option<ArticulatedPart>,
}

impl ObjectInstance {
    /// Reference point for placing other objects on or in this one, object frame, m: the lowest point on the vertical
    /// centre line. It is the origin for whole objects.
    pub fn foot_o(&self) -> Vec3 {
        match self.part {
            Some(_) => Vec3::new(self.bounds.centre().x, self.bounds.centre().y, self.bounds.min.z),
            None => Vec3::zeros(),
        }
    }

    /// Frame of a part's joint in the object frame. It coincides with the frame of the link.
    pub(super) fn joint_frame_o(&self) -> Pose {
        self.part.as_ref().map_or(Pose::identity(), |part| Pose::from(part.joint.origin_o))
    }
}

/// The scene did not come to rest. Places are `file:line`, empty if no script placed the object.
#[derive(Debug, thiserror::Error)]
pub enum SettleError {
    #[error(
        "object {object} still moves at {speed_mm:.1} mm/s after {SETTLE_TIMEOUT} s of settling; put it nearer to what \
         it rests on, or make it lie stably"
    )]
    Moving { object: String, speed_mm: f64, placed_at: String },
    #[error(
        "object {object} fell out of the world: there was nothing below it, and after {SETTLE_TIMEOUT} s of settling it is \
         {fallen:.1} m lower; place it above a support"
    )]
    Fell { object: String, fallen: f64, placed_at: String },
    #[error("interrupted")]
    Interrupted,
    #[error("settling failed: {failure}")]
    Failed { failure: StepFailure, placed_at: String },
}

impl SettleError {
    /// `file:line` where a script placed the object in question.
    pub fn place(&self) -> Option<&str> {
        match self {
            Self::Moving { placed_at, .. }
            | Self::Fell { placed_at, .. }
            | Self::Failed { placed_at, .. } => Some(placed_at.as_str()).filter(|place| !place.is_empty()),
            Self::Interrupted => None,
        }
    }
}

/// A scene with its robot, simulated at the physics rate (60 Hz by default).
///
/// The builder places every object and the robot; [`settle`](Self::settle) lets the objects come to rest.
/// World frame: z up, z = 0 on the support surface. Stepping is deterministic: equal scenes and commands
/// give bitwise equal states.
#[derive(Clone, Debug)]
pub struct Simulation {
    pub scene: Arc<Scene>,
    pub world: World,
    pub robot: RobotInstance,
    /// Objects in the order of the scene, each followed by its parts.
    pub objects: Vec<ObjectInstance>,
}

impl Simulation {
    /// Builds the world of a scene, with the robot in the joint configuration `scene.start_q`.
    ///
    /// # Errors
    /// An object cannot be built, two objects have one name, or objects overlap each other or the robot.
    pub fn new(scene: Arc<Scene>, settings: &Settings, cache: &AssetCache) -> Result<Self, SceneBuildError> {
        let mut world = World::new(settings.physics.clone(), scene.gravity);
        let objects = build::add_all(&mut world, &scene, cache)?;
        let robot = RobotInstance::new(
            &mut world,
            &settings.robot,
            &settings.tactile.gel,
            &scene.base_w,
            &scene.start_q,
            CONTROL_DT,
        );
        build::check_overlap(&mut world, &scene)?;
        build::check_base(&scene)?;
        Ok(Self { scene, world, robot, objects })
    }

    /// # Errors
    /// The solver failed; the state is no longer valid.
    pub fn step(&mut self) -> Result<(), StepFailure> {
        self.robot.advance(&mut self.world);
        self.world.step()
    }

    /// Steps until all objects have been at rest for 0.5 s, while the arm holds its pose.
    ///
    /// # Errors
    /// An object still moves after 3 s or has fallen out of the world, a physics step fails, or the run is cancelled.
    pub fn settle(&mut self) -> Result<(), SettleError> {
        let dt = self.world.params.dt;
        let mut settled_time = 0.0;
        let mut elapsed = 0.0;
        while settled_time < SETTLED_TIME {
            if cancel::requested() {
                return Err(SettleError::Interrupted);
            }
            self.step().map_err(|failure| SettleError::Failed {
                placed_at: failure.body().map_or(String::new(), |body| placed_at(&self.scene, body)),
                failure,
            })?;
            elapsed += dt;
            let fastest = self.fastest();
            let moving = fastest.filter(|(_, speed)| *speed >= SETTLED_SPEED);
            settled_time = if moving.is_none() { settled_time + dt } else { 0.0 };
            if let Some((object, speed)) = moving.filter(|_| elapsed > SETTLE_TIMEOUT) {
                return Err(self.unsettled(object, speed));
            }
        }
        for index in 0..self.objects.len() {
            self.objects[index].settled = self.settled_box(&self.objects[index]);
        }
        Ok(())
    }

    /// Box about an object that does not rest as modelled.
    fn settled_box(&self, object: &ObjectInstance) -> Option<SettledBox> {
        let soft = match object.body {
            BodyId::Soft(id) => Some(&self.world.soft(id).state),
            BodyId::Rigid(_) => None,
            BodyId::World | BodyId::Kinematic(_) | BodyId::Link(_) => return None,
        };
        SettledBox::new(&object.asset.shape, &self.pose(object), soft)
    }

    /// Angle by which an object leans from how it was placed, rad.
    pub fn tilt(&self, object: &ObjectInstance) -> f64 {
        lean(&self.pose(object), &object.start_w.rotation.inverse_transform_vector(&Vec3::z()))
    }

    /// The error about an object that moves at `speed` (m/s) after the time limit.
    fn unsettled(&self, object: &ObjectInstance, speed: f64) -> SettleError {
        let (name, placed_at) = (object.name.clone(), placed_at(&self.scene, &object.name));
        let height = self.centre(object).z;
        let fixed =
            self.objects.iter().filter(|other| other.body == BodyId::World && !other.colliders.is_empty());
        let floor = fixed
            .map(|other| Aabb::transformed(&other.bounds, &other.start_w).min.z)
            .fold(f64::INFINITY, f64::min);
        let fallen = object.start_w.translation.z - height;
        match fallen > MIN_FALL && height < floor {
            true => SettleError::Fell { object: name, fallen, placed_at },
            false => SettleError::Moving { object: name, speed_mm: 1e3 * speed, placed_at },
        }
    }

    /// The fastest object and its speed, m/s; the first one if several are equally fast.
    fn fastest(&self) -> Option<(&ObjectInstance, f64)> {
        let speeds = self.objects.iter().map(|object| (object, self.speed(object)));
        speeds.reduce(|best, next| if next.1 > best.1 { next } else { best })
    }

    /// Speed of the fastest point of an object, m/s: of the fastest node of a soft body, of the fastest corner of the
    /// bounding box of a rigid body or part.
    pub fn speed(&self, object: &ObjectInstance) -> f64 {
        let of_corners = |origin: Vec3, linear: Vec3, angular: Vec3| {
            let (pose, Aabb { min, max }) = (self.pose(object), object.bounds);
            let corners = (0..8).map(|corner| {
                let at = Vec3::from_fn(|axis, _| if corner >> axis & 1 == 0 { min[axis] } else { max[axis] });
                (linear + angular.cross(&((pose * nalgebra::Point3::from(at)).coords - origin))).norm()
            });
            corners.fold(0.0, f64::max)
        };
        match object.body {
            BodyId::Soft(index) => self.world.soft(index).state.max_speed(),
            BodyId::Rigid(index) => {
                let body = &self.world.rigid(index).state;
                of_corners(body.pose_w.translation.vector, body.v, body.w)
            }
            BodyId::Link(link) => {
                let articulation = self.world.articulation(link.articulation);
                let (tree, poses) = (articulation.tree(), articulation.poses());
                let velocity = joints::velocities(tree, poses, articulation.state.v.as_slice())[link.index];
                of_corners(poses[link.index].translation.vector, velocity.linear, velocity.angular)
            }
            BodyId::World | BodyId::Kinematic(_) => 0.0,
        }
    }

    /// Contact of an object with a collider or soft body, in the last step in which the object was awake. Zero for
    /// objects that never move.
    pub fn contact(&self, object: &ObjectInstance, partner: ContactPartner) -> ContactSummary {
        self.world.contact(object.body, partner)
    }

    /// True if the body of an object sleeps.
    pub fn is_asleep(&self, object: &ObjectInstance) -> bool {
        self.world.is_asleep(object.body)
    }

    /// Contacts of an object with the left and right pad.
    pub fn pad_contacts(&self, object: &ObjectInstance) -> [ContactSummary; 2] {
        self.robot.pads.map(|pad| self.contact(object, ContactPartner::Collider(pad)))
    }

    pub fn pad_friction(&self, object: &ObjectInstance) -> Friction {
        let pad = &self.world.collider(self.robot.pads[0]).friction;
        match object.body {
            BodyId::Soft(index) => pad.with(&self.world.soft(index).friction),
            _ => object.colliders.first().map_or(*pad, |&own| pad.with(&self.world.collider(own).friction)),
        }
    }

    /// Sum of the normal forces on the left and right pad, N, from bodies of every kind.
    pub fn pad_normal_forces(&self) -> [f64; 2] {
        self.robot.pads.map(|pad| normal_force(&self.world.patch(pad), |_| true))
    }

    /// Normal forces of the left and right pad on an object, N. Those on parts and on fixed objects are found in the
    /// contact patches, since contacts are recorded for free bodies only.
    pub fn pad_normal_forces_on(&self, object: &ObjectInstance) -> [f64; 2] {
        if object.body.is_free() {
            return self.pad_contacts(object).map(|contact| contact.normal_force);
        }
        let is_of_object =
            |partner| object.colliders.iter().any(|&own| partner == ContactPartner::Collider(own));
        self.robot.pads.map(|pad| normal_force(&self.world.patch(pad), is_of_object))
    }

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

    /// The present shape of an object, for measuring deformations from it; `None` if it is rigid or its shape is not
    /// finite.
    pub fn present_shape(&self, object: &ObjectInstance) -> Option<ReferenceShape> {
        let BodyId::Soft(id) = object.body else { return None };
        let body = &self.world.soft(id).state;
        ReferenceShape::of_mesh(&body.x, &body.model.mesh, object.bounds.size().norm()).ok()
    }

    /// Weight of an object, N; 0 for fixed objects and parts.
    pub fn weight(&self, object: &ObjectInstance) -> f64 {
        self.world.mass(object.body).map_or(0.0, |mass| mass * self.scene.gravity.norm())
    }

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
            BodyId::Soft(_) | BodyId::Rigid(_) => self.world.pose(object.body),
            BodyId::Link(_) => self.world.pose(object.body) * object.joint_frame_o().inverse(),
            BodyId::World | BodyId::Kinematic(_) => object.start_w,
        }
    }

    /// Checks that every free body starts above another object.
    ///
    /// # Errors
    /// The first body with nothing below it.
    pub fn check_support(&self) -> Result<(), SceneBuildError> {
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
                let at = object.start_w.translation.vector;
                let error = SceneBuildError::NothingBelow { object: object.name.clone(), x: at.x, y: at.y };
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

/// Normal force at the points of a patch that touch the partners of interest, N.
fn normal_force(patch: &ContactPatch, is_of_interest: impl Fn(ContactPartner) -> bool) -> f64 {
    let points = patch.points.iter().filter(|point| is_of_interest(point.partner));
    // The sum of no numbers is −0 in Rust, which would be printed.
    points.fold(0.0, |sum, point| sum + point.pressure * point.area)
}

/// `file:line` where the object of a name, or the object of the part of that name, was placed.
pub(super) fn placed_at(scene: &Scene, name: &str) -> String {
    let whole = name.split('.').next().unwrap_or(name);
    let object = scene.objects.iter().find(|object| object.name == whole);
    object.map_or(String::new(), |object| object.placed_at.clone())
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
    hex(&hash.finalize()[..8])
}
