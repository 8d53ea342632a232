//! Cast shadows in the tactile picture: what stands between a place of the gel and a lamp.
//!
//! Pressed gel stands out towards the camera. From each place one looks along the surface towards the lamp; where the
//! horizon (the greatest rise over distance) is higher than the lamp, its light is dimmed. What a place's own slope takes
//! away is in the fitted colours already, so only a horizon above that slope counts, and a ball shades not its own far
//! side but the ground behind it.

use super::surface::Window;

/// Light that is left in a full shadow: FOTS's factor (Zhao et al., arXiv 2404.19217, and its code).
const LEFT: f32 = 0.65;
/// Rise of the horizon from the shadow's edge to its full depth: the width of Taxim's fan of rays, ±0.1 rad.
const SOFT: f32 = 0.2;
/// Step towards the lamp, px (Taxim's).
const STEP: f32 = 1.25;
/// Rises below this over a window cast no shadow worth looking for, px.
const LOW: f32 = 0.5;

/// A lamp as the fit to real presses shows it.
///
/// By Lambert's law a small slope s towards a lamp of elevation e changes its light by the share s cot e, so the linear
/// part of the fit gives the lamp's direction and elevation. Light that is scattered on its way dilutes the share, so the
/// true lamps are lower rather than higher.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lamp {
    /// Unit vector along the surface towards the lamp, picture axes (x right, y down).
    pub towards: [f32; 2],
    /// Tangent of its elevation above the surface.
    pub rise: f32,
}

impl Lamp {
    /// The lamp of a fit whose light grows by the shares `x` and `y` a unit of slope along each axis.
    pub(super) fn of(x: f32, y: f32) -> Self {
        let share = x.hypot(y).max(1e-6);
        Self { towards: [x / share, y / share], rise: 1.0 / share }
    }
}

/// Shadows over a window.
pub(super) struct Shade<'a> {
    window: &'a Window,
    /// Height towards the camera of the highest place, px.
    highest: f32,
    /// Pixels a metre.
    scale: f32,
}

impl<'a> Shade<'a> {
    /// Of a window with pixels of edge `pitch`, m.
    pub(super) fn new(window: &'a Window, pitch: f32) -> Self {
        let scale = 1.0 / pitch;
        let highest = window.u.iter().fold(0.0_f32, |most, u| most.max(-u)) * scale;
        Self { window, highest, scale }
    }

    /// Dims `light`, pixels of `row` from column `first` of the window, by what stands before the lamp.
    pub(super) fn cast(&self, lamp: &Lamp, row: usize, first: usize, light: &mut [f32]) {
        let wide = self.window.size[0];
        for (i, light) in light.iter_mut().enumerate() {
            let here = -self.window.u[row * wide + first + i] * self.scale;
            if self.highest - here > LOW {
                *light *= 1.0 - (1.0 - LEFT) * self.depth(lamp, [(first + i) as f32, row as f32], here);
            }
        }
    }

    /// 0 in the light to 1 in full shadow, at a place of height `here` (px).
    fn depth(&self, lamp: &Lamp, from: [f32; 2], here: f32) -> f32 {
        let reach = (self.highest - here) / lamp.rise;
        // Its own slope, over the first step.
        let own = (self.height(from, lamp, STEP).unwrap_or(here) - here) / STEP;
        let least = lamp.rise.max(own);
        let mut horizon = least;
        let mut far = 2.0 * STEP;
        while far <= reach {
            let Some(height) = self.height(from, lamp, far) else { break };
            horizon = horizon.max((height - here) / far);
            far += STEP;
        }
        ((horizon - least) / SOFT).min(1.0)
    }

