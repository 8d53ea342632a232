//! The gel: grid over the pad and response of its surface to tractions, computed once for all fingers and frames.

use std::sync::Arc;

use nalgebra::Vector2;

use super::{height_map::FINE, substrate::SubstrateCompliance};
use softvt_common::range::RangeError;
use softvt_physics::contact::{LayerMaterial, LayerResponse};
use softvt_robot::PadSurface;
use softvt_robot::tactile::{OpticsModel, Pinhole, TactileSpec};
use softvt_signal::fourier::{Complex32, FftBuffers, PaddedFft};

/// Grid over the pad, kernels of the bonded layer and view of the camera: everything that is computed once per sensor.
///
/// Cell (i, j) of the grid has its centre at `((i − (columns − 1)/2) cell, (j − (rows − 1)/2) cell)` in the pad
/// frame; arrays are stored row by row (x fastest). For the elasticity the layer is infinite and flat, since
/// the edges of the pad and its shallow dome change little under a contact. Contact itself is found on the dome
/// and within the outline.
#[derive(Debug)]
pub struct Gel {
    /// Shape of the pad.
    pub pad: PadSurface,
    /// View of the camera.
    pub view: Pinhole,
    /// Number of cells along x.
    pub columns: usize,
    /// Number of cells along y.
    pub rows: usize,
    /// Edge of a cell, m.
    pub cell: f64,
    /// Points of the height maps of soft skins per cell along each axis.
    pub(super) soft_skin_points: usize,
    /// Height of the undeformed surface at each cell, m, pad frame; NaN outside the outline.
    pub(in super::super) dome: Vec<f32>,
    pub(super) fft: PaddedFft,
    pub(super) kernels: Arc<LayerKernels>,
}

/// Spectra of the layer's response, m/Pa, divided by the size of the transform.
#[derive(Debug)]
pub(super) struct LayerKernels {
    /// Normal displacement by pressure.
    pub(super) normal: Vec<f32>,
    /// Tangential displacement by shear: components xx, xy and yy.
    pub(super) tangential: [Vec<f32>; 3],
    /// Coupling of both: m k_x/k and m k_y/k ([`LayerResponse`]).
    pub(super) coupling: [Vec<f32>; 2],
    /// Wave number, 1/m.
    pub(super) k: Vec<f32>,
}

/// Working memory of one thread, and the compliance of the last gel and body; may serve any gel and
/// finger in any order.
#[derive(Clone, Debug, Default)]
pub struct GelScratch {
    pub(super) spectra: [Vec<Complex32>; 4],
    pub(super) buffers: FftBuffers,
    /// Spectrum of the compliance of gel and body in series.
    pub(super) compliance: Vec<f32>,
    /// The gel and the body of this spectrum.
    compliance_of: Option<(Arc<LayerKernels>, Option<SubstrateCompliance>)>,
    /// Size of the transform for which the buffers are allocated.
    pub(super) size: [usize; 2],
}

impl Gel {
    /// Computes grid and kernels of the gel of `spec` in the shape of `pad`.
    ///
    /// # Errors
    /// A number of the specification is out of its range.
    pub fn new(spec: &TactileSpec, pad: PadSurface) -> Result<Self, RangeError> {
        spec.validate()?;
        let cell = spec.gel.cell;
        let count = |length: f64| 2 * (0.5 * length / cell).ceil() as usize;
        let (columns, rows) = (count(pad.length), count(pad.width));
        // Periodic images of a contact act on each other only across the full width of the pad: there, one and a half
        // thicknesses away, a load moves the surface by less than 2 % of its displacement under the load.
        let fft = PaddedFft::new(columns, rows, (1.5 * pad.thickness / cell).ceil() as usize);
        let kernels = Arc::new(LayerKernels::new(&fft, &spec.gel.layer(&pad), cell));
        // Taxim shows the skins themselves; other optics show the surface of the gel, which presses details of soft
        // skins flat.
        let soft_skin_points = if matches!(spec.optics, OpticsModel::Taxim { .. }) { FINE } else { 1 };
        let (view, dome) = (spec.view, Vec::new());
        let mut gel = Self { pad, view, columns, rows, cell, soft_skin_points, dome, fft, kernels };
        let height = |at: Vector2<f64>| {
            let is_inside = pad.edge_distance(at.x, at.y) <= 0.0;
            if is_inside { pad.height(at.x, at.y) as f32 } else { f32::NAN }
        };
        gel.dome = (0..columns * rows).map(|c| height(gel.centre(c))).collect();
        Ok(gel)
    }

