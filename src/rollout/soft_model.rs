//! Finite-element models of soft assets, and the checks of their shapes.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::{asset_cache::DerivedShape, build_error::SceneBuildError};
use softvt_common::{disk_cache::DiskCache, text::format_number};
use softvt_geometry::{
    Aabb, Vec3,
    mass::{approximate_mass_properties, mass_properties},
    pieces::SeparatePieces,
    samples::{SampleSpec, surface_samples},
    shape::Shape,
    voxel::{SurfaceSample, VoxelMesh, VoxelSpec, voxel_mesh_within},
};
use softvt_physics::{World, fem::FemModel};
use softvt_scene::SoftMaterial;

/// Factor on the spacing of contact samples for approximate models.
const APPROXIMATE_SPACING: f64 = 4.0;

/// Largest number of nodes of the soft bodies of a scene: those of a cube of 33 voxels per edge.
pub(super) const MAX_NODES: usize = 40_000;
/// Number of nodes from which on a scene is slow enough for a warning.
const SLOW_NODES: usize = 8_000;

/// The end of a message about `nodes` nodes, which are too many.
pub(super) fn too_many(nodes: usize) -> String {
    format!("{}, expected at most {MAX_NODES}; give a lower resolution", cost_of(nodes))
}

/// A number of nodes with the memory and the processor time that they need, as far as they are known beforehand.
fn cost_of(nodes: usize) -> String {
    format!(
        "{nodes} nodes, which need about {} GB and {} s of processor time per simulated second",
        two_digits(1e-9 * FemModel::estimated_bytes(nodes)),
        two_digits(FemModel::estimated_seconds(nodes))
    )
}

fn two_digits(number: f64) -> String {
    let unit = 10f64.powf(number.log10().floor() - 1.0);
    format_number(((number / unit).round() * unit * 1e6).round() / 1e6)
}

/// A warning about a scene whose soft bodies are slow to simulate.
pub fn cost_warning(world: &World) -> Option<String> {
    let nodes = world.soft_bodies().iter().map(|soft| soft.state.model.mesh.nodes.len()).sum();
    let cost =
        || format!("the soft bodies of the scene have {}; a lower resolution is faster", cost_of(nodes));
    (nodes > SLOW_NODES).then(cost)
}

/// Builds the finite-element model of a soft body. `name` identifies the asset in error messages.
pub fn soft_model(
    name: &str,
    shape: &Shape,
    material: &SoftMaterial,
) -> Result<Arc<FemModel>, SceneBuildError> {
    Ok(SoftGeometry::new(name, shape, &shape.bounds(), material, false)?.model(material, 1.0))
}

/// Discretised shape of a soft body: the part of its model that depends on neither elasticity nor density.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct SoftGeometry {
    mesh: VoxelMesh,
    samples: Vec<SurfaceSample>,
    /// Volume of the shape, m³.
    volume: f64,
}

impl SoftGeometry {
    /// As [`SoftGeometry::new`], kept in `disk`.
    pub(super) fn stored(
        name: &str,
        shape: &DerivedShape,
        material: &SoftMaterial,
        approximate: bool,
        disk: &DiskCache,
    ) -> Result<Self, SceneBuildError> {
        let inputs = (&shape.shape, material.resolution, material.grasp_spacing, approximate);
        disk.get("voxels", &inputs, || Self::new(name, &shape.shape, &shape.bounds(), material, approximate))
    }

