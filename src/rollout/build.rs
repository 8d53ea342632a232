//! From a scene to a world: what each object becomes.

use std::sync::Arc;

use super::{
    articulated,
    asset_cache::AssetCache,
    simulation::{ObjectInstance, Simulation},
};
use crate::{
    geometry::{
        Aabb,
        mass::mass_properties,
        samples::{SampleSpec, surface_samples},
        shape::Shape,
        voxel::{VoxelMeshError, VoxelSpec, voxel_mesh},
    },
    physics::{
        BodyId, World,
        contact::ContactSurface,
        fem::{ElasticMaterial, FemModel},
        joints::JointTreeError,
        rigid::{RigidError, RigidState},
    },
    scene::{Body, Object, Scene, SoftMaterial},
    text::format_number,
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
        source: VoxelMeshError,
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
    /// Its joints carry what no joint could.
    #[error("object {object}: {source}")]
    Joints {
        /// Object name.
        object: String,
        /// What is wrong.
        source: JointTreeError,
    },
    /// Two objects are in each other.
    #[error(
        "objects {first} and {second}{} overlap by {} mm at the start; move them apart",
        placed(.second_at),
        format_number((1e4 * .depth).round() / 10.0)
    )]
    Overlap {
        /// Name of one.
        first: String,
        /// Name of the other.
        second: String,
        /// Where the other was placed, `file:line`; empty if no script did.
        second_at: String,
        /// How far the deepest point of one is under the surface of the other, m.
        depth: f64,
    },
    /// An object is in the robot's foot.
    #[error("object {0} starts inside of the robot's base; move it away")]
    InBase(String),
    /// An object is in the robot.
    #[error(
        "object {object} starts inside of the robot's hand ({part}), {} mm deep; move it away, or the arm (scene.start_q)",
        format_number((1e4 * .depth).round() / 10.0)
    )]
    InRobot {
        /// Object name.
        object: String,
        /// The part of the hand.
        part: String,
        /// How far the deepest point of one is under the surface of the other, m.
        depth: f64,
    },
    /// Nothing could hold an object.
    #[error("object {0} has nothing below it; put it above what it is to rest on")]
    NothingBelow(String),
    /// What is wrong with an object that a script placed.
    #[error("{place}: {source}")]
    At {
        /// `file:line`.
        place: String,
        /// What is wrong.
        source: Box<BuildError>,
    },
    /// Two objects have one name.
    #[error("the scene has two objects named {0}; names must be unique")]
    TwoNames(String),
}

fn placed(at: &str) -> String {
    if at.is_empty() { String::new() } else { format!(" (placed at {at})") }
}

impl BuildError {
    /// The same with the place of the script that put `object` into the scene.
    fn of(self, object: &Object) -> Self {
        match object.placed_at.as_str() {
            "" => self,
            place => Self::At { place: place.to_owned(), source: Box::new(self) },
        }
    }
}

/// FemModel data of a soft body of `shape`.
///
/// # Errors
/// A shape that cannot be meshed, or a material number out of range; `name` is what messages call it.
pub fn soft_rest(name: &str, shape: &Shape, material: &SoftMaterial) -> Result<Arc<FemModel>, BuildError> {
    check_soft(name, shape, material)?;
    meshed(name, shape, material, mass_properties(shape, 1.0).mass)
}

/// Whether a soft body of `shape` and `material` can be.
pub(super) fn check_soft(name: &str, shape: &Shape, material: &SoftMaterial) -> Result<(), BuildError> {
    check(name, material)?;
    check_size(name, shape, material)?;
    check_thickness(name, shape, material)
}

/// FemModel data of a soft body of some volume, m³, that can be.
pub(super) fn meshed(
    name: &str,
    shape: &Shape,
    material: &SoftMaterial,
    volume: f64,
) -> Result<Arc<FemModel>, BuildError> {
    let spec = VoxelSpec { resolution: material.resolution };
    let mesh =
        voxel_mesh(shape, &spec).map_err(|source| BuildError::Geometry { asset: name.to_owned(), source })?;
    let spacing = SampleSpec { grasp_spacing: material.grasp_spacing, ..SampleSpec::default() };
    let samples = surface_samples(shape, &mesh, &spacing);
    let law = ElasticMaterial {
        youngs_pa: material.youngs_pa,
        poisson: material.poisson,
        density: material.density,
    };
    Ok(FemModel::new(mesh, law, volume, samples))
}

fn check(name: &str, m: &SoftMaterial) -> Result<(), BuildError> {
    let wrong = |what: String| Err(BuildError::Material { asset: name.to_owned(), what });
    if !(m.youngs_pa > 0.0 && m.youngs_pa.is_finite()) {
        return wrong(format!(
            "Young's modulus is {} Pa, expected a positive number",
            format_number(m.youngs_pa)
        ));
    }
    if !(0.0..0.5).contains(&m.poisson) {
        return wrong(format!(
            "Poisson's ratio is {}, expected 0 <= poisson < 0.5",
            format_number(m.poisson)
        ));
    }
    if !(m.density > 0.0 && m.density.is_finite()) {
        return wrong(format!("density is {} kg/m³, expected a positive number", format_number(m.density)));
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
        format_number(size.x),
        format_number(size.y),
        format_number(size.z),
        1e3 * material.grasp_spacing
    );
    Err(BuildError::Material { asset: name.to_owned(), what })
}

