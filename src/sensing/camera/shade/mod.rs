pub(crate) mod noise;
pub(crate) mod pattern;
pub(crate) mod shading;
pub(crate) mod shadow;
pub(crate) mod text_decal;
pub(crate) mod tonemap;
