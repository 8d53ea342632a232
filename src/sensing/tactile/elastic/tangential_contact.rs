//! Shear under a contact that is dragged and twisted: sticking cells move as one rigid patch, the others slip at
//! the bound of friction.
//!
//! The tractions minimise the elastic energy among those that carry the given force and moment, by conjugate
//! gradients preconditioned with the pressure. Each direction is then a traction in proportion to the bound
//! of friction, so that few steps give the smooth interior of a contact, and its edge, where slip begins,
//! reaches the bound first.

use nalgebra::Vector2;

use super::gel::{Gel, GelScratch};
use softvt_geometry::{Mat3, Vec3};
use softvt_signal::fourier::Complex32;

/// Iterations end when the sticking cells differ from a rigid motion by less than this share of it (energy norm).
const TOLERANCE: f64 = 3e-2;
/// Largest number of iterations.
const MAX_ITERATIONS: usize = 6;
/// Factor by which the bound of friction grows if no sticking cell is left to carry the load.
const BOUND_GROWTH: f64 = 1.1;
/// Largest number of rounds of shifting load from slipping cells to sticking ones.
const MAX_ROUNDS: usize = 4;

/// Rigid motion along the surface, about the pad's origin.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PlanarMotion {
    /// Displacement along x, m.
    pub x: f64,
    /// Displacement along y, m.
    pub y: f64,
    /// Rotation about the pad's z axis, rad (small).
    pub angle: f64,
}

impl PlanarMotion {
    /// Displacement of a point, m.
    pub fn at(&self, p: &Vector2<f64>) -> Vector2<f64> {
        Vector2::new(self.x - self.angle * p.y, self.y + self.angle * p.x)
    }
}

impl From<Vec3> for PlanarMotion {
    fn from(v: Vec3) -> Self {
        Self { x: v.x, y: v.y, angle: v.z }
    }
}

/// Solution of a tangential contact.
#[derive(Clone, Debug)]
pub(super) struct TangentialSolution {
    /// Shear traction on the gel along x and y, Pa.
    pub(super) traction: [Vec<f32>; 2],
    /// Motion of the sticking part.
    pub(super) motion: PlanarMotion,
    /// Ratio of the bound of friction used to the one given; above 1 where friction could not hold the load.
    pub(super) friction_excess: f64,
}

/// Shears the cells under `pressure` (Pa) by `load`: force along x and y (N) and moment about the pad's z axis (N m).
/// `mu` is the coefficient of friction.
pub(super) fn solve_tangential_contact(
    gel: &Gel,
    pressure: &[f32],
    load: &Vec3,
    mu: f64,
    scratch: &mut GelScratch,
) -> TangentialSolution {
    let cells: Vec<usize> = (0..pressure.len()).filter(|&c| pressure[c] > 0.0).collect();
    let positions: Vec<_> = cells.iter().map(|&c| gel.centre(c)).collect();
    let load = load / (gel.cell * gel.cell);
    let zeros = || vec![0.0; pressure.len()];
    let mut friction_excess = 1.0;
    while mu > 0.0 && friction_excess <= 1e6 {
        let bounds = cells.iter().map(|&c| mu * friction_excess * f64::from(pressure[c])).collect();
        let problem = TangentialProblem { gel, cells: &cells, positions: &positions, bounds, load };
        if let Some((traction, motion)) = problem.solve(scratch) {
            return TangentialSolution { traction, motion, friction_excess };
        }
        friction_excess *= BOUND_GROWTH;
    }
    TangentialSolution { traction: [zeros(), zeros()], motion: PlanarMotion::default(), friction_excess }
}

struct TangentialProblem<'a> {
    gel: &'a Gel,
    /// Indices of the touching cells.
    cells: &'a [usize],
    /// Centre of each touching cell, m.
    positions: &'a [Vector2<f64>],
    /// Largest shear of each touching cell, Pa.
    bounds: Vec<f64>,
    /// Load per area of a cell, as [`Self::resultant`] sums tractions.
    load: Vec3,
}

