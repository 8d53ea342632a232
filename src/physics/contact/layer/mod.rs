//! Skins that are elastic layers on a rigid base, such as gel pads.
//!
//! A force anywhere on a layer moves its whole surface. The contact law of the solver is one of independent springs, so
//! each step gives them a new rest position: with the tractions `t` of the last step, the displacement `C t` of the
//! layer, and a stiffness k, the springs rest at `C t − t/k`. Once a contact does not change, `t = k (δ −
//! C t) + t` with the imposed displacement δ, so `C t = δ`: contact, stick and slip are those of the layer. While it
//! changes, the error falls by the factors `1 − λ` in each step, with the eigenvalues λ of `k C`. The stiffness at each
//! point is `k = p / |C| p`, with the pressure p. So no λ is above 1 (Collatz and Wielandt), and what changes in
//! proportion to p has λ = 1, without a delay.

mod response;

use std::sync::Arc;

use softvt_geometry::{BilinearGrid, Vec3};
use softvt_signal::fourier::{Complex32, PaddedFft};

pub use response::LayerResponse;

use super::SurfaceStiffness;

/// Material and thickness of an elastic layer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LayerMaterial {
    /// Shear modulus, Pa.
    pub shear_modulus: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// Thickness, m.
    pub thickness: f64,
}

/// Edge of the cells of the grid of a layer, m.
const CELL: f64 = 1.5e-3;

/// Response of a layer to forces on the nodes of a grid over it; z of its frame points out of the layer, and (0, 0) is
/// the middle of the grid. A force on a node acts as a pressure that falls linearly to the next nodes.
#[derive(Debug)]
pub struct ElasticLayer {
    grid: BilinearGrid,
    /// Displacement by forces on nodes that are `columns − 1` to the right to `columns − 1` to the left, by rows, m/N:
    /// components xx, xy, yy, zz, zx and zy. Those of xz and yz are −zx and −zy.
    response: [Vec<f32>; 6],
    /// Stiffness per area under a load about as wide as the layer is thick.
    untouched: SurfaceStiffness,
    /// Stiffness per area under waves of two cells.
    shortest: SurfaceStiffness,
}

impl ElasticLayer {
    /// The layer over a rectangle of `length` along x by `width` along y, m.
    pub fn new(material: &LayerMaterial, length: f64, width: f64) -> Self {
        let count = |extent: f64| 2 * (0.5 * extent / CELL).ceil() as usize + 1;
        let (columns, rows) = (count(length), count(width));
        let fft = PaddedFft::new(columns, rows, columns + (2.0 * material.thickness / CELL) as usize);
        let mut spectra: [Vec<Complex32>; 6] = std::array::from_fn(|_| fft.spectrum());
        let scale = 1.0 / ((fft.width * fft.height) as f64 * CELL * CELL);
        for ix in 0..fft.half_width {
            for iy in 0..fft.height {
                let k = fft.wave_vector(ix, iy, CELL);
                let magnitude = k[0].hypot(k[1]);
                let at = LayerResponse::new(material, magnitude);
                let [x, y] = if magnitude > 0.0 { k.map(|k| k / magnitude) } else { [0.0; 2] };
                let is_nyquist = [2 * ix == fft.width, 2 * iy == fft.height];
                let [odd_x, odd_y] = if is_nyquist[0] || is_nyquist[1] { [0.0; 2] } else { [x, y] };
                let difference = at.longitudinal - at.transverse;
                let real = |value: f64| Complex32::new((scale * value) as f32, 0.0);
                let odd = |value: f64| Complex32::new(0.0, -(scale * value) as f32);
                let entries = [
                    real(at.transverse + difference * x * x),
                    real(difference * odd_x * odd_y),
                    real(at.transverse + difference * y * y),
                    real(at.normal),
                    odd(at.coupling * odd_x),
                    odd(at.coupling * odd_y),
                ];
                for (spectrum, entry) in spectra.iter_mut().zip(entries) {
                    spectrum[ix * fft.height + iy] = entry;
                }
            }
        }
        // Of a force on the first node; the rest of the table is even or odd.
        let mut buffers = fft.buffers();
        let signs = [[1.0, 1.0], [-1.0, -1.0], [1.0, 1.0], [1.0, 1.0], [-1.0, 1.0], [1.0, -1.0]];
        let (across, mut index) = (2 * columns - 1, 0);
        let response = spectra.map(|mut spectrum| {
            let mut quarter = vec![0.0_f32; columns * rows];
            fft.inverse(&mut spectrum, &mut quarter, &mut buffers);
            let sign: [f32; 2] = signs[index];
            index += 1;
            let entry = |at: usize| {
                let [i, j] = [
                    (at % across) as isize - columns as isize + 1,
                    (at / across) as isize - rows as isize + 1,
                ];
                let sign = (if i < 0 { sign[0] } else { 1.0 }) * (if j < 0 { sign[1] } else { 1.0 });
                sign * quarter[j.unsigned_abs() * columns + i.unsigned_abs()]
            };
            (0..across * (2 * rows - 1)).map(entry).collect()
        });
        let stiffness = |half_wave: f64| {
            let at = LayerResponse::new(material, std::f64::consts::PI / half_wave);
            SurfaceStiffness { normal: 1.0 / at.normal, shear: 2.0 / (at.longitudinal + at.transverse) }
        };
        let [untouched, shortest] = [material.thickness, CELL].map(stiffness);
        Self { grid: BilinearGrid { columns, rows, spacing: CELL }, response, untouched, shortest }
    }

