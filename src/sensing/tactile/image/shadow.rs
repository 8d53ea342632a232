//! Cast shadows in the tactile image.
//!
//! Pressed gel rises towards the camera. For each pixel the horizon towards an LED is the greatest rise over distance
//! along the surface; where it is higher than the LED, the light is dimmed. The shading by the pixel's own slope is
//! in the fitted colours already, so only a horizon above that slope counts: a ball shades the ground next to it, not
//! its own far side.

use std::ops::Range;

use super::visible_surface::VisibleSurface;

/// Share of the light in a full shadow: FOTS's factor (Zhao et al., arXiv 2404.19217, and its code).
const FULL_SHADOW: f32 = 0.65;
/// Rise of the horizon from the edge of a shadow to its full depth: the width of Taxim's fan of rays, ±0.1 rad.
const PENUMBRA: f32 = 0.2;
/// Step along the ray towards the LED, px (as in Taxim).
const STEP: f32 = 1.25;
/// Height difference to the highest pixel below which a pixel is not tested, px.
const MIN_RISE: f32 = 0.5;

/// Direction of the LED of one channel, derived from the fit to real presses.
///
/// By Lambert's law a small slope s towards a light source of elevation e changes its light by the share s cot e, so
/// the linear part of the fit gives direction and elevation. Scattered light dilutes the share, so that the derived
/// elevation is rather too high than too low.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Led {
    /// Unit vector along the surface towards the LED, image axes (x right, y down).
    pub direction: [f32; 2],
    /// Tangent of the elevation above the surface.
    pub elevation_tangent: f32,
}

impl Led {
    /// LED of a fit in which the light grows by the shares `x` and `y` per unit of slope along each axis.
    pub(super) fn from_linear_fit(x: f32, y: f32) -> Self {
        let share = x.hypot(y).max(1e-6);
        Self { direction: [x / share, y / share], elevation_tangent: 1.0 / share }
    }
}

/// Casts shadows over the window of a surface.
pub(super) struct ShadowCaster<'a> {
    surface: &'a VisibleSurface,
    /// Greatest height towards the camera in each row, px.
    row_heights: Vec<f32>,
    /// Greatest height of all, px.
    highest: f32,
    /// Pixels per metre of height.
    scale: f32,
}

impl<'a> ShadowCaster<'a> {
    /// Shadows of a surface with pixels of edge `pitch`, m.
    pub(super) fn new(surface: &'a VisibleSurface, pitch: f32) -> Self {
        let scale = 1.0 / pitch;
        let highest = |u: &[f32]| u.iter().fold(0.0_f32, |most, u| most.max(-u)) * scale;
        let rows = surface.u.chunks(surface.size[0].max(1));
        Self { surface, row_heights: rows.map(highest).collect(), highest: highest(&surface.u), scale }
    }

    /// Dims `light`, the pixels of `row` from column `first` of the window on, by the shadows from `led`.
    ///
    /// All rays of the row advance together: their points lie at the same place between the pixels.
    pub(super) fn cast(&self, led: &Led, row: usize, first: usize, light: &mut [f32]) {
        let from = row * self.surface.size[0] + first;
        let here: Vec<f32> =
            self.surface.u[from..from + light.len()].iter().map(|u| -u * self.scale).collect();
        let lowest = here.iter().copied().fold(f32::MAX, f32::min);
        if light.is_empty() || self.highest - lowest <= MIN_RISE {
            return;
        }
        let least = self.own_slopes(led, [first, row], &here);
        let mut horizon = least.clone();
        let mut heights = vec![0.0; here.len()];
        let mut far = 2.0 * STEP;
        while far * led.elevation_tangent <= self.highest - lowest {
            let Some(line) = self.line(led, [first, row], far, here.len()) else { break };
            if line.highest(&self.row_heights) - lowest > far * led.elevation_tangent {
                let range = line.range.clone();
                self.sample(&line, &mut heights[range.clone()]);
                let pixels = horizon[range.clone()].iter_mut().zip(&heights[range.clone()]).zip(&here[range]);
                pixels.for_each(|((most, height), here)| *most = most.max((height - here) / far));
            }
            far += STEP;
        }
        for (light, ((horizon, least), here)) in light.iter_mut().zip(horizon.iter().zip(&least).zip(&here)) {
            if self.highest - here > MIN_RISE {
                *light *= 1.0 - (1.0 - FULL_SHADOW) * ((horizon - least) / PENUMBRA).min(1.0);
            }
        }
    }

    /// Slope above which the horizon of each pixel counts: the light's, or the slope of the pixel itself
    /// over the first step.
    fn own_slopes(&self, led: &Led, from: [usize; 2], here: &[f32]) -> Vec<f32> {
        let mut least = vec![led.elevation_tangent; here.len()];
        if let Some(line) = self.line(led, from, STEP, here.len()) {
            let range = line.range.clone();
            let mut heights = vec![0.0; range.len()];
            self.sample(&line, &mut heights);
            let pixels = least[range.clone()].iter_mut().zip(&heights).zip(&here[range]);
            pixels.for_each(|((least, height), here)| *least = least.max((height - here) / STEP));
        }
        least
    }

