//! From a scene to a world: what each object becomes.

use std::{convert::Infallible, sync::Arc};

use super::{
    made::Made,
    simulation::{Handle, Kind},
};
use crate::{
    geometry::{
        mass::mass_properties,
        samples::{SampleSpec, surface_samples},
        shape::{Aabb, Shape},
        voxelise::{GeometryError, VoxelSpec, voxel_mesh},
    },
    message::number,
    physics::{
        World,
        contact::{Collider, Friction, Mover, Surface},
        fem::{Material, Rest},
        rigid::{RigidBody, RigidError},
    },
    scene::{Asset, Body, Object, SoftMaterial},
};

/// An object cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum BuildError {
    /// Its shape cannot be meshed.
    #[error("asset {asset}: {source}")]
    Geometry {
        /// Asset name.
        asset: String,
        /// What is wrong.
        source: GeometryError,
    },
    /// Its mass properties are impossible.
    #[error("asset {asset}: {source}")]
    Rigid {
        /// Asset name.
        asset: String,
        /// What is wrong.
        source: RigidError,
    },
    /// A number of its material is out of range.
    #[error("asset {asset}: {what}")]
    Material {
        /// Asset name.
        asset: String,
        /// What is wrong and what was expected.
        what: String,
    },
    /// Two objects have one name.
    #[error("the scene has two objects named {0}; names must be unique")]
    TwoNames(String),
}

/// Rest data and bounds of assets, made once and shared by all episodes.
#[derive(Clone, Debug, Default)]
pub struct RestCache {
    rests: Made<Arc<Asset>, Arc<Rest>>,
    bounds: Made<Shape, Aabb>,
}

impl RestCache {
    /// Bounds of a shape; finding those of a displaced one takes a search.
    fn bounds(&self, shape: &Shape) -> Aabb {
        let made: Result<_, Infallible> =
            self.bounds.get(shape, |known| known == shape, || Ok(shape.bounds()));
        made.unwrap_or_else(|never| match never {})
    }

    /// Rest data of a soft asset.
    fn rest(&self, asset: &Arc<Asset>, material: &SoftMaterial) -> Result<Arc<Rest>, BuildError> {
        self.rests.get(
            asset,
            |known| known.shape == asset.shape && known.body == asset.body,
            || soft_rest(&asset.name, &asset.shape, material),
        )
    }
}

/// Rest data of a soft body of `shape`.
///
/// # Errors
/// A shape that cannot be meshed, or a material number out of range; `name` is what messages call it.
pub fn soft_rest(name: &str, shape: &Shape, material: &SoftMaterial) -> Result<Arc<Rest>, BuildError> {
    check(name, material)?;
    check_size(name, shape, material)?;
    let spec = VoxelSpec { resolution: material.resolution };
    let mesh =
        voxel_mesh(shape, &spec).map_err(|source| BuildError::Geometry { asset: name.to_owned(), source })?;
    let spacing = SampleSpec { grasp_spacing: material.grasp_spacing, ..SampleSpec::default() };
    let samples = surface_samples(shape, &mesh, &spacing);
    let volume = mass_properties(shape, 1.0).mass;
    let law =
        Material { youngs_pa: material.youngs_pa, poisson: material.poisson, density: material.density };
    Ok(Rest::new(mesh, law, volume, samples))
}

fn check(name: &str, m: &SoftMaterial) -> Result<(), BuildError> {
    let wrong = |what: String| Err(BuildError::Material { asset: name.to_owned(), what });
    if !(m.youngs_pa > 0.0 && m.youngs_pa.is_finite()) {
        return wrong(format!("Young's modulus is {} Pa, expected a positive number", number(m.youngs_pa)));
    }
    if !(0.0..0.5).contains(&m.poisson) {
        return wrong(format!("Poisson's ratio is {}, expected 0 <= poisson < 0.5", number(m.poisson)));
    }
    if !(m.density > 0.0 && m.density.is_finite()) {
        return wrong(format!("density is {} kg/m³, expected a positive number", number(m.density)));
    }
    Ok(())
}

/// Contact samples of one body: more would take minutes to find, and is nearly always a size in millimetres.
const MOST_SAMPLES: f64 = 1e6;

fn check_size(name: &str, shape: &Shape, material: &SoftMaterial) -> Result<(), BuildError> {
    let size = shape.bounds().size();
    let samples =
        2.0 * (size.x * size.y + size.y * size.z + size.z * size.x) / material.grasp_spacing.powi(2);
    if samples <= MOST_SAMPLES {
        return Ok(());
    }
    let what = format!(
        "it is {} × {} × {} m, about {samples:.0e} contact samples {} mm apart, expected at most {MOST_SAMPLES:.0e}; \
         sizes are in metres; a truly large body needs a larger grasp_spacing",
        number(size.x),
        number(size.y),
        number(size.z),
        1e3 * material.grasp_spacing
    );
    Err(BuildError::Material { asset: name.to_owned(), what })
}

/// Puts `object` into `world`.
pub(super) fn add(world: &mut World, object: &Object, cache: &RestCache) -> Result<Handle, BuildError> {
    let asset = &object.asset;
    let friction = Friction { static_mu: asset.friction.static_mu, dynamic_mu: asset.friction.dynamic_mu };
    let collider = |world: &mut World, mover, pose| {
        let layer = world.rigid_layer();
        world.add_collider(Collider::new(
            &object.name,
            (mover, pose),
            Arc::new(asset.shape.clone()),
            friction,
            layer,
        ))
    };
    let (kind, colliders) = match &asset.body {
        Body::Soft(material) => {
            let rest = cache.rest(asset, material)?;
            let surface: Arc<dyn Surface> = Arc::new(asset.shape.clone());
            let index = world.add_soft(&object.name, rest, Some(surface), &object.pose_w, friction);
            (Kind::Soft(index), Vec::new())
        }
        Body::Rigid { density } => {
            let m = mass_properties(&asset.shape, *density);
            let body = RigidBody::new(&object.pose_w, m.com, m.mass, m.inertia)
                .map_err(|source| BuildError::Rigid { asset: asset.name.clone(), source })?;
            let index = world.add_rigid(&object.name, body);
            let id = collider(world, Mover::Rigid(index), crate::geometry::Pose::identity());
            (Kind::Rigid(index), vec![id])
        }
        Body::Static => (Kind::Static, vec![collider(world, Mover::Static, object.pose_w)]),
        Body::Scenery => (Kind::Static, Vec::new()),
    };
    let bounds = cache.bounds(&asset.shape);
    Ok(Handle {
        name: object.name.clone(),
        asset: asset.clone(),
        kind,
        start_w: object.pose_w,
        colliders,
        bounds,
    })
}
