//! Appearance of surfaces: a base material with layers of procedural patterns, defined in the object frame at rest.

use std::sync::Arc;

use serde::Serialize;

use super::{decal::TextDecal, mesh_colours::MeshColours};
use softvt_geometry::shape::Shape;

/// Visual material of a surface (metalness–roughness model). Colours are linear RGB.
///
/// The layers are blended over the base in order, like coats of paint.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Visual {
    /// Base colour, 0..=1.
    pub albedo: [f64; 3],
    /// Roughness, 0..=1; its square is the α of the GGX distribution.
    pub roughness: f64,
    /// Metalness, 0..=1.
    pub metalness: f64,
    /// Layers over the base, from the bottom to the top.
    pub layers: Vec<VisualLayer>,
    /// Colours of a mesh file, by which the base colour is multiplied.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub colours: Option<MeshColours>,
}

impl Default for Visual {
    fn default() -> Self {
        Self::plain([0.7, 0.7, 0.7], 0.6, 0.0)
    }
}

impl Visual {
    /// A material without layers.
    pub fn plain(albedo: [f64; 3], roughness: f64, metalness: f64) -> Self {
        Self { albedo, roughness, metalness, layers: Vec::new(), colours: None }
    }

    /// True if it is the same at every point.
    pub fn is_uniform(&self) -> bool {
        self.layers.is_empty() && self.colours.is_none()
    }

    /// The same material with another layer on top.
    #[must_use]
    pub fn with(mut self, layer: VisualLayer) -> Self {
        self.layers.push(layer);
        self
    }
}

/// A colour blended over the layers below, weighted by a mask.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct VisualLayer {
    /// Spatial weight of the layer.
    pub mask: Mask,
    /// Colour, linear RGB, 0..=1.
    pub albedo: [f64; 3],
    /// Roughness, 0..=1.
    pub roughness: f64,
    /// Opacity where the mask is 1, 0..=1; at 0 only the relief of the layer remains.
    pub opacity: f64,
    /// Height by which the rendered surface is raised where the mask is 1, m. Rendered only: contact does not see it.
    pub relief_m: f64,
}

/// A weight in 0..=1 at every surface point of an object. Lengths are in metres, points in the object frame at rest.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub enum Mask {
    /// The weight is 1 everywhere.
    Whole,
    /// Alternating cubes of edge `size_m`, with a corner at the origin.
    Checker {
        /// Edge, m.
        size_m: f64,
    },
    /// Slabs across `axis`: 1 on the first `share` of each `pitch_m`.
    Stripes {
        /// Direction, any length.
        axis: [f64; 3],
        /// Period, m.
        pitch_m: f64,
        /// Share of a period with weight 1, 0..=1.
        share: f64,
    },
    /// From 0 at `from_m` to 1 at `to_m` along `axis`, smoothly.
    Gradient {
        /// Direction, any length.
        axis: [f64; 3],
        /// Coordinate of weight 0, m.
        from_m: f64,
        /// Coordinate of weight 1, m.
        to_m: f64,
    },
    /// Fractal noise (a sum of octaves), mapped linearly to 0 at `from` and 1 at `to`.
    Noise {
        /// Size of the coarsest features along x, y, z, m.
        size_m: [f64; 3],
        /// Number of octaves, 1..=8; each has half the size and half the weight of the one before.
        octaves: u32,
        /// Noise value (0..=1, mean 0.5) of weight 0.
        from: f64,
        /// Noise value of weight 1; less than `from` for the inverse.
        to: f64,
        /// Seed of the noise.
        seed: u32,
    },
    /// Growth rings of wood: coaxial cylinders about the line through `centre_m` along z, distorted by noise.
    Rings {
        /// Point on the axis, m.
        centre_m: [f64; 3],
        /// Distance between rings, m.
        pitch_m: f64,
        /// Amplitude of the distortion, m.
        wobble_m: f64,
        /// Seed of the noise.
        seed: u32,
    },
    /// Floor boards along x, side by side in y: a random constant weight per board.
    Boards {
        /// Length of a board, m.
        length_m: f64,
        /// Width of a board, m.
        width_m: f64,
        /// Seed of the weights.
        seed: u32,
    },
    /// The gaps between boards of these sizes (see [`Mask::Boards`]).
    Seams {
        /// Length of a board, m.
        length_m: f64,
        /// Width of a board, m.
        width_m: f64,
        /// Width of a gap, m.
        gap_m: f64,
    },
    /// Spheres at random places, one in each cube of edge `spacing_m`.
    Specks {
        /// Mean distance between spheres, m.
        spacing_m: f64,
        /// Radius, m.
        radius_m: f64,
        /// Seed of the places.
        seed: u32,
    },
    /// A plain weave in x and y.
    Weave {
        /// Width of a thread, m.
        pitch_m: f64,
    },
    /// Weight by the cosine between the surface normal and `axis`: 0 at `from`, 1 at `to`.
    Facing {
        /// Direction, any length.
        axis: [f64; 3],
        /// Cosine of weight 0.
        from: f64,
        /// Cosine of weight 1; less than `from` for the inverse.
        to: f64,
    },
    /// Interior of a shape.
    Inside {
        /// Shape, object frame, m.
        shape: Arc<Shape>,
        /// Width of the transition, centred on the surface of the shape, m.
        soft_m: f64,
    },
    /// The glyphs of a line of text, on surfaces that face the reading direction.
    Text {
        /// The text with its place and style.
        decal: Arc<TextDecal>,
    },
    /// One minus another mask.
    Inverse {
        /// Mask whose weight is subtracted.
        mask: Arc<Mask>,
    },
    /// The product of masks (their intersection).
    Product {
        /// Masks whose weights are multiplied.
        masks: Vec<Arc<Mask>>,
    },
}
