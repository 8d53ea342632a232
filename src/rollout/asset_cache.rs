//! What is derived from shapes and assets: computed at its first use and shared by all episodes.

use std::{
    convert::Infallible,
    sync::{Arc, OnceLock},
};

use serde::{Serialize, de::DeserializeOwned};

use super::{
    build_error::SceneBuildError, sensors::SensingError, shared_cache::SharedCache, soft_model::SoftGeometry,
};
use softvt_common::disk_cache::DiskCache;
use softvt_geometry::{
    Aabb, Pose, Vec3,
    cavity::cavity,
    mass::{MassProperties, approximate_mass_properties, mass_properties},
    pieces::SeparatePieces,
    shape::{SampleContact, Shape},
    voxel::{VoxelMesh, VoxelSpec},
};
use softvt_physics::{
    BodyId, World,
    contact::{Collider, CollisionGeometry, ContactSurface, Friction, SurfaceFeatures},
    fem::FemModel,
};
use softvt_robot::tactile::TactileSpec;
use softvt_scene::{Asset, Body, Object, SoftMaterial};
use softvt_sensing::{
    camera::{CameraError, RenderMesh},
    panda::RobotMeshes,
    tactile::{TactileSensor, TactileSkin},
};

/// Voxels along the longest edge by which the pieces of a rigid body are counted.
const PIECES_RESOLUTION: usize = 24;

/// A shape with what is derived from it. Values that take long are kept on disk.
#[derive(Debug)]
pub(super) struct DerivedShape {
    pub(super) shape: Shape,
    disk: DiskCache,
    bounds: OnceLock<Aabb>,
    mass: OnceLock<MassProperties>,
    rough_mass: OnceLock<MassProperties>,
    wall: OnceLock<Option<f64>>,
    cavity: OnceLock<Option<Aabb>>,
    pieces: OnceLock<Option<SeparatePieces>>,
    solid: OnceLock<Arc<CollisionGeometry>>,
}

/// The stored value of this kind for a shape.
fn stored<V: Serialize + DeserializeOwned>(
    disk: &DiskCache,
    kind: &'static str,
    inputs: &impl Serialize,
    compute: impl FnOnce() -> V,
) -> V {
    let Ok(value) = disk.get(kind, inputs, || Ok::<_, Infallible>(compute()));
    value
}

impl DerivedShape {
    fn new(shape: &Shape, disk: &DiskCache) -> Self {
        Self {
            shape: shape.clone(),
            disk: disk.clone(),
            bounds: OnceLock::new(),
            mass: OnceLock::new(),
            rough_mass: OnceLock::new(),
            wall: OnceLock::new(),
            cavity: OnceLock::new(),
            pieces: OnceLock::new(),
            solid: OnceLock::new(),
        }
    }

    fn stored<V: Serialize + DeserializeOwned>(
        &self,
        kind: &'static str,
        compute: impl FnOnce(&Shape) -> V,
    ) -> V {
        stored(&self.disk, kind, &self.shape, || compute(&self.shape))
    }

    pub(super) fn bounds(&self) -> Aabb {
        let search = || self.stored("bounds", Shape::bounds);
        *self.bounds.get_or_init(|| self.shape.closed_bounds().unwrap_or_else(search))
    }

    /// Mass properties at a uniform density of 1 kg/m³.
    fn unit_mass(&self, approximate: bool) -> &MassProperties {
        match approximate {
            true => self
                .rough_mass
                .get_or_init(|| self.stored("rough-mass", |shape| approximate_mass_properties(shape, 1.0))),
            false => self.mass.get_or_init(|| self.stored("mass", |shape| mass_properties(shape, 1.0))),
        }
    }

    /// Typical thickness of its thin walls, m; see [`thin_wall`].
    pub(super) fn wall(&self) -> Option<f64> {
        *self.wall.get_or_init(|| self.stored("wall", thin_wall))
    }

    /// Typical thickness of the thin parts that a probe finds, m; `None` if it has few. Kept on disk alone.
    pub(super) fn thickness(&self, probe: ThicknessProbe) -> Option<f64> {
        stored(&self.disk, "thickness", &(&self.shape, probe), || thin_parts(&self.shape, probe))
    }

    /// Box around its cavity, object frame; see [`cavity`].
    pub(super) fn cavity(&self) -> Option<Aabb> {
        *self.cavity.get_or_init(|| self.stored("cavity", cavity))
    }

