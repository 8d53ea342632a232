//! Cast shadows in the tactile image.
//!
//! Pressed gel rises towards the camera. For each pixel the horizon towards an LED is the greatest rise over distance
//! along the surface; where it is higher than the LED, the light is dimmed. The shading by the pixel's own slope is
//! in the fitted colours already, so only a horizon above that slope counts: a ball shades the ground next to it, not
//! its own far side.

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
    /// Greatest height towards the camera, px.
    highest: f32,
    /// Pixels per metre of height.
    scale: f32,
}

impl<'a> ShadowCaster<'a> {
    /// Shadows of a surface with pixels of edge `pitch`, m.
    pub(super) fn new(surface: &'a VisibleSurface, pitch: f32) -> Self {
        let scale = 1.0 / pitch;
        let highest = surface.u.iter().fold(0.0_f32, |most, u| most.max(-u)) * scale;
        Self { surface, highest, scale }
    }

    /// Dims `light`, the pixels of `row` from column `first` of the window on, by the shadows from `led`.
    pub(super) fn cast(&self, led: &Led, row: usize, first: usize, light: &mut [f32]) {
        let width = self.surface.size[0];
        for (i, light) in light.iter_mut().enumerate() {
            let here = -self.surface.u[row * width + first + i] * self.scale;
            if self.highest - here > MIN_RISE {
                *light *= 1.0 - (1.0 - FULL_SHADOW) * self.depth(led, [(first + i) as f32, row as f32], here);
            }
        }
    }

    /// Depth of the shadow on a pixel of height `here` (px): 0 in the light to 1 in full shadow.
    fn depth(&self, led: &Led, from: [f32; 2], here: f32) -> f32 {
        let reach = (self.highest - here) / led.elevation_tangent;
        // Slope of the pixel itself, over the first step.
        let own = (self.height(from, led, STEP).unwrap_or(here) - here) / STEP;
        let least = led.elevation_tangent.max(own);
        let mut horizon = least;
        let mut far = 2.0 * STEP;
        while far <= reach {
            let Some(height) = self.height(from, led, far) else { break };
            horizon = horizon.max((height - here) / far);
            far += STEP;
        }
        ((horizon - least) / PENUMBRA).min(1.0)
    }

    /// Height (px) at a distance (px) towards the LED; `None` outside the window.
    fn height(&self, from: [f32; 2], led: &Led, far: f32) -> Option<f32> {
        let [x, y] = [0, 1].map(|axis| from[axis] + far * led.direction[axis]);
        let [width, height] = self.surface.size;
        if x < 0.0 || y < 0.0 || x >= (width - 1) as f32 || y >= (height - 1) as f32 {
            return None;
        }
        let (i, j) = (x as usize, y as usize);
        let (tx, ty) = (x - i as f32, y - j as f32);
        let u = &self.surface.u[j * width + i..];
        let upper = u[0] + tx * (u[1] - u[0]);
        let lower = u[width] + tx * (u[width + 1] - u[width]);
        Some(-(upper + ty * (lower - upper)) * self.scale)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tactile::PolynomialOptics;

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

    #[test]
    fn the_leds_of_the_mini_are_low_and_at_three_sides() {
        let leds = PolynomialOptics::gelsight_mini().expect("shipped").leds;
        for (led, degrees) in leds.iter().zip([-97.0_f32, 10.0, 84.0]) {
            let found = led.direction[1].atan2(led.direction[0]).to_degrees();
            let elevation = led.elevation_tangent.atan().to_degrees();
            assert!((found - degrees).abs() < 5.0, "{found}° instead of {degrees}°");
            assert!((10.0..35.0).contains(&elevation), "{elevation}° high");
        }
    }
}
