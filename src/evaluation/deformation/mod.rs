//! FEM-RMS deformation D: distance of a soft body from its reference shape after removal of the rigid motion.
//!
//! With positions `x` now and `X` in the reference shape, their means `c` and `C` over the volume `V`, and the diagonal
//! `d` of the bounding box of the object as modelled ([`ReferenceShape::of_mesh`]):
//!
//! `D = 100 % · sqrt( 1/V ∫ |x − c − R (X − C)|² dV ) / d`
//!
//! `R` is the proper rotation that minimises the sum (Kabsch, 1976), found as the leading eigenvector of Horn's 4×4
//! matrix (Horn, "Closed-form solution of absolute orientation using unit quaternions", 1987). That is the same
//! optimum as the SVD with a flipped last singular vector, but it is a proper rotation by construction, also for
//! flat and collapsed bodies.
//!
//! The integral of the score ([`METRIC_ID`]) is exact for the displacements of the elements, and the box is that of the
//! surface, so that D depends on the mesh only by these displacements. A sum over nodes, each with the volume that it
//! stands for, is 3 % larger with six voxels along an edge. SoftVTBench's released code weights all nodes alike and
//! takes their box along the axes of the world ([`V1_METRIC_ID`]); that value is reported too. The reference is the
//! settled shape, so sagging under gravity does not count.

pub mod series;

use nalgebra::{Matrix4, Quaternion, SymmetricEigen};

use softvt_geometry::{
    Aabb, Mat3, Quat, Vec3,
    voxel::{VolumeProduct, VoxelMesh},
};

/// Name of D as it is scored: integrated over the volume, of the diagonal along the axes of the object.
pub const METRIC_ID: &str = "fem_volume_rms_rigid_aligned_object_bbox_pct_v2";

/// Name of D as SoftVTBench's released code defines it: all nodes alike, of the diagonal along the axes of the world.
pub const V1_METRIC_ID: &str = "fem_rms_rigid_aligned_bbox_pct_v1";

/// Diagonal of a bounding box below which a body counts as a point, m.
const SMALLEST_DIAGONAL_M: f64 = 1e-12;

/// A deformation cannot be measured.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct DeformationError(String);

/// Deformation of a body at one moment; percentages are of [`ReferenceShape::diagonal_m`] unless said otherwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deformation {
    /// D, % ([`METRIC_ID`]).
    pub rms_pct: f64,
    /// Largest node displacement of the same fit, %.
    pub max_pct: f64,
    /// D as SoftVTBench's released code defines it ([`V1_METRIC_ID`]), % of [`ReferenceShape::v1_diagonal_m`].
    pub v1_rms_pct: f64,
    /// Rotation of the fit, from the reference to the current shape.
    pub rotation: Quat,
    /// Extents of the current world-aligned bounding box, m.
    pub bbox_m: Vec3,
}

/// Shape that deformations are measured from, usually the settled one.
///
/// Sums over the reference nodes are precomputed, so that [`ReferenceShape::measure`] takes two passes over the nodes
/// and does not allocate memory.
#[derive(Clone, Debug)]
pub struct ReferenceShape {
    /// Node positions about their uniform mean, m.
    nodes: Vec<Vec3>,
    /// Share of the volume of each node, summing to one.
    weights: Vec<f64>,
    /// Mean of `nodes` over the volume, m.
    weighted_centre: Vec3,
    /// Products of the positions with the shape functions of each node over the volume, m: `weights` times `nodes`
    /// where the volume is in the nodes.
    products: Vec<Vec3>,
    /// Product over the elements with the inverse of their volume, 1/m³; `None` where the volume is in the nodes.
    elements: Option<(VolumeProduct, f64)>,
    /// Extents of the bounding box in the frame of the nodes, m.
    bbox_m: Vec3,
    /// Diagonal of the bounding box of the object, m.
    diagonal_m: f64,
}

/// Means of a set of nodes and their covariance sums with the reference, from one pass.
struct AlignmentSums {
    mean: Vec3,
    weighted_mean: Vec3,
    product: Mat3,
    weighted_product: Mat3,
    bbox_m: Vec3,
}

