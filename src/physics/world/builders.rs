//! Bodies with their shapes, for [`World::insert`]. All but shape and material have defaults.

use std::sync::Arc;

use super::World;
use crate::{
    contact::{ContactSurface, Friction},
    fem::{ElasticMaterial, FemModel},
    ids::{ColliderId, KinematicId, RigidId, SoftId},
    rigid::{RigidError, RigidState},
};
use softvt_geometry::{
    Pose, Vec3, mass::mass_properties, samples::SampleSpec, shape::Shape, voxel::VoxelMeshError,
};

/// A description of a body that [`World::insert`] takes.
pub trait BodyBuilder {
    /// Identifier of the inserted body, or why it cannot be made.
    type Output;

    /// Adds it to a world.
    fn insert(self, world: &mut World) -> Self::Output;
}

/// Name, shape, place and friction of a body.
#[derive(Clone, Debug)]
struct Placed {
    name: String,
    shape: Shape,
    pose: Pose,
    friction: Friction,
}

/// A solid that never moves.
#[derive(Clone, Debug)]
pub struct FixedBuilder(Placed);

/// A solid that [`World::move_kinematic`] moves.
#[derive(Clone, Debug)]
pub struct KinematicBuilder(Placed);

/// A free rigid body.
#[derive(Clone, Debug)]
pub struct RigidBodyBuilder {
    placed: Placed,
    density: f64,
}

/// A finite-element soft body. A shape of several pieces is one body whose pieces move apart.
#[derive(Clone, Debug)]
pub struct SoftBodyBuilder {
    placed: Placed,
    material: ElasticMaterial,
    resolution: usize,
    spacing: SampleSpec,
}

/// Methods that all builders have.
macro_rules! placed {
    ($($builder:ident, $($field:tt).+;)*) => {
        $(impl $builder {
            /// Name in messages; by default the kind of body.
            pub fn named(mut self, name: &str) -> Self {
                self.$($field).+.name = name.to_owned();
                self
            }

            /// Position of its frame, m, world.
            pub fn at(mut self, x: f64, y: f64, z: f64) -> Self {
                self.$($field).+.pose.translation = Vec3::new(x, y, z).into();
                self
            }

            /// Pose of its frame, world.
            pub fn pose(mut self, pose: Pose) -> Self {
                self.$($field).+.pose = pose;
                self
            }

            /// Friction of its surface.
            pub fn friction(mut self, friction: Friction) -> Self {
                self.$($field).+.friction = friction;
                self
            }
        })*
    };
}

placed! {
    FixedBuilder, 0;
    KinematicBuilder, 0;
    RigidBodyBuilder, placed;
    SoftBodyBuilder, placed;
}

impl Placed {
    fn new(name: &str, shape: Shape) -> Self {
        Self { name: name.to_owned(), shape, pose: Pose::identity(), friction: Friction::default() }
    }
}

impl FixedBuilder {
    /// A solid of this shape.
    pub fn new(shape: Shape) -> Self {
        Self(Placed::new("fixed", shape))
    }

    /// A plate of 2 × 2 m whose top is at height 0.
    pub fn ground() -> Self {
        Self::new(Shape::cuboid(Vec3::new(2.0, 2.0, 0.1))).named("ground").at(0.0, 0.0, -0.05)
    }
}

impl KinematicBuilder {
    /// A solid of this shape.
    pub fn new(shape: Shape) -> Self {
        Self(Placed::new("kinematic", shape))
    }
}

impl RigidBodyBuilder {
    /// A body of this shape and density, kg/m³.
    pub fn new(shape: Shape, density: f64) -> Self {
        Self { placed: Placed::new("rigid body", shape), density }
    }
}

impl SoftBodyBuilder {
    /// A body of this shape and material, with 6 voxels along its longest edge.
    pub fn new(shape: Shape, material: ElasticMaterial) -> Self {
        let placed = Placed::new("soft body", shape);
        Self { placed, material, resolution: 6, spacing: SampleSpec::default() }
    }

    /// Number of voxels along the longest edge.
    pub fn resolution(self, resolution: usize) -> Self {
        Self { resolution, ..self }
    }

    /// Spacing of its contact samples.
    pub fn sample_spacing(self, spacing: SampleSpec) -> Self {
        Self { spacing, ..self }
    }
}

impl BodyBuilder for FixedBuilder {
    type Output = ColliderId;

    fn insert(self, world: &mut World) -> ColliderId {
        let Placed { name, shape, pose, friction } = self.0;
        world.add_shape(&name, crate::BodyId::World, pose, &shape, friction)
    }
}

impl BodyBuilder for KinematicBuilder {
    type Output = KinematicId;

    fn insert(self, world: &mut World) -> KinematicId {
        let Placed { name, shape, pose, friction } = self.0;
        let id = world.add_kinematic(pose);
        world.add_shape(&name, id, Pose::identity(), &shape, friction);
        id
    }
}

impl BodyBuilder for RigidBodyBuilder {
    type Output = Result<RigidId, RigidError>;

    fn insert(self, world: &mut World) -> Self::Output {
        let Placed { name, shape, pose, friction } = self.placed;
        let mass = mass_properties(&shape, self.density);
        let id = world.add_rigid(&name, RigidState::new(&pose, mass.com, mass.mass, mass.inertia)?);
        world.add_shape(&name, id, Pose::identity(), &shape, friction);
        Ok(id)
    }
}

impl BodyBuilder for SoftBodyBuilder {
    type Output = Result<SoftId, VoxelMeshError>;

    fn insert(self, world: &mut World) -> Self::Output {
        let Placed { name, shape, pose, friction } = self.placed;
        let volume = mass_properties(&shape, 1.0).mass;
        let model = FemModel::from_shape(&shape, volume, self.material, self.resolution, &self.spacing)?;
        let surface: Arc<dyn ContactSurface> = Arc::new(shape);
        Ok(world.add_soft(&name, model, Some(surface), &pose, friction))
    }
}
