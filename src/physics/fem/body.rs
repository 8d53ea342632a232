//! The finite-element model of a soft body (immutable, shared) and its state.

use std::sync::Arc;

use super::{
    densification::{self, Densification},
    element::{self, Stiffness},
    force::{self, ElementCorners, Relaxing, elastic},
    material::ElasticMaterial,
    relaxation::{Branch, BranchStep, Relaxation},
    rotation::polar,
};
use softvt_geometry::{
    Mat3, Pose, Quat, Vec3, hex8,
    samples::{SampleSpec, surface_samples},
    shape::Shape,
    voxel::{
        CELLS_PER_VOXEL, DistinctFills, OccupancyMask, SurfaceSample, VoxelMesh, VoxelMeshError, VoxelSpec,
        voxel_mesh,
    },
};

/// Smallest mass of a node relative to that of a full interior node.
const MIN_MASS_RATIO: f64 = 1e-3;
/// Fill fraction below which a voxel is not checked for inversion.
const MIN_CHECKED_FILL: f64 = 0.2;

/// Contact samples carried by the same nodes: those of an element, or of one of its faces.
#[derive(Clone, Debug)]
pub struct ContactSampleGroup {
    /// The nodes, of which the first `count` are used.
    pub nodes: [u32; 8],
    /// Number of used entries of `nodes`.
    pub count: usize,
    /// First sample of the group.
    pub first: usize,
    /// One past its last sample.
    pub last: usize,
    /// Edge of its largest patch, m.
    pub spacing: f64,
}

/// A contact sample: a quadrature point of the surface, embedded in the mesh.
#[derive(Clone, Debug)]
pub struct ContactSample {
    /// Position, normal and area at rest.
    pub surface: SurfaceSample,
    /// Weights of the nodes of its group; they sum to 1.
    pub weights: [f64; 8],
}

/// The finite-element model of a soft body: mesh, material, masses, rest stiffness and contact samples.
///
/// It is immutable and can be shared by several bodies.
#[derive(Debug)]
pub struct FemModel {
    /// The undeformed voxel mesh, object frame.
    pub mesh: VoxelMesh,
    /// Elastic constants and density of all elements.
    pub material: ElasticMaterial,
    /// Lumped node masses, kg; they sum to density × volume.
    pub mass: Vec<f64>,
    /// Contact samples, ordered by group.
    pub samples: Vec<ContactSample>,
    /// Consecutive samples on the same nodes.
    pub groups: Vec<ContactSampleGroup>,
    /// Square root of the mean sample area, m: the typical spacing.
    pub spacing: f64,
    pub(super) stiffness: Vec<Stiffness>,
    pub(super) stiffness_of: Vec<u32>,
    pub(super) corners: ElementCorners,
    /// Mean shape gradients, parallel to `stiffness`.
    pub(super) mean: Vec<[Vec3; 8]>,
    /// Share of material, parallel to `stiffness`.
    pub(super) share: Vec<f64>,
    pub(super) densification: Densification,
    /// Damping by the material's loss factor; `None` for a material without one.
    pub(crate) relaxation: Option<Relaxation>,
    is_checked: Vec<bool>,
}

/// Memory of the factor of a body of n nodes over n^(4/3), bytes: measured on cubes of 6 to 24 voxels per edge. The
/// exponent is that of the fill of nested dissection.
const FACTOR_BYTES: f64 = 2048.0;

/// Processor time of a simulated second (60 steps) of a body of n nodes at rest on a support over n^(3/2), s: of the
/// order of that of cubes of 6 to 24 voxels per edge.
const SECONDS: f64 = 8e-6;

impl FemModel {
    /// Estimated memory of the factor of a body of so many nodes, bytes.
    pub fn estimated_bytes(nodes: usize) -> f64 {
        FACTOR_BYTES * (nodes as f64).powf(4.0 / 3.0)
    }

    /// Estimated processor time of a simulated second of a body of so many nodes, s.
    pub fn estimated_seconds(nodes: usize) -> f64 {
        SECONDS * (nodes as f64).powf(1.5)
    }