    /// Stiffness per area under a load about as wide as the layer is thick.
    pub fn untouched(&self) -> SurfaceStiffness {
        self.untouched
    }
}

/// Forces on a layer in the last step, and how they have moved its surface.
#[derive(Clone, Debug)]
pub(crate) struct LayerState {
    layer: Arc<ElasticLayer>,
    /// Force on each node, N.
    force: Vec<Vec3>,
    /// The forces that the displacements belong to, N.
    displaced_by: Vec<Vec3>,
    /// Displacement of each node that the springs at points do not have by themselves, m.
    moved: Vec<Vec3>,
    /// Stiffness per area of the springs at each node.
    stiffness: Vec<SurfaceStiffness>,
    /// The loaded nodes, and sums over them for a row of nodes: displacements along x, y and z, and the largest ones
    /// that the pressure would cause along z and along the surface.
    loaded: Vec<usize>,
    row: [Vec<f32>; 5],
}

/// Change of a force, over the largest one, up to which displacements are kept.
const UNCHANGED: f64 = 1e-6;
/// Pressure that is added everywhere for the stiffness, over the mean one.
const LEAST_PRESSURE: f64 = 0.2;
/// Rows and columns of nodes around the loaded ones whose displacement is found.
const AROUND: usize = 1;

impl LayerState {
    /// A layer that nothing touches.
    pub(crate) fn new(layer: Arc<ElasticLayer>) -> Self {
        let nodes = layer.grid.nodes();
        let none = vec![Vec3::zeros(); nodes];
        Self {
            force: none.clone(),
            displaced_by: none.clone(),
            moved: none,
            stiffness: vec![layer.untouched; nodes],
            loaded: Vec::new(),
            row: std::array::from_fn(|_| Vec::new()),
            layer,
        }
    }

    /// Removes all forces before those of a step are added.
    pub(crate) fn clear(&mut self) {
        self.force.fill(Vec3::zeros());
    }

    /// Adds a force (N) on the layer at a point, in its frame.
    pub(crate) fn add(&mut self, p: &Vec3, force: &Vec3) {
        for (node, share) in self.layer.grid.around(p.x, p.y) {
            self.force[node] += force * share;
        }
    }

    /// Stiffness per area of a spring at a point.
    pub(crate) fn stiffness_at(&self, p: &Vec3) -> SurfaceStiffness {
        let mut sum = SurfaceStiffness { normal: 0.0, shear: 0.0 };
        for (node, share) in self.layer.grid.around(p.x, p.y) {
            sum.normal += share * self.stiffness[node].normal;
            sum.shear += share * self.stiffness[node].shear;
        }
        sum
    }

