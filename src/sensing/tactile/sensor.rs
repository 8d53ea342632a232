//! A sensor as one thing: its gel, its optics and its markers.

use std::sync::Arc;

use image::RgbImage;

use super::{
    FieldError, Gel, GelField, MarkerModel, MarkerStyle, Markers, Optics, OpticsError, OpticsModel, PICTURE,
    PadInput, Scratch, TactileSpec, TactileSpecError, Taxim, draw_markers, markers, npz::NpzError, sense,
};
use crate::robot::PadSurface;

/// Why a sensor cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum SensorError {
    /// A number out of its range.
    #[error(transparent)]
    Spec(#[from] TactileSpecError),
    /// The shipped optics are broken.
    #[error(transparent)]
    Optics(#[from] OpticsError),
    /// Taxim's tables cannot be read.
    #[error("tactile.optics.tables: {0}")]
    Tables(#[from] NpzError),
}

/// How a picture comes from a field.
#[derive(Debug)]
enum Eye {
    Polynomial { optics: Box<Optics>, shadows: bool },
    Taxim(Box<Taxim>),
}

/// A sensor, the same for both fingers; made once and shared by all frames and threads.
#[derive(Debug)]
pub struct Sensor {
    /// Its gel.
    pub gel: Gel,
    /// What it sees without a touch.
    pub untouched: Arc<RgbImage>,
    eye: Eye,
    markers: MarkerModel,
}

/// A finger's sensor at one instant.
#[derive(Clone, Debug)]
pub struct Touched {
    /// The gel; `None` if nothing presses.
    pub field: Option<GelField>,
    /// Initial and present places of the markers, px.
    pub markers: Markers,
    /// The colour picture, 320 × 240, without markers.
    pub picture: RgbImage,
}

impl Eye {
    fn picture(&self, gel: &Gel, field: Option<&GelField>) -> RgbImage {
        let [wide, high] = PICTURE;
        let mut picture = RgbImage::new(wide as u32, high as u32);
        match self {
            Self::Polynomial { optics, shadows } => optics.picture(gel, field, *shadows, &mut picture),
            Self::Taxim(taxim) => taxim.picture(gel, field, &mut picture),
        }
        picture
    }
}

impl Sensor {
    /// A sensor of these numbers with the gel pad of a GelSight Mini.
    ///
    /// # Errors
    /// A number out of its range, or tables that cannot be read.
    pub fn new(spec: &TactileSpec) -> Result<Self, SensorError> {
        let gel = Gel::new(spec, PadSurface::default())?;
        let eye = match &spec.optics {
            OpticsModel::Polynomial => {
                Eye::Polynomial { optics: Box::new(Optics::mini()?), shadows: spec.shadows }
            }
            OpticsModel::Taxim { tables } => Eye::Taxim(Box::new(Taxim::load(tables)?)),
        };
        let untouched = Arc::new(eye.picture(&gel, None));
        Ok(Self { gel, untouched, eye, markers: spec.markers })
    }

    /// What the sensor sees of a touch.
    ///
    /// # Errors
    /// A load or friction that is no number, or a load without a skin over the pad.
    pub fn see(&self, input: &PadInput, scratch: &mut Scratch) -> Result<Touched, FieldError> {
        let field = sense(&self.gel, input, scratch)?;
        let picture = self.eye.picture(&self.gel, field.as_ref());
        let markers = markers(&self.gel, &self.markers, field.as_ref());
        Ok(Touched { field, markers, picture })
    }
}

impl Touched {
    /// The picture with its markers drawn.
    pub fn with_markers(&self, style: MarkerStyle) -> RgbImage {
        let mut picture = self.picture.clone();
        draw_markers(&mut picture, &self.markers, style);
        picture
    }
}
