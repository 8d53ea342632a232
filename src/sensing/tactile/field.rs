//! The gel field: what a touch does to the gel's surface.

use rustfft::num_complex::Complex32;

use super::{
    gel::{Gel, Scratch},
    load::PadLoad,
    normal,
    relief::{FINE, Relief, Surface},
    shear::{self, Drag},
};
use crate::geometry::Vec3;

/// What touches a pad, and how hard.
#[derive(Clone, Copy, Debug)]
pub struct PadInput<'a> {
    /// Force and moment on the gel, from the solver.
    pub load: PadLoad,
    /// Skins of the touching bodies.
    pub surfaces: &'a [Surface<'a>],
    /// Friction coefficient of the pair of gel and bodies: the bound of shear over pressure; see [`PadLoad::friction_of`].
    pub friction: f64,
    /// Give of the touching body's surface in series with the gel; `None` presses the skin as it is.
    pub give: Option<Give>,
}

/// How a soft body's skin gives way to ridges finer than its finite elements: a half space for waves shorter than
/// `resolved`; longer ones are in the skin's shape already. (Johnson, *Contact Mechanics*, 1985, §4.2.)
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Give {
    /// E/(1 − ν²) of the body, Pa.
    pub modulus: f64,
    /// Length of waves that the body's mesh resolves, m.
    pub resolved: f64,
}

/// The touched gel; arrays over [`Gel`]'s cells.
#[derive(Clone, Debug)]
pub struct GelField {
    /// Pressure on the gel, Pa; sums up to the load's normal force.
    pub pressure: Vec<f64>,
    /// Shear traction on the gel along x and y, Pa; sums up to the load's shear and moment about z.
    pub shear: [Vec<f64>; 2],
    /// Displacement of the gel's surface along x, y, z, m, pad frame.
    pub displacement: [Vec<f32>; 3],
    /// How far the skins were pushed in beyond where they are given, m; negative if pulled back.
    pub push: f64,
    /// Rigid motion (m, m, rad about the pad's z axis) of the part of the contact that sticks.
    pub motion: Vec3,
    /// 1, or by how much more than friction the shear needs to be held.
    pub friction_excess: f64,
    /// Whether the skins keep their shape, finer than the grid too.
    pub(super) firm: bool,
    /// The skins where they were pushed to.
    pub(super) relief: Relief,
}

/// Why a touch has no field.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FieldError {
    /// A load without a body.
    #[error("the pad is pressed with {force} N, but no skin of the {surfaces} given lies over it")]
    NothingThere {
        /// Normal force, N.
        force: f64,
        /// Number of skins.
        surfaces: usize,
    },
    /// A number that is none.
    #[error("the pad's {field} is {value}; expected a finite number{and}")]
    Number {
        /// Which.
        field: &'static str,
        /// Its value.
        value: f64,
        /// More about it.
        and: &'static str,
    },
}

/// The field of a touch; `None`, at no cost, if nothing presses. A pure function of its input: nothing is kept from one
/// frame to the next, so that pictures may be made in any order or later.
///
/// # Errors
/// A number that is not finite, or a pressing force without a skin over the pad.
pub fn sense(gel: &Gel, input: &PadInput, scratch: &mut Scratch) -> Result<Option<GelField>, FieldError> {
    check(input)?;
    let load = &input.load;
    if load.normal() <= 0.0 {
        return Ok(None);
    }
    scratch.fit(gel);
    compose(gel, input.give, scratch);
    let mut relief = Relief::of(gel, input.surfaces);
    let nothing = || FieldError::NothingThere { force: load.normal(), surfaces: input.surfaces.len() };
    let pressed = normal::press(gel, &gaps(gel, &relief), load.normal(), scratch).ok_or_else(nothing)?;
    let wanted = Drag::new(load.force.x, load.force.y, load.moment.z);
    let dragged = shear::drag(gel, &pressed.pressure, &wanted, input.friction, scratch);
    let displacement = displace(gel, &pressed.pressure, &dragged.traction, scratch);
    relief.height.iter_mut().for_each(|z| *z -= pressed.push as f32);
    let (pressure, shear) = exact(gel, &pressed.pressure, &dragged.traction, load.normal(), &wanted);
    Ok(Some(GelField {
        pressure,
        shear,
        displacement,
        push: pressed.push,
        motion: dragged.motion,
        friction_excess: dragged.relaxed,
        firm: input.give.is_none(),
        relief,
    }))
}

