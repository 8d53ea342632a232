//! GelSight tactile sensing: what a touch does to the gel, the picture it gives, the markers it moves.
//!
//! [`Gel`] is made once; [`sense`] turns the solver's load and the touching skins into a [`GelField`]; pictures
//! ([`Optics`]), [`markers()`] and [`Taxels`] follow from it. `docs/tactile.md` draws the frames and tells the method.

mod field;
mod fourier;
mod gel;
mod layer;
mod load;
mod markers;
mod mosaic;
mod motion;
mod normal;
pub mod npz;
pub mod optics;
mod relief;
mod sensor;
mod shadow;
mod shear;
mod skin;
mod spec;
mod surface;
mod taxim;
mod view;

#[cfg(test)]
mod field_tests;
#[cfg(test)]
mod golden_tests;
#[cfg(test)]
mod picture_tests;
#[cfg(test)]
mod taxim_tests;

pub use field::{FieldError, GelField, Give, PadInput, sense};
pub use gel::{Gel, Scratch};
pub use load::{PadLoad, Taxels};
pub use markers::{ARROW_GAIN, MARKERS, MarkerStyle, Markers, Places, draw_markers, markers, untouched};
pub use mosaic::{CELLS as HISTORY, MosaicLayout, mosaic, mosaic_cell};
pub use motion::Motion;
pub use optics::{Optics, OpticsError};
pub use relief::Surface;
pub use sensor::{Sensor, SensorError, Touched};
pub use shadow::Lamp;
pub use skin::Skin;
pub use spec::{FotsSpec, GelSpec, MarkerModel, OpticsModel, PICTURE, TactileSpec, TactileSpecError, View};
pub use taxim::Taxim;