    /// Height (px) a distance (px) towards the lamp; `None` beyond the window.
    fn height(&self, from: [f32; 2], lamp: &Lamp, far: f32) -> Option<f32> {
        let [x, y] = [0, 1].map(|axis| from[axis] + far * lamp.towards[axis]);
        let [wide, high] = self.window.size;
        if x < 0.0 || y < 0.0 || x >= (wide - 1) as f32 || y >= (high - 1) as f32 {
            return None;
        }
        let (i, j) = (x as usize, y as usize);
        let (tx, ty) = (x - i as f32, y - j as f32);
        let u = &self.window.u[j * wide + i..];
        let upper = u[0] + tx * (u[1] - u[0]);
        let lower = u[wide] + tx * (u[wide + 1] - u[wide]);
        Some(-(upper + ty * (lower - upper)) * self.scale)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sensing::tactile::Optics;

    const PITCH: f32 = 6.34e-5;

    /// A window of 160 × 120 px of heights (px) towards the camera.
    fn window(height: impl Fn(f32, f32) -> f32) -> Window {
        let size = [160, 120];
        let place = |p: usize| ((p % size[0]) as f32, (p / size[0]) as f32);
        let u = (0..size[0] * size[1]).map(|p| -PITCH * height(place(p).0, place(p).1)).collect();
        Window { from: [0, 0], size, u }
    }

    fn row(window: &Window, lamp: &Lamp, row: usize) -> Vec<f32> {
        let mut light = vec![1.0; window.size[0]];
        Shade::new(window, PITCH).cast(lamp, row, 0, &mut light);
        light
    }

    #[test]
    fn a_wall_shades_as_far_behind_it_as_its_height_over_the_lamps_rise() {
        // A wall 10 px high at x = 100…110, the lamp to the right at a rise of 1 in 4: its shadow is 40 px long.
        let wall = window(|x, _| if (100.0..=110.0).contains(&x) { 10.0 } else { 0.0 });
        let lamp = Lamp { towards: [1.0, 0.0], rise: 0.25 };
        let light = row(&wall, &lamp, 60);
        assert!((0..58).chain(100..160).all(|x| light[x] == 1.0), "{light:?}");
        assert!((62..99).all(|x| light[x] < 1.0), "{light:?}");
        // A horizon of 10/20 is in full shadow (0.25 + 0.2), one of 10/30 in part of it.
        let part = 1.0 - (1.0 - LEFT) * (1.0 / 3.0 - 0.25) / SOFT;
        assert!((light[80] - LEFT).abs() < 1e-6 && (light[70] - part).abs() < 1e-3, "{light:?}");
        assert!((60..98).all(|x| light[x + 1] <= light[x] + 1e-6), "{light:?}");
    }

    #[test]
    fn a_ball_shades_the_ground_behind_it_and_not_its_own_flank() {
        let ball = window(|x, y| (20.0 - ((x - 80.0).powi(2) + (y - 60.0).powi(2)) / 40.0).max(0.0));
        let lamp = Lamp { towards: [1.0, 0.0], rise: 0.3 };
        let light = row(&ball, &lamp, 60);
        assert!((56..160).all(|x| light[x] == 1.0), "{light:?}");
        assert!(light[48] < 0.9 && light[45] < 0.9, "{light:?}");
    }

    #[test]
    fn a_flat_gel_has_no_shadow() {
        let lamp = Lamp { towards: [0.6, 0.8], rise: 1e-3 };
        assert!(row(&window(|_, _| 0.0), &lamp, 60).iter().all(|&light| light == 1.0));
    }

    #[test]
    fn the_minis_lamps_are_low_and_at_three_sides() {
        let lamps = *Optics::mini().expect("shipped").lamps();
        for (lamp, degrees) in lamps.iter().zip([-97.0_f32, 10.0, 84.0]) {
            let found = lamp.towards[1].atan2(lamp.towards[0]).to_degrees();
            let elevation = lamp.rise.atan().to_degrees();
            assert!((found - degrees).abs() < 5.0, "{found}° instead of {degrees}°");
            assert!((10.0..35.0).contains(&elevation), "{elevation}° high");
        }
    }
}
