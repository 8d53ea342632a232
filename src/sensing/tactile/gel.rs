//! The gel: its grid and how its surface answers tractions. Made once, shared by all fingers and frames.

use rustfft::num_complex::Complex32;

use super::{
    fourier::{Buffers, Plane},
    layer::Layer,
    spec::{TactileSpec, TactileSpecError, View},
};
use crate::robot::PadSurface;

/// What is computed once for a sensor: grid over the pad, kernels of the bonded layer, view.
///
/// Cell (i, j) of the grid has its centre at `((i − (columns − 1)/2) cell, (j − (rows − 1)/2) cell)` in the pad frame;
/// arrays run along x first. The layer is endless and flat as far as its elasticity goes (the pad's edges and its shallow
/// dome change little beneath a contact); contact is found on the dome and within the footprint.
#[derive(Debug)]
pub struct Gel {
    /// Shape of the pad.
    pub pad: PadSurface,
    /// What the camera sees of it.
    pub view: View,
    /// Cells along x.
    pub columns: usize,
    /// Cells along y.
    pub rows: usize,
    /// Edge of a cell, m.
    pub cell: f64,
    /// Height of the untouched surface at each cell, m, pad frame; NaN outside of the footprint.
    pub(super) dome: Vec<f32>,
    pub(super) plane: Plane,
    pub(super) kernels: Kernels,
}

/// Spectra of the layer's response, m/Pa, divided by the size of the transform.
#[derive(Debug)]
pub(super) struct Kernels {
    pub normal: Vec<f32>,
    /// xx, xy, yy.
    pub inline: [Vec<f32>; 3],
    /// m k_x/k, m k_y/k.
    pub coupling: [Vec<f32>; 2],
    /// Wave number, 1/m.
    pub k: Vec<f32>,
}

/// The rooms for intermediate results of one thread; may serve any gel, any finger, in any order.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    pub(super) spectra: [Vec<Complex32>; 4],
    pub(super) buffers: Option<Buffers>,
    /// Spectrum with which pressure moves gel and body together.
    pub(super) composite: Vec<f32>,
    pub(super) shape: (usize, usize),
}

impl Gel {
    /// Precomputes the gel of `spec` in the shape of `pad`.
    ///
    /// # Errors
    /// A number of the specification out of its range.
    pub fn new(spec: &TactileSpec, pad: PadSurface) -> Result<Self, TactileSpecError> {
        spec.validate()?;
        let cell = spec.gel.cell;
        let count = |length: f64| 2 * (0.5 * length / cell).ceil() as usize;
        let (columns, rows) = (count(pad.length), count(pad.width));
        // Two thicknesses away a load moves the surface by less than 1 % of what it does beneath itself.
        let plane = Plane::new(columns, rows, (2.0 * pad.thickness / cell).ceil() as usize);
        let layer = Layer {
            shear_modulus: spec.gel.shear_modulus,
            poisson: spec.gel.poisson,
            thickness: pad.thickness,
        };
        let kernels = Kernels::new(&plane, &layer, cell);
        let mut gel = Self { pad, view: spec.view, columns, rows, cell, dome: Vec::new(), plane, kernels };
        let inside = |at: [f64; 2]| pad.edge_distance(at[0], at[1]) <= 0.0;
        let height = |at: [f64; 2]| if inside(at) { pad.height(at[0], at[1]) as f32 } else { f32::NAN };
        gel.dome = (0..columns * rows).map(|c| height(gel.centre(c))).collect();
        Ok(gel)
    }

    /// Centre of cell `c` (x, y), m, pad frame.
    pub fn centre(&self, c: usize) -> [f64; 2] {
        [self.x(c % self.columns), self.y(c / self.columns)]
    }

    /// x of column `i`, m.
    pub fn x(&self, i: usize) -> f64 {
        (i as f64 - 0.5 * (self.columns - 1) as f64) * self.cell
    }

    /// y of row `j`, m.
    pub fn y(&self, j: usize) -> f64 {
        (j as f64 - 0.5 * (self.rows - 1) as f64) * self.cell
    }
}

impl Kernels {
    fn new(plane: &Plane, layer: &Layer, cell: f64) -> Self {
        let size = plane.half * plane.high;
        let empty = || Vec::with_capacity(size);
        let mut kernels = Self {
            normal: empty(),
            inline: [empty(), empty(), empty()],
            coupling: [empty(), empty()],
            k: empty(),
        };
        let scale = 1.0 / (plane.wide * plane.high) as f64;
        for run in 0..plane.half {
            for at in 0..plane.high {
                let (k, odd) = plane.frequency(run, at, cell);
                let size = k[0].hypot(k[1]);
                let found = layer.response(size);
                let unit = if size > 0.0 { k.map(|k| k / size) } else { [0.0; 2] };
                let odd = if size > 0.0 { odd.map(|k| k / size) } else { [0.0; 2] };
                let difference = found.along - found.across;
                let push = |to: &mut Vec<f32>, value: f64| to.push((scale * value) as f32);
                push(&mut kernels.normal, found.normal);
                push(&mut kernels.inline[0], found.across + difference * unit[0] * unit[0]);
                push(&mut kernels.inline[1], difference * odd[0] * odd[1]);
                push(&mut kernels.inline[2], found.across + difference * unit[1] * unit[1]);
                push(&mut kernels.coupling[0], found.coupling * odd[0]);
                push(&mut kernels.coupling[1], found.coupling * odd[1]);
                kernels.k.push(size as f32);
            }
        }
        kernels
    }
}

impl Scratch {
    /// Makes room for `gel`.
    pub(super) fn fit(&mut self, gel: &Gel) {
        let shape = (gel.plane.wide, gel.plane.high);
        if self.buffers.is_none() || self.shape != shape {
            self.spectra = std::array::from_fn(|_| gel.plane.spectrum());
            self.buffers = Some(gel.plane.buffers());
            self.shape = shape;
        }
    }
}
