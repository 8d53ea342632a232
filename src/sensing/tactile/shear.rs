//! The shear under a contact that is dragged and twisted: what sticks moves as one, what would exceed friction slips.
//!
//! The tractions minimise the elastic energy among those that carry the given force and moment, by conjugate gradients
//! preconditioned with the pressure: each direction is a traction in proportion to what friction can hold, so few steps
//! give the smooth inside of a contact, and the edge, where slip begins, comes first to its bound.

use rustfft::num_complex::Complex32;

use super::gel::{Gel, Scratch};
use crate::geometry::{Mat3, Vec3};

/// Iterations end when the sticking cells move as one up to this share of their motion (energy norm).
const TOLERANCE: f64 = 3e-2;
/// Most iterations.
const MOST: usize = 6;
/// Factor by which the bound grows when no sticking cell is left to carry the load.
const RELAX: f64 = 1.1;
/// Rounds of giving what slipping cells could not carry to the others.
const ROUNDS: usize = 4;

/// Solved shear.
#[derive(Clone, Debug)]
pub(super) struct Dragged {
    /// Shear traction on the gel along x and y, Pa.
    pub traction: [Vec<f32>; 2],
    /// How the sticking part has moved: m, m, rad, about the pad's origin.
    pub motion: Vec3,
    /// Bound used over the bound given; above 1 where the load could not be held.
    pub relaxed: f64,
}

/// Force (N), force (N) and moment about the pad's z axis (N m).
pub(super) type Drag = Vec3;

/// Drags the cells under `pressure` (Pa) with `drag`, on friction `mu`.
pub(super) fn drag(gel: &Gel, pressure: &[f32], drag: &Drag, mu: f64, scratch: &mut Scratch) -> Dragged {
    let cells: Vec<usize> = (0..pressure.len()).filter(|&c| pressure[c] > 0.0).collect();
    let none = || vec![0.0; pressure.len()];
    let mut relaxed = 1.0;
    if mu <= 0.0 {
        return Dragged { traction: [none(), none()], motion: Vec3::zeros(), relaxed };
    }
    loop {
        let problem = Problem::new(gel, pressure, &cells, drag, mu * relaxed);
        if let Some((traction, motion)) = problem.solve(scratch) {
            return Dragged { traction, motion, relaxed };
        }
        relaxed *= RELAX;
        if relaxed > 1e6 {
            return Dragged { traction: [none(), none()], motion: Vec3::zeros(), relaxed };
        }
    }
}

struct Problem<'a> {
    gel: &'a Gel,
    cells: &'a [usize],
    /// x, y of each touching cell, m.
    places: Vec<[f64; 2]>,
    /// Largest shear of each, Pa.
    bounds: Vec<f64>,
    load: Vec3,
}

impl<'a> Problem<'a> {
    fn new(gel: &'a Gel, pressure: &[f32], cells: &'a [usize], drag: &Drag, mu: f64) -> Self {
        let places = cells.iter().map(|&c| gel.centre(c)).collect();
        let bounds = cells.iter().map(|&c| mu * f64::from(pressure[c])).collect();
        Self { gel, cells, places, bounds, load: drag / (gel.cell * gel.cell) }
    }

    fn solve(&self, scratch: &mut Scratch) -> Option<([Vec<f32>; 2], Vec3)> {
        let n = self.cells.len();
        let mut weights = self.bounds.clone();
        let mut t = vec![[0.0; 2]; n];
        self.carry(&mut t, &mut weights)?;
        let mut u = self.convolve(&t, scratch);
        let mut direction = vec![[0.0; 2]; n];
        let (mut before, mut keep) = (1.0, 0.0);
        let mut motion = Vec3::zeros();
        for _ in 0..MOST {
            let inverse = self.inertia(&weights).try_inverse()?;
            motion = inverse * self.sum(|i| u[i].map(|u| u * weights[i]));
            let residual: Vec<[f64; 2]> =
                (0..n).map(|i| minus(u[i], rigid(&motion, self.places[i]))).collect();
            let now: f64 = (0..n).map(|i| weights[i] * dot(residual[i], residual[i])).sum();
            let whole: f64 = (0..n).map(|i| weights[i] * dot(u[i], u[i])).sum();
            if now <= TOLERANCE * TOLERANCE * whole {
                break;
            }
            for i in 0..n {
                let share = keep * now / before;
                direction[i] = [0, 1].map(|a| share * direction[i][a] - weights[i] * residual[i][a]);
            }
            before = now;
            let moved = self.convolve(&direction, scratch);
            let curvature: f64 = (0..n).map(|i| dot(direction[i], moved[i])).sum();
            let down: f64 = (0..n).map(|i| -dot(direction[i], residual[i])).sum();
            if curvature <= 0.0 || curvature.is_nan() {
                break;
            }
            let step = down / curvature;
            for i in 0..n {
                for a in 0..2 {
                    t[i][a] += step * direction[i][a];
                    u[i][a] += step * moved[i][a];
                }
            }
            keep = 1.0;
            if self.clip(&mut t, &mut weights) {
                self.carry(&mut t, &mut weights)?;
                u = self.convolve(&t, scratch);
                direction.fill([0.0; 2]);
                keep = 0.0;
            }
        }
        Some((self.spread(&t), motion))
    }

