//! Equilibria at 60, 120 and 240 Hz.

use crate::support::{Body, Outcome, Squeeze, run};

/// The squeezes whose step is halved, with the change allowed.
pub fn cases() -> [(&'static str, Squeeze, f64); 4] {
    let cube = Squeeze::default();
    let round = |body, youngs_pa, gap| Squeeze { body, youngs_pa, ..cube }.gap_mm(gap);
    [
        ("cube, gap 42", cube.gap_mm(42.0), 0.005),
        ("cube, gap 48", cube.gap_mm(48.0), 0.005),
        ("sphere, gap 42", round(Body::Sphere { radius: 0.025 }, 3e4, 42.0), 0.02),
        ("capsule, gap 32", round(Body::Capsule { radius: 0.02, length: 0.07 }, 1.5e4, 32.0), 0.02),
    ]
}

/// The squeeze at 60, 120 and 240 Hz.
pub fn refined(options: &Squeeze) -> [Outcome; 3] {
    [60.0, 120.0, 240.0].map(|rate| run(&Squeeze { dt: 1.0 / rate, ..*options }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn force_and_deformation_of_a_grasp_do_not_depend_on_the_step() {
        for (name, options, bound) in cases() {
            let runs = refined(&options);
            for (key, value) in [
                ("grip force", runs.each_ref().map(|o| o.force_grip_n)),
                ("hold force", runs.each_ref().map(|o| o.force_hold_n)),
                ("hold D", runs.each_ref().map(|o| o.d_hold_pct)),
            ] {
                let spread = value.iter().map(|v| (v / value[2] - 1.0).abs()).fold(0.0, f64::max);
                assert!(spread < bound, "{name}: {key} {value:?}");
            }
        }
    }
}
