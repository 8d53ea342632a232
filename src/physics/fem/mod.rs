//! Corotational finite elements on voxel meshes.
//!
//! The law is linear isotropic elasticity in a rotating frame, one rotation per element (Müller & Gross 2004; Felippa &
//! Haugen 2005). With `R = polar(F)`, `F` the element-mean deformation gradient, `y_a = Rᵀ x_a`, the energy of an
//! element is `U = ½ (y − X)ᵀ K₀ (y − X)` and its force the exact `−∂U/∂x` ([`force`]). `K₀` is a trilinear
//! hexahedron ([`element`]), so that ν near 0.5 does not lock. An element that is compressed below 0.3 of its volume
//! stiffens (`densification`). Time stepping uses the SPD tangent `R K₀ Rᵀ`.

pub mod body;
pub(crate) mod densification;
pub mod element;
pub mod force;
pub mod material;
pub(crate) mod relaxation;
pub mod rigid_motion;
pub mod rotation;
pub mod strain;
pub(crate) mod system;

pub use body::{FemModel, FemState, MinDetF};
pub use material::ElasticMaterial;
pub use strain::{StrainLimits, StrainMeter};
