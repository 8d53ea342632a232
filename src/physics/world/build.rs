//! Adding objects to a world.

use std::sync::Arc;

use super::{
    Articulation, JointDrive, KinematicFrame, RigidBody, SoftBody, World,
    state::{JointFriction, SleepState},
};
use crate::{
    contact::{Collider, ContactHistory, ContactSurface, Friction, LayerState, SurfaceStiffness},
    fem::{FemModel, FemState, system::VelocitySystem},
    ids::{ArticulationId, BodyId, ColliderId, KinematicId, RigidId, SoftId},
    joints::{self, JointState, JointTree},
    rigid::RigidState,
};
use softvt_geometry::{Pose, shape::Shape};

impl World {
    /// Adds a soft body in its rest configuration at `pose`. [`FemModel::from_shape`] builds the model.
    ///
    /// `surface` is the body's surface at rest (object frame), on which the samples of other soft bodies press.
    /// Without one, two soft bodies touch only where the samples of this one meet the surface of the other.
    pub fn add_soft(
        &mut self,
        name: &str,
        model: Arc<FemModel>,
        surface: Option<Arc<dyn ContactSurface>>,
        pose: &Pose,
        friction: Friction,
    ) -> SoftId {
        let modulus = model.contact_modulus();
        let mut state = FemState::new(model.clone(), pose);
        state.update_elastic(0.0);
        self.wake_all();
        self.soft.push(SoftBody {
            name: name.to_owned(),
            state,
            friction,
            stiffness: SurfaceStiffness { normal: modulus, shear: self.params.shear_ratio * modulus },
            surface,
            assembly: None,
            sleep: SleepState::default(),
            contacts: Vec::new(),
            system: VelocitySystem::new(&model),
            history: ContactHistory::new(model.samples.len()),
            steps_awake: 0,
            inverted_time: 0.0,
        });
        SoftId::new(self.soft.len() - 1)
    }

    /// Adds a free rigid body without colliders; [`World::add_shape`] adds them.
    pub fn add_rigid(&mut self, name: &str, state: RigidState) -> RigidId {
        self.rigid.push(RigidBody {
            name: name.to_owned(),
            state,
            assembly: None,
            sleep: SleepState::default(),
            contacts: Vec::new(),
        });
        RigidId::new(self.rigid.len() - 1)
    }

    /// Adds an articulation at joint coordinates `q` with one optional drive per joint. Gravity acts on its links if
    /// `has_gravity`; it does not on an arm whose controller compensates it.
    ///
    /// # Panics
    /// The number of coordinates or drives is not the number of joints.
    pub fn add_articulation(
        &mut self,
        name: &str,
        tree: JointTree,
        q: &[f64],
        drives: Vec<Option<JointDrive>>,
        has_gravity: bool,
    ) -> ArticulationId {
        let joints = tree.dofs();
        assert!(q.len() == joints && drives.len() == joints, "{name}: one coordinate and drive per joint");
        let poses = joints::forward(&tree, q);
        self.articulations.push(Articulation {
            name: name.to_owned(),
            state: JointState::at_rest(q),
            tree,
            last_drives: drives.clone(),
            drives,
            drive_forces: vec![0.0; joints],
            has_gravity,
            assembly: None,
            sleep: SleepState::default(),
            friction: q.iter().map(|&anchor| JointFriction { anchor, stiffness: 0.0, dt: 0.0 }).collect(),
            poses,
        });
        ArticulationId::new(self.articulations.len() - 1)
    }

    /// Adds a kinematic frame: a frame that carries colliders and whose motion [`World::move_kinematic`] prescribes.
    pub fn add_kinematic(&mut self, pose: Pose) -> KinematicId {
        self.kinematic.push(KinematicFrame { pose, next: pose });
        KinematicId::new(self.kinematic.len() - 1)
    }

    /// Sets the pose of a kinematic frame after the next step. The frame moves there at constant velocity.
    pub fn move_kinematic(&mut self, id: KinematicId, next: Pose) {
        self.kinematic[id.index()].next = next;
    }

    /// Places a kinematic frame at `pose` without moving it there. Wakes all bodies.
    pub fn place_kinematic(&mut self, id: KinematicId, pose: Pose) {
        self.wake_all();
        self.kinematic[id.index()] = KinematicFrame { pose, next: pose };
    }

    /// Adds a collider to its parent, and returns its identity.
    ///
    /// # Panics
    /// The collider's parent is a soft body, whose surface is that of its mesh, or is not in this world.
    pub fn add_collider(&mut self, collider: Collider) -> ColliderId {
        let can_carry = self.has_solid(collider.parent);
        assert!(can_carry, "collider {}: {:?} cannot carry it", collider.name, collider.parent);
        self.wake_all();
        self.layers.push(collider.layer.clone().map(LayerState::new));
        self.colliders.push(collider);
        ColliderId::new(self.colliders.len() - 1)
    }

    /// True if a body is in this world and not soft.
    pub(super) fn has_solid(&self, body: BodyId) -> bool {
        match body {
            BodyId::World => true,
            BodyId::Kinematic(id) => id.index() < self.kinematic.len(),
            BodyId::Rigid(id) => id.index() < self.rigid.len(),
            BodyId::Link(id) => {
                let articulation = self.articulations.get(id.articulation.index());
                articulation.is_some_and(|articulation| id.index < articulation.tree.dofs())
            }
            BodyId::Soft(_) => false,
        }
    }

    /// Adds a nearly rigid collider of `shape` at `pose_in_parent` on `parent`.
    ///
    /// # Panics
    /// As [`World::add_collider`].
    pub fn add_shape(
        &mut self,
        name: &str,
        parent: impl Into<BodyId>,
        pose_in_parent: Pose,
        shape: &Shape,
        friction: Friction,
    ) -> ColliderId {
        let (surface, stiffness) = (Arc::new(shape.clone()), self.rigid_surface_stiffness());
        self.add_collider(Collider::new(name, parent, pose_in_parent, surface, friction, stiffness))
    }

    /// Contact stiffness of nearly rigid surfaces, from [`PhysicsParams::rigid_modulus`](super::super::PhysicsParams).
    pub fn rigid_surface_stiffness(&self) -> SurfaceStiffness {
        SurfaceStiffness {
            normal: self.params.rigid_modulus,
            shear: self.params.shear_ratio * self.params.rigid_modulus,
        }
    }
}
