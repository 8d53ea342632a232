//! Damping by a loss factor: a Maxwell branch and a dashpot in parallel with the spring of each element.
//!
//! The loss factor η = tan δ of soft solids is nearly constant over a decade of frequency, where a dashpot alone has
//! η = β ω. A branch of a spring in series with a dashpot has its largest loss at one frequency; together they are
//! flat. With stiffness `K` at rest, the force is `K (u + g d)`, where the stretch `d` of the branch follows
//! `ḋ = u̇ − d/τ`, and `β K u̇`. At angular frequency ω, with `r = ω τ`,
//!
//! `tan δ = (g r / (1 + r²) + β ω) / (1 + g r² / (1 + r²))` (Ferry, *Viscoelastic Properties of Polymers*, 1980, ch.
//! 3).
//!
//! A lossy material is stiffer when it moves fast: by the Kramers–Kronig relations, a flat loss factor adds (2/π) η ln
//! of the ratio of two frequencies to the stiffness. The stiffness of a material is that at rest.

/// Frequency of the branch, 1/(2π τ), Hz.
const FREQUENCY: f64 = 2.0;
/// `g = SHARE[0] η / (1 − SHARE[1] η)` and `β = DASHPOT η (1 + g)`: fitted, so that tan δ is within 18 % of η from 1 to
/// 10 Hz for η up to 0.6.
const SHARE: [f64; 2] = [2.0, 0.7];
const DASHPOT: f64 = 0.0115;

/// The law of a material of one loss factor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Relaxation {
    /// Stiffness of the branch over that at rest, `g`.
    pub share: f64,
    /// Time `β` of the dashpot, s.
    pub dashpot: f64,
}

impl Relaxation {
    /// The law with a loss factor in [`ElasticMaterial::LOSS_FACTOR`](super::ElasticMaterial::LOSS_FACTOR).
    pub(crate) fn new(loss_factor: f64) -> Self {
        let [slope, bend] = SHARE;
        let share = slope * loss_factor / (1.0 - bend * loss_factor);
        Self { share, dashpot: DASHPOT * loss_factor * (1.0 + share) }
    }

    /// Time τ of the branch, s.
    fn time() -> f64 {
        0.5 / (std::f64::consts::PI * FREQUENCY)
    }
}

/// Effect of a time step on every branch, for motion at constant velocity.
#[derive(Clone, Copy, Debug)]
pub struct BranchStep {
    /// Share of the stretch that is left at the end.
    decay: f64,
    /// Stretch at the end over the displacement within the step.
    gain: f64,
}

impl BranchStep {
    /// A step of `dt`, s.
    pub fn new(dt: f64) -> Self {
        let ratio = dt / Relaxation::time();
        let decay = libm::exp(-ratio);
        Self { decay, gain: if ratio > 0.0 { (1.0 - decay) / ratio } else { 1.0 } }
    }
}

/// The branch of one element: 24 displacements of its corners in its rotating frame, m.
#[derive(Clone, Debug)]
pub struct Branch {
    /// Displacements at the last update.
    last: [f64; 24],
    /// Stretch of the spring.
    stretch: [f64; 24],
}

impl Default for Branch {
    fn default() -> Self {
        Self { last: [0.0; 24], stretch: [0.0; 24] }
    }
}

impl Branch {
    /// Moves the element to displacements `u` within a step, and returns the exact stretch.
    pub fn advance(&mut self, u: &[f64; 24], step: BranchStep) -> &[f64; 24] {
        let BranchStep { decay, gain } = step;
        for ((stretch, last), u) in self.stretch.iter_mut().zip(&mut self.last).zip(u) {
            *stretch = decay * *stretch + gain * (u - *last);
            *last = *u;
        }
        &self.stretch
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_loss_factor_is_flat_from_1_to_10_hz() {
        for loss_factor in [0.02, 0.1, 0.3, 0.6] {
            let Relaxation { share, dashpot } = Relaxation::new(loss_factor);
            for frequency in [1.0, 2.0, 3.0, 5.0, 7.0, 10.0] {
                let w = 2.0 * std::f64::consts::PI * frequency;
                let r = w * Relaxation::time();
                let loss = share * r / (1.0 + r * r) + dashpot * w;
                let found = loss / (1.0 + share * r * r / (1.0 + r * r));
                assert!((found / loss_factor - 1.0).abs() < 0.18, "{found} at {frequency} Hz, {loss_factor}");
            }
        }
    }

    #[test]
    fn a_branch_that_is_held_forgets_and_one_that_jumps_does_not() {
        let mut branch = Branch::default();
        assert_eq!(branch.advance(&[1.0; 24], BranchStep::new(0.0)), &[1.0; 24]);
        let held = branch.advance(&[1.0; 24], BranchStep::new(Relaxation::time()))[0];
        assert!((held - (-1f64).exp()).abs() < 1e-15, "{held}");
        // At constant velocity the stretch tends to velocity times τ, whatever the step.
        for steps in [10, 100] {
            let (mut branch, dt) = (Branch::default(), 10.0 * Relaxation::time() / f64::from(steps));
            let mut stretch = 0.0;
            for step in 1..=steps {
                stretch = branch.advance(&[f64::from(step) * dt; 24], BranchStep::new(dt))[3];
            }
            assert!((stretch / Relaxation::time() - 1.0 + (-10f64).exp()).abs() < 1e-12, "{stretch}");
        }
    }

    #[test]
    fn the_decay_in_a_step_has_the_same_bits_on_every_platform() {
        // The last bit of std differs with glibc.
        assert_eq!(BranchStep::new(1.0 / 240.0).decay.to_bits(), 0x3fee_5e1a_95cb_4134);
    }
}
