//! Shear under a contact that is dragged and twisted: sticking cells move as one rigid patch, the others slip at
//! the bound of friction.
//!
//! The tractions minimise the elastic energy among those that carry the given force and moment, by conjugate
//! gradients preconditioned with the pressure. Each direction is then a traction in proportion to the bound
//! of friction, so that few steps give the smooth interior of a contact, and its edge, where slip begins,
//! reaches the bound first.

use rustfft::num_complex::Complex32;

use super::gel::{Gel, GelScratch};
use crate::geometry::{Mat3, Vec3};

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
    pub fn at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [self.x - self.angle * y, self.y + self.angle * x]
    }
}

impl From<Vec3> for PlanarMotion {
    fn from(v: Vec3) -> Self {
        Self { x: v.x, y: v.y, angle: v.z }
    }
}

/// Tangential load on a contact: force along x and y (N) and moment about the pad's z axis (N m).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TangentialLoad {
    pub(super) force: [f64; 2],
    pub(super) moment: f64,
}

impl TangentialLoad {
    /// The load per area, as [`resultant`] sums tractions.
    pub(super) fn over_area(&self, area: f64) -> Vec3 {
        Vec3::new(self.force[0], self.force[1], self.moment) / area
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

/// Shears the cells under `pressure` (Pa) by `load`, with the coefficient of friction `mu`.
pub(super) fn solve_tangential_contact(
    gel: &Gel,
    pressure: &[f32],
    load: &TangentialLoad,
    mu: f64,
    scratch: &mut GelScratch,
) -> TangentialSolution {
    let cells: Vec<usize> = (0..pressure.len()).filter(|&c| pressure[c] > 0.0).collect();
    let zeros = || vec![0.0; pressure.len()];
    let free = |friction_excess| TangentialSolution {
        traction: [zeros(), zeros()],
        motion: PlanarMotion::default(),
        friction_excess,
    };
    let mut friction_excess = 1.0;
    if mu <= 0.0 {
        return free(friction_excess);
    }
    loop {
        let problem = TangentialProblem::new(gel, pressure, &cells, load, mu * friction_excess);
        if let Some((traction, motion)) = problem.solve(scratch) {
            return TangentialSolution { traction, motion, friction_excess };
        }
        friction_excess *= BOUND_GROWTH;
        if friction_excess > 1e6 {
            return free(friction_excess);
        }
    }
}

struct TangentialProblem<'a> {
    gel: &'a Gel,
    /// Indices of the touching cells.
    cells: &'a [usize],
    /// Centre of each touching cell, m.
    positions: Vec<[f64; 2]>,
    /// Largest shear of each touching cell, Pa.
    bounds: Vec<f64>,
    /// Load per area of a cell.
    load: Vec3,
}

impl<'a> TangentialProblem<'a> {
    fn new(gel: &'a Gel, pressure: &[f32], cells: &'a [usize], load: &TangentialLoad, mu: f64) -> Self {
        let positions = cells.iter().map(|&c| gel.centre(c)).collect();
        let bounds = cells.iter().map(|&c| mu * f64::from(pressure[c])).collect();
        Self { gel, cells, positions, bounds, load: load.over_area(gel.cell * gel.cell) }
    }

    /// Traction and motion of the sticking part; `None` if friction cannot hold the load.
    fn solve(&self, scratch: &mut GelScratch) -> Option<([Vec<f32>; 2], PlanarMotion)> {
        let n = self.cells.len();
        // Weight of each cell in the preconditioner; 0 where it slips.
        let mut weights = self.bounds.clone();
        let mut t = vec![[0.0; 2]; n];
        self.carry(&mut t, &mut weights)?;
        let mut u = self.displacement(&t, scratch);
        let mut direction = vec![[0.0; 2]; n];
        let (mut before, mut conjugate) = (1.0, 0.0);
        let mut motion = PlanarMotion::default();
        for _ in 0..MAX_ITERATIONS {
            let inverse = self.spring_stiffness(&weights).try_inverse()?;
            motion = PlanarMotion::from(inverse * self.resultant(|i| u[i].map(|u| u * weights[i])));
            let residual: Vec<[f64; 2]> = (0..n).map(|i| minus(u[i], motion.at(self.positions[i]))).collect();
            let now: f64 = (0..n).map(|i| weights[i] * dot(residual[i], residual[i])).sum();
            let whole: f64 = (0..n).map(|i| weights[i] * dot(u[i], u[i])).sum();
            if now <= TOLERANCE * TOLERANCE * whole {
                break;
            }
            for i in 0..n {
                let share = conjugate * now / before;
                direction[i] = [0, 1].map(|a| share * direction[i][a] - weights[i] * residual[i][a]);
            }
            before = now;
            let moved = self.displacement(&direction, scratch);
            let curvature: f64 = (0..n).map(|i| dot(direction[i], moved[i])).sum();
            let descent: f64 = (0..n).map(|i| -dot(direction[i], residual[i])).sum();
            if curvature <= 0.0 || curvature.is_nan() {
                break;
            }
            let step = descent / curvature;
            for i in 0..n {
                for a in 0..2 {
                    t[i][a] += step * direction[i][a];
                    u[i][a] += step * moved[i][a];
                }
            }
            conjugate = 1.0;
            if self.clip(&mut t, &mut weights) {
                self.carry(&mut t, &mut weights)?;
                u = self.displacement(&t, scratch);
                direction.fill([0.0; 2]);
                conjugate = 0.0;
            }
        }
        Some((self.to_grid(&t), motion))
    }