impl ReferenceShape {
    /// Prepares a reference of points alone from its `nodes` (m, any frame) and one weight per node, of which only
    /// ratios matter.
    ///
    /// # Errors
    /// Fewer than three nodes, a node that is not finite, a body without size, or weights that are not one per node,
    /// negative, not finite or all zero.
    pub fn new(nodes: &[Vec3], weights: &[f64]) -> Result<Self, DeformationError> {
        let refuse = |problem: String| Err(DeformationError(problem));
        if nodes.len() < 3 {
            return refuse(format!("a deformation needs at least 3 nodes, got {}", nodes.len()));
        }
        if nodes.len() != weights.len() {
            return refuse(format!("{} nodes but {} node weights", nodes.len(), weights.len()));
        }
        require_finite(nodes)?;
        let total: f64 = weights.iter().sum();
        let bad = weights.iter().position(|w| !w.is_finite() || *w < 0.0);
        if let Some(node) = bad.or((total <= 0.0 || !total.is_finite()).then_some(0)) {
            let weight = weights[node];
            return refuse(format!(
                "node weight {node} is {weight}: weights must be finite, not negative, and not all zero"
            ));
        }
        let weights: Vec<f64> = weights.iter().map(|w| w / total).collect();
        let bbox_m = Aabb::from_points(nodes).map_or_else(Vec3::zeros, |bounds| bounds.size());
        let diagonal_m = bbox_m.norm();
        if diagonal_m <= SMALLEST_DIAGONAL_M || !diagonal_m.is_finite() {
            return refuse(format!(
                "the diagonal of the bounding box is {diagonal_m} m: the body has no size"
            ));
        }
        // Means are taken about the first node: a small body far from the origin loses no digits.
        let mean = nodes[0] + nodes.iter().map(|x| x - nodes[0]).sum::<Vec3>() / nodes.len() as f64;
        let nodes: Vec<Vec3> = nodes.iter().map(|x| x - mean).collect();
        let products: Vec<Vec3> = nodes.iter().zip(&weights).map(|(x, w)| x * *w).collect();
        let weighted_centre = products.iter().sum();
        Ok(Self { nodes, weights, weighted_centre, products, elements: None, bbox_m, diagonal_m })
    }

    /// Prepares a reference of a body with this `mesh`, whose nodes are at `nodes` (m, any frame). The bounding box of
    /// the object along its own axes has the diagonal `diagonal_m`, m.
    ///
    /// # Errors
    /// As [`ReferenceShape::new`].
    pub fn of_mesh(nodes: &[Vec3], mesh: &VoxelMesh, diagonal_m: f64) -> Result<Self, DeformationError> {
        let product = VolumeProduct::new(mesh);
        let volumes: Vec<f64> = product.times(nodes.len(), |_| Vec3::x()).iter().map(|sum| sum.x).collect();
        let mut reference = Self::new(nodes, &volumes)?;
        let per_volume = 1.0 / volumes.iter().sum::<f64>();
        let products = product.times(nodes.len(), |node| reference.nodes[node]);
        reference.products = products.iter().map(|sum| sum * per_volume).collect();
        reference.elements = Some((product, per_volume));
        Ok(Self { diagonal_m, ..reference })
    }

    /// Diagonal of the bounding box of the object along its own axes, m; that of the nodes if it has no mesh.
    pub fn diagonal_m(&self) -> f64 {
        self.diagonal_m
    }

    /// Diagonal of the reference's bounding box in the frame of the nodes, m.
    pub fn v1_diagonal_m(&self) -> f64 {
        self.bbox_m.norm()
    }

    /// Extents of the reference's bounding box in the frame of the nodes, m.
    pub fn bbox_m(&self) -> Vec3 {
        self.bbox_m
    }

    /// Number of nodes, at least three.
    pub fn node_count(&self) -> usize {
        self.nodes.len()
    }

