//! Images of contacts.

use super::{
    super::{
        PadWrench,
        elastic::{
            Gel,
            tests::{TestSkin, graph, pressed},
        },
    },
    PolynomialOptics,
};
use softvt_robot::PadSurface;
use softvt_robot::tactile::TactileSpec;

fn gel() -> Gel {
    Gel::new(&TactileSpec::default(), PadSurface::default()).expect("default numbers")
}

fn dome(radius: f64) -> TestSkin {
    graph(12e-3, 2e-4, |x, y| (x * x + y * y) / (2.0 * radius))
}

#[test]
fn without_a_contact_the_image_is_the_untouched_one() {
    let (gel, optics) = (gel(), PolynomialOptics::gelsight_mini().expect("shipped"));
    assert_eq!(optics.render(&gel, None, false), optics.untouched);
}

#[test]
fn shadows_darken_the_ground_next_to_a_press_and_not_the_untouched_image() {
    let (gel, optics) = (gel(), PolynomialOptics::gelsight_mini().expect("shipped"));
    assert_eq!(optics.render(&gel, None, true), optics.untouched);
    // A stamp 4 mm wide, pushed in with steep sides.
    let stamp = graph(2e-3, 1e-4, |_, _| 0.0);
    let field = pressed(&gel, &stamp, PadWrench::new(12.0, [0.0; 2], 0.0, [0.0; 2]));
    let (rgb, shaded) = (optics.render(&gel, Some(&field), false), optics.render(&gel, Some(&field), true));
    let darker = rgb.iter().zip(shaded.iter()).filter(|(lit, shaded)| **shaded + 3 < **lit).count();
    assert!(darker > 300, "{darker} values darker");
    // From the corner of the stamp, no shadow is longer than the depth of the dent over the elevation
    // of the lowest LED.
    let elevation = optics.leds.iter().map(|led| f64::from(led.elevation_tangent)).fold(1.0, f64::min);
    let reach = (2.0_f64.sqrt() * 2e-3 + field.depth() / elevation) / gel.view.pitch;
    for (p, (lit, shaded)) in rgb.iter().zip(shaded.iter()).enumerate() {
        let (x, y) = ((p / 3 % 320) as f64 - 160.0, (p / 960) as f64 - 120.0);
        assert!(*shaded <= lit + 1, "({x}, {y}): {lit} became {shaded}");
        assert!(x.hypot(y) < reach || shaded.abs_diff(*lit) <= 1, "({x}, {y}): {lit} became {shaded}");
    }
}

#[test]
fn a_contact_changes_the_image_around_it_and_nowhere_else() {
    let (gel, optics) = (gel(), PolynomialOptics::gelsight_mini().expect("shipped"));
    let field = pressed(&gel, &dome(4e-3), PadWrench::new(0.5, [0.0; 2], 0.0, [0.0; 2]));
    let image = optics.render(&gel, Some(&field), false);
    let changed = |x: u32, y: u32| image.get_pixel(x, y) != optics.untouched.get_pixel(x, y);
    assert!((0..240).any(|y| changed(175, y)) && (0..320).any(|x| changed(x, 105)));
    for (x, y) in [(2, 2), (317, 2), (2, 237), (317, 237), (10, 120), (310, 120)] {
        assert!(!changed(x, y), "({x}, {y})");
    }
}

/// Directions (degrees) of the slopes at which red, green and blue gain most in real presses. They are measured on
/// the images, independently of the fit.
const GAINS: [f64; 3] = [-97.0, 10.0, 84.0];

#[test]
fn each_colour_gains_on_the_side_of_its_led_at_every_pixel_and_slope() {
    let optics = PolynomialOptics::gelsight_mini().expect("shipped");
    let turns = (0..72).map(|i| std::f64::consts::TAU * f64::from(i) / 72.0);
    let places = (0..9).flat_map(|j| (0..11).map(move |i| [(i * 32).min(319), (j * 30).min(239)]));
    for (place, steep) in places.flat_map(|p| [0.02, 0.1, 0.3, 0.5, 0.7, 1.0].map(|s| (p, s))) {
        let around: Vec<(f64, [f64; 3])> = turns
            .clone()
            .map(|phi| (phi, optics.colour_change(steep * phi.cos(), steep * phi.sin(), place)))
            .collect();
        for (channel, degrees) in GAINS.into_iter().enumerate() {
            let at = |phi: f64| phi - degrees.to_radians();
            let sum = around.iter().fold([0.0; 2], |sum, (phi, gain)| {
                [sum[0] + gain[channel] * at(*phi).cos(), sum[1] + gain[channel] * at(*phi).sin()]
            });
            let off = sum[1].atan2(sum[0]).to_degrees();
            assert!(off.abs() < 15.0, "channel {channel} at {place:?}, slope {steep}: {off:.0}° off");
            // Not only on average: for every pair of opposite sides, the one towards the LED is brighter.
            for (k, (phi, gain)) in around.iter().enumerate().filter(|(_, (phi, _))| at(*phi).cos() > 0.5) {
                let opposite = around[(k + 36) % 72].1[channel];
                let side = phi.to_degrees();
                assert!(
                    gain[channel] > opposite,
                    "channel {channel} at {place:?}, slope {steep} to {side:.0}°"
                );
            }
        }
    }
}

#[test]
fn the_colour_of_a_small_slope_is_smooth_over_the_image() {
    let optics = PolynomialOptics::gelsight_mini().expect("shipped");
    for (a, b) in [(0.1, 0.0), (-0.1, 0.0), (0.0, 0.1), (0.0, -0.1), (-0.2, 0.2)] {
        let at = |x: usize, y: usize| optics.colour_change(a, b, [x, y]);
        for (x, y) in (1..239).flat_map(|y| (1..319).map(move |x| (x, y))) {
            let here = at(x, y);
            for (before, after) in [(at(x - 1, y), at(x + 1, y)), (at(x, y - 1), at(x, y + 1))] {
                for c in 0..3 {
                    let (step, kink) = (after[c] - here[c], after[c] - 2.0 * here[c] + before[c]);
                    assert!(step.abs() < 1.0, "({a}, {b}) at ({x}, {y}): a step of {step} of 255");
                    assert!(kink.abs() < 0.1, "({a}, {b}) at ({x}, {y}): a kink of {kink} of 255 per pixel");
                }
            }
        }
    }
}