    /// Gives what is missing of the load to the sticking cells, as a rigid motion on springs of their weights.
    fn carry(&self, t: &mut [[f64; 2]], weights: &mut [f64]) -> Option<()> {
        for _ in 0..ROUNDS {
            self.add_missing(t, weights)?;
            if !self.clip(t, weights) {
                return Some(());
            }
        }
        self.add_missing(t, weights)?;
        // The last round may leave a few cells over their bound; far over it, friction cannot hold the load.
        let held = (0..t.len()).all(|i| dot(t[i], t[i]) <= (1.05 * self.bounds[i]).powi(2));
        held.then_some(())
    }

    fn add_missing(&self, t: &mut [[f64; 2]], weights: &[f64]) -> Option<()> {
        let missing = self.load - self.sum(|i| t[i]);
        let motion = self.inertia(weights).try_inverse()? * missing;
        for i in 0..t.len() {
            let add = rigid(&motion, self.places[i]);
            t[i] = [0, 1].map(|a| t[i][a] + weights[i] * add[a]);
        }
        t.iter().all(|t| t[0].is_finite() && t[1].is_finite()).then_some(())
    }

    /// Brings cells back to their bounds; they slip from now on. Whether there were any.
    fn clip(&self, t: &mut [[f64; 2]], weights: &mut [f64]) -> bool {
        let mut any = false;
        for i in 0..t.len() {
            let size = dot(t[i], t[i]).sqrt();
            if weights[i] > 0.0 && size > self.bounds[i] * (1.0 + 1e-9) {
                t[i] = t[i].map(|t| t * self.bounds[i] / size);
                weights[i] = 0.0;
                any = true;
            }
        }
        any
    }

    /// Force and moment of the tractions `of`, over the area of a cell.
    fn sum(&self, of: impl Fn(usize) -> [f64; 2]) -> Vec3 {
        self.places.iter().enumerate().fold(Vec3::zeros(), |sum, (i, at)| {
            let t = of(i);
            sum + Vec3::new(t[0], t[1], at[0] * t[1] - at[1] * t[0])
        })
    }

    /// Force and moment by rigid motions of springs of the given weights.
    fn inertia(&self, weights: &[f64]) -> Mat3 {
        self.places.iter().zip(weights).fold(Mat3::zeros(), |sum, (&[x, y], &w)| {
            let moment = w * (x * x + y * y);
            sum + Mat3::new(w, 0.0, -w * y, 0.0, w, w * x, -w * y, w * x, moment)
        })
    }

    fn spread(&self, t: &[[f64; 2]]) -> [Vec<f32>; 2] {
        [0, 1].map(|a| {
            let mut field = vec![0.0; self.gel.columns * self.gel.rows];
            self.cells.iter().zip(t).for_each(|(&c, t)| field[c] = t[a] as f32);
            field
        })
    }

    /// Displacements of the touching cells along the surface by tractions there.
    fn convolve(&self, t: &[[f64; 2]], scratch: &mut Scratch) -> Vec<[f64; 2]> {
        let [mut x, mut y] = self.spread(t);
        let Scratch { spectra: [sx, sy, ..], buffers: Some(buffers), .. } = scratch else {
            return Vec::new();
        };
        self.gel.plane.forward(&x, sx, buffers);
        self.gel.plane.forward(&y, sy, buffers);
        inline(self.gel, sx, sy);
        self.gel.plane.inverse(sx, &mut x, buffers);
        self.gel.plane.inverse(sy, &mut y, buffers);
        self.cells.iter().map(|&c| [f64::from(x[c]), f64::from(y[c])]).collect()
    }
}

/// Turns the spectra of shear tractions into those of displacements along the surface.
pub(super) fn inline(gel: &Gel, sx: &mut [Complex32], sy: &mut [Complex32]) {
    let [xx, xy, yy] = &gel.kernels.inline;
    for i in 0..sx.len() {
        let (x, y) = (sx[i], sy[i]);
        sx[i] = x * xx[i] + y * xy[i];
        sy[i] = x * xy[i] + y * yy[i];
    }
}

/// Displacement at (x, y) by a rigid motion.
fn rigid(motion: &Vec3, [x, y]: [f64; 2]) -> [f64; 2] {
    [motion.x - motion.z * y, motion.y + motion.z * x]
}

fn minus(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}
