//! Compressive strain of a soft body at its Gauss points, and the share of its volume beyond a strain.
//!
//! The strain is `ε = 1 − σ_min(F)`: the engineering (Biot) strain of the most shortened direction, invariant to
//! rotations. `σ_min` has the sign of `det F`, so that an inverted point has a strain above 1. A point counts with an
//! eighth of its voxel's filled volume. Voxels filled by less than a tenth are not counted.

use nalgebra::Vector3;

use super::{
    body::{FemModel, FemState},
    force::{ElementCorners, gauss_gradients},
};
use softvt_geometry::{Mat3, Vec3, hex8, voxel::VoxelMesh};

/// Fill fraction below which a voxel is not counted.
const MIN_COUNTED_FILL: f64 = 0.1;
/// Gauss points of an element.
const POINTS: usize = 8;

/// Compressive strain `1 − σ_min(F)` of a deformation gradient.
pub fn compressive_strain(f: &Mat3) -> f64 {
    // A matrix that is not finite has no singular values.
    let smallest = f.try_svd(false, false, f64::EPSILON, 0).map_or(f64::NAN, |svd| svd.singular_values.min());
    1.0 - smallest * if f.determinant() < 0.0 { -1.0 } else { 1.0 }
}

/// Compressive strain at every node of a body whose nodes are at `x`, for displays: the mean over the Gauss points of
/// its elements, weighted by their volume; 0 where none is counted.
pub fn node_strains(model: &FemModel, x: &[Vec3]) -> Vec<f64> {
    let mesh = &model.mesh;
    let (mut sums, mut weights) = (vec![0.0; mesh.nodes.len()], vec![0.0; mesh.nodes.len()]);
    for (element, occupancy) in mesh.occupancy.iter().enumerate() {
        let fill = occupancy.fraction();
        if fill < MIN_COUNTED_FILL {
            continue;
        }
        let mean = gradients_at(mesh, x, element).iter().map(compressive_strain).sum::<f64>() / POINTS as f64;
        for &node in &mesh.elements[element] {
            sums[node as usize] += fill * mean;
            weights[node as usize] += fill;
        }
    }
    sums.iter().zip(&weights).map(|(sum, weight)| if *weight > 0.0 { sum / weight } else { 0.0 }).collect()
}

/// Cauchy–Green tensor of a deformation gradient, and whether the gradient is inverted.
struct Stretch {
    xx: f64,
    yy: f64,
    zz: f64,
    xy: f64,
    xz: f64,
    yz: f64,
    is_inverted: bool,
}

impl Stretch {
    fn new(f: &Mat3) -> Self {
        let (x, y, z) = (f.column(0), f.column(1), f.column(2));
        Self {
            xx: x.dot(&x),
            yy: y.dot(&y),
            zz: z.dot(&z),
            xy: x.dot(&y),
            xz: x.dot(&z),
            yz: y.dot(&z),
            is_inverted: f.determinant() < 0.0,
        }
    }

    /// True if the compressive strain is above `strain`: `FᵀF − (1 − strain)² I` is not positive semidefinite, or
    /// det F is negative. Exact up to rounding, by the pivots of the LDLᵀ factorisation.
    fn is_beyond(&self, strain: f64) -> bool {
        let shift = (1.0 - strain) * (1.0 - strain);
        let first = self.xx - shift;
        let (l_y, l_z) = (self.xy / first, self.xz / first);
        let second = self.yy - shift - l_y * self.xy;
        let rest = self.yz - l_z * self.xy;
        let third = self.zz - shift - l_z * self.xz - rest * rest / second;
        // A value that is not a number counts as beyond.
        let is_within = first > 0.0 && second > 0.0 && third >= 0.0;
        self.is_inverted || !is_within
    }
}

/// Two limits on the compressive strain of a material, each in (0, 1]; `None` if the material does not state it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StrainLimits {
    /// Strain at which cell walls buckle; reversible in an elastomer.
    pub collapse: Option<f64>,
    /// Strain that leaves damage after release.
    pub damage: Option<f64>,
}

