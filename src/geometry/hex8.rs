//! The eight-node hexahedron: corner numbering and trilinear shape functions.
//!
//! Bit `axis` of a corner's number is its coordinate along that axis: corner `c` of a unit cube is at
//! `(c & 1, c >> 1 & 1, c >> 2 & 1)`. Local coordinates `ξ ∈ [0, 1]³` start at corner 0. The shape function of a corner
//! is the product over the axes of `ξ` or `1 − ξ`.

use super::Vec3;

/// Coordinates of corner `c` of a unit cube, each 0 or 1.
pub fn corner(c: usize) -> Vec3 {
    Vec3::from_fn(|axis, _| (c >> axis & 1) as f64)
}

/// Coordinates of corner `c` as index steps on a grid.
pub fn corner_index(c: usize) -> [usize; 3] {
    std::array::from_fn(|axis| c >> axis & 1)
}

/// Coordinates of corner `c` of the cube `[-1, 1]³`, each −1 or 1.
pub fn corner_sign(c: usize) -> Vec3 {
    Vec3::from_fn(|axis, _| if c >> axis & 1 == 1 { 1.0 } else { -1.0 })
}

/// Values of the eight shape functions at local coordinates `xi`; they sum to 1.
pub fn weights(xi: &Vec3) -> [f64; 8] {
    std::array::from_fn(|c| {
        let factor = |axis: usize| if c >> axis & 1 == 1 { xi[axis] } else { 1.0 - xi[axis] };
        factor(0) * factor(1) * factor(2)
    })
}

/// Local coordinates (each −1 or 1 over √3, mapped to `[0, 1]`) of the 2×2×2 Gauss points.
pub fn gauss_points() -> [Vec3; 8] {
    std::array::from_fn(|g| (0.5 * corner_sign(g) / 3f64.sqrt()).add_scalar(0.5))
}

/// A point of a quadrature rule in an element.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QuadraturePoint {
    /// Local coordinates, in `[0, 1]³`.
    pub xi: Vec3,
    /// Volume that it stands for, m³.
    pub weight: f64,
}

/// The rule of the 2×2×2 Gauss points of a cube with this volume, m³.
pub fn gauss_rule(volume: f64) -> impl Iterator<Item = QuadraturePoint> {
    gauss_points().into_iter().map(move |xi| QuadraturePoint { xi, weight: volume / 8.0 })
}

/// Gradients of the eight shape functions at local coordinates `xi` of a cube with edge `h` (m), 1/m.
pub fn gradients(xi: &Vec3, h: f64) -> [Vec3; 8] {
    std::array::from_fn(|corner| {
        let upper = |axis: usize| corner >> axis & 1 == 1;
        let weight = |axis: usize| if upper(axis) { xi[axis] } else { 1.0 - xi[axis] };
        let slope = |axis: usize| if upper(axis) { 1.0 / h } else { -1.0 / h };
        Vec3::new(
            slope(0) * weight(1) * weight(2),
            weight(0) * slope(1) * weight(2),
            weight(0) * weight(1) * slope(2),
        )
    })
}
