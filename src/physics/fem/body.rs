//! A soft body: its rest data (shared, immutable) and its state.

use std::sync::Arc;

use super::{
    element::{self, Stiffness},
    force::{self, Corners, elastic},
    rotation::polar,
};
use crate::geometry::{
    Mat3, Pose, Vec3, hex8,
    voxel::{OccupancyMask, SUBCELLS, SurfaceSample, VoxelMesh},
};

/// Isotropic linear elasticity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ElasticMaterial {
    /// Young's modulus, Pa.
    pub youngs_pa: f64,
    /// Poisson's ratio, 0 ≤ ν < 0.5.
    pub poisson: f64,
    /// Density, kg/m³.
    pub density: f64,
}

/// Least mass of a node as a share of a full interior node's.
const MASS_FLOOR: f64 = 1e-3;
/// Voxels with less material than this are not watched for inversion.
const WATCHED_FILL: f64 = 0.2;

/// Samples that share the same nodes.
#[derive(Clone, Debug)]
pub struct SampleGroup {
    /// The nodes that carry the samples; the first `count` are used.
    pub nodes: [u32; 8],
    /// Number of carrying nodes.
    pub count: usize,
    /// First sample of the group.
    pub first: usize,
    /// One past its last sample.
    pub last: usize,
}

/// A contact sample: where it sits, its weights in its group's node order, and what it stands for.
#[derive(Clone, Debug)]
pub struct ContactSample {
    /// The geometric sample.
    pub surface: SurfaceSample,
    /// Weights of the group's nodes.
    pub weights: [f64; 8],
}

/// What never changes about a soft body.
#[derive(Debug)]
pub struct FemModel {
    /// The voxel mesh at rest, object frame.
    pub mesh: VoxelMesh,
    /// ElasticMaterial.
    pub material: ElasticMaterial,
    /// Node masses, kg; they sum to density × volume.
    pub mass: Vec<f64>,
    /// Contact samples, ordered by group.
    pub samples: Vec<ContactSample>,
    /// ContactSample groups.
    pub groups: Vec<SampleGroup>,
    /// Typical side of a sample's patch, m.
    pub spacing: f64,
    pub(super) stiffness: Vec<Stiffness>,
    pub(super) stiffness_of: Vec<u32>,
    pub(super) corners: Corners,
    pub(super) mean: [Vec3; 8],
    watched: Vec<bool>,
}

/// What the factor of a body of n nodes takes, bytes over n^(4/3): measured on cubes of 6 to 24 voxels an edge, whose fill
/// grows as that of nested dissection does.
const FACTOR_BYTES: f64 = 2048.0;

impl FemModel {
    /// About what a body takes in memory once it has been stepped, bytes.
    pub fn bytes(&self) -> usize {
        let (nodes, elements) = (self.mesh.nodes.len(), self.mesh.elements.len());
        let own = nodes * (size_of::<f64>() + 4 * size_of::<Vec3>())
            + elements * (size_of::<[u32; 8]>() + size_of::<OccupancyMask>() + 2 * size_of::<Mat3>())
            + self.samples.len() * size_of::<ContactSample>()
            + self.stiffness.len() * size_of::<Stiffness>();
        own + (FACTOR_BYTES * (nodes as f64).powf(4.0 / 3.0)) as usize
    }

    /// Builds the rest data; `volume` (m³) is the body's true volume, which fixes its mass.
    pub fn new(
        mesh: VoxelMesh,
        material: ElasticMaterial,
        volume: f64,
        samples: Vec<SurfaceSample>,
    ) -> Arc<Self> {
        let h = mesh.edge;
        let mut fills: Vec<OccupancyMask> = Vec::new();
        let stiffness_of = mesh
            .occupancy
            .iter()
            .map(|fill| match fills.iter().position(|f| f == fill) {
                Some(at) => at as u32,
                None => {
                    fills.push(*fill);
                    fills.len() as u32 - 1
                }
            })
            .collect();
        let stiffness =
            fills.iter().map(|f| element::stiffness(h, f, material.youngs_pa, material.poisson)).collect();
        let spacing = (samples.iter().map(|s| s.area).sum::<f64>() / samples.len().max(1) as f64).sqrt();
        let (samples, groups) = group_samples(&mesh, samples);
        Arc::new(Self {
            mass: node_masses(&mesh, material.density, volume),
            watched: mesh.occupancy.iter().map(|f| f.fraction() >= WATCHED_FILL).collect(),
            material,
            samples,
            groups,
            spacing,
            stiffness,
            stiffness_of,
            corners: std::array::from_fn(|c| hex8::corner(c) * h),
            mean: element::mean_gradients(h),
            mesh,
        })
    }

