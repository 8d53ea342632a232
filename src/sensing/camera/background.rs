//! What does not move, seen by a camera that does not move either: drawn once, then only re-lit where something new hides
//! its light.

use super::{V3, picture::Picture, raster::Samples, shade::Split};
use crate::scene::Camera;

/// A point that a pixel of the background shows.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spot {
    /// World, m.
    pub p: V3,
    /// Unit normal; zero where nothing is.
    pub n: V3,
    /// Place in the shadow maps.
    pub place: [f32; 3],
    /// Mean light of the pixel.
    pub split: Split,
    /// Mean display value of the pixel, 0..=255.
    pub display: V3,
}

/// The background of one stage for one camera.
#[derive(Clone, Debug)]
pub(super) struct Background {
    pub stage: u64,
    pub camera: Camera,
    pub samples: Samples,
    pub spots: Vec<Spot>,
    pub picture: Picture,
}
