//! What surfaces look like: a base and layers of procedural patterns over it, all in the object frame at rest.

use std::sync::Arc;

use super::decal::TextDecal;
use crate::geometry::shape::Shape;

/// The look of a surface (metal/rough model). Colours are linear RGB.
#[derive(Clone, Debug, PartialEq)]
pub struct Visual {
    /// Base colour, 0..=1.
    pub albedo: [f64; 3],
    /// Roughness, 0..=1 (the square is GGX's width).
    pub roughness: f64,
    /// Metalness, 0..=1.
    pub metalness: f64,
    /// Painted over the base one after the other.
    pub layers: Vec<VisualLayer>,
}

impl Default for Visual {
    fn default() -> Self {
        Self { albedo: [0.7, 0.7, 0.7], roughness: 0.6, metalness: 0.0, layers: Vec::new() }
    }
}

impl Visual {
    /// One colour all over.
    pub fn plain(albedo: [f64; 3], roughness: f64, metalness: f64) -> Self {
        Self { albedo, roughness, metalness, layers: Vec::new() }
    }

    /// The same with another layer on top.
    #[must_use]
    pub fn with(mut self, layer: VisualLayer) -> Self {
        self.layers.push(layer);
        self
    }
}

/// A colour laid over what is below where a mask says so.
#[derive(Clone, Debug, PartialEq)]
pub struct VisualLayer {
    /// Where.
    pub mask: Mask,
    /// Colour, linear RGB, 0..=1.
    pub albedo: [f64; 3],
    /// Roughness, 0..=1.
    pub roughness: f64,
    /// Share of this layer where the mask is 1, 0..=1; 0 leaves the relief alone.
    pub opacity: f64,
    /// Height of the drawn surface where the mask is 1, m (it is drawn only: nothing touches it).
    pub relief_m: f64,
}

/// A number between 0 and 1 at every point of an object. Lengths are metres, points those of the object frame at rest.
#[derive(Clone, Debug, PartialEq)]
pub enum Mask {
    /// 1 everywhere.
    Whole,
    /// Cubes of edge `size_m`, every other one 1; a corner lies at the origin.
    Checker {
        /// Edge, m.
        size_m: f64,
    },
    /// Slabs across `axis`: 1 on the first `share` of each `pitch_m`.
    Stripes {
        /// Direction, any length.
        axis: [f64; 3],
        /// Distance from one to the next, m.
        pitch_m: f64,
        /// Share that is 1, 0..=1.
        share: f64,
    },
    /// From 0 at `from_m` to 1 at `to_m` along `axis`, smoothly.
    Gradient {
        /// Direction, any length.
        axis: [f64; 3],
        /// Where it is 0, m.
        from_m: f64,
        /// Where it is 1, m.
        to_m: f64,
    },
    /// Cloudy noise (fractal sum of octaves), stretched to 0 at `from` and 1 at `to`.
    Noise {
        /// Size of the coarsest features along x, y, z, m.
        size_m: [f64; 3],
        /// Octaves, each half the size and half the weight of the one before, 1..=8.
        octaves: u32,
        /// Value of the noise (0..=1, mean 0.5) that becomes 0.
        from: f64,
        /// Value that becomes 1; below `from` for the inverse.
        to: f64,
        /// Chooses the noise.
        seed: u32,
    },
    /// Year rings: cylinders about the line through `centre_m` along z, bent by noise.
    Rings {
        /// A point of the axis, m.
        centre_m: [f64; 3],
        /// Distance from one ring to the next, m.
        pitch_m: f64,
        /// How far noise bends them, m.
        wobble_m: f64,
        /// Chooses the noise.
        seed: u32,
    },
    /// Boards that lie along x, side by side in y: a constant a board between 0 and 1.
    Boards {
        /// Length of a board, m.
        length_m: f64,
        /// Width of a board, m.
        width_m: f64,
        /// Chooses the values.
        seed: u32,
    },
    /// The gaps between the boards of the same sizes.
    Seams {
        /// Length of a board, m.
        length_m: f64,
        /// Width of a board, m.
        width_m: f64,
        /// Width of a gap, m.
        gap_m: f64,
    },
    /// Round specks, one in each cube of edge `spacing_m`, strewn about.
    Specks {
        /// Mean distance, m.
        spacing_m: f64,
        /// Radius, m.
        radius_m: f64,
        /// Chooses the places.
        seed: u32,
    },
    /// A plain weave in x and y.
    Weave {
        /// Width of a thread, m.
        pitch_m: f64,
    },
    /// Where the surface faces `axis`: by the cosine between its normal and that, 0 at `from`, 1 at `to`.
    Facing {
        /// Direction, any length.
        axis: [f64; 3],
        /// Cosine that becomes 0.
        from: f64,
        /// Cosine that becomes 1; below `from` for the inverse.
        to: f64,
    },
    /// Inside of a shape.
    Inside {
        /// The shape.
        shape: Arc<Shape>,
        /// Width of the border, half of it on either side of the shape's surface, m.
        soft_m: f64,
    },
    /// The letters of a line of text, where the surface faces who reads it.
    Text {
        /// The line.
        print: Arc<TextDecal>,
    },
    /// One minus a mask.
    Inverse {
        /// The mask.
        mask: Arc<Mask>,
    },
    /// The product of masks: where all of them are.
    Both {
        /// The masks.
        masks: Vec<Arc<Mask>>,
    },
}