/// Measures the strains of a body, and accumulates its damage.
#[derive(Clone, Debug)]
pub struct StrainMeter {
    /// Share of the counted volume of one Gauss point of each element; 0 for elements that are not counted.
    share: Vec<f64>,
    limits: StrainLimits,
    /// Share of the volume that is beyond the collapse strain now.
    collapsed_share: f64,
    /// Share of the volume that has ever been beyond the damage strain.
    damaged_share: f64,
    /// One bit per Gauss point that has been beyond the damage strain.
    damaged: Vec<u8>,
}

impl StrainMeter {
    /// A meter of an undamaged body of `model`.
    pub fn new(model: &FemModel, limits: StrainLimits) -> Self {
        let fills = model.mesh.occupancy.iter().map(|fill| fill.fraction());
        let counted = fills.map(|fill| if fill >= MIN_COUNTED_FILL { fill } else { 0.0 });
        let counted: Vec<f64> = counted.collect();
        let total = POINTS as f64 * counted.iter().sum::<f64>();
        let share = counted.iter().map(|fill| fill / total.max(f64::MIN_POSITIVE)).collect();
        Self { share, limits, collapsed_share: 0.0, damaged_share: 0.0, damaged: vec![0; counted.len()] }
    }

    /// Share of the volume (0..=1) that was beyond the collapse strain in the state of the last update;
    /// `None` without that limit.
    pub fn collapsed_share(&self) -> Option<f64> {
        self.limits.collapse.map(|_| self.collapsed_share)
    }

    /// Share of the volume (0..=1) that has ever been beyond the damage strain; `None` without that limit.
    pub fn damaged_share(&self) -> Option<f64> {
        self.limits.damage.map(|_| self.damaged_share)
    }

    /// Takes in the present state. Does not allocate.
    pub fn update(&mut self, state: &FemState) {
        let StrainLimits { collapse, damage } = self.limits;
        if collapse.is_none() && damage.is_none() {
            return;
        }
        let lowest = collapse.unwrap_or(1.0).min(damage.unwrap_or(1.0));
        let (mut collapsed, mut damaged) = (0.0, 0.0);
        for (element, share) in self.share.iter().enumerate().filter(|(_, share)| **share > 0.0) {
            let before = self.damaged[element];
            let mut now = Marks { collapsed: 0, damaged: before };
            // The bound is several times cheaper than the gradients, and suffices for most elements.
            let is_within = squared_strain_bound(state, element) < lowest * lowest;
            if !is_within {
                for (point, f) in gradients_of(state, element).iter().enumerate() {
                    let stretch = Stretch::new(f);
                    now.collapsed |=
                        u8::from(collapse.is_some_and(|limit| stretch.is_beyond(limit))) << point;
                    now.damaged |= u8::from(damage.is_some_and(|limit| stretch.is_beyond(limit))) << point;
                }
            }
            self.damaged[element] = now.damaged;
            collapsed += share * f64::from(now.collapsed.count_ones());
            damaged += share * f64::from(now.damaged.count_ones());
        }
        (self.collapsed_share, self.damaged_share) = (collapsed, damaged);
    }

    /// Share of the volume (0..=1) that is beyond `strain` now.
    pub fn share_beyond(&self, state: &FemState, strain: f64) -> f64 {
        let counted = self.share.iter().enumerate().filter(|(_, share)| **share > 0.0);
        let beyond = counted.map(|(element, share)| {
            let points =
                gradients_of(state, element).iter().filter(|f| Stretch::new(f).is_beyond(strain)).count();
            share * points as f64
        });
        beyond.sum()
    }

