//! Pictures and markers of touches.

use super::{
    FotsSpec, Gel, MarkerModel, MarkerStyle, Optics, PadLoad, TactileSpec, draw_markers,
    field_tests::{graph, touch},
    markers, untouched,
};
use crate::robot::PadSurface;

fn gel() -> Gel {
    Gel::new(&TactileSpec::default(), PadSurface::default()).expect("default numbers")
}

fn dome(radius: f64) -> (Vec<crate::geometry::Vec3>, Vec<[u32; 3]>) {
    graph(12e-3, 2e-4, |x, y| (x * x + y * y) / (2.0 * radius))
}

#[test]
fn without_a_touch_the_picture_is_the_untouched_one_and_no_marker_moves() {
    let (gel, optics) = (gel(), Optics::mini().expect("shipped"));
    let mut rgb = vec![7; 320 * 240 * 3];
    optics.picture(&gel, None, &mut rgb);
    assert_eq!(rgb, optics.untouched());
    for model in [MarkerModel::Elastic, MarkerModel::Fots(FotsSpec::default())] {
        assert_eq!(markers(&gel, &model, None), [untouched(), untouched()]);
    }
}

#[test]
fn a_touch_changes_the_picture_around_it_and_nowhere_else() {
    let (gel, optics) = (gel(), Optics::mini().expect("shipped"));
    let field = touch(&gel, &dome(4e-3), PadLoad::new(0.5, [0.0; 2], 0.0, [0.0; 2]));
    let mut rgb = vec![0; 320 * 240 * 3];
    optics.picture(&gel, Some(&field), &mut rgb);
    let changed = |x: usize, y: usize| {
        (0..3).any(|c| {
            let at = 3 * (y * 320 + x) + c;
            rgb[at] != optics.untouched()[at]
        })
    };
    assert!((0..240).any(|y| changed(175, y)) && (0..320).any(|x| changed(x, 105)));
    for (x, y) in [(2, 2), (317, 2), (2, 237), (317, 237), (10, 120), (310, 120)] {
        assert!(!changed(x, y), "({x}, {y})");
    }
}

#[test]
fn each_colour_gains_on_the_side_of_its_lamp_as_measured() {
    let optics = Optics::mini().expect("shipped");
    for (channel, degrees) in [(0, -97.0_f64), (1, 10.0), (2, 84.0)] {
        let n = 72;
        let mut sum = [0.0; 2];
        for i in 0..n {
            let phi = std::f64::consts::TAU * f64::from(i) / f64::from(n);
            let gain = optics.change(0.3 * phi.cos(), 0.3 * phi.sin(), 0.0, 0.0)[channel];
            sum = [sum[0] + gain * phi.cos(), sum[1] + gain * phi.sin()];
        }
        let found = sum[1].atan2(sum[0]).to_degrees();
        assert!((found - degrees).abs() < 15.0, "channel {channel}: {found:.0}°, measured {degrees}°");
    }
}

#[test]
fn a_dent_moves_markers_outwards_by_perspective_and_by_the_gel() {
    let gel = gel();
    let skin = graph(12e-3, 2e-4, |_, _| 0.0);
    let field = touch(&gel, &skin, PadLoad::new(40.0, [0.0; 2], 0.0, [0.0; 2]));
    let [from, to] = markers(&gel, &MarkerModel::Elastic, Some(&field));
    let marker = 4 * 11 + 8;
    let rest = gel.view.image_to_pad(&gel.pad, from[marker].map(f64::from));
    let u = field.at(&gel, rest.x, rest.y);
    assert!(u[2] < -5e-5, "{u:?}");
    let flat = (rest.x + u[0]) / (gel.view.lens + rest.z) * gel.view.lens / gel.view.pitch + 160.0;
    let shift = f64::from(to[marker][0]) - flat;
    let expected = (rest.x + u[0]) / gel.view.pitch * -u[2] / gel.view.lens;
    assert!(shift > 0.0 && (shift / expected - 1.0).abs() < 0.05, "{shift} {expected}");
}

