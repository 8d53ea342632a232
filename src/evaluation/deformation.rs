//! How far a soft body is from its reference shape once its rigid motion is removed: FEM-RMS deformation D.
//!
//! `D = sqrt( Σ wᵢ |xᵢ − c − R (Xᵢ − C)|² / Σ wᵢ ) / diagonal`, in percent, with `R` the best proper rotation (Kabsch,
//! 1976). `R` is found as the leading eigenvector of Horn's 4×4 matrix (Horn, "Closed-form solution of absolute
//! orientation using unit quaternions", 1987): the same optimum as the SVD with a flipped last singular vector, but it
//! is a proper rotation by construction, also for flat and collapsed bodies.

use nalgebra::{Matrix4, Quaternion, SymmetricEigen};

use crate::geometry::{Mat3, Quat, Vec3};

/// The name of the uniform RMS measure, shared with SoftVTBench.
pub const METRIC_ID: &str = "fem_rms_rigid_aligned_bbox_pct_v1";

/// A bounding box with a smaller diagonal than this is a point, m.
const SMALLEST_DIAGONAL_M: f64 = 1e-12;

/// Why a deformation cannot be measured.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DeformationError {
    /// A rotation needs three points.
    #[error("a deformation needs at least 3 nodes, got {0}: use a finer voxel mesh")]
    TooFewNodes(usize),
    /// There is one weight a node.
    #[error("{nodes} nodes but {weights} node weights: give one weight a node")]
    WeightCount {
        /// Number of nodes.
        nodes: usize,
        /// Number of weights.
        weights: usize,
    },
    /// A weight is negative or not finite, or all are zero.
    #[error("node weight {node} is {value}: weights must be finite, not negative, and not all zero")]
    BadWeight {
        /// Node index.
        node: usize,
        /// Its weight.
        value: f64,
    },
    /// The measured body has other nodes than the reference.
    #[error(
        "the reference has {expected} nodes, the measured body {got}: measure the body the reference is of"
    )]
    NodeCount {
        /// Nodes of the reference.
        expected: usize,
        /// Nodes given.
        got: usize,
    },
    /// A node is not a number, infinite or absurdly far away.
    #[error("node {node} is not finite ({x}, {y}, {z}): the simulation has diverged")]
    NonFinite {
        /// Node index.
        node: usize,
        /// Its position, m.
        x: f64,
        /// Its position, m.
        y: f64,
        /// Its position, m.
        z: f64,
    },
    /// All nodes of the reference are one point.
    #[error("the reference's bounding-box diagonal is {0} m: the body has no size")]
    NoSize(f64),
}

/// A body's deformation at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deformation {
    /// D, uniform over the nodes, % of the reference's bounding-box diagonal ([`METRIC_ID`]).
    pub rms_pct: f64,
    /// The same with the reference's node weights in the fit and in the mean, %.
    pub weighted_pct: f64,
    /// Largest node displacement of the uniform fit, %.
    pub max_pct: f64,
    /// The fitted rotation, reference to current.
    pub rotation: Quat,
    /// Extents of the current world-aligned bounding box, m.
    pub bbox_m: Vec3,
}

/// A reference shape, prepared so that measuring neither allocates nor repeats work.
#[derive(Clone, Debug)]
pub struct Reference {
    /// Node positions about their uniform mean, m.
    nodes: Vec<Vec3>,
    /// Node weights, summing to one.
    weights: Vec<f64>,
    /// Weighted mean of `nodes`, m.
    weighted_centre: Vec3,
    /// Bounding-box extents, m.
    bbox_m: Vec3,
    diagonal_m: f64,
}

/// First moments of a set of nodes and their products with the reference, as one pass gathers them.
struct Moments {
    mean: Vec3,
    weighted_mean: Vec3,
    product: Mat3,
    weighted_product: Mat3,
    bbox_m: Vec3,
}

impl Reference {
    /// Prepares the reference shape from its settled `nodes` (m, any frame) and their `weights` (volume or mass).
    ///
    /// # Errors
    /// Fewer than three nodes, a node that is not finite, weights that do not fit, or a body without size.
    pub fn new(nodes: &[Vec3], weights: &[f64]) -> Result<Self, DeformationError> {
        if nodes.len() < 3 {
            return Err(DeformationError::TooFewNodes(nodes.len()));
        }
        if nodes.len() != weights.len() {
            return Err(DeformationError::WeightCount { nodes: nodes.len(), weights: weights.len() });
        }
        if let Some(error) = first_bad_node(nodes) {
            return Err(error);
        }
        let weights = normalised(weights)?;
        let (low, high) = bounds(nodes);
        let diagonal_m = (high - low).norm();
        if diagonal_m <= SMALLEST_DIAGONAL_M || !diagonal_m.is_finite() {
            return Err(DeformationError::NoSize(diagonal_m));
        }
        // Means are taken about the first node: a small body far from the origin loses no digits.
        let mean = nodes[0] + nodes.iter().map(|x| x - nodes[0]).sum::<Vec3>() / nodes.len() as f64;
        let nodes: Vec<Vec3> = nodes.iter().map(|x| x - mean).collect();
        let weighted_centre = nodes.iter().zip(&weights).map(|(x, w)| x * *w).sum();
        Ok(Self { nodes, weights, weighted_centre, bbox_m: high - low, diagonal_m })
    }

