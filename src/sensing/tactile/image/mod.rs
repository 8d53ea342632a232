//! Colour image of a gel field, and the mosaic of the last images of both fingers.
//!
//! [`PolynomialOptics`] is the default; [`TaximOptics`] runs Taxim's pipeline with tables of the user. Both write 320
//! × 240 pixels of 8-bit RGB, row by row from the top.

mod mosaic;
mod polynomial_optics;
mod shadow;
mod taxim;
#[cfg(test)]
mod tests;
mod visible_surface;

pub use mosaic::{HISTORY_LENGTH, TactileMosaicLayout, mosaic, mosaic_cell};
pub use polynomial_optics::{OpticsError, OpticsFile, PolynomialOptics, SLOPE_MONOMIALS, slope_monomials};
pub use shadow::Led;
pub use taxim::TaximOptics;