impl TangentialProblem<'_> {
    /// Traction and motion of the sticking part; `None` if friction cannot hold the load.
    fn solve(&self, scratch: &mut GelScratch) -> Option<([Vec<f32>; 2], PlanarMotion)> {
        let n = self.cells.len();
        // Weight of each cell in the preconditioner; 0 where it slips.
        let mut weights = self.bounds.clone();
        let mut t = vec![Vector2::zeros(); n];
        self.carry(&mut t, &mut weights)?;
        let mut u = self.displacement(&t, scratch);
        let mut direction = vec![Vector2::zeros(); n];
        let (mut before, mut conjugate) = (1.0, 0.0);
        let mut motion = PlanarMotion::default();
        for _ in 0..MAX_ITERATIONS {
            let inverse = self.spring_stiffness(&weights).try_inverse()?;
            motion = PlanarMotion::from(inverse * self.resultant(|i| u[i] * weights[i]));
            let residual: Vec<_> = (0..n).map(|i| u[i] - motion.at(&self.positions[i])).collect();
            let now: f64 = (0..n).map(|i| weights[i] * residual[i].dot(&residual[i])).sum();
            let whole: f64 = (0..n).map(|i| weights[i] * u[i].dot(&u[i])).sum();
            if now <= TOLERANCE * TOLERANCE * whole {
                break;
            }
            let share = conjugate * now / before;
            for i in 0..n {
                direction[i] = share * direction[i] - weights[i] * residual[i];
            }
            before = now;
            let moved = self.displacement(&direction, scratch);
            let curvature: f64 = (0..n).map(|i| direction[i].dot(&moved[i])).sum();
            let descent: f64 = (0..n).map(|i| -direction[i].dot(&residual[i])).sum();
            if curvature <= 0.0 || curvature.is_nan() {
                break;
            }
            let step = descent / curvature;
            for i in 0..n {
                t[i] += step * direction[i];
                u[i] += step * moved[i];
            }
            conjugate = 1.0;
            if self.clip(&mut t, &mut weights) {
                self.carry(&mut t, &mut weights)?;
                u = self.displacement(&t, scratch);
                direction.fill(Vector2::zeros());
                conjugate = 0.0;
            }
        }
        Some((self.to_grid(&t), motion))
    }

    /// Distributes the missing part of the load over the sticking cells until none exceeds its bound. Returns `None`
    /// if friction cannot hold the load.
    fn carry(&self, t: &mut [Vector2<f64>], weights: &mut [f64]) -> Option<()> {
        for _ in 0..MAX_ROUNDS {
            self.add_missing(t, weights)?;
            if !self.clip(t, weights) {
                return Some(());
            }
        }
        self.add_missing(t, weights)?;
        // The last round may leave a few cells slightly over their bound. Further over it, friction
        // cannot hold the load.
        let is_held = (0..t.len()).all(|i| t[i].dot(&t[i]) <= (1.05 * self.bounds[i]).powi(2));
        is_held.then_some(())
    }

    /// Adds the missing part of the load, as a rigid motion on springs with the weights as stiffness.
    fn add_missing(&self, t: &mut [Vector2<f64>], weights: &[f64]) -> Option<()> {
        let missing = self.load - self.resultant(|i| t[i]);
        let motion = PlanarMotion::from(self.spring_stiffness(weights).try_inverse()? * missing);
        for i in 0..t.len() {
            t[i] += weights[i] * motion.at(&self.positions[i]);
        }
        t.iter().all(|t| t.x.is_finite() && t.y.is_finite()).then_some(())
    }

    /// Scales cells back to their bounds; they slip from now on. Returns true if there were any.
    fn clip(&self, t: &mut [Vector2<f64>], weights: &mut [f64]) -> bool {
        let mut any = false;
        for i in 0..t.len() {
            let size = t[i].dot(&t[i]).sqrt();
            if weights[i] > 0.0 && size > self.bounds[i] * (1.0 + 1e-9) {
                t[i] = t[i] * self.bounds[i] / size;
                weights[i] = 0.0;
                any = true;
            }
        }
        any
    }

    /// Force and moment of the tractions `of`, per area of a cell.
    fn resultant(&self, of: impl Fn(usize) -> Vector2<f64>) -> Vec3 {
        self.positions.iter().enumerate().fold(Vec3::zeros(), |sum, (i, at)| {
            let t = of(i);
            sum + Vec3::new(t.x, t.y, at.x * t.y - at.y * t.x)
        })
    }

    fn spring_stiffness(&self, weights: &[f64]) -> Mat3 {
        self.positions
            .iter()
            .zip(weights)
            .fold(Mat3::zeros(), |sum, (position, &weight)| sum + spring_stiffness(position, weight))
    }

    /// Values of the touching cells as a field over all cells.
    fn to_grid(&self, t: &[Vector2<f64>]) -> [Vec<f32>; 2] {
        [0, 1].map(|a| {
            let mut field = vec![0.0; self.gel.columns * self.gel.rows];
            self.cells.iter().zip(t).for_each(|(&c, t)| field[c] = t[a] as f32);
            field
        })
    }

    /// Tangential displacement of each touching cell by tractions on them, m.
    fn displacement(&self, t: &[Vector2<f64>], scratch: &mut GelScratch) -> Vec<Vector2<f64>> {
        let [mut x, mut y] = self.to_grid(t);
        let GelScratch { spectra: [sx, sy, ..], buffers, .. } = scratch;
        self.gel.fft.forward(&x, sx, buffers);
        self.gel.fft.forward(&y, sy, buffers);
        apply_shear_kernel(self.gel, sx, sy);
        let row = |cell: Option<&usize>| cell.map_or(0, |c| c / self.gel.columns);
        let rows = row(self.cells.first())..row(self.cells.last()) + 1;
        self.gel.fft.inverse_rows(sx, &mut x, rows.clone(), buffers);
        self.gel.fft.inverse_rows(sy, &mut y, rows, buffers);
        self.cells.iter().map(|&c| Vector2::new(x[c].into(), y[c].into())).collect()
    }
}

/// Replaces the spectra of shear tractions by the spectra of the tangential displacements.
pub(super) fn apply_shear_kernel(gel: &Gel, sx: &mut [Complex32], sy: &mut [Complex32]) {
    let [xx, xy, yy] = &gel.kernels.tangential;
    for i in 0..sx.len() {
        let (x, y) = (sx[i], sy[i]);
        sx[i] = x * xx[i] + y * xy[i];
        sy[i] = x * xy[i] + y * yy[i];
    }
}

/// Force and moment by rigid motions of a spring of stiffness `w` at a point.
pub(super) fn spring_stiffness(p: &Vector2<f64>, w: f64) -> Mat3 {
    let (x, y) = (p.x, p.y);
    let moment = w * (x * x + y * y);
    Mat3::new(w, 0.0, -w * y, 0.0, w, w * x, -w * y, w * x, moment)
}