impl GelField {
    /// Greatest depth of the dent, m.
    pub fn depth(&self) -> f64 {
        -f64::from(self.displacement[2].iter().copied().fold(0.0, f32::min))
    }

    /// Centre of the pressure (x, y), m.
    pub fn centre(&self, gel: &Gel) -> [f64; 2] {
        let mut sum = [0.0; 3];
        for (c, &p) in self.pressure.iter().enumerate().filter(|(_, p)| **p > 0.0) {
            let [x, y] = gel.centre(c);
            sum = [sum[0] + p * x, sum[1] + p * y, sum[2] + p];
        }
        [sum[0] / sum[2], sum[1] / sum[2]]
    }

    /// Whether the cell at (x, y) is pressed.
    pub fn touches(&self, gel: &Gel, x: f64, y: f64) -> bool {
        let i = (x / gel.cell + 0.5 * (gel.columns - 1) as f64).round();
        let j = (y / gel.cell + 0.5 * (gel.rows - 1) as f64).round();
        let inside = i >= 0.0 && j >= 0.0 && i < gel.columns as f64 && j < gel.rows as f64;
        inside && self.pressure[j as usize * gel.columns + i as usize] > 0.0
    }

    /// Displacement of the surface at (x, y), m: cubic between cells, at rest beyond the grid.
    pub fn at(&self, gel: &Gel, x: f64, y: f64) -> [f64; 3] {
        let (i, wx) = taps(x / gel.cell + 0.5 * (gel.columns - 1) as f64);
        let (j, wy) = taps(y / gel.cell + 0.5 * (gel.rows - 1) as f64);
        let mut out = [0.0; 3];
        for (b, wy) in wy.iter().enumerate() {
            for (a, wx) in wx.iter().enumerate() {
                let (i, j) = (i + a as isize, j + b as isize);
                if (0..gel.columns as isize).contains(&i) && (0..gel.rows as isize).contains(&j) {
                    let c = j as usize * gel.columns + i as usize;
                    out = std::array::from_fn(|d| out[d] + wx * wy * f64::from(self.displacement[d][c]));
                }
            }
        }
        out
    }
}

/// First of four neighbours and their weights in Keys' cubic interpolation (IEEE TASSP 29 (1981) 1153).
pub(super) fn taps(at: f64) -> (isize, [f64; 4]) {
    let base = at.floor();
    let t = at - base;
    let weights = [
        ((-0.5 * t + 1.0) * t - 0.5) * t,
        (1.5 * t - 2.5) * t * t + 1.0,
        ((-1.5 * t + 2.0) * t + 0.5) * t,
        (0.5 * t - 0.5) * t * t,
    ];
    (base as isize - 1, weights)
}

fn check(input: &PadInput) -> Result<(), FieldError> {
    let load = &input.load;
    let finite = [
        ("force along x", load.force.x),
        ("force along y", load.force.y),
        ("force along z", load.force.z),
        ("moment about z", load.moment.z),
    ];
    for (field, value) in finite {
        if !value.is_finite() {
            return Err(FieldError::Number { field, value, and: "" });
        }
    }
    if !(input.friction >= 0.0 && input.friction.is_finite()) {
        return Err(FieldError::Number { field: "friction", value: input.friction, and: " of at least 0" });
    }
    let positive =
        input.give.iter().flat_map(|g| [("give.modulus", g.modulus), ("give.resolved", g.resolved)]);
    for (field, value) in positive {
        if !(value > 0.0 && value.is_finite()) {
            return Err(FieldError::Number { field, value, and: " above 0" });
        }
    }
    Ok(())
}

