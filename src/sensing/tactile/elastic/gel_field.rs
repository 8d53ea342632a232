//! Gel field: pressure, shear and displacement of the gel's surface under a contact.

use nalgebra::Vector2;

use super::{
    gel::{Gel, GelScratch},
    height_map::{FINE, HeightMap, SkinMesh},
    normal_contact::solve_normal_contact,
    pad_wrench::{PadWrench, Taxels},
    substrate::SubstrateCompliance,
};
use softvt_geometry::{BilinearGrid, Mat3, Vec3};
use softvt_physics::world::PatchPoint;
use softvt_signal::fourier::Complex32;

/// Contact of bodies with a pad: the input of [`GelField::solve`].
#[derive(Clone, Copy, Debug)]
pub struct TactileContact<'a> {
    /// Force and moment on the gel, from the solver.
    pub wrench: PadWrench,
    /// The solver's contact points, which say how the shear is distributed. Without any, it is in proportion to the
    /// pressure.
    pub points: &'a [PatchPoint],
    /// Surfaces of the touching bodies.
    pub skins: &'a [SkinMesh<'a>],
    /// Compliance of the touching body in series with the gel; `None` presses its surface in unchanged,
    /// like a rigid stamp.
    pub substrate: Option<SubstrateCompliance>,
}

/// Gel under a contact; arrays are over the cells of [`Gel`], row by row.
#[derive(Clone, Debug)]
pub struct GelField {
    /// Pressure on the gel, Pa; integrates to the normal force of the wrench.
    pub pressure: Vec<f64>,
    /// Shear traction on the gel along x and y, Pa; integrates to the shear force and the moment about z of the wrench.
    pub shear: [Vec<f64>; 2],
    /// Displacement of the gel's surface along x, y, z, m, pad frame.
    pub displacement: [Vec<f32>; 3],
    /// Rigid approach of the skins from their given position, m; negative if they were pulled back.
    pub approach: f64,
    /// Mean motion of the contact along the surface: the rigid one that is nearest to its displacement, weighted by
    /// pressure.
    pub motion: PlanarMotion,
    /// True if the skins keep their shape also below the size of a cell.
    pub(in super::super) has_rigid_skin: bool,
    /// The skins in their final position.
    pub(in super::super) height_map: HeightMap,
}

/// Reasons why a contact has no field.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "the messages describe the variants")]
pub enum TactileContactError {
    #[error("the pad is pressed with {force} N, but no skin is given")]
    NoSkin { force: f64 },
    #[error("the pad's {field} is {value}; expected a finite number{condition}")]
    BadNumber { field: &'static str, value: f64, condition: &'static str },
}

impl GelField {
    /// Solves a contact; `None` if nothing presses, or only outside the grid.
    ///
    /// The skins are pressed in until the pressure carries the normal force of the wrench. The shear over the pressure
    /// is that of the solver's points around each cell. The result does not depend on earlier calls: `scratch` keeps
    /// working memory, and the compliance of the last gel and body.
    ///
    /// # Errors
    /// A number is not finite, or there is a pressing force but no skin.
    pub fn solve(
        gel: &Gel,
        contact: &TactileContact,
        scratch: &mut GelScratch,
    ) -> Result<Option<Self>, TactileContactError> {
        validate(contact)?;
        let TactileContact { wrench, points, skins, substrate } = contact;
        if wrench.normal() <= 0.0 {
            return Ok(None);
        }
        scratch.fit(gel);
        scratch.set_compliance(gel, *substrate);
        let points_per_cell = if substrate.is_some() { gel.soft_skin_points } else { FINE };
        let mut height_map = HeightMap::new(gel, skins, points_per_cell);
        if skins.is_empty() {
            return Err(TactileContactError::NoSkin { force: wrench.normal() });
        }
        // A skin that passes outside the grid, such as a rim at the edge of the pad, leaves no imprint.
        let Some(normal) = solve_normal_contact(gel, &height_map.gaps(gel), wrench.normal(), scratch) else {
            return Ok(None);
        };
        height_map.height.iter_mut().for_each(|z| *z -= normal.approach as f32);
        // In double precision, and scaled so that it integrates to the force exactly.
        let mut pressure: Vec<f64> = normal.pressure.iter().map(|&p| f64::from(p)).collect();
        let scale = wrench.normal() / (gel.cell * gel.cell) / pressure.iter().sum::<f64>();
        pressure.iter_mut().for_each(|p| *p *= scale);
        let load = Vec3::new(wrench.force.x, wrench.force.y, wrench.moment.z);
        let shear = balanced_shear(gel, &pressure, &ShearShares::new(gel, points, &pressure), &load);
        let narrowed = shear.each_ref().map(|along| along.iter().map(|&t| t as f32).collect());
        let displacement = surface_displacement(gel, &normal.pressure, &narrowed, scratch);
        let motion = mean_motion(gel, &pressure, &displacement);
        Ok(Some(Self {
            pressure,
            shear,
            displacement,
            approach: normal.approach,
            motion,
            has_rigid_skin: substrate.is_none(),
            height_map,
        }))
    }

