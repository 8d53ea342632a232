//! A tactile sensor: gel, optics and markers together.

use std::sync::Arc;

use image::RgbImage;

use super::{
    elastic::{Gel, GelField, GelScratch, TactileContact, TactileContactError},
    image::{OpticsError, PolynomialOptics, TaximOptics},
    markers::{MarkerStyle, Markers},
};
use softvt_common::{npy::NpyError, range::RangeError};
use softvt_robot::PadSurface;
use softvt_robot::tactile::{MarkerModel, OpticsModel, TactileSpec};

/// Reasons why a sensor cannot be created.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the messages describe the variants")]
pub enum TactileSensorError {
    #[error(transparent)]
    Spec(#[from] RangeError),
    #[error(transparent)]
    Optics(#[from] OpticsError),
    #[error("tactile.optics.tables: {0}")]
    Tables(#[from] NpyError),
}

/// Renderer of the colour image.
#[derive(Debug)]
enum OpticsBackend {
    Polynomial { optics: Box<PolynomialOptics>, shadows: bool },
    Taxim(Box<TaximOptics>),
}

/// Tactile sensor, the same for both fingers; created once and shared by all frames and threads.
///
/// # Example
///
/// A ball of 4 mm radius is pressed into the gel with 1.5 N. Its lower side, a paraboloid to first order, is given in
/// the pad frame: origin at the apex of the gel, z out of the gel.
///
/// ```
/// use softvt_geometry::Vec3;
/// use softvt_robot::tactile::TactileSpec;
/// use softvt_sensing::tactile::{GelScratch, PadWrench, SkinMesh, TactileContact, TactileSensor};
///
/// let sensor = TactileSensor::new(&TactileSpec::default())?;
/// // A grid of 21 × 21 vertices, 0.4 mm apart; the triangles face the gel.
/// let at = |i: u32| 4e-4 * (f64::from(i) - 10.0);
/// let height = |x: f64, y: f64| (x * x + y * y) / 8e-3;
/// let grid = (0..21).flat_map(|j| (0..21).map(move |i| (at(i), at(j))));
/// let vertices: Vec<Vec3> = grid.map(|(x, y)| Vec3::new(x, y, height(x, y))).collect();
/// let squares = (0..20).flat_map(|j| (0..20).map(move |i| 21 * j + i));
/// let triangles: Vec<[u32; 3]> = squares.flat_map(|a| [[a, a + 22, a + 1], [a, a + 21, a + 22]]).collect();
/// let contact = TactileContact {
///     wrench: PadWrench::new(1.5, [0.0; 2], 0.0, [0.0; 2]),
///     skins: &[SkinMesh { vertices: &vertices, triangles: &triangles }],
///     points: &[],
///     substrate: None,
/// };
/// let reading = sensor.read(&contact, &mut GelScratch::default())?;
///
/// let field = reading.field.expect("the ball presses");
/// assert!((field.wrench(&sensor.gel).normal() - 1.5).abs() < 1e-9);
/// // The image changes around the contact, and a marker next to it moves outwards.
/// assert_eq!(reading.image.dimensions(), (320, 240));
/// assert_ne!(reading.image.get_pixel(185, 120), sensor.untouched_image.get_pixel(185, 120));
/// assert_eq!(reading.image.get_pixel(5, 5), sensor.untouched_image.get_pixel(5, 5));
/// let right_of_centre = 4 * 11 + 6;
/// assert!(reading.markers.current[right_of_centre][0] > reading.markers.initial[right_of_centre][0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct TactileSensor {
    /// Gel with its grid and kernels.
    pub gel: Gel,
    /// Image without a contact, 320 × 240.
    pub untouched_image: Arc<RgbImage>,
    optics: OpticsBackend,
    markers: MarkerModel,
}

/// Output of a tactile sensor at one instant.
#[derive(Clone, Debug)]
pub struct TactileReading {
    /// Field of the gel; `None` if nothing presses.
    pub field: Option<GelField>,
    /// Markers in the image.
    pub markers: Markers,
    /// Colour image without markers, 320 × 240; rows from the top, RGB.
    pub image: RgbImage,
}

impl OpticsBackend {
    fn render(&self, gel: &Gel, field: Option<&GelField>) -> RgbImage {
        match self {
            Self::Polynomial { optics, shadows } => optics.render(gel, field, *shadows),
            Self::Taxim(taxim) => taxim.render(gel, field),
        }
    }
}

impl TactileSensor {
    /// Sensor with these parameters and the gel pad of a GelSight Mini.
    ///
    /// # Errors
    /// A parameter is out of its range, or the tables of the optics cannot be read.
    pub fn new(spec: &TactileSpec) -> Result<Self, TactileSensorError> {
        let gel = Gel::new(spec, PadSurface::default())?;
        let optics = match &spec.optics {
            OpticsModel::Polynomial {} => OpticsBackend::Polynomial {
                optics: Box::new(PolynomialOptics::gelsight_mini()?),
                shadows: spec.shadows,
            },
            OpticsModel::Taxim { tables } => OpticsBackend::Taxim(Box::new(TaximOptics::load(tables)?)),
        };
        let untouched_image = Arc::new(optics.render(&gel, None));
        Ok(Self { gel, untouched_image, optics, markers: spec.markers })
    }

    /// Reading of a contact. `scratch` saves time and does not influence the result.
    ///
    /// # Errors
    /// A number of the contact is not finite, or a force presses but no skin is given.
    pub fn read(
        &self,
        contact: &TactileContact,
        scratch: &mut GelScratch,
    ) -> Result<TactileReading, TactileContactError> {
        let field = GelField::solve(&self.gel, contact, scratch)?;
        let image = self.optics.render(&self.gel, field.as_ref());
        let markers = Markers::new(&self.gel, &self.markers, field.as_ref());
        Ok(TactileReading { field, markers, image })
    }
}

impl TactileReading {
    /// Copy of the image with the markers drawn in.
    pub fn with_markers(&self, style: MarkerStyle) -> RgbImage {
        let mut image = self.image.clone();
        self.markers.draw(&mut image, style);
        image
    }
}
