//! Surface of the gel at the resolution of the image.
//!
//! The free surface of the gel is interpolated from the grid by a cubic. In contact with a rigid skin, the surface
//! lies on the skin, whose height map is finer than the grid, so that the two never overlap. Details of a soft skin
//! below the size of a cell are left out: the gel presses them flat.

use std::ops::Range;

use super::super::elastic::{Gel, GelField, cubic_taps};
use softvt_robot::tactile::IMAGE_SIZE;

/// Displacement of the surface along z at each pixel of a window of the image, m; zero outside the window.
#[derive(Clone, Debug, Default)]
pub(super) struct VisibleSurface {
    /// First column and row of the window, px.
    pub(super) from: [usize; 2],
    /// Columns and rows of the window, px.
    pub(super) size: [usize; 2],
    /// Displacement along z, m, row by row.
    pub(super) u: Vec<f32>,
}

/// Slope above which a cell belongs to the window; smaller ones change no colour by half a grey level.
pub(super) const MIN_SLOPE: f32 = 1e-3;

/// Taps of the cubic interpolation of the grid at one pixel along one axis.
struct PixelTaps {
    first: isize,
    weights: [f32; 4],
}

/// Linear interpolation of the height map at one pixel along one axis.
#[derive(Clone, Copy)]
struct LinearTap {
    /// Index of the first of two neighbours.
    index: usize,
    /// Weight of the second one.
    share: f32,
    /// Position of the pixel, m.
    metres: f64,
}

impl VisibleSurface {
    /// Surface of a field; the window covers all that changes and a little more.
    pub(super) fn new(gel: &Gel, field: &GelField) -> Self {
        let Some(mut surface) = Self::flat_window(gel, &field.displacement[2]) else {
            return Self::default();
        };
        let count = [gel.columns, gel.rows];
        let [x, y] = [0, 1].map(|axis| -> Vec<PixelTaps> {
            let at = |p| gel.view.pixel_centre(axis, p) / gel.cell + 0.5 * (count[axis] - 1) as f64;
            let taps = surface.pixels(axis).map(|p| cubic_taps(at(p)));
            taps.map(|t| PixelTaps { first: t.first, weights: t.weights.map(|w| w as f32) }).collect()
        });
        surface.u = resample(&field.displacement[2], count, &x, &y);
        if field.has_rigid_skin {
            surface.lower_to_skin(gel, field);
        }
        surface.soften();
        surface
    }

    /// Pixels of the window along an axis.
    fn pixels(&self, axis: usize) -> Range<usize> {
        self.from[axis]..self.from[axis] + self.size[axis]
    }

    /// Window around the cells of the grid that are steeper than [`MIN_SLOPE`], without its displacements.
    fn flat_window(gel: &Gel, u: &[f32]) -> Option<Self> {
        let (n, least) = (gel.columns, MIN_SLOPE * gel.cell as f32);
        let (mut low, mut high) = ([usize::MAX; 2], [0; 2]);
        for j in 1..gel.rows {
            for i in 1..n {
                let c = j * n + i;
                if (u[c] - u[c - 1]).abs() > least || (u[c] - u[c - n]).abs() > least {
                    low = [low[0].min(i - 1), low[1].min(j - 1)];
                    high = [high[0].max(i), high[1].max(j)];
                }
            }
        }
        if low[0] > high[0] {
            return None;
        }
        let mut window = Self::default();
        for (axis, edge) in IMAGE_SIZE.map(|edge| edge as f64).into_iter().enumerate() {
            let px = |[i, j]: [usize; 2]| gel.centre(j * n + i)[axis] / gel.view.pitch + 0.5 * edge;
            window.from[axis] = (px(low) - 2.0).clamp(0.0, edge) as usize;
            window.size[axis] = (px(high) + 2.0).clamp(0.0, edge) as usize - window.from[axis];
        }
        (window.size[0] > 2 && window.size[1] > 2).then_some(window)
    }

    /// Lowers the surface to the skin where they touch.
    fn lower_to_skin(&mut self, gel: &Gel, field: &GelField) {
        let map = &field.height_map;
        let half = [map.columns, map.rows].map(|n| 0.5 * (n - 1) as f64);
        let interpolation = |axis: usize| -> Vec<LinearTap> {
            let last = [map.columns, map.rows][axis] - 2;
            let tap = |p| {
                let metres = gel.view.pixel_centre(axis, p);
                let at = (metres / map.cell + half[axis]).clamp(0.0, last as f64);
                LinearTap { index: at as usize, share: at.fract() as f32, metres }
            };
            self.pixels(axis).map(tap).collect()
        };
        let (xs, ys) = (interpolation(0), interpolation(1));
        let (curve_x, curve_y) = (0.5 / gel.pad.radius_x, 0.5 / gel.pad.radius_y);
        let bend: Vec<f32> = xs.iter().map(|x| (curve_x * x.metres * x.metres) as f32).collect();
        let mut mixed = vec![0.0; map.columns];
        for (row, &LinearTap { index: j, share: ty, metres: y }) in ys.iter().enumerate() {
            let dome = (curve_y * y * y) as f32;
            let line = row * self.size[0]..(row + 1) * self.size[0];
            let upper = &map.height[j * map.columns..];
            let lower = &map.height[(j + 1) * map.columns..];
            for (mix, (a, b)) in mixed.iter_mut().zip(upper.iter().zip(lower)) {
                *mix = (1.0 - ty) * a + ty * b + dome;
            }
            for ((u, &LinearTap { index: i, share: tx, .. }), bend) in
                self.u[line].iter_mut().zip(&xs).zip(&bend)
            {
                let skin = (1.0 - tx) * mixed[i] + tx * mixed[i + 1] + bend;
                // NaN at the edge of the skin, where 0 · ∞ is added: `min` ignores it.
                *u = u.min(skin);
            }
        }
    }