    /// Displacement of the surface at a point with a traction on it (Pa), in the frame of the layer, m.
    pub(crate) fn moved_at(&self, p: &Vec3, traction: &Vec3) -> Vec3 {
        let smooth: Vec3 =
            self.layer.grid.around(p.x, p.y).iter().map(|&(node, share)| self.moved[node] * share).sum();
        smooth + self.layer.shortest.compliance(traction, &Vec3::z())
    }

    /// Finds stiffness and displacements for the present forces.
    pub(crate) fn update(&mut self) {
        let largest = self.force.iter().map(Vec3::norm_squared).fold(0.0, f64::max);
        let changes =
            self.force.iter().zip(&self.displaced_by).map(|(now, then)| (now - then).norm_squared());
        if changes.fold(0.0, f64::max) <= UNCHANGED * UNCHANGED * largest {
            return;
        }
        self.displaced_by.clone_from(&self.force);
        let layer = &*self.layer;
        let (BilinearGrid { columns, rows, .. }, response) = (layer.grid, &layer.response);
        self.loaded.clear();
        self.loaded.extend((0..self.force.len()).filter(|&node| self.force[node] != Vec3::zeros()));
        self.moved.fill(Vec3::zeros());
        self.stiffness.fill(layer.untouched);
        let (Some(first), Some(last)) = (self.loaded.first(), self.loaded.last()) else { return };
        let span = |low: usize, high: usize, count: usize| {
            low.saturating_sub(AROUND)..(high + 1 + AROUND).min(count)
        };
        let of_columns = self.loaded.iter().map(|node| node % columns);
        let (left, right) = of_columns.fold((columns, 0), |(l, r), i| (l.min(i), r.max(i)));
        let (i, j) = (span(left, right, columns), span(first / columns, last / columns, rows));
        let (across, width) = (2 * columns - 1, i.len());
        // A small pressure everywhere keeps the rim of a contact from being soft.
        let mean =
            self.loaded.iter().map(|&node| self.force[node].norm()).sum::<f64>() / self.loaded.len() as f64;
        let pressure = |force: &Vec3| force.z.abs() + LEAST_PRESSURE * mean;
        for row in j {
            self.row.iter_mut().for_each(|line| {
                line.clear();
                line.resize(width, 0.0);
            });
            let [x, y, z, normal, shear] = &mut self.row;
            for &node in &self.loaded {
                let (f, p) = (self.force[node].cast::<f32>(), pressure(&self.force[node]) as f32);
                let start =
                    (row + rows - 1 - node / columns) * across + columns - 1 + i.start - node % columns;
                let [xx, xy, yy, zz, zx, zy] = response.each_ref().map(|table| &table[start..start + width]);
                for k in 0..width {
                    x[k] += xx[k] * f.x + xy[k] * f.y - zx[k] * f.z;
                    y[k] += xy[k] * f.x + yy[k] * f.y - zy[k] * f.z;
                    z[k] += zx[k] * f.x + zy[k] * f.y + zz[k] * f.z;
                    normal[k] += zz[k].abs() * p;
                    shear[k] += (xx[k].max(yy[k]) + xy[k].abs()) * p;
                }
            }
            for k in 0..width {
                let node = row * columns + i.start + k;
                self.moved[node] = Vec3::new(x[k].into(), y[k].into(), z[k].into());
                if self.force[node] != Vec3::zeros() {
                    let p = pressure(&self.force[node]) / (CELL * CELL);
                    self.stiffness[node] =
                        SurfaceStiffness { normal: p / f64::from(normal[k]), shear: p / f64::from(shear[k]) };
                }
            }
        }
        for &node in &self.loaded {
            self.moved[node] -= layer.shortest.compliance(&(self.force[node] / (CELL * CELL)), &Vec3::z());
        }
    }
}

#[cfg(test)]
mod tests;