    /// Distributes the missing part of the load over the sticking cells until none exceeds its bound. Returns `None`
    /// if friction cannot hold the load.
    fn carry(&self, t: &mut [[f64; 2]], weights: &mut [f64]) -> Option<()> {
        for _ in 0..MAX_ROUNDS {
            self.add_missing(t, weights)?;
            if !self.clip(t, weights) {
                return Some(());
            }
        }
        self.add_missing(t, weights)?;
        // The last round may leave a few cells slightly over their bound. Further over it, friction
        // cannot hold the load.
        let is_held = (0..t.len()).all(|i| dot(t[i], t[i]) <= (1.05 * self.bounds[i]).powi(2));
        is_held.then_some(())
    }

    /// Adds the missing part of the load, as a rigid motion on springs with the weights as stiffness.
    fn add_missing(&self, t: &mut [[f64; 2]], weights: &[f64]) -> Option<()> {
        let missing = self.load - self.resultant(|i| t[i]);
        let motion = PlanarMotion::from(self.spring_stiffness(weights).try_inverse()? * missing);
        for i in 0..t.len() {
            let add = motion.at(self.positions[i]);
            t[i] = [0, 1].map(|a| t[i][a] + weights[i] * add[a]);
        }
        t.iter().all(|t| t[0].is_finite() && t[1].is_finite()).then_some(())
    }

    /// Scales cells back to their bounds; they slip from now on. Returns true if there were any.
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

    /// Force and moment of the tractions `of`, per area of a cell.
    fn resultant(&self, of: impl Fn(usize) -> [f64; 2]) -> Vec3 {
        self.positions.iter().enumerate().fold(Vec3::zeros(), |sum, (i, at)| {
            let t = of(i);
            sum + Vec3::new(t[0], t[1], at[0] * t[1] - at[1] * t[0])
        })
    }

    fn spring_stiffness(&self, weights: &[f64]) -> Mat3 {
        self.positions
            .iter()
            .zip(weights)
            .fold(Mat3::zeros(), |sum, (&position, &weight)| sum + spring_stiffness(position, weight))
    }

    /// Values of the touching cells as a field over all cells.
    fn to_grid(&self, t: &[[f64; 2]]) -> [Vec<f32>; 2] {
        [0, 1].map(|a| {
            let mut field = vec![0.0; self.gel.columns * self.gel.rows];
            self.cells.iter().zip(t).for_each(|(&c, t)| field[c] = t[a] as f32);
            field
        })
    }

    /// Tangential displacement of each touching cell by tractions on them, m.
    fn displacement(&self, t: &[[f64; 2]], scratch: &mut GelScratch) -> Vec<[f64; 2]> {
        let [mut x, mut y] = self.to_grid(t);
        let GelScratch { spectra: [sx, sy, ..], buffers: Some(buffers), .. } = scratch else {
            return Vec::new();
        };
        self.gel.fft.forward(&x, sx, buffers);
        self.gel.fft.forward(&y, sy, buffers);
        apply_shear_kernel(self.gel, sx, sy);
        self.gel.fft.inverse(sx, &mut x, buffers);
        self.gel.fft.inverse(sy, &mut y, buffers);
        self.cells.iter().map(|&c| [f64::from(x[c]), f64::from(y[c])]).collect()
    }
}

/// Replaces the spectra of shear tractions by those of the tangential displacements.
pub(super) fn apply_shear_kernel(gel: &Gel, sx: &mut [Complex32], sy: &mut [Complex32]) {
    let [xx, xy, yy] = &gel.kernels.tangential;
    for i in 0..sx.len() {
        let (x, y) = (sx[i], sy[i]);
        sx[i] = x * xx[i] + y * xy[i];
        sy[i] = x * xy[i] + y * yy[i];
    }
}

/// Force and moment by rigid motions of a spring of stiffness `w` at (x, y).
pub(super) fn spring_stiffness([x, y]: [f64; 2], w: f64) -> Mat3 {
    let moment = w * (x * x + y * y);
    Mat3::new(w, 0.0, -w * y, 0.0, w, w * x, -w * y, w * x, moment)
}

fn minus(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}
