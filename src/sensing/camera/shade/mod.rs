//! Shading: procedural materials, ambient occlusion, shadow maps, reflectance and tone mapping.

pub(crate) mod occlusion;
pub(crate) mod pattern;
pub(crate) mod shading;
pub(crate) mod shadow;
pub(crate) mod tonemap;