/// Sets the compliance of gel and body in series.
fn compose(gel: &Gel, give: Option<Give>, scratch: &mut Scratch) {
    scratch.composite.clone_from(&gel.kernels.normal);
    let Some(give) = give else { return };
    let size = (gel.plane.wide * gel.plane.high) as f64;
    let longest = std::f64::consts::TAU / give.resolved;
    for (total, &k) in scratch.composite.iter_mut().zip(&gel.kernels.k) {
        let k = f64::from(k).max(1e-3);
        let short = 1.0 - (-(k / longest).powi(2)).exp();
        *total += (2.0 * short / (give.modulus * k) / size) as f32;
    }
}

/// Height of the skins above the untouched gel at each cell.
fn gaps(gel: &Gel, relief: &Relief) -> Vec<f32> {
    let gap = |c: usize| {
        let height = relief.at_cell(c % gel.columns, c / gel.columns) - gel.dome[c];
        if height.is_nan() { f32::INFINITY } else { height }
    };
    debug_assert_eq!(relief.columns, FINE * gel.columns);
    (0..gel.columns * gel.rows).map(gap).collect()
}

/// Displacement of the gel's surface by pressure and shear.
pub(super) fn displace(
    gel: &Gel,
    pressure: &[f32],
    shear: &[Vec<f32>; 2],
    scratch: &mut Scratch,
) -> [Vec<f32>; 3] {
    let mut out = std::array::from_fn(|_| vec![0.0; pressure.len()]);
    let Scratch { spectra: [sx, sy, sp, sz], buffers: Some(buffers), .. } = scratch else { return out };
    gel.plane.forward(pressure, sp, buffers);
    gel.plane.forward(&shear[0], sx, buffers);
    gel.plane.forward(&shear[1], sy, buffers);
    let [mx, my] = &gel.kernels.coupling;
    for i in 0..sp.len() {
        // −i m k/k · t − N p
        let along = sx[i] * mx[i] + sy[i] * my[i];
        sz[i] = Complex32::new(along.im, -along.re) - sp[i] * gel.kernels.normal[i];
    }
    shear::inline(gel, sx, sy);
    for i in 0..sp.len() {
        let outwards = Complex32::new(sp[i].im, -sp[i].re);
        sx[i] += outwards * mx[i];
        sy[i] += outwards * my[i];
    }
    for (spectrum, field) in [sx, sy, sz].into_iter().zip(&mut out) {
        gel.plane.inverse(spectrum, field, buffers);
    }
    out
}

/// The tractions in double precision, with the last bits so that they sum up to the load.
fn exact(gel: &Gel, p: &[f32], t: &[Vec<f32>; 2], normal: f64, wanted: &Drag) -> (Vec<f64>, [Vec<f64>; 2]) {
    let area = gel.cell * gel.cell;
    let mut pressure: Vec<f64> = p.iter().map(|&p| f64::from(p)).collect();
    let scale = normal / area / pressure.iter().sum::<f64>();
    pressure.iter_mut().for_each(|p| *p *= scale);
    let mut shear = [0, 1].map(|a| t[a].iter().map(|&t| f64::from(t)).collect::<Vec<f64>>());
    let mut inertia = crate::geometry::Mat3::zeros();
    let mut missing = wanted / area;
    let touching: Vec<usize> = (0..p.len()).filter(|&c| p[c] > 0.0).collect();
    for &c in &touching {
        let ([x, y], w) = (gel.centre(c), pressure[c]);
        let (tx, ty) = (shear[0][c], shear[1][c]);
        missing -= Vec3::new(tx, ty, x * ty - y * tx);
        let moment = w * (x * x + y * y);
        inertia += crate::geometry::Mat3::new(w, 0.0, -w * y, 0.0, w, w * x, -w * y, w * x, moment);
    }
    if let Some(inverse) = inertia.try_inverse() {
        let motion = inverse * missing;
        for &c in &touching {
            let ([x, y], w) = (gel.centre(c), pressure[c]);
            shear[0][c] += w * (motion.x - motion.z * y);
            shear[1][c] += w * (motion.y + motion.z * x);
        }
    }
    (pressure, shear)
}