    /// Meshes a shape within its tight bounds. An `approximate` geometry has fewer contact samples and an approximate
    /// volume.
    pub(super) fn new(
        name: &str,
        shape: &Shape,
        bounds: &Aabb,
        material: &SoftMaterial,
        approximate: bool,
    ) -> Result<Self, SceneBuildError> {
        let refused = |what| SceneBuildError::Material { asset: name.to_owned(), what };
        if let Some(what) = size_problem(&bounds.size(), material) {
            return Err(refused(what));
        }
        let (grasp_spacing, volume) = match approximate {
            true => {
                (APPROXIMATE_SPACING * material.grasp_spacing, approximate_mass_properties(shape, 1.0).mass)
            }
            false => (material.grasp_spacing, mass_properties(shape, 1.0).mass),
        };
        let mesh = voxel_mesh_within(shape, bounds, &VoxelSpec { resolution: material.resolution })
            .map_err(|source| SceneBuildError::Geometry { asset: name.to_owned(), source })?;
        if mesh.nodes.len() > MAX_NODES {
            return Err(refused(format!("its voxel mesh has {}", too_many(mesh.nodes.len()))));
        }
        // D of several pieces would measure how they move apart.
        if let Some(SeparatePieces { count, gap }) = SeparatePieces::find(&mesh) {
            return Err(refused(format!(
                "its voxel mesh has {count} separate pieces, {:.1} mm apart; join them, give a higher resolution if the shape is \
                 connected, or make each an asset of its own",
                1e3 * gap
            )));
        }
        let samples = surface_samples(shape, &mesh, &SampleSpec { grasp_spacing, ..SampleSpec::default() });
        Ok(Self { mesh, samples, volume })
    }

    /// The model of a body of this shape at `scale` times the size. Its deformations under proportional loads are those
    /// of the unscaled body, up to rounding.
    pub(super) fn model(&self, material: &SoftMaterial, scale: f64) -> Arc<FemModel> {
        let law = material.elastic;
        if scale == 1.0 {
            return FemModel::new(self.mesh.clone(), law, self.volume, self.samples.clone());
        }
        let samples = self.samples.iter().map(|sample| sample.scaled(scale)).collect();
        FemModel::new(self.mesh.scaled(scale), law, self.volume * scale.powi(3), samples)
    }
}

/// Maximum number of contact samples of one body. More take minutes to compute; nearly always the size
/// was given in millimetres.
const MAX_SAMPLES: f64 = 1e6;

