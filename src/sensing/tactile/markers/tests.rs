//! Markers under contacts.

use super::{
    super::{
        PadWrench,
        elastic::{
            Gel,
            tests::{graph, pressed},
        },
    },
    MarkerStyle, Markers,
};
use softvt_robot::PadSurface;
use softvt_robot::tactile::{FotsSpec, MarkerModel, TactileSpec};

fn gel() -> Gel {
    Gel::new(&TactileSpec::default(), PadSurface::default()).expect("default numbers")
}

#[test]
fn without_a_contact_no_marker_moves() {
    let gel = gel();
    for model in [MarkerModel::Elastic {}, MarkerModel::Fots(FotsSpec::default())] {
        assert_eq!(Markers::new(&gel, &model, None), Markers::at_rest());
    }
}

#[test]
fn a_dent_moves_markers_outwards_by_perspective_and_by_the_gel() {
    let gel = gel();
    let skin = graph(12e-3, 2e-4, |_, _| 0.0);
    let field = pressed(&gel, &skin, PadWrench::new(40.0, [0.0; 2], 0.0, [0.0; 2]));
    let Markers { initial: from, current: to } = Markers::new(&gel, &MarkerModel::Elastic {}, Some(&field));
    let marker = 4 * 11 + 8;
    let rest = gel.view.image_to_pad(&gel.pad, from[marker].map(f64::from));
    let u = field.displacement_at(&gel, rest.x, rest.y);
    assert!(u[2] < -5e-5, "{u:?}");
    let flat = (rest.x + u[0]) / (gel.view.lens + rest.z) * gel.view.lens / gel.view.pitch + 160.0;
    let shift = f64::from(to[marker][0]) - flat;
    let expected = (rest.x + u[0]) / gel.view.pitch * -u[2] / gel.view.lens;
    assert!(shift > 0.0 && (shift / expected - 1.0).abs() < 0.05, "{shift} {expected}");
}

#[test]
fn shear_moves_markers_along_and_gravity_pulls_them_to_the_left_on_both_fingers() {
    // A lifted object is pulled towards the finger tips: −x of both pads, left in both images.
    let gel = gel();
    let flat = graph(6e-3, 2e-4, |_, _| 0.0);
    let still = pressed(&gel, &flat, PadWrench::new(5.0, [0.0; 2], 0.0, [0.0; 2]));
    for (shear, axis, sign) in [([-2.0, 0.0], 0, -1.0), ([0.0, 2.0], 1, 1.0)] {
        let field = pressed(&gel, &flat, PadWrench::new(5.0, shear, 0.0, [0.0; 2]));
        for model in [MarkerModel::Elastic {}, MarkerModel::Fots(FotsSpec::default())] {
            let place = |field| Markers::new(&gel, &model, Some(field)).current[4 * 11 + 5];
            let (before, after) = (place(&still), place(&field));
            let moved = f64::from(after[axis] - before[axis]) * sign;
            let across = f64::from(after[1 - axis] - before[1 - axis]);
            assert!(moved > 0.3 && across.abs() < 0.05 * moved, "{model:?}: {moved} px, across {across}");
            if matches!(model, MarkerModel::Elastic {}) {
                // The middle of a patch moves most if its shear is in proportion to its pressure.
                let mean = [field.motion.x, field.motion.y][axis] * sign / gel.view.pitch;
                assert!((1.0..1.5).contains(&(moved / mean)), "{moved} px, on average {mean} px");
            }
        }
    }
}

#[test]
fn twist_moves_opposite_markers_in_opposite_directions() {
    let gel = gel();
    let flat = graph(6e-3, 2e-4, |_, _| 0.0);
    for model in [MarkerModel::Elastic {}, MarkerModel::Fots(FotsSpec::default())] {
        let place = |twist| {
            let field = pressed(&gel, &flat, PadWrench::new(5.0, [0.0; 2], twist, [0.0; 2]));
            Markers::new(&gel, &model, Some(&field)).current
        };
        let (still, twisted) = (place(0.0), place(6e-3));
        let turn = |m: usize| twisted[m][1] - still[m][1];
        // Right of the centre a positive twist (x towards y) moves markers down, left of it up.
        let (right, left) = (turn(4 * 11 + 7), turn(4 * 11 + 3));
        assert!(right > 0.1 && (right + left).abs() < 0.03 * right, "{model:?}: {right} {left}");
    }
}

#[test]
fn fots_follows_its_published_law() {
    // No marker is inside the patch, so that only the motion of the contact remains.
    let gel = gel();
    let law = FotsSpec::default();
    let flat = graph(2e-3, 1e-4, |_, _| 0.0);
    let field = pressed(&gel, &flat, PadWrench::new(2.0, [0.5, 0.0], 0.0, [0.0; 2]));
    let model = MarkerModel::Fots(FotsSpec { height_factor: 0.0, ..law });
    let Markers { initial: from, current: to } = Markers::new(&gel, &model, Some(&field));
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
    Markers::at_rest().draw(&mut rgb, MarkerStyle::Dots);
    assert_eq!(rgb[3 * (120 * 320 + 160)], 20);
    assert_eq!(rgb[3 * (132 * 320 + 174)], 128);
    let mut moved = Markers::at_rest();
    moved.current[0] = [f32::NAN, -1e9];
    moved.current[49] = [163.0, 120.0];
    let mut rgb = vec![128; 320 * 240 * 3];
    moved.draw(&mut rgb, MarkerStyle::Arrows);
    assert!(rgb[3 * (120 * 320 + 165)] > 200 && rgb[3 * (120 * 320 + 165) + 2] < 100);
}