    /// Sum of the tractions, taken at the apex plane.
    pub fn wrench(&self, gel: &Gel) -> PadWrench {
        let area = gel.cell * gel.cell;
        self.pressed_cells().fold(PadWrench::default(), |sum, (c, p)| {
            let force = Vec3::new(self.shear[0][c], self.shear[1][c], -p) * area;
            sum.plus(&gel.centre(c).push(0.0), force)
        })
    }

    /// Tractions on a grid of `shape` taxels; each cell is distributed over the four taxels around it.
    pub fn taxels(&self, gel: &Gel, shape: [usize; 2]) -> Taxels {
        let mut taxels = Taxels::empty(&gel.pad, shape);
        for (c, p) in self.pressed_cells() {
            taxels.add(gel.centre(c).into(), gel.cell * gel.cell, p, [self.shear[0][c], self.shear[1][c]]);
        }
        taxels
    }

    /// Indices and pressures of the cells with pressure.
    fn pressed_cells(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.pressure.iter().copied().enumerate().filter(|(_, p)| *p > 0.0)
    }

    /// Greatest depth of the dent, m.
    pub fn depth(&self) -> f64 {
        -f64::from(self.displacement[2].iter().copied().fold(0.0, f32::min))
    }

    /// Centre of pressure (x, y), m.
    pub fn centre(&self, gel: &Gel) -> Vector2<f64> {
        let sum = self.pressed_cells().fold(Vec3::zeros(), |sum, (c, p)| sum + p * gel.centre(c).push(1.0));
        sum.xy() / sum.z
    }

    /// True if there is pressure on the cell at (x, y), m.
    pub fn touches(&self, gel: &Gel, x: f64, y: f64) -> bool {
        let [i, j] = gel.grid_position(x, y).map(f64::round);
        let is_inside = i >= 0.0 && j >= 0.0 && i < gel.columns as f64 && j < gel.rows as f64;
        is_inside && self.pressure[j as usize * gel.columns + i as usize] > 0.0
    }

    /// Displacement (x, y, z) of the surface at (x, y), m: cubic between cells, zero outside the grid.
    pub fn displacement_at(&self, gel: &Gel, x: f64, y: f64) -> [f64; 3] {
        let [tx, ty] = gel.grid_position(x, y).map(cubic_taps);
        let mut out = [0.0; 3];
        for (b, wy) in ty.weights.iter().enumerate() {
            for (a, wx) in tx.weights.iter().enumerate() {
                let (i, j) = (tx.first + a as isize, ty.first + b as isize);
                if (0..gel.columns as isize).contains(&i) && (0..gel.rows as isize).contains(&j) {
                    let c = j as usize * gel.columns + i as usize;
                    out = std::array::from_fn(|d| out[d] + wx * wy * f64::from(self.displacement[d][c]));
                }
            }
        }
        out
    }
}

/// Taps of Keys' cubic interpolation along one axis (IEEE TASSP 29 (1981) 1153).
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct CubicTaps {
    /// Index of the first of four neighbours; may be outside the grid.
    pub(in super::super) first: isize,
    /// Weights of the four neighbours.
    pub(in super::super) weights: [f64; 4],
}

/// Taps at a position in units of cells, with the first centre at 0.
pub(in super::super) fn cubic_taps(position: f64) -> CubicTaps {
    let base = position.floor();
    let t = position - base;
    let weights = [
        ((-0.5 * t + 1.0) * t - 0.5) * t,
        (1.5 * t - 2.5) * t * t + 1.0,
        ((-1.5 * t + 2.0) * t + 0.5) * t,
        (0.5 * t - 0.5) * t * t,
    ];
    CubicTaps { first: base as isize - 1, weights }
}

fn validate(contact: &TactileContact) -> Result<(), TactileContactError> {
    let TactileContact { wrench, substrate, .. } = contact;
    let substrate = substrate.unwrap_or(SubstrateCompliance { modulus: 1.0, resolved: 1.0 });
    for (field, value, is_valid, condition) in [
        ("force along x", wrench.force.x, true, ""),
        ("force along y", wrench.force.y, true, ""),
        ("force along z", wrench.force.z, true, ""),
        ("moment about z", wrench.moment.z, true, ""),
        ("substrate.modulus", substrate.modulus, substrate.modulus > 0.0, " above 0"),
        ("substrate.resolved", substrate.resolved, substrate.resolved > 0.0, " above 0"),
    ] {
        if !(value.is_finite() && is_valid) {
            return Err(TactileContactError::BadNumber { field, value, condition });
        }
    }
    Ok(())
}