    /// Its separate pieces; gaps below a voxel are not seen.
    pub(super) fn pieces(&self) -> Option<SeparatePieces> {
        let find =
            |shape: &Shape| SeparatePieces::of_shape(shape, &VoxelSpec { resolution: PIECES_RESOLUTION });
        *self.pieces.get_or_init(|| self.stored("pieces", find))
    }

    /// Its geometry for contact with other hard bodies.
    fn solid(&self) -> Arc<CollisionGeometry> {
        let make = || {
            let (disk, shape) = (self.disk.clone(), self.shape.clone());
            let features = move || stored(&disk, "features", &shape, || SurfaceFeatures::of(&shape));
            Arc::new(CollisionGeometry::with_features(&self.shape, features))
        };
        self.solid.get_or_init(make).clone()
    }

    /// A collider of a hard body at `pose_in_parent` on `parent`.
    pub(super) fn collider(
        self: &Arc<Self>,
        world: &World,
        name: &str,
        parent: BodyId,
        pose_in_parent: Pose,
        friction: Friction,
    ) -> Collider {
        Collider {
            name: name.to_owned(),
            parent,
            pose_in_parent,
            surface: self.clone(),
            friction,
            stiffness: world.rigid_surface_stiffness(),
            layer: None,
            bounds: self.bounds(),
            base_of: None,
            collision_geometry: Some(self.solid()),
        }
    }
}

impl ContactSurface for DerivedShape {
    fn contact(&self, p: &Vec3, facing: &Vec3, spacing: f64) -> SampleContact {
        self.shape.contact(p, facing, spacing)
    }

    fn is_farther(&self, p: &Vec3, reach: f64) -> bool {
        self.shape.is_farther(p, reach)
    }

    fn bounds(&self) -> Aabb {
        Self::bounds(self)
    }

    fn collision_geometry(&self) -> Option<CollisionGeometry> {
        Some(CollisionGeometry::new(&self.shape))
    }
}

/// Everything that is derived from the shapes and assets of a script: geometry, finite-element models, meshes and
/// skins, with the models of robot and tactile sensors. A clone shares the values.
#[derive(Clone, Debug)]
pub struct AssetCache {
    entries: Arc<CacheEntries>,
    /// True to compute masses and contact samples approximately.
    approximate: bool,
}

#[derive(Debug)]
struct CacheEntries {
    disk: DiskCache,
    shapes: SharedCache<Shape, Arc<DerivedShape>>,
    /// By the asset as it was declared. True if approximate, here and below.
    geometries: SharedCache<(Arc<Asset>, bool), Arc<SoftGeometry>>,
    models: SharedCache<(Arc<Asset>, bool), Arc<FemModel>>,
    meshes: SharedCache<Arc<Asset>, Arc<RenderMesh>>,
    skins: SharedCache<Arc<Asset>, Arc<TactileSkin>>,
    sensors: SharedCache<TactileSpec, Arc<TactileSensor>>,
    robot: SharedCache<(), Arc<RobotMeshes>>,
}

/// Maximum number of entries. A suite has a few dozen assets, but a layout with random appearance adds new ones of
/// several megabytes in every episode.
const MAX_ENTRIES: usize = 64;
/// Maximum number of shapes, which scripts make many of on the way to those of their assets.
const MAX_SHAPES: usize = 256;
/// Maximum number of skins, of some 7 MB each: in suites whose objects vary, no episode needs those of another.
/// Episodes keep their own.
const MAX_SKINS: usize = 8;

/// A cache that keeps what takes long in the disk cache of the process.
impl Default for AssetCache {
    fn default() -> Self {
        Self::stored_in(DiskCache::default())
    }
}

impl AssetCache {
    /// An empty cache that keeps what takes long in `disk`.
    pub fn stored_in(disk: DiskCache) -> Self {
        let entries = CacheEntries {
            disk,
            shapes: SharedCache::new(MAX_SHAPES),
            geometries: SharedCache::new(MAX_ENTRIES),
            models: SharedCache::new(MAX_ENTRIES),
            meshes: SharedCache::new(MAX_ENTRIES),
            skins: SharedCache::new(MAX_SKINS),
            sensors: SharedCache::new(MAX_ENTRIES),
            robot: SharedCache::new(1),
        };
        Self { entries: Arc::new(entries), approximate: false }
    }