    /// Estimated memory of a body after its first step, bytes.
    pub fn bytes(&self) -> usize {
        let (nodes, elements) = (self.mesh.nodes.len(), self.mesh.elements.len());
        let branches = self.relaxation.map_or(0, |_| elements * size_of::<Branch>());
        // Six vectors per node: position at rest and now, velocity, force, and two for a product with the tangent.
        let own = nodes * (size_of::<f64>() + 6 * size_of::<Vec3>())
            + elements * (size_of::<[u32; 8]>() + size_of::<OccupancyMask>() + 2 * size_of::<Mat3>())
            + branches
            + self.samples.len() * size_of::<ContactSample>()
            + self.stiffness.len() * size_of::<Stiffness>();
        own + Self::estimated_bytes(nodes) as usize
    }

    /// Builds the model of a shape with `resolution` voxels along its longest edge.
    ///
    /// `volume` (m³) is the mass of [`mass_properties`](softvt_geometry::mass::mass_properties) at unit density. It is
    /// a parameter because its computation may take longer than everything else.
    ///
    /// # Errors
    /// The shape has no voxel mesh.
    pub fn from_shape(
        shape: &Shape,
        volume: f64,
        material: ElasticMaterial,
        resolution: usize,
        spacing: &SampleSpec,
    ) -> Result<Arc<Self>, VoxelMeshError> {
        let mesh = voxel_mesh(shape, &VoxelSpec { resolution })?;
        let samples = surface_samples(shape, &mesh, spacing);
        Ok(Self::new(mesh, material, volume, samples))
    }

    /// Builds the model; `volume` (m³) is the true volume of the body, which determines its mass.
    pub fn new(
        mesh: VoxelMesh,
        material: ElasticMaterial,
        volume: f64,
        samples: Vec<SurfaceSample>,
    ) -> Arc<Self> {
        let h = mesh.edge;
        let DistinctFills { fills, of_element: stiffness_of } = mesh.distinct_fills();
        let stiffness = fills.iter().map(|f| element::stiffness(h, f, &material)).collect();
        let spacing = (samples.iter().map(|s| s.area).sum::<f64>() / samples.len().max(1) as f64).sqrt();
        let (samples, groups) = group_samples(&mesh, samples);
        Arc::new(Self {
            mass: node_masses(&mesh, material.density(), volume),
            is_checked: mesh.occupancy.iter().map(|f| f.fraction() >= MIN_CHECKED_FILL).collect(),
            material,
            samples,
            groups,
            spacing,
            stiffness,
            stiffness_of,
            corners: std::array::from_fn(|c| hex8::corner(c) * h),
            mean: fills.iter().map(|fill| element::mean_gradients(h, fill)).collect(),
            share: fills.iter().map(|fill| fill.fraction()).collect(),
            densification: Densification::new(&material, h),
            relaxation: material.relaxation(),
            mesh,
        })
    }

    /// Edge of the largest patch of all samples, m.
    pub(crate) fn max_spacing(&self) -> f64 {
        self.groups.iter().map(|group| group.spacing).fold(0.0, f64::max)
    }

    /// Total mass, kg.
    pub fn total_mass(&self) -> f64 {
        self.mass.iter().sum()
    }

    /// Normal contact stiffness of the surface per area, Pa/m: `min(1e9, 7 E/h)` with the voxel edge h.
    ///
    /// It stands for the compliance to pressure that changes within a voxel, which the voxels lack: that of a half
    /// space to a wave of length λ is `λ (1 − ν²) / (π E)`. The factor is measured: presses by gel pads, and by flat
    /// ones in the independent reference, with 6 to 12 voxels have the force of 24 within 6 %. With a stiff surface,
    /// 30, force and deformation at a width are up to 28 and 42 % too large with six voxels.
    pub fn contact_modulus(&self) -> f64 {
        (7.0 * self.material.youngs_pa() / self.mesh.edge).min(1e9)
    }
}