    /// Strain that all but `tail` (0..1) of the volume stays below: `tail` 0.05 is the 95th percentile. NaN if a strain
    /// is not finite or no voxel is counted.
    ///
    /// The strain of a point is its mean over the material within `length` (m) of it at rest, with the bell-shaped
    /// weight `(1 − r²/length²)²`: non-local, as that of damage models (Pijaudier-Cabot & Bažant, Nonlocal damage
    /// theory, J. Eng. Mech. 113, 1987; weight: Bažant & Jirásek, J. Eng. Mech. 128, 2002). The local one, with
    /// `length` 0, is singular at the edge of a pad, and its percentiles depend on the voxels.
    pub fn percentile(&self, state: &FemState, tail: f64, length: f64) -> f64 {
        let mesh = &state.model.mesh;
        let strains = |(element, &share): (usize, &f64)| match share > 0.0 {
            true => gradients_of(state, element).map(|f| compressive_strain(&f)),
            false => [0.0; POINTS],
        };
        let local: Vec<[f64; POINTS]> = self.share.iter().enumerate().map(strains).collect();
        if local.iter().flatten().any(|strain| !strain.is_finite()) {
            return f64::NAN;
        }
        let around = neighbours(mesh.edge, length);
        let mut points: Vec<WeightedStrain> = Vec::new();
        for (element, &share) in self.share.iter().enumerate().filter(|(_, share)| **share > 0.0) {
            let corner = mesh.nodes[mesh.elements[element][0] as usize];
            let cell = ((corner - mesh.origin) / mesh.edge).map(|at| at.round() as i64);
            for (point, own) in local[element].iter().enumerate() {
                let (mut sum, mut weights) = (share * own, share);
                for near in &around[point] {
                    let Some(element) = mesh.element_at((cell + near.cell).into()) else { continue };
                    let weight = self.share[element as usize] * near.weight;
                    sum += weight * local[element as usize][near.point];
                    weights += weight;
                }
                points.push(WeightedStrain { strain: sum / weights, share });
            }
        }
        points.sort_by(|a, b| b.strain.total_cmp(&a.strain));
        let mut above = 0.0;
        let reached = points.iter().find(|point| {
            above += point.share;
            above > tail
        });
        reached.map_or(f64::NAN, |point| point.strain)
    }
}

/// A Gauss point near another.
struct Neighbour {
    /// Voxel relative to the other's.
    cell: Vector3<i64>,
    /// Index in its voxel.
    point: usize,
    /// Weight of its strain, 0..1.
    weight: f64,
}

/// Gauss points within a length of each Gauss point of a voxel of this edge, without itself.
fn neighbours(edge: f64, length: f64) -> [Vec<Neighbour>; POINTS] {
    let (gauss, reach) = (hex8::gauss_points(), (length / edge).ceil() as i64);
    let side = 2 * reach + 1;
    let cells =
        (0..side.pow(3)).map(|k| Vector3::new(k % side, k / side % side, k / side / side).add_scalar(-reach));
    std::array::from_fn(|own| {
        let near = |cell: Vector3<i64>, point: usize| {
            let away = (cell.map(|at| at as f64) + gauss[point] - gauss[own]) * edge;
            let share = 1.0 - away.norm_squared() / (length * length);
            let is_other = cell != Vector3::zeros() || point != own;
            (is_other && share > 0.0).then_some(Neighbour { cell, point, weight: share * share })
        };
        cells.clone().flat_map(|cell| (0..POINTS).filter_map(move |point| near(cell, point))).collect()
    })
}

/// Bits of the Gauss points of an element beyond each limit.
struct Marks {
    collapsed: u8,
    damaged: u8,
}

/// Strain of a point with its share of the volume.
struct WeightedStrain {
    strain: f64,
    share: f64,
}

/// Square of an upper bound on the compressive strain in an element; NaN if a position is.
///
/// Each column of F is a mean of the four edges of the element along that axis, over their length at rest. So `|F − R|`
/// is at most the norm of the largest differences of edges from the columns of R, and `1 − σ_min(F)` at most `|F − R|`
/// for every rotation R (Weyl's inequality for singular values: Horn & Johnson, Matrix Analysis, 2013, §7.3).
fn squared_strain_bound(state: &FemState, element: usize) -> f64 {
    let mesh = &state.model.mesh;
    let corners = mesh.elements[element].map(|node| state.x[node as usize]);
    let inverse = 1.0 / mesh.edge;
    let rotation = &state.rotation[element];
    let largest = |axis: usize| {
        let difference = |low: usize| {
            let edge = (corners[low | 1 << axis] - corners[low]) * inverse;
            (edge - rotation.column(axis)).norm_squared()
        };
        let edges = (0..corners.len()).filter(|corner| corner >> axis & 1 == 0);
        // A NaN stays, unlike in `f64::max`.
        edges
            .map(difference)
            .fold(0.0, |most: f64, own| if own <= most || most.is_nan() { most } else { own })
    };
    largest(0) + largest(1) + largest(2)
}