    /// The same values, with masses and contact samples that are approximate: for scenes that are checked,
    /// and at most settle.
    #[must_use]
    pub fn approximate(&self) -> Self {
        Self { approximate: true, ..self.clone() }
    }

    /// The same values, with exact masses and contact samples.
    #[must_use]
    pub fn exact(&self) -> Self {
        Self { approximate: false, ..self.clone() }
    }

    pub fn bounds(&self, shape: &Shape) -> Aabb {
        shape.closed_bounds().unwrap_or_else(|| self.shape(shape).bounds())
    }

    pub(super) fn shape(&self, shape: &Shape) -> Arc<DerivedShape> {
        let CacheEntries { shapes, disk, .. } = &*self.entries;
        let new = || Ok::<_, Infallible>(Arc::new(DerivedShape::new(shape, disk)));
        let Ok(derived) = shapes.get(shape, |known| known == shape, new);
        derived
    }

    /// Mass properties of a shape at a uniform density, kg/m³.
    pub(super) fn mass(&self, shape: &Shape, density: f64) -> MassProperties {
        let derived = self.shape(shape);
        let unit = derived.unit_mass(self.approximate);
        MassProperties { mass: unit.mass * density, com: unit.com, inertia: unit.inertia * density }
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
        let (CacheEntries { geometries, models, disk, .. }, approximate) = (&*self.entries, self.approximate);
        let build = || {
            let geometry = geometries.get(
                &(nominal.clone(), approximate),
                |(known, rough)| {
                    *rough == approximate
                        && known.shape == nominal.shape
                        && has_discretisation(known, declared)
                },
                || {
                    let shape = self.shape(&nominal.shape);
                    SoftGeometry::stored(&asset.name, &shape, declared, approximate, disk).map(Arc::new)
                },
            )?;
            Ok(geometry.model(material, object.scale))
        };
        let is_same =
            |(known, rough): &(Arc<Asset>, bool)| *rough == approximate && have_same_surface(known, asset);
        models.get(&(asset.clone(), approximate), is_same, build)
    }

    /// Render mesh of an asset; `mesh` is the voxel mesh of a soft body.
    pub(super) fn mesh(
        &self,
        name: &str,
        asset: &Arc<Asset>,
        mesh: Option<&VoxelMesh>,
    ) -> Result<Arc<RenderMesh>, CameraError> {
        let same = |known: &Arc<Asset>| have_same_surface(known, asset) && known.visuals == asset.visuals;
        self.entries.meshes.get(asset, same, || {
            let (shape, visuals, disk) = (&asset.shape, &asset.visuals, &self.entries.disk);
            let model = match mesh {
                None => RenderMesh::from_shape(name, shape, visuals, disk)?,
                Some(mesh) => RenderMesh::from_soft_shape(name, shape, visuals, mesh, disk)?,
            };
            Ok(Arc::new(model))
        })
    }

    /// Tactile skin of an asset: the fine surface mesh that presses into gels.
    pub(super) fn skin(
        &self,
        name: &str,
        asset: &Arc<Asset>,
        mesh: Option<&VoxelMesh>,
    ) -> Result<Arc<TactileSkin>, SensingError> {
        let same = |known: &Arc<Asset>| have_same_surface(known, asset);
        self.entries.skins.get(asset, same, || {
            let disk = &self.entries.disk;
            let skin = match mesh {
                None => TactileSkin::from_shape(&asset.shape, disk),
                Some(mesh) => TactileSkin::from_soft(&asset.shape, mesh, disk)
                    .ok_or_else(|| SensingError::Skin(name.to_owned()))?,
            };
            Ok(Arc::new(skin))
        })
    }

    pub(super) fn robot(&self) -> Result<Arc<RobotMeshes>, CameraError> {
        let CacheEntries { robot, disk, .. } = &*self.entries;
        robot.get(&(), |()| true, || Ok(Arc::new(RobotMeshes::new(disk)?)))
    }

    pub(super) fn sensor(&self, spec: &TactileSpec) -> Result<Arc<TactileSensor>, SensingError> {
        self.entries.sensors.get(spec, |known| known == spec, || Ok(Arc::new(TactileSensor::new(spec)?)))
    }
}

/// True if two assets have the same surface, at rest and deformed.
fn have_same_surface(a: &Asset, b: &Asset) -> bool {
    a.shape == b.shape && a.body == b.body
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
