//! The touched surface at the picture's resolution.
//!
//! Where the gel is free its surface is the grid's, by a cubic; where it touches something firm it lies on the skin, which is
//! known finer than the grid: nowhere is it inside. Soft skins give way to the gel in all that is finer than the grid.

use super::{
    field::{GelField, taps},
    gel::Gel,
    spec::PICTURE,
};

/// Displacement along z of the surface seen in each pixel (m), within a window; zero outside.
#[derive(Clone, Debug, Default)]
pub(super) struct Window {
    /// First column and row, px.
    pub from: [usize; 2],
    /// Columns and rows, px.
    pub size: [usize; 2],
    /// Displacement along z, m, row by row.
    pub u: Vec<f32>,
}

/// Steeper than this a cell belongs to the window: a slope that changes no colour by half a grey level.
pub(super) const FLAT: f32 = 1e-3;

/// How pixel centres along one axis read a grid: first of the taps and their weights.
struct Reading {
    first: Vec<isize>,
    weights: Vec<[f32; 4]>,
}

impl Window {
    /// The window of a field, one pixel wider than what changes.
    pub(super) fn of(gel: &Gel, field: &GelField) -> Self {
        let Some((from, size)) = extent(gel, &field.displacement[2]) else { return Self::default() };
        let centre = |axis: usize, p: usize| (p as f64 + 0.5 - 0.5 * PICTURE[axis] as f64) * gel.view.pitch;
        let count = [gel.columns, gel.rows];
        let reading = |axis: usize| {
            let at = |p| centre(axis, p) / gel.cell + 0.5 * (count[axis] - 1) as f64;
            let (first, weights) = (from[axis]..from[axis] + size[axis])
                .map(|p| {
                    let (first, weights) = taps(at(p));
                    (first, weights.map(|w| w as f32))
                })
                .unzip();
            Reading { first, weights }
        };
        let (x, y) = (reading(0), reading(1));
        let free = resample(&field.displacement[2], count, &x, &y);
        let mut window = Self { from, size, u: free };
        if field.firm {
            window.touch(gel, field, centre);
        }
        window.soften();
        window
    }

    /// Lays the surface on the skin where they touch.
    fn touch(&mut self, gel: &Gel, field: &GelField, centre: impl Fn(usize, usize) -> f64) {
        let relief = &field.relief;
        let half = [relief.columns, relief.rows].map(|n| 0.5 * (n - 1) as f64);
        let places = |axis: usize| -> Vec<(usize, f32, f64)> {
            let last = [relief.columns, relief.rows][axis] - 2;
            (self.from[axis]..self.from[axis] + self.size[axis])
                .map(|p| {
                    let metres = centre(axis, p);
                    let at = (metres / relief.cell + half[axis]).clamp(0.0, last as f64);
                    (at as usize, at.fract() as f32, metres)
                })
                .collect()
        };
        let (xs, ys) = (places(0), places(1));
        let (curve_x, curve_y) = (0.5 / gel.pad.radius_x, 0.5 / gel.pad.radius_y);
        let bend: Vec<f32> = xs.iter().map(|&(_, _, x)| (curve_x * x * x) as f32).collect();
        let mut mixed = vec![0.0; relief.columns];
        for (row, &(j, ty, y)) in ys.iter().enumerate() {
            let dome = (curve_y * y * y) as f32;
            let line = row * self.size[0]..(row + 1) * self.size[0];
            let upper = &relief.height[j * relief.columns..];
            let lower = &relief.height[(j + 1) * relief.columns..];
            for (mix, (a, b)) in mixed.iter_mut().zip(upper.iter().zip(lower)) {
                *mix = (1.0 - ty) * a + ty * b + dome;
            }
            for ((u, &(i, tx, _)), bend) in self.u[line].iter_mut().zip(&xs).zip(&bend) {
                let skin = (1.0 - tx) * mixed[i] + tx * mixed[i + 1] + bend;
                // Not a number at the skin's rim, where a product of zero and infinity is added: `min` leaves it out.
                *u = u.min(skin);
            }
        }
    }