/// Displacement of the gel's surface by pressure and shear, m.
pub(super) fn surface_displacement(
    gel: &Gel,
    pressure: &[f32],
    shear: &[Vec<f32>; 2],
    scratch: &mut GelScratch,
) -> [Vec<f32>; 3] {
    let mut out = std::array::from_fn(|_| vec![0.0; pressure.len()]);
    let GelScratch { spectra: [sx, sy, sp, sz], buffers, .. } = scratch;
    gel.fft.forward(pressure, sp, buffers);
    gel.fft.forward(&shear[0], sx, buffers);
    gel.fft.forward(&shear[1], sy, buffers);
    let [mx, my] = &gel.kernels.coupling;
    for i in 0..sp.len() {
        // −i m k/k · t − N p
        let along = sx[i] * mx[i] + sy[i] * my[i];
        sz[i] = Complex32::new(along.im, -along.re) - sp[i] * gel.kernels.normal[i];
    }
    let [xx, xy, yy] = &gel.kernels.tangential;
    for i in 0..sp.len() {
        (sx[i], sy[i]) = (sx[i] * xx[i] + sy[i] * xy[i], sx[i] * xy[i] + sy[i] * yy[i]);
        let outwards = Complex32::new(sp[i].im, -sp[i].re);
        sx[i] += outwards * mx[i];
        sy[i] += outwards * my[i];
    }
    for (spectrum, field) in [sx, sy, sz].into_iter().zip(&mut out) {
        gel.fft.inverse(spectrum, field, buffers);
    }
    out
}

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

/// Shear of contact points over the pressure of the field, on a grid of nodes [`Self::SPACING`] apart: the pressure
/// around a node carries the shear of the points around it.
struct ShearShares {
    grid: BilinearGrid,
    /// Of each node, along x and y.
    shares: Vec<Vector2<f64>>,
}

impl ShearShares {
    /// Distance of the nodes, m: a little more than that of the points.
    const SPACING: f64 = 1e-3;

    fn new(gel: &Gel, points: &[PatchPoint], pressure: &[f64]) -> Self {
        let count = |length: f64| (length / Self::SPACING).ceil() as usize + 2;
        let (columns, rows) = (count(gel.pad.length), count(gel.pad.width));
        let grid = BilinearGrid { columns, rows, spacing: Self::SPACING };
        let mut shares = vec![Vector2::zeros(); grid.nodes()];
        for point in points {
            let traction = -(point.normal_p * point.pressure + point.shear_p);
            for (node, share) in grid.around(point.p_p.x, point.p_p.y) {
                shares[node] += traction.xy() * (point.area * share);
            }
        }
        let mut pressed = vec![0.0; grid.nodes()];
        for (c, p) in pressure.iter().enumerate().filter(|(_, p)| **p > 0.0) {
            let at = gel.centre(c);
            for (node, share) in grid.around(at.x, at.y) {
                pressed[node] += p * gel.cell * gel.cell * share;
            }
        }
        for (share, force) in shares.iter_mut().zip(pressed) {
            *share = if force > 0.0 { *share / force } else { Vector2::zeros() };
        }
        Self { grid, shares }
    }

    /// Shear over pressure at a point, along x and y.
    fn at(&self, p: Vector2<f64>) -> Vector2<f64> {
        self.grid.around(p.x, p.y).iter().map(|&(node, share)| self.shares[node] * share).sum()
    }
}

/// Shear of each cell by these shares of its pressure, corrected so that it integrates to `load`: by a share that is a
/// rigid motion.
fn balanced_shear(gel: &Gel, pressure: &[f64], shares: &ShearShares, load: &Vec3) -> [Vec<f64>; 2] {
    let mut shear = [0, 1].map(|_| vec![0.0; pressure.len()]);
    let mut stiffness = Mat3::zeros();
    let mut missing = load / (gel.cell * gel.cell);
    let touching: Vec<usize> = (0..pressure.len()).filter(|&c| pressure[c] > 0.0).collect();
    for &c in &touching {
        let at = gel.centre(c);
        let t = pressure[c] * shares.at(at);
        (shear[0][c], shear[1][c]) = (t.x, t.y);
        missing -= Vec3::new(t.x, t.y, at.x * t.y - at.y * t.x);
        stiffness += spring_stiffness(&at, pressure[c]);
    }
    if let Some(inverse) = stiffness.try_inverse() {
        let motion = PlanarMotion::from(inverse * missing);
        for &c in &touching {
            let add = pressure[c] * motion.at(&gel.centre(c));
            shear[0][c] += add.x;
            shear[1][c] += add.y;
        }
    }
    shear
}

/// The rigid motion along the surface that is nearest to a displacement, weighted by pressure.
fn mean_motion(gel: &Gel, pressure: &[f64], displacement: &[Vec<f32>; 3]) -> PlanarMotion {
    let (mut stiffness, mut moved) = (Mat3::zeros(), Vec3::zeros());
    for c in (0..pressure.len()).filter(|&c| pressure[c] > 0.0) {
        let (at, p) = (gel.centre(c), pressure[c]);
        let [x, y] = [0, 1].map(|axis| p * f64::from(displacement[axis][c]));
        moved += Vec3::new(x, y, at.x * y - at.y * x);
        stiffness += spring_stiffness(&at, p);
    }
    stiffness.try_inverse().map_or(PlanarMotion::default(), |inverse| (inverse * moved).into())
}

/// Force and moment by rigid motions of a spring of stiffness `w` at a point.
fn spring_stiffness(p: &Vector2<f64>, w: f64) -> Mat3 {
    let (x, y) = (p.x, p.y);
    let moment = w * (x * x + y * y);
    Mat3::new(w, 0.0, -w * y, 0.0, w, w * x, -w * y, w * x, moment)
}
