//! Composable signed-distance shapes.

use super::Vec3;

/// A solid, described by its signed distance in the object frame (m; negative inside).
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// A box centred on the origin.
    Box {
        /// Half extents, m.
        half: Vec3,
    },
    /// A sphere centred on the origin.
    Sphere {
        /// Radius, m.
        radius: f64,
    },
}

impl Shape {
    /// Signed distance φ (scaled by 1/|∇φ|) at `p_o` and the outward unit normal there.
    pub fn distance_and_normal(&self, p_o: &Vec3) -> (f64, Vec3) {
        let _ = p_o;
        match self {
            Self::Box { .. } => (f64::INFINITY, Vec3::z()),
            Self::Sphere { .. } => (f64::INFINITY, Vec3::z()),
        }
    }
}