    /// Total mass, kg.
    pub fn total_mass(&self) -> f64 {
        self.mass.iter().sum()
    }

    /// Normal contact modulus of the surface per area, Pa/m: `min(1e9, 30 E/h)`, stiff enough that the voxels decide.
    pub fn contact_modulus(&self) -> f64 {
        (30.0 * self.material.youngs_pa / self.mesh.edge).min(1e9)
    }
}

/// Masses lumped by the shape functions over the filled part, floored, then scaled to `density · volume` in all.
fn node_masses(mesh: &VoxelMesh, density: f64, volume: f64) -> Vec<f64> {
    let cell = mesh.edge.powi(3) / (SUBCELLS * SUBCELLS * SUBCELLS) as f64;
    let mut mass = vec![0.0; mesh.nodes.len()];
    for (nodes, fill) in mesh.elements.iter().zip(&mesh.occupancy) {
        for sub in (0..SUBCELLS * SUBCELLS * SUBCELLS).filter(|&sub| fill.contains(sub)) {
            let at = crate::geometry::voxel::Embedding { element: 0, local: OccupancyMask::centre(sub) };
            for (&node, w) in nodes.iter().zip(at.weights()) {
                mass[node as usize] += density * cell * w;
            }
        }
    }
    let floor = MASS_FLOOR * density * mesh.edge.powi(3);
    mass.iter_mut().for_each(|m| *m = m.max(floor));
    let scale = density * volume / mass.iter().sum::<f64>();
    mass.iter_mut().for_each(|m| *m *= scale);
    mass
}

/// Groups samples that are carried by the same nodes (an element, or one face of it) and orders them by group.
fn group_samples(mesh: &VoxelMesh, samples: Vec<SurfaceSample>) -> (Vec<ContactSample>, Vec<SampleGroup>) {
    let key = |s: &SurfaceSample| {
        let weights = s.at.weights();
        let mask = weights.iter().enumerate().fold(0u8, |m, (c, w)| if *w > 1e-12 { m | 1 << c } else { m });
        (s.at.element, mask)
    };
    let mut keyed: Vec<((u32, u8), SurfaceSample)> = samples.into_iter().map(|s| (key(&s), s)).collect();
    keyed.sort_by_key(|(key, _)| *key);
    let (mut out, mut groups): (Vec<ContactSample>, Vec<SampleGroup>) =
        (Vec::with_capacity(keyed.len()), Vec::new());
    let mut last_key = None;
    for (key, surface) in keyed {
        let corners: Vec<usize> = (0..8).filter(|c| key.1 >> c & 1 == 1).collect();
        if last_key != Some(key) {
            last_key = Some(key);
            let mut nodes = [0; 8];
            let element = mesh.elements[key.0 as usize];
            corners.iter().enumerate().for_each(|(i, &c)| nodes[i] = element[c]);
            groups.push(SampleGroup { nodes, count: corners.len(), first: out.len(), last: out.len() });
        }
        let all = surface.at.weights();
        let mut weights = [0.0; 8];
        corners.iter().enumerate().for_each(|(i, &c)| weights[i] = all[c]);
        out.push(ContactSample { surface, weights });
        if let Some(group) = groups.last_mut() {
            group.last = out.len();
        }
    }
    (out, groups)
}