    /// Centre (x, y) of the cell at index `c`, m, pad frame.
    pub fn centre(&self, c: usize) -> Vector2<f64> {
        let (i, j) = ((c % self.columns) as f64, (c / self.columns) as f64);
        self.cell * Vector2::new(i - 0.5 * (self.columns - 1) as f64, j - 0.5 * (self.rows - 1) as f64)
    }

    /// Position of a point (m) in units of cells, with the centre of cell (0, 0) at 0.
    pub(super) fn grid_position(&self, x: f64, y: f64) -> [f64; 2] {
        [x / self.cell + 0.5 * (self.columns - 1) as f64, y / self.cell + 0.5 * (self.rows - 1) as f64]
    }
}

impl LayerKernels {
    fn new(fft: &PaddedFft, layer: &LayerMaterial, cell: f64) -> Self {
        let size = fft.half_width * fft.height;
        let empty = || Vec::with_capacity(size);
        let mut kernels = Self {
            normal: empty(),
            tangential: [empty(), empty(), empty()],
            coupling: [empty(), empty()],
            k: empty(),
        };
        let scale = 1.0 / (fft.width * fft.height) as f64;
        for ix in 0..fft.half_width {
            for iy in 0..fft.height {
                let k = fft.wave_vector(ix, iy, cell);
                let magnitude = k[0].hypot(k[1]);
                let response = LayerResponse::new(layer, magnitude);
                let unit = if magnitude > 0.0 { k.map(|k| k / magnitude) } else { [0.0; 2] };
                // The sign of a Nyquist frequency is not defined; odd kernels leave it out.
                let is_nyquist = [2 * ix == fft.width, 2 * iy == fft.height];
                let odd = [0, 1].map(|axis| if is_nyquist[axis] { 0.0 } else { unit[axis] });
                let difference = response.longitudinal - response.transverse;
                let push = |to: &mut Vec<f32>, value: f64| to.push((scale * value) as f32);
                push(&mut kernels.normal, response.normal);
                push(&mut kernels.tangential[0], response.transverse + difference * unit[0] * unit[0]);
                push(&mut kernels.tangential[1], difference * odd[0] * odd[1]);
                push(&mut kernels.tangential[2], response.transverse + difference * unit[1] * unit[1]);
                push(&mut kernels.coupling[0], response.coupling * odd[0]);
                push(&mut kernels.coupling[1], response.coupling * odd[1]);
                kernels.k.push(magnitude as f32);
            }
        }
        kernels
    }
}

impl GelScratch {
    /// Allocates the buffers for `gel`, unless they have its size already.
    pub(super) fn fit(&mut self, gel: &Gel) {
        let size = [gel.fft.width, gel.fft.height];
        if self.size != size {
            self.spectra = std::array::from_fn(|_| gel.fft.spectrum());
            self.buffers = gel.fft.buffers();
            self.size = size;
        }
    }

    /// Computes the compliance of `gel` and of a body in series with it, unless it is known.
    pub(super) fn set_compliance(&mut self, gel: &Gel, body: Option<SubstrateCompliance>) {
        let is_known =
            |(kernels, of): &(Arc<LayerKernels>, _)| Arc::ptr_eq(kernels, &gel.kernels) && *of == body;
        if self.compliance_of.as_ref().is_some_and(is_known) {
            return;
        }
        self.compliance.clone_from(&gel.kernels.normal);
        if let Some(body) = body {
            body.add_to(&mut self.compliance, &gel.kernels.k, gel.fft.width * gel.fft.height);
        }
        self.compliance_of = Some((gel.kernels.clone(), body));
    }
}