/// A body thinner than a voxel has no element of its own across it, and what is far thinner none at all.
fn check_thickness(name: &str, shape: &Shape, material: &SoftMaterial) -> Result<(), BuildError> {
    let size = shape.bounds().size();
    let (thin, long) = (size.min(), size.max());
    let edge = long / material.resolution.max(1) as f64;
    // The slack is for a size that is a whole number of voxels.
    if !(thin > 0.0 && thin < edge * (1.0 - 1e-6)) {
        return Ok(());
    }
    let mm = |metres: f64| format_number((1e5 * metres).round() / 100.0);
    let needed = (long / thin * (1.0 - 1e-6)).ceil();
    let cure = if needed <= SoftMaterial::MAX_RESOLUTION as f64 {
        format!("resolution = {needed} would serve")
    } else {
        let least = mm(long / SoftMaterial::MAX_RESOLUTION as f64);
        format!(
            "no resolution up to {} would serve; make it at least {least} mm thick",
            SoftMaterial::MAX_RESOLUTION
        )
    };
    let what = format!(
        "it is {} mm thick, thinner than a voxel: at resolution {} they are {} mm; {cure}",
        mm(thin),
        material.resolution,
        mm(edge)
    );
    Err(BuildError::Material { asset: name.to_owned(), what })
}

/// Walls of hard bodies are at least this thick, m: what meets a thinner sheet is through it before contact can hold it.
const LEAST_SHEET: f64 = 2e-3;
/// The longest side of an object is at least this long, m: less is nearly always a wrong scale.
const LEAST_SIZE: f64 = 1e-3;

fn check_scale(object: &Object, cache: &AssetCache) -> Result<(), BuildError> {
    let longest = cache.bounds(&object.asset.shape).size().max();
    // What is empty is told as such, when it is meshed.
    if longest >= LEAST_SIZE || longest == 0.0 {
        return Ok(());
    }
    let what = format!(
        "it is {longest:.1e} m long, expected at least {} m; sizes are in metres (a mesh has a scale)",
        format_number(LEAST_SIZE)
    );
    Err(BuildError::Material { asset: object.asset.name.clone(), what })
}

fn check_sheet(object: &Object, cache: &AssetCache) -> Result<(), BuildError> {
    match cache.wall(&object.asset.shape).filter(|wall| *wall < LEAST_SHEET) {
        None => Ok(()),
        Some(wall) => Err(BuildError::Material {
            asset: object.asset.name.clone(),
            what: format!(
                "it is about {} mm thick, or its walls are, expected at least {} mm: what meets a thinner one may pass \
                 through it",
                format_number((1e4 * wall).round() / 10.0),
                format_number(1e3 * LEAST_SHEET)
            ),
        }),
    }
}

/// Objects may overlap by this much where they are put, m: contact takes it up while they settle.
const OVERLAP: f64 = 1e-3;

/// Puts all objects of `scene` into `world`; their handles in the order of the scene, those of an object's parts after
/// it.
pub(super) fn add_all(
    world: &mut World,
    scene: &Scene,
    cache: &AssetCache,
) -> Result<Vec<ObjectInstance>, BuildError> {
    let mut handles: Vec<ObjectInstance> = Vec::new();
    for object in &scene.objects {
        if handles.iter().any(|known| known.name == object.name) {
            return Err(BuildError::TwoNames(object.name.clone()).of(object));
        }
        add(world, object, cache, &mut handles).map_err(|error| error.of(object))?;
    }
    Ok(handles)
}

/// Nothing may start inside of anything else, nor of the robot, which is in `world` already.
pub(super) fn check_overlap(world: &mut World, scene: &Scene) -> Result<(), BuildError> {
    let found = world.penetrations(OVERLAP);
    let Some(deepest) = found.iter().max_by(|a, b| a.depth.total_cmp(&b.depth)) else { return Ok(()) };
    // A part is named after its object and a dot, which no object's name holds.
    let index = |name: &str| {
        let whole = name.split('.').next().unwrap_or(name);
        scene.objects.iter().position(|object| object.name == whole)
    };
    let [mut first, mut second] = [0, 1].map(|i| (index(&deepest.names[i]), deepest.names[i].clone()));
    if first.0 < second.0 {
        // The one that was placed last is the one to be moved.
        std::mem::swap(&mut first, &mut second);
    }
    if let (Some(index), None) = (first.0, second.0) {
        // What is of no object is of the robot.
        let (object, part) = (first.1, second.1);
        return Err(BuildError::InRobot { object, part, depth: deepest.depth }.of(&scene.objects[index]));
    }
    let place = |index: Option<usize>| index.map_or(String::new(), |i| scene.objects[i].placed_at.clone());
    let error = BuildError::Overlap {
        first: first.1,
        second: second.1,
        second_at: place(second.0),
        depth: deepest.depth,
    };
    Err(match first.0 {
        Some(index) => error.of(&scene.objects[index]),
        None => error,
    })
}

