//! Adding objects to a world.

use std::sync::Arc;

use super::{
    Articulation, JointDrive, KinematicFrame, RigidBody, SoftBody, World,
    state::{JointFriction, SleepState},
};
use crate::{
    geometry::{
        Pose,
        mass::mass_properties,
        samples::{SampleSpec, surface_samples},
        shape::Shape,
        voxel::{VoxelMeshError, VoxelSpec, voxel_mesh},
    },
    physics::{
        contact::{Collider, ContactHistory, ContactSurface, Friction, SurfaceStiffness},
        fem::{ElasticMaterial, FemModel, FemState, system::VelocitySystem},
        ids::{ArticulationId, BodyId, ColliderId, KinematicId, RigidId, SoftId},
        joints::{self, JointState, JointTree},
        rigid::{RigidError, RigidState},
    },
};

impl World {
    /// Adds a soft body in its rest configuration at `pose`. See [`SoftBodyBuilder`] for the way from a shape.
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
        state.update_elastic();
        self.soft.push(SoftBody {
            name: name.to_owned(),
            min_det_f: state.min_det_f(),
            state,
            friction,
            stiffness: SurfaceStiffness { normal: modulus, shear: self.params.shear_ratio * modulus },
            surface,
            sleep: SleepState::default(),
            contacts: Vec::new(),
            system: VelocitySystem::new(&model),
            history: ContactHistory::new(model.samples.len()),
            steps_awake: 0,
            inverted_time: 0.0,
        });
        SoftId::new(self.soft.len() - 1)
    }

    /// Adds a free rigid body without colliders. See [`RigidBodyBuilder`] for the way from a shape.
    pub fn add_rigid(&mut self, name: &str, state: RigidState) -> RigidId {
        self.rigid.push(RigidBody {
            name: name.to_owned(),
            state,
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
            drives,
            has_gravity,
            sleep: SleepState::default(),
            friction: q.iter().map(|&anchor| JointFriction { anchor, stiffness: 0.0 }).collect(),
            poses,
            scratch: joints::Scratch::default(),
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

    /// Places a kinematic frame at `pose` without moving it there.
    pub fn place_kinematic(&mut self, id: KinematicId, pose: Pose) {
        self.kinematic[id.index()] = KinematicFrame { pose, next: pose };
    }

    /// Adds a collider.
    ///
    /// # Panics
    /// The collider's parent is a soft body, whose surface is that of its mesh, or is not in this world.
    pub fn add_collider(&mut self, collider: Collider) -> ColliderId {
        let is_here = match collider.parent {
            BodyId::World => true,
            BodyId::Kinematic(id) => id.index() < self.kinematic.len(),
            BodyId::Rigid(id) => id.index() < self.rigid.len(),
            BodyId::Link(id) => {
                let articulation = self.articulations.get(id.articulation.index());
                articulation.is_some_and(|articulation| id.index < articulation.tree.dofs())
            }
            BodyId::Soft(_) => false,
        };
        assert!(is_here, "collider {}: {:?} cannot carry it", collider.name, collider.parent);
        self.colliders.push(collider);
        ColliderId::new(self.colliders.len() - 1)
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

/// Why a body cannot be made from a shape.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum BodyError {
    #[error("{name}: {source}")]
    Geometry { name: String, source: VoxelMeshError },
    #[error("{name}: {source}")]
    Rigid { name: String, source: RigidError },
}

/// A soft body made from a shape: voxel mesh, contact samples, finite-element model.
///
/// Defaults: resolution 6 (voxels along the longest edge), benchmark friction, sample spacing of
/// [`SampleSpec::default`], at the origin.
#[derive(Clone, Debug)]
pub struct SoftBodyBuilder {
    name: String,
    shape: Shape,
    material: ElasticMaterial,
    resolution: usize,
    samples: SampleSpec,
    friction: Friction,
    pose: Pose,
}

impl SoftBodyBuilder {
    /// A body of `shape` (object frame) and `material`; `name` is used in messages.
    pub fn new(name: &str, shape: &Shape, material: ElasticMaterial) -> Self {
        Self {
            name: name.to_owned(),
            shape: shape.clone(),
            material,
            resolution: 6,
            samples: SampleSpec::default(),
            friction: Friction::default(),
            pose: Pose::identity(),
        }
    }

    /// Sets the number of voxels along the longest edge of the bounding box.
    #[must_use]
    pub fn resolution(mut self, resolution: usize) -> Self {
        self.resolution = resolution;
        self
    }

    /// Sets the spacing of the contact samples.
    #[must_use]
    pub fn samples(mut self, samples: SampleSpec) -> Self {
        self.samples = samples;
        self
    }

    /// Sets the friction of the surface.
    #[must_use]
    pub fn friction(mut self, friction: Friction) -> Self {
        self.friction = friction;
        self
    }

    /// Sets the initial pose of the object frame in the world.
    #[must_use]
    pub fn pose(mut self, pose: Pose) -> Self {
        self.pose = pose;
        self
    }

    /// The finite-element model alone, to be shared by several bodies.
    ///
    /// # Errors
    /// The shape has no voxel mesh.
    pub fn model(&self) -> Result<Arc<FemModel>, BodyError> {
        let mesh = voxel_mesh(&self.shape, &VoxelSpec { resolution: self.resolution })
            .map_err(|source| BodyError::Geometry { name: self.name.clone(), source })?;
        let samples = surface_samples(&self.shape, &mesh, &self.samples);
        Ok(FemModel::new(mesh, self.material, mass_properties(&self.shape, 1.0).mass, samples))
    }

    /// Adds the body to `world`.
    ///
    /// # Errors
    /// The shape has no voxel mesh.
    pub fn insert(self, world: &mut World) -> Result<SoftId, BodyError> {
        let model = self.model()?;
        Ok(world.add_soft(&self.name, model, Some(Arc::new(self.shape)), &self.pose, self.friction))
    }
}

/// A free rigid body made from a shape of uniform density, with one collider.
///
/// Defaults: benchmark friction, at the origin.
#[derive(Clone, Debug)]
pub struct RigidBodyBuilder {
    name: String,
    shape: Shape,
    density: f64,
    friction: Friction,
    pose: Pose,
}

impl RigidBodyBuilder {
    /// A body of `shape` (object frame) and `density` (kg/m³); `name` is used in messages.
    pub fn new(name: &str, shape: &Shape, density: f64) -> Self {
        Self {
            name: name.to_owned(),
            shape: shape.clone(),
            density,
            friction: Friction::default(),
            pose: Pose::identity(),
        }
    }

    /// Sets the friction of the surface.
    #[must_use]
    pub fn friction(mut self, friction: Friction) -> Self {
        self.friction = friction;
        self
    }

    /// Sets the initial pose of the object frame in the world.
    #[must_use]
    pub fn pose(mut self, pose: Pose) -> Self {
        self.pose = pose;
        self
    }

    /// Adds the body and its collider to `world`.
    ///
    /// # Errors
    /// Shape and density give no valid mass or inertia.
    pub fn insert(self, world: &mut World) -> Result<RigidId, BodyError> {
        let mass = mass_properties(&self.shape, self.density);
        let state = RigidState::new(&self.pose, mass.com, mass.mass, mass.inertia)
            .map_err(|source| BodyError::Rigid { name: self.name.clone(), source })?;
        let id = world.add_rigid(&self.name, state);
        world.add_shape(&self.name, id, Pose::identity(), &self.shape, self.friction);
        Ok(id)
    }
}