    /// The points at a distance (px) towards the LED from `count` pixels of a row; `None` if none lies in the window.
    fn line(&self, led: &Led, [first, row]: [usize; 2], far: f32, count: usize) -> Option<SampleLine> {
        let [width, height] = self.surface.size.map(|n| n as isize);
        let offset = led.direction.map(|along| far * along);
        let whole = offset.map(f32::floor);
        let [column, row] = [first as isize + whole[0] as isize, row as isize + whole[1] as isize];
        let (start, end) = ((-column).max(0), (width - 1 - column).min(count as isize));
        (start < end && (0..height - 1).contains(&row)).then(|| SampleLine {
            range: start as usize..end as usize,
            row: row as usize,
            column: (column + start) as usize,
            share: [offset[0] - whole[0], offset[1] - whole[1]],
        })
    }

    /// Heights (px) at the points of a line.
    fn sample(&self, line: &SampleLine, heights: &mut [f32]) {
        let ([tx, ty], width, count) = (line.share, self.surface.size[0], heights.len());
        let from = line.row * width + line.column;
        let part = |offset: usize| self.surface.u[from + offset..from + offset + count].iter();
        let corners = part(0).zip(part(1)).zip(part(width)).zip(part(width + 1));
        for (height, (((a, b), c), d)) in heights.iter_mut().zip(corners) {
            let (upper, lower) = (a + tx * (b - a), c + tx * (d - c));
            *height = -(upper + ty * (lower - upper)) * self.scale;
        }
    }
}

/// Points between the pixels of two rows, one for each pixel in a range.
struct SampleLine {
    /// Pixels whose points lie in the window.
    range: Range<usize>,
    /// The upper of the two rows of pixels.
    row: usize,
    /// Column to the left of the first point.
    column: usize,
    /// Distance of the points from that column and row, px.
    share: [f32; 2],
}

impl SampleLine {
    /// Greatest height in both rows, px.
    fn highest(&self, row_heights: &[f32]) -> f32 {
        row_heights[self.row].max(row_heights[self.row + 1])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PITCH: f32 = 6.34e-5;

    /// Surface of 160 × 120 px with given heights (px) towards the camera.
    fn surface(height: impl Fn(f32, f32) -> f32) -> VisibleSurface {
        let size = [160, 120];
        let place = |p: usize| ((p % size[0]) as f32, (p / size[0]) as f32);
        let u = (0..size[0] * size[1]).map(|p| -PITCH * height(place(p).0, place(p).1)).collect();
        VisibleSurface { from: [0, 0], size, u }
    }

    fn row(surface: &VisibleSurface, led: &Led, row: usize) -> Vec<f32> {
        let mut light = vec![1.0; surface.size[0]];
        ShadowCaster::new(surface, PITCH).cast(led, row, 0, &mut light);
        light
    }

    #[test]
    fn the_shadow_of_a_wall_is_its_height_over_the_elevation_of_the_led() {
        // A wall 10 px high at x = 100…110, the LED to the right at an elevation of 1 in 4: its shadow is 40 px long.
        let wall = surface(|x, _| if (100.0..=110.0).contains(&x) { 10.0 } else { 0.0 });
        let led = Led { direction: [1.0, 0.0], elevation_tangent: 0.25 };
        let light = row(&wall, &led, 60);
        assert!((0..58).chain(100..160).all(|x| light[x] == 1.0), "{light:?}");
        assert!((62..99).all(|x| light[x] < 1.0), "{light:?}");
        // A horizon of 10/20 is in full shadow (0.25 + 0.2), one of 10/30 in part of it.
        let part = 1.0 - (1.0 - FULL_SHADOW) * (1.0 / 3.0 - 0.25) / PENUMBRA;
        assert!((light[80] - FULL_SHADOW).abs() < 1e-6 && (light[70] - part).abs() < 1e-3, "{light:?}");
        assert!((60..98).all(|x| light[x + 1] <= light[x] + 1e-6), "{light:?}");
    }

    #[test]
    fn a_ball_shades_the_ground_and_not_its_own_flank() {
        let ball = surface(|x, y| (20.0 - ((x - 80.0).powi(2) + (y - 60.0).powi(2)) / 40.0).max(0.0));
        let led = Led { direction: [1.0, 0.0], elevation_tangent: 0.3 };
        let light = row(&ball, &led, 60);
        assert!((56..160).all(|x| light[x] == 1.0), "{light:?}");
        assert!(light[48] < 0.9 && light[45] < 0.9, "{light:?}");
    }

    #[test]
    fn a_flat_gel_has_no_shadow() {
        let led = Led { direction: [0.6, 0.8], elevation_tangent: 1e-3 };
        assert!(row(&surface(|_, _| 0.0), &led, 60).iter().all(|&light| light == 1.0));
    }
}