    /// Deformation of `nodes` (m, any frame, in the order of the reference).
    ///
    /// # Errors
    /// Another number of nodes than the reference has, or a node that is not finite.
    pub fn measure(&self, nodes: &[Vec3]) -> Result<Deformation, DeformationError> {
        if nodes.len() != self.nodes.len() {
            let (expected, got) = (self.nodes.len(), nodes.len());
            return Err(DeformationError(format!(
                "the reference has {expected} nodes, the measured body {got}"
            )));
        }
        let sums = self.sums(nodes)?;
        let rotation = best_rotation(&sums.weighted_product);
        let (fit, v1_fit) = (
            rotation.to_rotation_matrix().into_inner(),
            best_rotation(&sums.product).to_rotation_matrix().into_inner(),
        );
        let displacement = |node: usize| {
            nodes[node] - nodes[0] - sums.weighted_mean - fit * (self.nodes[node] - self.weighted_centre)
        };
        let (mut sum, mut largest, mut v1_sum) = (0.0_f64, 0.0_f64, 0.0_f64);
        for (node, (x, rest)) in nodes.iter().zip(&self.nodes).enumerate() {
            let square = displacement(node).norm_squared();
            sum += self.weights[node] * square;
            largest = largest.max(square);
            v1_sum += (x - nodes[0] - sums.mean - v1_fit * rest).norm_squared();
        }
        if let Some((product, per_volume)) = &self.elements {
            sum = per_volume
                * product
                    .elements()
                    .map(|(nodes, matrix)| {
                        let d = nodes.map(|node| displacement(node as usize));
                        let row = |(a, weights): (&Vec3, &[f64; 8])| {
                            a.dot(&d.iter().zip(weights).map(|(b, weight)| b * *weight).sum())
                        };
                        d.iter().zip(matrix).map(row).sum::<f64>()
                    })
                    .sum::<f64>();
        }
        // Finite nodes may still be so far away that their squares overflow.
        if !(v1_sum.is_finite() && sum.is_finite()) {
            return Err(far_node(nodes));
        }
        let percent = 100.0 / self.diagonal_m();
        Ok(Deformation {
            rms_pct: percent * sum.sqrt(),
            max_pct: percent * largest.sqrt(),
            v1_rms_pct: 100.0 / self.v1_diagonal_m() * (v1_sum / nodes.len() as f64).sqrt(),
            rotation,
            bbox_m: sums.bbox_m,
        })
    }

    fn sums(&self, nodes: &[Vec3]) -> Result<AlignmentSums, DeformationError> {
        let (mut sum, mut weighted_sum) = (Vec3::zeros(), Vec3::zeros());
        let (mut product, mut weighted_product) = (Mat3::zeros(), Mat3::zeros());
        let (mut low, mut high) = (nodes[0], nodes[0]);
        for (node, x) in nodes.iter().enumerate() {
            (low, high) = (low.inf(x), high.sup(x));
            let x = x - nodes[0];
            sum += x;
            weighted_sum += x * self.weights[node];
            product += x * self.nodes[node].transpose();
            weighted_product += x * self.products[node].transpose();
        }
        weighted_product -= weighted_sum * self.weighted_centre.transpose();
        // An eigenvector search must not be given a NaN.
        if !product.iter().chain(weighted_product.iter()).all(|v| v.is_finite()) {
            require_finite(nodes)?;
            return Err(far_node(nodes));
        }
        let mean = sum / nodes.len() as f64;
        Ok(AlignmentSums { mean, weighted_mean: weighted_sum, product, weighted_product, bbox_m: high - low })
    }
}

/// The rotation that maximises `tr(Rᵀ P)` with `P = Σ x Xᵀ` (Horn, 1987).
fn best_rotation(product: &Mat3) -> Quat {
    let p = product;
    let (a, b, c) = (p[(2, 1)] - p[(1, 2)], p[(0, 2)] - p[(2, 0)], p[(1, 0)] - p[(0, 1)]);
    let (d, e, f) = (p[(1, 0)] + p[(0, 1)], p[(0, 2)] + p[(2, 0)], p[(2, 1)] + p[(1, 2)]);
    let (x, y, z) = (p[(0, 0)], p[(1, 1)], p[(2, 2)]);
    #[rustfmt::skip]
    let matrix = Matrix4::new(
        x + y + z, a, b, c,
        a, x - y - z, d, e,
        b, d, y - x - z, f,
        c, e, f, z - x - y,
    );
    let eigen = SymmetricEigen::new(matrix);
    let leading =
        (1..4).fold(0, |best, i| if eigen.eigenvalues[i] > eigen.eigenvalues[best] { i } else { best });
    let q = eigen.eigenvectors.column(leading);
    let sign = if q[0] < 0.0 { -1.0 } else { 1.0 };
    Quat::from_quaternion(Quaternion::new(q[0], q[1], q[2], q[3]) * sign)
}

fn require_finite(nodes: &[Vec3]) -> Result<(), DeformationError> {
    let bad = nodes.iter().position(|x| !x.iter().all(|v| v.is_finite()));
    bad.map_or(Ok(()), |node| Err(non_finite(nodes, node)))
}

fn far_node(nodes: &[Vec3]) -> DeformationError {
    let node = (1..nodes.len()).fold(0, |far, i| if nodes[i].amax() > nodes[far].amax() { i } else { far });
    non_finite(nodes, node)
}

fn non_finite(nodes: &[Vec3], node: usize) -> DeformationError {
    let p = nodes[node];
    DeformationError(format!(
        "node {node} is not finite ({}, {}, {}): the simulation has diverged",
        p.x, p.y, p.z
    ))
}

#[cfg(test)]
mod tests;
