//! Data derived from assets, computed once and shared by all episodes.

use std::{convert::Infallible, sync::Arc};

use serde::{Serialize, de::DeserializeOwned};

use super::{build_error::SceneBuildError, shared_cache::SharedCache, soft_model::SoftGeometry};
use softvt_common::disk_cache::DiskCache;
use softvt_geometry::{
    Aabb, Pose, Vec3,
    cavity::cavity,
    mass::{MassProperties, approximate_mass_properties, mass_properties},
    pieces::SeparatePieces,
    shape::Shape,
    voxel::VoxelSpec,
};
use softvt_physics::{
    BodyId, World,
    contact::{Collider, CollisionGeometry, Friction, SurfaceFeatures},
    fem::FemModel,
};
use softvt_scene::{Asset, Body, Object, SoftMaterial};

/// Finite-element models of assets, and expensive queries of their shapes: bounds, mass,
/// wall thickness, contact samples.
#[derive(Clone, Debug, Default)]
pub struct AssetCache {
    models: SharedCache<Arc<Asset>, Arc<FemModel>>,
    /// By the asset as it was declared.
    geometries: SharedCache<Arc<Asset>, Arc<SoftGeometry>>,
    bounds: SharedCache<Shape, Aabb>,
    masses: SharedCache<Shape, MassProperties>,
    solids: SharedCache<Shape, Arc<CollisionGeometry>>,
    walls: SharedCache<Shape, Option<f64>>,
    thicknesses: SharedCache<(Shape, ThicknessProbe), Option<f64>>,
    cavities: SharedCache<Shape, Option<Aabb>>,
    pieces: SharedCache<Shape, Option<SeparatePieces>>,
    disk: DiskCache,
    /// True to compute masses and contact samples approximately.
    approximate: bool,
}

/// Voxels along the longest edge by which the pieces of a rigid body are counted.
const PIECES_RESOLUTION: usize = 24;

/// The cached value of a shape.
fn of_shape<V: Clone>(cache: &SharedCache<Shape, V>, shape: &Shape, compute: impl FnOnce() -> V) -> V {
    let Ok(value) = cache.get(shape, |known| known == shape, || Ok::<_, Infallible>(compute()));
    value
}

/// The stored value of this kind for a shape.
fn stored<V: Serialize + DeserializeOwned>(
    disk: &DiskCache,
    kind: &'static str,
    shape: &Shape,
    compute: impl FnOnce() -> V,
) -> V {
    let Ok(value) = disk.get(kind, shape, || Ok::<_, Infallible>(compute()));
    value
}

impl AssetCache {
    /// An empty cache that keeps what takes long in `disk`; by default in the cache of the process.
    pub fn stored_in(disk: DiskCache) -> Self {
        Self { disk, ..Self::default() }
    }

    /// A cache for scenes that are checked, and at most settle: expensive values are approximate.
    pub fn approximate() -> Self {
        Self { approximate: true, ..Self::default() }
    }

    /// Bounds of a shape.
    pub(super) fn bounds(&self, shape: &Shape) -> Aabb {
        of_shape(&self.bounds, shape, || stored(&self.disk, "bounds", shape, || shape.bounds()))
    }

    /// Mass properties of a shape at a uniform density, kg/m³.
    pub(super) fn mass(&self, shape: &Shape, density: f64) -> MassProperties {
        let unit = of_shape(&self.masses, shape, || match self.approximate {
            true => stored(&self.disk, "rough-mass", shape, || approximate_mass_properties(shape, 1.0)),
            false => stored(&self.disk, "mass", shape, || mass_properties(shape, 1.0)),
        });
        MassProperties { mass: unit.mass * density, com: unit.com, inertia: unit.inertia * density }
    }

    /// Typical thickness of the thin walls of a shape, m; see [`thin_wall`].
    pub(super) fn wall(&self, shape: &Shape) -> Option<f64> {
        of_shape(&self.walls, shape, || stored(&self.disk, "wall", shape, || thin_wall(shape)))
    }

    /// Typical thickness of the thin parts of a shape that a probe finds, m; `None` if it has few.
    pub(super) fn thickness(&self, shape: &Shape, probe: ThicknessProbe) -> Option<f64> {
        let compute = || Ok::<_, Infallible>(thin_parts(shape, probe));
        let Ok(thickness) = self.thicknesses.get(
            &(shape.clone(), probe),
            |(known, of)| *of == probe && known == shape,
            || self.disk.get("thickness", &(shape, probe), compute),
        );
        thickness
    }

    /// Box around the cavity of a shape, object frame; see [`cavity`].
    pub(super) fn cavity(&self, shape: &Shape) -> Option<Aabb> {
        of_shape(&self.cavities, shape, || stored(&self.disk, "cavity", shape, || cavity(shape)))
    }

