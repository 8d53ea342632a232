//! Putting things into a world.

use std::sync::Arc;

use super::{Articulation, Bristle, Drive, Kinematic, Rigid, Soft, World};
use crate::{
    geometry::{Pose, Vec3},
    physics::{
        contact::{Collider, ColliderId, Friction, Layer, Memory, Surface},
        fem::{SoftBody, body::Rest, system::System},
        joints::{self, Tree, TreeState},
        params::Params,
        rigid::RigidBody,
    },
};

impl World {
    /// An empty world.
    pub fn new(params: Params, gravity: Vec3) -> Self {
        Self { params, gravity, ..Self::default() }
    }

    /// Adds a soft body at rest at `pose`; its index. Other soft bodies feel `surface` (object frame), if it has one.
    pub fn add_soft(
        &mut self,
        name: &str,
        rest: Arc<Rest>,
        surface: Option<Arc<dyn Surface>>,
        pose: &Pose,
        friction: Friction,
    ) -> usize {
        let modulus = rest.contact_modulus();
        let mut body = SoftBody::new(rest.clone(), pose);
        body.update_elastic();
        self.soft.push(Soft {
            name: name.to_owned(),
            min_det_f: body.min_det_f(),
            body,
            friction,
            layer: Layer { normal: modulus, shear: self.params.shear_ratio * modulus },
            surface,
            asleep: false,
            touches: Vec::new(),
            system: System::new(&rest),
            memory: Memory::new(rest.samples.len()),
            steps: 0,
            slow_for: 0.0,
            inverted_for: 0.0,
        });
        self.soft.len() - 1
    }

    /// Adds a free rigid body; its index.
    pub fn add_rigid(&mut self, name: &str, body: RigidBody) -> usize {
        self.rigid.push(Rigid {
            name: name.to_owned(),
            body,
            asleep: false,
            touches: Vec::new(),
            slow_for: 0.0,
        });
        self.rigid.len() - 1
    }

    /// Adds a joint tree at coordinates `q`; its index.
    pub fn add_tree(
        &mut self,
        name: &str,
        tree: Tree,
        q: &[f64],
        drives: Vec<Option<Drive>>,
        gravity: bool,
    ) -> usize {
        let poses = joints::forward(&tree, q);
        self.trees.push(Articulation {
            name: name.to_owned(),
            state: TreeState::at_rest(q),
            tree,
            drives,
            gravity,
            asleep: false,
            slow_for: 0.0,
            bristles: q.iter().map(|&from| Bristle { from, stiffness: 0.0 }).collect(),
            poses,
            scratch: joints::Scratch::default(),
        });
        self.trees.len() - 1
    }

    /// Adds a frame whose motion will be prescribed; its index.
    pub fn add_kinematic(&mut self, pose: Pose) -> usize {
        self.kinematic.push(Kinematic { pose, next: pose });
        self.kinematic.len() - 1
    }

    /// Adds a collider; its id.
    pub fn add_collider(&mut self, collider: Collider) -> ColliderId {
        self.colliders.push(collider);
        self.colliders.len() - 1
    }

    /// The layer of a collider without a soft surface.
    pub fn rigid_layer(&self) -> Layer {
        Layer {
            normal: self.params.rigid_modulus,
            shear: self.params.shear_ratio * self.params.rigid_modulus,
        }
    }

    /// Says where a prescribed frame will be after the next step.
    pub fn move_kinematic(&mut self, index: usize, next: Pose) {
        self.kinematic[index].next = next;
    }
}