/// Masses lumped by the shape functions over the filled part, limited from below, and scaled to a total
/// of `density · volume`.
fn node_masses(mesh: &VoxelMesh, density: f64, volume: f64) -> Vec<f64> {
    let cell = mesh.edge.powi(3) / CELLS_PER_VOXEL as f64;
    let mut mass = vec![0.0; mesh.nodes.len()];
    for (nodes, fill) in mesh.elements.iter().zip(&mesh.occupancy) {
        for centre in fill.centres() {
            for (&node, w) in nodes.iter().zip(hex8::weights(&centre)) {
                mass[node as usize] += density * cell * w;
            }
        }
    }
    let floor = MIN_MASS_RATIO * density * mesh.edge.powi(3);
    mass.iter_mut().for_each(|m| *m = m.max(floor));
    let scale = density * volume / mass.iter().sum::<f64>();
    mass.iter_mut().for_each(|m| *m *= scale);
    mass
}

/// Groups samples that are carried by the same nodes and sorts them by group.
fn group_samples(
    mesh: &VoxelMesh,
    samples: Vec<SurfaceSample>,
) -> (Vec<ContactSample>, Vec<ContactSampleGroup>) {
    let key = |s: &SurfaceSample| {
        let weights = s.at.weights();
        let mask = weights.iter().enumerate().fold(0u8, |m, (c, w)| if *w > 1e-12 { m | 1 << c } else { m });
        (s.at.element, mask)
    };
    let mut keyed: Vec<((u32, u8), SurfaceSample)> = samples.into_iter().map(|s| (key(&s), s)).collect();
    keyed.sort_by_key(|(key, _)| *key);
    let (mut out, mut groups): (Vec<ContactSample>, Vec<ContactSampleGroup>) =
        (Vec::with_capacity(keyed.len()), Vec::new());
    let mut last_key = None;
    for (key, surface) in keyed {
        let corners: Vec<usize> = (0..8).filter(|c| key.1 >> c & 1 == 1).collect();
        if last_key != Some(key) {
            last_key = Some(key);
            let mut nodes = [0; 8];
            let element = mesh.elements[key.0 as usize];
            corners.iter().enumerate().for_each(|(i, &c)| nodes[i] = element[c]);
            let (first, last) = (out.len(), out.len());
            groups.push(ContactSampleGroup { nodes, count: corners.len(), first, last, spacing: 0.0 });
        }
        let all = surface.at.weights();
        let mut weights = [0.0; 8];
        corners.iter().enumerate().for_each(|(i, &c)| weights[i] = all[c]);
        let spacing = surface.area.sqrt();
        out.push(ContactSample { surface, weights });
        if let Some(group) = groups.last_mut() {
            group.last = out.len();
            group.spacing = group.spacing.max(spacing);
        }
    }
    (out, groups)
}

/// Smallest volume ratio in a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MinDetF {
    /// Determinant of the deformation gradient; 1 at rest, ≤ 0 for an inverted element.
    pub det_f: f64,
    /// Index of the element with this determinant.
    pub element: usize,
}