    /// Separate pieces of a shape; gaps below a voxel are not seen.
    pub(super) fn pieces(&self, shape: &Shape) -> Option<SeparatePieces> {
        let find = || SeparatePieces::of_shape(shape, &VoxelSpec { resolution: PIECES_RESOLUTION });
        of_shape(&self.pieces, shape, || stored(&self.disk, "pieces", shape, find))
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
            collision_geometry: Some(of_shape(&self.solids, shape, || {
                Arc::new(self.collision_geometry(shape))
            })),
        }
    }

    fn collision_geometry(&self, shape: &Shape) -> CollisionGeometry {
        let (disk, own) = (self.disk.clone(), shape.clone());
        CollisionGeometry::with_features(shape, move || {
            stored(&disk, "features", &own, || SurfaceFeatures::of(&own))
        })
    }

    /// Finite-element model of a soft object with this material. Instances of one asset share its discretisation.
    pub(super) fn model(
        &self,
        object: &Object,
        material: &SoftMaterial,
    ) -> Result<Arc<FemModel>, SceneBuildError> {
        let Object { asset, nominal, .. } = object;
        let declared = match &nominal.body {
            Body::Soft(declared) => declared,
            _ => material,
        };
        let build = || {
            let geometry = self.geometries.get(
                nominal,
                |known| known.shape == nominal.shape && has_discretisation(known, declared),
                || {
                    SoftGeometry::stored(&asset.name, &nominal.shape, declared, self.approximate, &self.disk)
                        .map(Arc::new)
                },
            )?;
            Ok(geometry.model(material, object.scale))
        };
        self.models.get(asset, |known| known.shape == asset.shape && known.body == asset.body, build)
    }
}

/// True if an asset is a soft body with the resolution and the contact samples of `material`.
fn has_discretisation(asset: &Asset, material: &SoftMaterial) -> bool {
    matches!(&asset.body, Body::Soft(SoftMaterial { resolution, grasp_spacing, .. })
        if *resolution == material.resolution && *grasp_spacing == material.grasp_spacing)
}

/// Minimum thickness of the walls of moving parts, m. Other bodies can pass through thinner ones between two steps.
pub(super) const MIN_PART_WALL: f64 = 4e-3;
/// Step of the search for the far side of a wall, m.
const WALL_STEP: f64 = 2e-4;
/// Share of the surface below which thin walls are ignored: rims and edges.
const THIN_SHARE: f64 = 0.1;
/// Rays along each edge of a side of the bounds, cast in search of walls.
const RAYS: usize = 12;

/// Typical thickness of the walls of a shape that are thinner than [`MIN_PART_WALL`], m. `None` if at most a tenth of
/// the surface has such walls.
fn thin_wall(shape: &Shape) -> Option<f64> {
    let steps = (MIN_PART_WALL / WALL_STEP).round() as usize;
    thin_parts(shape, ThicknessProbe { step: WALL_STEP, steps, share: THIN_SHARE })
}

/// A search for thin parts of a shape: those thinner than `steps` steps of `step` (m) below its surface.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(super) struct ThicknessProbe {
    pub(super) step: f64,
    pub(super) steps: usize,
    /// Share of the surface up to which thin parts do not count.
    pub(super) share: f64,
}

/// Typical thickness of the thin parts of a shape, m. `None` if it has few.
fn thin_parts(shape: &Shape, ThicknessProbe { step, steps, share }: ThicknessProbe) -> Option<f64> {
    let hits = outer_points(shape);
    let under = |p: &Vec3| {
        let normal = shape.distance_and_normal(p).1;
        let mut depths = (1..steps).map(|index| step * index as f64);
        depths.find(|depth| shape.distance(&(p - normal * *depth)) > 0.0)
    };
    let mut thin: Vec<f64> = hits.iter().filter_map(under).collect();
    if thin.len() as f64 <= share * hits.len() as f64 {
        return None;
    }
    thin.sort_by(f64::total_cmp);
    Some(thin[thin.len() / 2])
}

/// First intersections of the surface with parallel rays along the six axis directions. Rays find walls of any
/// thickness, unlike a grid of samples.
fn outer_points(shape: &Shape) -> Vec<Vec3> {
    let bounds = shape.bounds();
    let size = bounds.size();
    let mut hits = Vec::new();
    for (axis, far) in (0..3).flat_map(|axis| [(axis, false), (axis, true)]) {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let mut direction = Vec3::zeros();
        direction[axis] = if far { -1.0 } else { 1.0 };
        for cell in 0..RAYS * RAYS {
            let share = |index: usize| (index as f64 + 0.5) / RAYS as f64;
            let mut start = if far { bounds.max } else { bounds.min };
            start[u] = bounds.min[u] + size[u] * share(cell % RAYS);
            start[v] = bounds.min[v] + size[v] * share(cell / RAYS);
            start -= direction * MIN_PART_WALL;
            let hit = shape.ray(&start, &direction, size[axis] + 2.0 * MIN_PART_WALL);
            hits.extend(hit.map(|length| start + direction * length));
        }
    }
    hits
}
