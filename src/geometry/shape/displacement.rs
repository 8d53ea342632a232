//! Height fields that displace the surface of a shape.

use serde::Serialize;

use super::warp::Axis;
use crate::{Vec3, hex8};

/// A height field over a surface; positive heights raise it outwards.
/// Its serialised names are part of fingerprints of assets.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub enum SurfaceRelief {
    /// Ridges at a regular pitch.
    Ridges(Ridges),
    /// Bumps on a jittered lattice.
    Bumps(Bumps),
}

/// Ridges of height `height · w((1 + cos ψ)/2)` with phase `ψ = count·θ + 2π (along/pitch + r/radial_pitch) + phase`:
/// rings along the axis (`pitch`), flutes around it (`count`), screws (both) or a spiral (`count`, `radial_pitch`).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Ridges {
    /// Axis of the pattern.
    pub axis: Axis,
    /// Height from valley (0) to crest, m; negative for grooves.
    pub height: f64,
    /// Number of ridges around the axis; 0 for rings, negative for opposite handedness.
    pub count: i32,
    /// Period along the axis, m; infinite for flutes.
    pub pitch: f64,
    /// Period in the radial direction, m; infinite if the pattern does not depend on the radius.
    pub radial_pitch: f64,
    /// Phase at θ = 0, rad.
    pub phase: f64,
    /// Exponent of the raised cosine, 1..=8: 1 is a sine wave, larger values give narrow crests and wide valleys.
    pub sharpness: f64,
    /// Weight of the ridges along an axis; `None` for everywhere.
    pub mask: Option<Ramp>,
}

/// Bumps (seeds, raisins) on a jittered cubic lattice; those that intersect the surface are visible.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Bumps {
    /// Height, m; negative for dents.
    pub height: f64,
    /// Radius of each bump, m; at most half of `spacing`.
    pub radius: f64,
    /// Edge of the lattice, m.
    pub spacing: f64,
    /// Seed of the jitter.
    pub seed: u64,
    /// Weight of the bumps along an axis; `None` for everywhere.
    pub mask: Option<Ramp>,
}

/// A weight that changes smoothly from 0 at `from` to 1 at `to` along an axis; `from` may exceed `to`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Ramp {
    /// Axis along which the weight changes.
    pub axis: Axis,
    /// Coordinate of weight 0, m.
    pub from: f64,
    /// Coordinate of weight 1, m.
    pub to: f64,
}

/// Distance from the axis within which ridges fade out, per ridge (at least one), m: there they would merge.
const FADE_RADIUS: f64 = 1e-3;

impl SurfaceRelief {
    /// Height (m) and its gradient at a point.
    pub(super) fn height(&self, p: &Vec3) -> (f64, Vec3) {
        let ((height, gradient), mask) = match self {
            Self::Ridges(ridges) => (ridges.height(p), &ridges.mask),
            Self::Bumps(bumps) => (bumps.height(p), &bumps.mask),
        };
        let Some(mask) = mask else { return (height, gradient) };
        let (weight, slope) = mask.weight(p);
        (height * weight, gradient * weight + mask.axis.unit() * (slope * height))
    }

    /// Upper bound of the height, m, ≥ 0.
    pub(super) fn max_height(&self) -> f64 {
        match self {
            Self::Ridges(ridges) => ridges.height.max(0.0),
            Self::Bumps(bumps) => bumps.height.max(0.0),
        }
    }
}

impl Ramp {
    fn weight(&self, p: &Vec3) -> (f64, f64) {
        let span = self.to - self.from;
        let t = ((p[self.axis.index()] - self.from) / span).clamp(0.0, 1.0);
        (t * t * (3.0 - 2.0 * t), 6.0 * t * (1.0 - t) / span)
    }
}

impl Ridges {
    fn height(&self, p: &Vec3) -> (f64, Vec3) {
        let k = self.axis.index();
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        let (x, y) = (p[i], p[j]);
        let square = (x * x + y * y).max(1e-18);
        let r = square.sqrt();
        let turn = std::f64::consts::TAU;
        let count = f64::from(self.count);
        let phase = self.phase + count * y.atan2(x) + turn * (p[k] / self.pitch + r / self.radial_pitch);
        let slope = turn / (self.radial_pitch * r);
        let mut d_phase = Vec3::zeros();
        d_phase[i] = -count * y / square + slope * x;
        d_phase[j] = count * x / square + slope * y;
        d_phase[k] = turn / self.pitch;
        let (sin, cos) = phase.sin_cos();
        let wave = 0.5 + 0.5 * cos;
        let crest = wave.powf(self.sharpness);
        let d_crest = if wave > 1e-12 { self.sharpness * crest / wave * (-0.5 * sin) } else { 0.0 };
        let (value, gradient) = (self.height * crest, d_phase * (self.height * d_crest));
        if self.count == 0 && self.radial_pitch.is_infinite() {
            return (value, gradient);
        }
        let inner = (FADE_RADIUS * count.abs().max(1.0)).powi(2);
        let fade = square / (square + inner);
        let d_fade = 2.0 * inner / (square + inner).powi(2);
        let mut gradient = gradient * fade;
        gradient[i] += value * d_fade * x;
        gradient[j] += value * d_fade * y;
        (value * fade, gradient)
    }
}

impl Bumps {
    fn height(&self, p: &Vec3) -> (f64, Vec3) {
        // A bump extends at most half a cell beyond its own, so two cells per axis can contribute.
        let base = (p / self.spacing).map(|x| (x - 0.5).floor());
        let mut best = (0.0, Vec3::zeros());
        for cell in 0..8 {
            let corner = base + hex8::corner(cell);
            let arm = p - (corner + self.jitter(&corner)) * self.spacing;
            let t = arm.norm_squared() / (self.radius * self.radius);
            if t < 1.0 && (1.0 - t).powi(2) > best.0 {
                best = ((1.0 - t).powi(2), arm * (-4.0 * (1.0 - t) / (self.radius * self.radius)));
            }
        }
        (self.height * best.0, best.1 * self.height)
    }

    /// Position of a bump in its lattice cell, [0, 1)³, from the bits of a SplitMix64 hash (Steele et al.
    /// 2014) of the cell.
    fn jitter(&self, corner: &Vec3) -> Vec3 {
        let mut state = self.seed;
        for axis in 0..3 {
            state = mix(state ^ (corner[axis] as i64 as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15));
        }
        Vec3::from_fn(|axis, _| (state >> (21 * axis) & 0x1f_ffff) as f64 / f64::from(1u32 << 21))
    }
}

/// The output function of SplitMix64.
fn mix(state: u64) -> u64 {
    let z = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}
