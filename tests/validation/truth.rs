//! Small-strain pad stiffness of the cube against converged truth, and how it changes with the pads.

use softvt::evaluation::deformation::ReferenceShape;

use crate::support::{Scene, Squeeze};

/// Of graded meshes refined to convergence (`tests/reference/rows/truth.jsonl` and the outside reference named there):
/// force per closing, N/m, and D per closing on 7³ nodes, %/mm, for centred 22 mm pads.
pub const TRUTH: (f64, f64) = (620.0, 0.212);
/// Closing, m.
const CLOSE: f64 = 2e-4;

/// Stiffness, N/m, and D on the 7³ nodes of resolution 6, %/mm, between sticking pads without gravity.
pub fn small_strain(resolution: usize, pad_mm: f64, offset_mm: [f64; 2]) -> (f64, f64) {
    let options = Squeeze {
        resolution,
        friction: 1e3,
        pad: 1e-3 * pad_mm,
        pad_offset: offset_mm.map(|o| 1e-3 * o),
        gap: 0.05 - CLOSE,
        grounded: false,
        ..Squeeze::default()
    };
    let mut scene = Scene::new(&options);
    let mut force = 0.0;
    for _ in 0..((options.lift_at() + 0.25) / options.dt) as usize {
        let seen = scene.step(&softvt::geometry::Pose::identity()).expect("a step");
        force = seen.force;
    }
    let body = &scene.world.soft_bodies()[0].state;
    let on = |c: &f64| {
        let at = (c + 0.025) * 6.0 / 0.05;
        (at - at.round()).abs() < 1e-6
    };
    let on_lattice: Vec<usize> =
        (0..body.x.len()).filter(|&n| body.model.mesh.nodes[n].iter().all(on)).collect();
    let rest: Vec<_> = on_lattice.iter().map(|&n| body.model.mesh.nodes[n]).collect();
    let now: Vec<_> = on_lattice.iter().map(|&n| body.x[n]).collect();
    let reference = ReferenceShape::new(&rest, &vec![1.0; rest.len()]).expect("a cube");
    let d = reference.measure(&now).expect("a cube").v1_rms_pct;
    (force / CLOSE, d / (1e3 * CLOSE))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pad_stiffness_is_within_15_per_cent_of_converged_truth_at_resolutions_6_and_12() {
        for resolution in [6, 12] {
            let (stiffness, d) = small_strain(resolution, 22.0, [0.0; 2]);
            let errors = (stiffness / TRUTH.0 - 1.0, d / TRUTH.1 - 1.0);
            assert!(errors.0.abs() < 0.15 && errors.1.abs() < 0.15, "resolution {resolution}: {errors:?}");
        }
    }

    #[test]
    fn widening_or_moving_a_pad_by_a_tenth_of_a_millimetre_changes_the_force_by_less_than_3_per_cent() {
        for move_it in [false, true] {
            let forces: Vec<f64> = (0..=10)
                .map(|i| 0.1 * f64::from(i))
                .map(|x| {
                    let (pad, offset) = if move_it { (22.0, [x, 0.0]) } else { (22.0 + x, [0.0; 2]) };
                    small_strain(6, pad, offset).0
                })
                .collect();
            for pair in forces.windows(2) {
                assert!((pair[1] / pair[0] - 1.0).abs() < 0.03, "{forces:?}");
            }
        }
    }
}