/// Describes a body with too many contact samples, or thinner than a voxel, which may have no elements at all.
fn size_problem(size: &Vec3, material: &SoftMaterial) -> Option<String> {
    let samples =
        2.0 * (size.x * size.y + size.y * size.z + size.z * size.x) / material.grasp_spacing.powi(2);
    if samples > MAX_SAMPLES {
        let [x, y, z] = [size.x, size.y, size.z].map(format_number);
        return Some(format!(
            "it is {x} × {y} × {z} m, about {samples:.0e} contact samples {} mm apart, expected at most {MAX_SAMPLES:.0e}; \
             sizes are in metres; a truly large body needs a larger grasp_spacing",
            1e3 * material.grasp_spacing
        ));
    }
    let (thin, long, resolution) = (size.min(), size.max(), material.resolution);
    let edge = long / resolution.max(1) as f64;
    // The slack is for a size that is a whole number of voxels.
    if !(thin > 0.0 && thin < edge * (1.0 - 1e-6)) {
        return None;
    }
    let mm = |metres: f64| format_number((1e5 * metres).round() / 100.0);
    let (needed, most) = ((long / thin * (1.0 - 1e-6)).ceil(), SoftMaterial::MAX_RESOLUTION);
    let fix = match needed <= most as f64 {
        true => format!("give resolution = {needed}"),
        false => format!(
            "no resolution up to {most} is fine enough; make it at least {} mm thick",
            mm(long / most as f64)
        ),
    };
    Some(format!(
        "it is {} mm thick, thinner than a voxel: at resolution {resolution} they are {} mm; {fix}",
        mm(thin),
        mm(edge)
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use softvt_evaluation::deformation::ReferenceShape;
    use softvt_geometry::{Pose, Vec3};
    use softvt_physics::{BodyId, PhysicsParams, World, contact::Friction, fem::ElasticMaterial};

    const RADIUS: f64 = 0.03;

    fn ball() -> (Shape, SoftMaterial) {
        let material = SoftMaterial {
            elastic: ElasticMaterial::new(3e4, 0.4, 300.0).expect("valid"),
            resolution: 4,
            grasp_spacing: 4e-3,
            collapse_strain: None,
            damage_strain: None,
        };
        (Shape::Sphere { radius: RADIUS }, material)
    }

    /// D (%) and force per pad (N) of the ball at `scale`, pressed between two plates to `share` of its diameter.
    fn press(scale: f64, share: f64) -> (f64, f64) {
        let (shape, material) = ball();
        let geometry = SoftGeometry::new("ball", &shape, &shape.bounds(), &material, false).expect("meshed");
        let model = geometry.model(&material, scale);
        let mut world = World::new(PhysicsParams::default(), Vec3::zeros());
        let body = world.add_soft("ball", model.clone(), None, &Pose::identity(), Friction::default());
        let plate = Shape::Box { half: Vec3::new(0.005, 0.05, 0.05) };
        let at = |side: f64, gap: f64| Pose::translation(side * (gap + 0.005), 0.0, 0.0);
        let plates = [-1.0, 1.0].map(|side| {
            let frame = world.add_kinematic(at(side, RADIUS * scale));
            (side, frame, world.add_shape("plate", frame, Pose::identity(), &plate, Friction::NONE))
        });
        let diagonal_m = shape.bounds().size().norm() * scale;
        let rest = ReferenceShape::of_mesh(&world.soft(body).state.x, &model.mesh, diagonal_m);
        let rest = rest.expect("a shape");
        for step in 1..=40 {
            let closed = f64::from(step.min(20)) / 20.0;
            let gap = RADIUS * scale * (1.0 - closed * (1.0 - share));
            plates.iter().for_each(|(side, frame, _)| world.move_kinematic(*frame, at(*side, gap)));
            world.step().expect("a gentle squeeze");
        }
        let d = rest.measure(&world.soft(body).state.x).expect("measured").rms_pct;
        (d, world.contact(BodyId::from(body), plates[0].2).normal_force)
    }

    #[test]
    fn a_scaled_body_has_the_voxels_of_the_nominal_one_and_the_cube_of_its_mass() {
        let (shape, material) = ball();
        let geometry = SoftGeometry::new("ball", &shape, &shape.bounds(), &material, false).expect("meshed");
        let [nominal, scaled] = [1.0, 1.12].map(|scale| geometry.model(&material, scale));
        assert_eq!(nominal.mesh.elements, scaled.mesh.elements);
        assert_eq!(nominal.mesh.occupancy, scaled.mesh.occupancy);
        assert_eq!(nominal.samples.len(), scaled.samples.len());
        let ratio = scaled.total_mass() / nominal.total_mass();
        assert!((ratio - 1.12f64.powi(3)).abs() < 1e-9, "{ratio}");
        // The same as an asset that is declared at that size.
        let declared =
            soft_model("ball", &Shape::Sphere { radius: 1.12 * RADIUS }, &material).expect("meshed");
        assert!((declared.total_mass() / scaled.total_mass() - 1.0).abs() < 1e-9);
        assert_eq!(declared.mesh.elements.len(), scaled.mesh.elements.len());
    }

    #[test]
    fn proportional_squeezes_of_scaled_bodies_have_equal_deformation_and_forces_as_their_area() {
        let (nominal, force) = press(1.0, 0.85);
        assert!(nominal > 1.0, "{nominal} %");
        let scale = 0.88;
        let (d, scaled_force) = press(scale, 0.85);
        assert!((d / nominal - 1.0).abs() < 0.01, "{d} % instead of {nominal} %");
        let ratio = scaled_force / force / (scale * scale);
        assert!((ratio - 1.0).abs() < 0.02, "{scaled_force} N and {force} N");
        let (deeper, _) = press(1.0, 0.80);
        assert!(deeper > 1.1 * nominal, "the criterion distinguishes squeezes");
    }
}
