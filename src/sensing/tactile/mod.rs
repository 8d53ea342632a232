//! GelSight tactile sensing: deformation of the gel by a contact, its colour image and the markers in it.
//!
//! [`TactileSensor`] is created once and shared by both fingers. [`TactileSensor::read`] maps the force on a pad and
//! the surfaces of the touching bodies to a [`TactileReading`]. Every step is a pure function of its input, so images
//! may be computed later and in any order.
//!
//! - [`elastic`]: the gel as an elastic layer; pressure, shear and displacement of its surface ([`GelField`]).
//! - [`image`]: the colour image of a field, and the mosaic of the last images.
//! - [`markers`]: positions of the printed markers, and measures of their motion ([`MarkerFlow`]).
//!
//! `docs/tactile.md` draws the frames and explains the method.

pub mod elastic;
pub mod image;
pub mod markers;
mod sensor;
mod skin;
#[cfg(test)]
mod tests;

pub use self::{
    elastic::{
        Gel, GelField, GelScratch, PadWrench, SkinMesh, SubstrateCompliance, TactileContact,
        TactileContactError, Taxels,
    },
    image::{
        HISTORY_LENGTH, OpticsError, PolynomialOptics, TactileMosaicLayout, TaximOptics, mosaic, mosaic_cell,
    },
    markers::{MARKER_COUNT, MarkerFlow, MarkerPositions, MarkerStyle, Markers},
    sensor::{TactileReading, TactileSensor, TactileSensorError},
    skin::{PlacedSkin, TactileSkin},
};