/// Deformation gradients at the Gauss points of an element.
fn gradients_of(state: &FemState, element: usize) -> [Mat3; POINTS] {
    gradients_at(&state.model.mesh, &state.x, element)
}

/// The same for nodes at `x`.
fn gradients_at(mesh: &VoxelMesh, x: &[Vec3], element: usize) -> [Mat3; POINTS] {
    let nodes = &mesh.elements[element];
    let corners: ElementCorners = std::array::from_fn(|c| x[nodes[c] as usize]);
    gauss_gradients(&corners, mesh.edge)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::fem::ElasticMaterial;
    use softvt_geometry::{Pose, Quat, Vec3, samples::SampleSpec, shape::Shape};

    fn material() -> ElasticMaterial {
        ElasticMaterial::new(3e4, 0.3, 200.0).expect("valid")
    }

    fn state_of(shape: &Shape) -> FemState {
        let model = FemModel::from_shape(shape, 1e-4, material(), 6, &SampleSpec::default()).unwrap();
        FemState::new(model, &Pose::identity())
    }

    fn cube() -> FemState {
        state_of(&Shape::Box { half: Vec3::repeat(0.025) })
    }

    fn deformed(mut state: FemState, f: &Mat3) -> FemState {
        state.x.iter_mut().for_each(|x| *x = f * *x);
        state
    }

    proptest! {
        #[test]
        fn the_bound_on_the_strain_skips_no_point_beyond_the_limit(
            offsets in prop::collection::vec(prop::array::uniform3(-1.0..1.0), 343),
            size in 0.0..4e-3,
            limit in 0.05..0.6,
        ) {
            let mut state = cube();
            state.x.iter_mut().zip(&offsets).for_each(|(x, offset)| *x += Vec3::from(*offset) * size);
            state.update_elastic(0.0);
            let mut meter =
                StrainMeter::new(&state.model, StrainLimits { collapse: Some(limit), damage: None });
            meter.update(&state);
            let exact = meter.share_beyond(&state, limit);
            prop_assert!((meter.collapsed_share().unwrap() - exact).abs() < 1e-12);
        }
    }

    #[test]
    fn no_position_that_is_not_a_number_counts_as_within_a_limit() {
        for node in 0..8 {
            let mut state = cube();
            let node = state.model.mesh.elements[0][node] as usize;
            state.x[node].y = f64::NAN;
            let mut meter =
                StrainMeter::new(&state.model, StrainLimits { collapse: Some(0.5), damage: Some(0.6) });
            meter.update(&state);
            assert_eq!(meter.collapsed_share(), Some(meter.share_beyond(&state, 0.5)));
            assert!(meter.damaged_share().is_some_and(|share| share > 0.0));
        }
    }

    #[test]
    fn a_homogeneous_compression_has_its_strain_everywhere_in_any_rotation() {
        let stretch = Mat3::from_diagonal(&Vec3::new(1.07, 0.8, 1.05));
        for turn in [Vec3::zeros(), Vec3::new(0.3, -1.0, 2.0), Vec3::new(3.1, 0.0, 0.0)] {
            let rotation = *Quat::from_scaled_axis(turn).to_rotation_matrix().matrix();
            let state = deformed(cube(), &(rotation * stretch));
            let meter = StrainMeter::new(&state.model, StrainLimits::default());
            assert!((meter.percentile(&state, 0.05, 0.0) - 0.2).abs() < 1e-12);
            assert_eq!(meter.share_beyond(&state, 0.2 + 1e-9), 0.0);
            assert!((meter.share_beyond(&state, 0.2 - 1e-9) - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn a_linear_gradient_of_strain_gives_its_quantiles() {
        // u = −a y²/2 along y: the strain a·y at height y, bilinear within a voxel up to second order.
        let mut state = cube();
        let slope = 0.2 / 0.025;
        for x in &mut state.x {
            let y = x.y + 0.025;
            x.y -= 0.25 * slope * y * y;
        }
        let meter = StrainMeter::new(&state.model, StrainLimits::default());
        // Voxels have one strain each along y: (2k + 1)/12 of the largest, 0.2.
        let (expected, found) = (0.2 * 11.0 / 12.0, meter.percentile(&state, 0.05, 0.0));
        assert!((found - expected).abs() < 1e-9, "{found}");
        assert!((meter.share_beyond(&state, 0.1) - 0.5).abs() < 1e-12);
    }

    #[test]
    fn damage_stays_when_the_body_recovers_and_collapse_does_not() {
        let rest = cube();
        let pressed = deformed(rest.clone(), &Mat3::from_diagonal(&Vec3::new(1.0, 1.0, 0.7)));
        let limits = StrainLimits { collapse: Some(0.1), damage: Some(0.25) };
        let mut meter = StrainMeter::new(&rest.model, limits);
        meter.update(&rest);
        assert_eq!((meter.collapsed_share(), meter.damaged_share()), (Some(0.0), Some(0.0)));
        meter.update(&pressed);
        let whole = |share: Option<f64>| (share.unwrap() - 1.0).abs() < 1e-12;
        assert!(whole(meter.collapsed_share()) && whole(meter.damaged_share()));
        meter.update(&rest);
        assert_eq!(meter.collapsed_share(), Some(0.0));
        assert!(whole(meter.damaged_share()));
        let mut none = StrainMeter::new(&rest.model, StrainLimits::default());
        none.update(&pressed);
        assert_eq!((none.collapsed_share(), none.damaged_share()), (None, None));
    }

    #[test]
    fn an_inverted_body_is_beyond_every_strain() {
        let state = deformed(cube(), &Mat3::from_diagonal(&Vec3::new(1.0, 1.0, -1.2)));
        let meter = StrainMeter::new(&state.model, StrainLimits::default());
        assert!((meter.share_beyond(&state, 1.0) - 1.0).abs() < 1e-12);
        // The smallest singular value is that of the axes that are not stretched, with the sign of det F.
        assert!((meter.percentile(&state, 0.05, 0.0) - 2.0).abs() < 1e-12);
    }

    #[test]
    fn voxels_that_are_nearly_empty_are_not_counted_and_the_shares_sum_to_one() {
        let state = state_of(&Shape::Sphere { radius: 0.025 });
        let meter = StrainMeter::new(&state.model, StrainLimits::default());
        let total: f64 = meter.share.iter().map(|share| 8.0 * share).sum();
        assert!((total - 1.0).abs() < 1e-12, "{total}");
        for (share, fill) in meter.share.iter().zip(&state.model.mesh.occupancy) {
            assert_eq!(*share > 0.0, fill.fraction() >= 0.1);
        }
    }

    #[test]
    fn a_state_that_is_not_finite_has_no_percentile_and_is_beyond() {
        let mut state = cube();
        state.x.iter_mut().for_each(|x| x.y = f64::NAN);
        let meter = StrainMeter::new(&state.model, StrainLimits::default());
        assert!(meter.percentile(&state, 0.05, 0.0).is_nan());
        assert!((meter.share_beyond(&state, 0.9) - 1.0).abs() < 1e-12);
    }

    proptest! {
        #[test]
        fn the_test_by_pivots_agrees_with_the_singular_values(e in prop::collection::vec(-1.0f64..1.0, 9), strain in 0.01f64..0.99) {
            let f = Mat3::identity() + Mat3::from_column_slice(&e);
            let found = compressive_strain(&f);
            prop_assume!((found - strain).abs() > 1e-9);
            prop_assert_eq!(Stretch::new(&f).is_beyond(strain), found > strain);
        }
    }
}