    /// Diagonal of the reference's bounding box, m.
    pub fn diagonal_m(&self) -> f64 {
        self.diagonal_m
    }

    /// Extents of the reference's bounding box, m.
    pub fn bbox_m(&self) -> Vec3 {
        self.bbox_m
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Never: a reference has at least three nodes.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Measures the deformation of `nodes` (m, any frame, in the order of the reference). Does not allocate.
    ///
    /// # Errors
    /// Another number of nodes than the reference's, or a node that is not finite.
    pub fn measure(&self, nodes: &[Vec3]) -> Result<Deformation, DeformationError> {
        if nodes.len() != self.nodes.len() {
            return Err(DeformationError::NodeCount { expected: self.nodes.len(), got: nodes.len() });
        }
        let moments = self.moments(nodes)?;
        let rotation = best_rotation(&moments.product);
        let (fit, weighted_fit) = (
            rotation.to_rotation_matrix().into_inner(),
            best_rotation(&moments.weighted_product).to_rotation_matrix().into_inner(),
        );
        let (mut sum, mut weighted_sum, mut largest) = (0.0_f64, 0.0_f64, 0.0_f64);
        for ((x, rest), weight) in nodes.iter().zip(&self.nodes).zip(&self.weights) {
            let x = x - nodes[0];
            let square = (x - moments.mean - fit * rest).norm_squared();
            sum += square;
            largest = largest.max(square);
            let weighted = x - moments.weighted_mean - weighted_fit * (rest - self.weighted_centre);
            weighted_sum += weight * weighted.norm_squared();
        }
        // Finite nodes may still be so far away that their squares overflow.
        if !(sum.is_finite() && weighted_sum.is_finite()) {
            return Err(far_node(nodes));
        }
        let percent = 100.0 / self.diagonal_m;
        Ok(Deformation {
            rms_pct: percent * (sum / nodes.len() as f64).sqrt(),
            weighted_pct: percent * weighted_sum.sqrt(),
            max_pct: percent * largest.sqrt(),
            rotation,
            bbox_m: moments.bbox_m,
        })
    }

    fn moments(&self, nodes: &[Vec3]) -> Result<Moments, DeformationError> {
        let (mut sum, mut weighted_sum) = (Vec3::zeros(), Vec3::zeros());
        let (mut product, mut weighted_product) = (Mat3::zeros(), Mat3::zeros());
        let (mut low, mut high) = (nodes[0], nodes[0]);
        for ((x, rest), weight) in nodes.iter().zip(&self.nodes).zip(&self.weights) {
            (low, high) = (low.inf(x), high.sup(x));
            let x = x - nodes[0];
            let outer = x * rest.transpose();
            sum += x;
            weighted_sum += x * *weight;
            product += outer;
            weighted_product += outer * *weight;
        }
        weighted_product -= weighted_sum * self.weighted_centre.transpose();
        // An eigenvector search must not be given a NaN.
        if !product.iter().chain(weighted_product.iter()).all(|v| v.is_finite()) {
            return Err(first_bad_node(nodes).unwrap_or_else(|| far_node(nodes)));
        }
        let mean = sum / nodes.len() as f64;
        Ok(Moments { mean, weighted_mean: weighted_sum, product, weighted_product, bbox_m: high - low })
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

fn normalised(weights: &[f64]) -> Result<Vec<f64>, DeformationError> {
    if let Some(node) = weights.iter().position(|w| !w.is_finite() || *w < 0.0) {
        return Err(DeformationError::BadWeight { node, value: weights[node] });
    }
    let total: f64 = weights.iter().sum();
    if total <= 0.0 || !total.is_finite() {
        return Err(DeformationError::BadWeight { node: 0, value: weights[0] });
    }
    Ok(weights.iter().map(|w| w / total).collect())
}

fn bounds(nodes: &[Vec3]) -> (Vec3, Vec3) {
    nodes.iter().fold((nodes[0], nodes[0]), |(low, high), x| (low.inf(x), high.sup(x)))
}

fn first_bad_node(nodes: &[Vec3]) -> Option<DeformationError> {
    let node = nodes.iter().position(|x| !x.iter().all(|v| v.is_finite()))?;
    Some(non_finite(nodes, node))
}

fn far_node(nodes: &[Vec3]) -> DeformationError {
    let node = (1..nodes.len()).fold(0, |far, i| if nodes[i].amax() > nodes[far].amax() { i } else { far });
    non_finite(nodes, node)
}

fn non_finite(nodes: &[Vec3], node: usize) -> DeformationError {
    let p = nodes[node];
    DeformationError::NonFinite { node, x: p.x, y: p.y, z: p.z }
}

#[cfg(test)]
#[path = "deformation_tests.rs"]
mod tests;