    /// Blurs like the coating and lens of the sensor: twice a binomial filter of five pixels along each axis
    /// (σ = 1.4 px).
    fn soften(&mut self) {
        let n = self.size[0];
        if n < 5 {
            return;
        }
        let mut line = vec![0.0; n];
        for row in self.u.chunks_exact_mut(n) {
            for _ in 0..2 {
                line.copy_from_slice(row);
                blur([0, 1, 2, 3, 4].map(|k| &line[k..n - 4 + k]), &mut row[2..n - 2]);
            }
        }
        let inner = 2..self.size[1].saturating_sub(2);
        let blur_rows = |from: &[f32], to: &mut [f32]| {
            for j in inner.clone() {
                let rows = [0, 1, 2, 3, 4].map(|k| &from[(j + k - 2) * n..(j + k - 1) * n]);
                blur(rows, &mut to[j * n..(j + 1) * n]);
            }
        };
        let mut once = self.u.clone();
        blur_rows(&self.u, &mut once);
        blur_rows(&once, &mut self.u);
    }

    /// Writes the slopes along x and y of a row of pixels, by central differences; 0 at the border of the window,
    /// where the surface is flat. `pitch` is the edge of a pixel, m.
    pub(super) fn slopes(&self, row: usize, pitch: f32, slope_x: &mut [f32], slope_y: &mut [f32]) {
        let n = self.size[0];
        slope_x.fill(0.0);
        slope_y.fill(0.0);
        if row == 0 || row + 1 >= self.size[1] || n < 3 {
            return;
        }
        let half = 0.5 / pitch;
        let here = &self.u[row * n..(row + 1) * n];
        let above = &self.u[(row - 1) * n..row * n];
        let below = &self.u[(row + 1) * n..(row + 2) * n];
        for (slope, (left, right)) in slope_x[1..n - 1].iter_mut().zip(here.iter().zip(&here[2..])) {
            *slope = half * (right - left);
        }
        let columns = slope_y.iter_mut().zip(above.iter().zip(below));
        columns.take(n - 1).skip(1).for_each(|(slope, (up, down))| *slope = half * (down - up));
    }
}

/// Binomial mean of five rows.
fn blur([a, b, c, d, e]: [&[f32]; 5], out: &mut [f32]) {
    let inner = b.iter().zip(c).zip(d);
    for (((out, a), ((b, c), d)), e) in out.iter_mut().zip(a).zip(inner).zip(e) {
        *out = 0.0625 * (a + e + 4.0 * (b + d) + 6.0 * c);
    }
}

/// Interpolates a field of the grid at pixels, first along x, then along y; the field is 0 outside the grid.
fn resample(field: &[f32], count: [usize; 2], x: &[PixelTaps], y: &[PixelTaps]) -> Vec<f32> {
    let (wide, n) = (x.len(), count[0]);
    let mut lines = vec![0.0_f32; wide * count[1]];
    // A row between zeros, so that no tap is outside.
    const MARGIN: usize = 4;
    let mut padded = vec![0.0; n + 2 * MARGIN];
    let starts: Vec<usize> = x
        .iter()
        .map(|taps| (taps.first + MARGIN as isize).clamp(0, (n + MARGIN) as isize) as usize)
        .collect();
    for (line, row) in lines.chunks_exact_mut(wide).zip(field.chunks_exact(n)) {
        padded[MARGIN..MARGIN + n].copy_from_slice(row);
        for ((out, PixelTaps { weights: [wa, wb, wc, wd], .. }), start) in line.iter_mut().zip(x).zip(&starts)
        {
            let Some([a, b, c, d]) = padded[*start..].first_chunk() else { continue };
            *out = wa * a + wb * b + wc * c + wd * d;
        }
    }
    let outside = vec![0.0; wide];
    let line = |j: isize| {
        let is_inside = (0..count[1] as isize).contains(&j);
        if is_inside { &lines[j as usize * wide..(j as usize + 1) * wide] } else { &outside }
    };
    let mut out = Vec::with_capacity(wide * y.len());
    for PixelTaps { first, weights: [wa, wb, wc, wd] } in y {
        let [a, b, c, d] = [0, 1, 2, 3].map(|k| line(first + k));
        let taps = a.iter().zip(b).zip(c.iter().zip(d));
        out.extend(taps.map(|((a, b), (c, d))| wa * a + wb * b + wc * c + wd * d));
    }
    out
}