/// State of a soft body: node positions and velocities, and the elastic forces and rotations computed from them.
///
/// After changing `x`, call [`FemState::update_elastic`].
#[derive(Clone, Debug)]
pub struct FemState {
    /// Mesh, masses and stiffness, shared by equal bodies.
    pub model: Arc<FemModel>,
    /// Node positions, m, world.
    pub x: Vec<Vec3>,
    /// Node velocities, m/s, world.
    pub v: Vec<Vec3>,
    /// Elastic node forces at `x`, N, world.
    pub force: Vec<Vec3>,
    /// Element rotations at `x`, from the object frame to the world.
    pub rotation: Vec<Mat3>,
    /// Mean rotation of the body, from the object frame to the world.
    pub frame: Mat3,
    /// Stored elastic energy at `x`, J.
    pub elastic_energy: f64,
    /// Largest curvature of the densification of each element at `x`.
    pub(super) densification: Vec<f64>,
    /// The Maxwell branch of each element; none for a material without loss factor.
    branches: Vec<Branch>,
    min_det_f: MinDetF,
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
            densification: vec![0.0; model.mesh.elements.len()],
            branches: model
                .relaxation
                .map_or(Vec::new(), |_| vec![Branch::default(); model.mesh.elements.len()]),
            min_det_f: MinDetF { det_f: 1.0, element: 0 },
            x,
            model,
        }
    }

    /// Updates rotations, forces, energy and volume ratios for the current positions, to which the body has moved
    /// within `dt`, s.
    pub fn update_elastic(&mut self, dt: f64) {
        let (rest, step) = (&*self.model, BranchStep::new(dt));
        self.force.fill(Vec3::zeros());
        self.elastic_energy = 0.0;
        self.min_det_f = MinDetF { det_f: f64::INFINITY, element: 0 };
        let mut mean = Mat3::zeros();
        for (e, nodes) in rest.mesh.elements.iter().enumerate() {
            let x: ElementCorners = std::array::from_fn(|c| self.x[nodes[c] as usize]);
            let kind = rest.stiffness_of[e] as usize;
            let (k0, mean_gradients) = (&rest.stiffness[kind], &rest.mean[kind]);
            let relaxing = self.branches.get_mut(e).zip(rest.relaxation);
            let relaxing = relaxing.map(|(branch, law)| Relaxing { branch, share: law.share, step });
            let mut result = elastic(&x, &rest.corners, mean_gradients, k0, self.rotation[e], relaxing);
            let det_f = force::min_det(&x, rest.mesh.edge);
            if rest.is_checked[e] && det_f < self.min_det_f.det_f {
                self.min_det_f = MinDetF { det_f, element: e };
            }
            self.densification[e] = if det_f < densification::ONSET {
                rest.densification.add(&x, rest.share[kind], &mut result)
            } else {
                0.0
            };
            self.rotation[e] = result.rotation;
            self.elastic_energy += result.energy;
            mean += result.rotation;
            for (c, f) in result.force.iter().enumerate() {
                self.force[nodes[c] as usize] += f;
            }
        }
        self.frame = polar(&(mean / rest.mesh.elements.len() as f64), self.frame);
    }

    /// Smallest det F at `x` over the Gauss points of all elements that hold enough material.
    pub fn min_det_f(&self) -> MinDetF {
        self.min_det_f
    }

    /// Object frame of the body as if it were rigid, world: its mean rotation and mean node position.
    pub fn mean_pose(&self) -> Pose {
        let mean = |nodes: &[Vec3]| nodes.iter().sum::<Vec3>() / nodes.len() as f64;
        let rotation = Quat::from_matrix(&self.frame);
        Pose::from_parts((mean(&self.x) - rotation * mean(&self.model.mesh.nodes)).into(), rotation)
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

    /// Velocity of a contact sample of a group, m/s.
    pub(crate) fn sample_velocity(&self, group: usize, sample: usize) -> Vec3 {
        let (group, sample) = (&self.model.groups[group], &self.model.samples[sample]);
        let nodes = group.nodes[..group.count].iter().zip(&sample.weights);
        nodes.map(|(&node, weight)| self.v[node as usize] * *weight).sum()
    }

    /// Momentum of each node, N s.
    pub fn momenta(&self) -> impl Iterator<Item = Vec3> {
        self.v.iter().zip(&self.model.mass).map(|(v, m)| v * *m)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_branches_of_a_material_with_a_loss_factor_count_as_memory() {
        let bytes = |loss_factor: f64| {
            let material =
                ElasticMaterial::new(3e4, 0.4, 300.0).and_then(|own| own.with_loss_factor(loss_factor));
            let (cube, material) = (Shape::cuboid(Vec3::repeat(0.05)), material.expect("valid"));
            let model = FemModel::from_shape(&cube, 1.25e-4, material, 4, &SampleSpec::default());
            model.expect("a cube").bytes()
        };
        // 64 elements with the stretch and the last displacement of 8 corners.
        assert_eq!(bytes(0.1) - bytes(0.0), 64 * 2 * 8 * 3 * 8);
    }
}