/// The column of the robot's first two links, which nothing collides with: radius, and from where to where on its axis, m
/// (the collision meshes of the public `franka_description`, rounded inwards).
const COLUMN: (f64, [f64; 2]) = (0.05, [0.03, 0.33]);

/// Nothing that may move starts inside of the robot's base.
pub(super) fn check_base(scene: &Scene) -> Result<(), BuildError> {
    let (radius, [low, high]) = COLUMN;
    let movable = |object: &&Object| matches!(object.asset.body, Body::Soft(_) | Body::Rigid { .. });
    for object in scene.objects.iter().filter(movable) {
        let column_o = object.pose_w.inverse() * scene.base_w;
        let steps = ((high - low) / radius).ceil() as usize;
        let inside = (0..=steps).any(|step| {
            let z = low + (high - low) * step as f64 / steps as f64;
            object.asset.shape.distance(&(column_o * nalgebra::Point3::new(0.0, 0.0, z)).coords) < radius
        });
        if inside {
            return Err(BuildError::InBase(object.name.clone()).of(object));
        }
    }
    Ok(())
}

/// Every body that is free to fall starts above something.
///
/// # Errors
/// The first one that does not.
pub fn check_support(sim: &Simulation) -> Result<(), BuildError> {
    let boxes: Vec<Aabb> = sim.objects.iter().map(|h| h.bounds.transformed(&h.start_w)).collect();
    for (handle, own) in sim.objects.iter().zip(&boxes) {
        let holds = |(other, below): (&ObjectInstance, &Aabb)| {
            let beneath = (0..2).all(|i| below.min[i] < own.max[i] && own.min[i] < below.max[i]);
            other.name != handle.name
                && !matches!(other.asset.body, Body::Scenery)
                && beneath
                && below.min.z < own.min.z
        };
        if handle.body.is_free() && !sim.objects.iter().zip(&boxes).any(holds) {
            let object = sim.scene.objects.iter().find(|object| object.name == handle.name);
            let error = BuildError::NothingBelow(handle.name.clone());
            return Err(match object {
                Some(object) => error.of(object),
                None => error,
            });
        }
    }
    Ok(())
}

/// Puts `object` into `world` and its handles behind the others.
fn add(
    world: &mut World,
    object: &Object,
    cache: &AssetCache,
    handles: &mut Vec<ObjectInstance>,
) -> Result<(), BuildError> {
    let asset = &object.asset;
    check_scale(object, cache)?;
    if matches!(asset.body, Body::Rigid { .. }) {
        check_sheet(object, cache)?;
    }
    let collider = |world: &World, parent: BodyId, pose_in_parent| {
        cache.collider(world, &object.name, parent, pose_in_parent, &asset.shape, asset.friction)
    };
    let mut parts = Vec::new();
    let (body, colliders) = match &asset.body {
        Body::Soft(material) => {
            let rest = cache.rest(asset, material)?;
            let surface: Arc<dyn ContactSurface> = Arc::new(asset.shape.clone());
            let id = world.add_soft(&object.name, rest, Some(surface), &object.pose_w, asset.friction);
            (id.into(), Vec::new())
        }
        Body::Rigid { density } => {
            let m = cache.mass(&asset.shape, *density);
            let body = RigidState::new(&object.pose_w, m.com, m.mass, m.inertia)
                .map_err(|source| BuildError::Rigid { asset: asset.name.clone(), source })?;
            let body = BodyId::Rigid(world.add_rigid(&object.name, body));
            let collider = collider(world, body, crate::geometry::Pose::identity());
            (body, vec![world.add_collider(collider)])
        }
        Body::Articulated(carried) => {
            let (articulation, made) = articulated::add(world, object, carried, handles.len(), cache)?;
            parts = made;
            let base = collider(world, BodyId::World, object.pose_w).as_base_of(articulation);
            (BodyId::World, vec![world.add_collider(base)])
        }
        Body::Static => {
            let collider = collider(world, BodyId::World, object.pose_w);
            (BodyId::World, vec![world.add_collider(collider)])
        }
        Body::Scenery => (BodyId::World, Vec::new()),
    };
    handles.push(ObjectInstance {
        name: object.name.clone(),
        asset: asset.clone(),
        body,
        start_w: object.pose_w,
        colliders,
        bounds: cache.bounds(&asset.shape),
        part: None,
    });
    handles.extend(parts);
    Ok(())
}
