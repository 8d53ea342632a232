//! What follows from assets alone, made once and shared by all episodes.

use std::{convert::Infallible, sync::Arc};

use super::{
    articulated,
    build::{BuildError, check_soft, meshed, soft_rest},
    shared_cache::SharedCache,
};
use crate::{
    geometry::{
        Aabb, Pose,
        mass::{MassProperties, approximate_mass_properties, mass_properties},
        shape::Shape,
    },
    physics::{
        BodyId, World,
        contact::{Collider, CollisionGeometry, Friction},
        fem::FemModel,
    },
    scene::{Asset, SoftMaterial},
};

/// Finite-element models of assets, and what takes a search over their shapes: bounds, masses, walls, where their skin can touch.
#[derive(Clone, Debug, Default)]
pub struct AssetCache {
    rests: SharedCache<Arc<Asset>, Arc<FemModel>>,
    bounds: SharedCache<Shape, Aabb>,
    masses: SharedCache<Shape, MassProperties>,
    solids: SharedCache<Shape, Arc<CollisionGeometry>>,
    walls: SharedCache<Shape, Option<f64>>,
    /// Whether masses and contact samples need only be about right.
    rough: bool,
}

/// Contact samples of a rough body are this many times farther apart.
const ROUGH_SPACING: f64 = 4.0;

/// The value of a shape; making it cannot fail.
fn of_shape<V: Clone>(made: &SharedCache<Shape, V>, shape: &Shape, make: impl FnOnce() -> V) -> V {
    let value: Result<_, Infallible> = made.get(shape, |known| known == shape, || Ok(make()));
    value.unwrap_or_else(|never| match never {})
}

fn rough_rest(name: &str, shape: &Shape, material: &SoftMaterial) -> Result<Arc<FemModel>, BuildError> {
    check_soft(name, shape, material)?;
    let rough = SoftMaterial { grasp_spacing: ROUGH_SPACING * material.grasp_spacing, ..material.clone() };
    meshed(name, shape, &rough, approximate_mass_properties(shape, 1.0).mass)
}

impl AssetCache {
    /// For scenes that are looked at before anything moves, and never run: what takes long is made roughly.
    pub fn rough() -> Self {
        Self { rough: true, ..Self::default() }
    }

    /// Bounds of a shape; finding those of a displaced one takes a search.
    pub(super) fn bounds(&self, shape: &Shape) -> Aabb {
        of_shape(&self.bounds, shape, || shape.bounds())
    }

    /// Mass properties of a shape at a uniform density, kg/m³.
    pub(super) fn mass(&self, shape: &Shape, density: f64) -> MassProperties {
        let make = if self.rough { approximate_mass_properties } else { mass_properties };
        let unit = of_shape(&self.masses, shape, || make(shape, 1.0));
        MassProperties { mass: unit.mass * density, com: unit.com, inertia: unit.inertia * density }
    }

    /// Thickness of walls that are thinner than a moving part's may be, m, if there are such.
    pub(super) fn wall(&self, shape: &Shape) -> Option<f64> {
        of_shape(&self.walls, shape, || articulated::thin_wall(shape))
    }

    /// A collider of a hard shape at `pose_in_parent` on `parent`.
    pub(super) fn collider(
        &self,
        world: &World,
        name: &str,
        parent: BodyId,
        pose_in_parent: Pose,
        shape: &Shape,
        friction: Friction,
    ) -> Collider {
        Collider {
            name: name.to_owned(),
            parent,
            pose_in_parent,
            surface: Arc::new(shape.clone()),
            friction,
            stiffness: world.rigid_surface_stiffness(),
            bounds: self.bounds(shape),
            base_of: None,
            solid: Some(of_shape(&self.solids, shape, || Arc::new(CollisionGeometry::new(shape)))),
        }
    }

    /// FemModel data of a soft asset.
    pub(super) fn rest(
        &self,
        asset: &Arc<Asset>,
        material: &SoftMaterial,
    ) -> Result<Arc<FemModel>, BuildError> {
        self.rests.get(
            asset,
            |known| known.shape == asset.shape && known.body == asset.body,
            || match self.rough {
                true => rough_rest(&asset.name, &asset.shape, material),
                false => soft_rest(&asset.name, &asset.shape, material),
            },
        )
    }
}