#[test]
fn shear_moves_markers_its_way_and_gravity_pulls_them_to_the_left_on_both_fingers() {
    // A lifted object hangs towards the finger tips: −x of both pads, which both pictures show to the left.
    let gel = gel();
    let flat = graph(6e-3, 2e-4, |_, _| 0.0);
    let still = touch(&gel, &flat, PadLoad::new(5.0, [0.0; 2], 0.0, [0.0; 2]));
    for (shear, axis, sign) in [([-2.0, 0.0], 0, -1.0), ([0.0, 2.0], 1, 1.0)] {
        let field = touch(&gel, &flat, PadLoad::new(5.0, shear, 0.0, [0.0; 2]));
        for model in [MarkerModel::Elastic, MarkerModel::Fots(FotsSpec::default())] {
            let place = |field| markers(&gel, &model, Some(field))[1][4 * 11 + 5];
            let (before, after) = (place(&still), place(&field));
            let moved = f64::from(after[axis] - before[axis]) * sign;
            let across = f64::from(after[1 - axis] - before[1 - axis]);
            assert!(moved > 0.3 && across.abs() < 0.05 * moved, "{model:?}: {moved} px, across {across}");
            if model == MarkerModel::Elastic {
                // The middle of a stuck patch moves with it.
                let expected = field.motion[axis] * sign / gel.view.pitch;
                assert!((moved / expected - 1.0).abs() < 0.1, "{moved} px, patch {expected} px");
            }
        }
    }
}

#[test]
fn twist_moves_opposite_markers_oppositely_and_no_twist_moves_none() {
    let gel = gel();
    let flat = graph(6e-3, 2e-4, |_, _| 0.0);
    for model in [MarkerModel::Elastic, MarkerModel::Fots(FotsSpec::default())] {
        let place = |twist| {
            let field = touch(&gel, &flat, PadLoad::new(5.0, [0.0; 2], twist, [0.0; 2]));
            markers(&gel, &model, Some(&field))[1]
        };
        let (still, twisted) = (place(0.0), place(6e-3));
        let turn = |m: usize| twisted[m][1] - still[m][1];
        // Right of the centre a positive twist (x towards y) moves markers down, left of it up.
        let (right, left) = (turn(4 * 11 + 7), turn(4 * 11 + 3));
        assert!(right > 0.1 && (right + left).abs() < 0.03 * right, "{model:?}: {right} {left}");
    }
}

#[test]
fn fots_is_its_law() {
    // Where the patch lies no marker is touched, so that the contact's motion alone is left.
    let gel = gel();
    let law = FotsSpec::default();
    let flat = graph(2e-3, 1e-4, |_, _| 0.0);
    let field = touch(&gel, &flat, PadLoad::new(2.0, [0.5, 0.0], 0.0, [0.0; 2]));
    let [from, to] = markers(&gel, &MarkerModel::Fots(FotsSpec { height_factor: 0.0, ..law }), Some(&field));
    let centre = field.centre(&gel);
    for (a, b) in from.iter().zip(&to) {
        let dx = f64::from(a[0]) - 160.0 - centre[0] * law.scale * 1e3;
        let dy = f64::from(a[1]) - 120.0 - centre[1] * law.scale * 1e3;
        let expected = field.motion.x * law.scale * 1e3 * (-law.shear * (dx * dx + dy * dy)).exp();
        assert!((f64::from(b[0] - a[0]) - expected).abs() < 1e-3, "{a:?} {b:?} {expected}");
    }
}

#[test]
fn drawn_markers_are_dark_dots_and_bright_arrows() {
    let mut rgb = vec![128; 320 * 240 * 3];
    draw_markers(&mut rgb, &[untouched(), untouched()], MarkerStyle::Dots);
    assert_eq!(rgb[3 * (120 * 320 + 160)], 20);
    assert_eq!(rgb[3 * (132 * 320 + 174)], 128);
    let mut moved = untouched();
    moved[0] = [f32::NAN, -1e9];
    moved[49] = [163.0, 120.0];
    let mut rgb = vec![128; 320 * 240 * 3];
    draw_markers(&mut rgb, &[untouched(), moved], MarkerStyle::Arrows);
    assert!(rgb[3 * (120 * 320 + 165)] > 200 && rgb[3 * (120 * 320 + 165) + 2] < 100);
}