/// Smallest volume ratio in a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MinDetF {
    /// Determinant of the deformation gradient; 1 at rest, ≤ 0 for an inverted element.
    pub det_f: f64,
    /// The element.
    pub element: usize,
}

/// A soft body in motion.
#[derive(Clone, Debug)]
pub struct FemState {
    /// FemModel data.
    pub model: Arc<FemModel>,
    /// Node positions, m, world.
    pub x: Vec<Vec3>,
    /// Node velocities, m/s, world.
    pub v: Vec<Vec3>,
    /// Elastic node forces at `x`, N, world; made by [`FemState::update_elastic`].
    pub force: Vec<Vec3>,
    /// Element rotations at `x`.
    pub rotation: Vec<Mat3>,
    /// Rotation of the body as a whole.
    pub frame: Mat3,
    /// Stored elastic energy at `x`, J.
    pub elastic_energy: f64,
}

impl FemState {
    /// A body at rest in its rest configuration at `pose`.
    pub fn new(model: Arc<FemModel>, pose: &Pose) -> Self {
        let x: Vec<Vec3> =
            model.mesh.nodes.iter().map(|p| pose * nalgebra::Point3::from(*p)).map(|p| p.coords).collect();
        let r = *pose.rotation.to_rotation_matrix().matrix();
        let nodes = x.len();
        Self {
            rotation: vec![r; model.mesh.elements.len()],
            frame: r,
            v: vec![Vec3::zeros(); nodes],
            force: vec![Vec3::zeros(); nodes],
            elastic_energy: 0.0,
            x,
            model,
        }
    }

    /// Evaluates rotations, forces and energy at the present positions.
    pub fn update_elastic(&mut self) {
        let rest = &*self.model;
        self.force.fill(Vec3::zeros());
        self.elastic_energy = 0.0;
        let mut mean = Mat3::zeros();
        for (e, nodes) in rest.mesh.elements.iter().enumerate() {
            let x: Corners = std::array::from_fn(|c| self.x[nodes[c] as usize]);
            let k0 = &rest.stiffness[rest.stiffness_of[e] as usize];
            let result = elastic(&x, &rest.corners, &rest.mean, k0, self.rotation[e]);
            self.rotation[e] = result.rotation;
            self.elastic_energy += result.energy;
            mean += result.rotation;
            for (c, f) in result.force.iter().enumerate() {
                self.force[nodes[c] as usize] += f;
            }
        }
        self.frame = polar(&(mean / rest.mesh.elements.len() as f64), self.frame);
    }

    /// Smallest det F over the Gauss points of all elements that hold enough material.
    pub fn min_det_f(&self) -> MinDetF {
        let rest = &*self.model;
        let mut least = MinDetF { det_f: f64::INFINITY, element: 0 };
        for (e, nodes) in rest.mesh.elements.iter().enumerate().filter(|(e, _)| rest.watched[*e]) {
            let x: Corners = std::array::from_fn(|c| self.x[nodes[c] as usize]);
            let det = force::min_det(&x, rest.mesh.edge);
            if det < least.det_f {
                least = MinDetF { det_f: det, element: e };
            }
        }
        least
    }

    /// Centre of mass, m.
    pub fn centre(&self) -> Vec3 {
        self.weighted(&self.x)
    }

    /// Velocity of the centre of mass, m/s.
    pub fn velocity(&self) -> Vec3 {
        self.weighted(&self.v)
    }

    fn weighted(&self, values: &[Vec3]) -> Vec3 {
        let sum: Vec3 = values.iter().zip(&self.model.mass).map(|(x, m)| x * *m).sum();
        sum / self.model.total_mass()
    }

    /// Kinetic energy, J.
    pub fn kinetic_energy(&self) -> f64 {
        0.5 * self.v.iter().zip(&self.model.mass).map(|(v, m)| m * v.norm_squared()).sum::<f64>()
    }

    /// Largest node speed, m/s.
    pub fn max_speed(&self) -> f64 {
        self.v.iter().map(|v| v.norm_squared()).fold(0.0, f64::max).sqrt()
    }
}