    /// Blurs like the sensor's coating and lens: twice a binomial of five pixels along each axis (σ = 1.4 px).
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
        let mut from = self.u.clone();
        for _ in 0..2 {
            for j in 2..self.size[1].saturating_sub(2) {
                let rows = [0, 1, 2, 3, 4].map(|k| &from[(j + k - 2) * n..(j + k - 1) * n]);
                blur(rows, &mut self.u[j * n..(j + 1) * n]);
            }
            from.copy_from_slice(&self.u);
        }
    }

    /// The pixel's slope along x and y from its four neighbours; 0 at the window's rim, where the surface is flat.
    pub(super) fn slopes(&self, row: usize, pitch: f32, along: &mut [f32], across: &mut [f32]) {
        let n = self.size[0];
        along.fill(0.0);
        across.fill(0.0);
        if row == 0 || row + 1 >= self.size[1] || n < 3 {
            return;
        }
        let half = 0.5 / pitch;
        let here = &self.u[row * n..(row + 1) * n];
        let above = &self.u[(row - 1) * n..row * n];
        let below = &self.u[(row + 1) * n..(row + 2) * n];
        for (slope, (left, right)) in along[1..n - 1].iter_mut().zip(here.iter().zip(&here[2..])) {
            *slope = half * (right - left);
        }
        let columns = across.iter_mut().zip(above.iter().zip(below));
        columns.take(n - 1).skip(1).for_each(|(slope, (up, down))| *slope = half * (down - up));
    }
}

/// Binomial mean of five lines.
fn blur([a, b, c, d, e]: [&[f32]; 5], out: &mut [f32]) {
    let inner = b.iter().zip(c).zip(d);
    for (((out, a), ((b, c), d)), e) in out.iter_mut().zip(a).zip(inner).zip(e) {
        *out = 0.0625 * (a + e + 4.0 * (b + d) + 6.0 * c);
    }
}

/// First pixels and numbers of pixels of the window around steep cells.
fn extent(gel: &Gel, u: &[f32]) -> Option<([usize; 2], [usize; 2])> {
    let (n, least) = (gel.columns, FLAT * gel.cell as f32);
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
    let place = [Gel::x, Gel::y];
    let mut window = ([0; 2], [0; 2]);
    for axis in 0..2 {
        let px = |at: f64| at / gel.view.pitch + 0.5 * PICTURE[axis] as f64;
        let from = (px(place[axis](gel, low[axis].min(high[axis]))) - 2.0).clamp(0.0, PICTURE[axis] as f64);
        let to = (px(place[axis](gel, high[axis])) + 2.0).clamp(0.0, PICTURE[axis] as f64);
        window.0[axis] = from as usize;
        window.1[axis] = to as usize - from as usize;
    }
    (low[0] <= high[0] && window.1[0] > 2 && window.1[1] > 2).then_some(window)
}

/// A field of the grid read at pixels, first along x, then along y; 0 outside.
fn resample(field: &[f32], count: [usize; 2], x: &Reading, y: &Reading) -> Vec<f32> {
    let (wide, n) = (x.first.len(), count[0]);
    let mut lines = vec![0.0_f32; wide * count[1]];
    for (line, row) in lines.chunks_exact_mut(wide).zip(field.chunks_exact(n)) {
        for ((out, &first), weights) in line.iter_mut().zip(&x.first).zip(&x.weights) {
            for (k, w) in weights.iter().enumerate() {
                let i = first + k as isize;
                if (0..n as isize).contains(&i) {
                    *out += w * row[i as usize];
                }
            }
        }
    }
    let mut out = vec![0.0; wide * y.first.len()];
    for ((row, &first), weights) in out.chunks_exact_mut(wide).zip(&y.first).zip(&y.weights) {
        for (k, &w) in weights.iter().enumerate() {
            let j = first + k as isize;
            if (0..count[1] as isize).contains(&j) {
                let line = &lines[j as usize * wide..(j as usize + 1) * wide];
                row.iter_mut().zip(line).for_each(|(out, value)| *out += w * value);
            }
        }
    }
    out
}
