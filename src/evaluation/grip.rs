//! Grip ratio, the largest force on a pad over the least that holds the object on its path, and the contact of both
//! pads while the object is carried.
//!
//! To follow its path, an object of mass m needs the force L = m (a − g). The robot exerts it while nothing else
//! touches the object. L has a part L_n along the axis of the two pads and a part L_t across it. With Coulomb friction
//! μ between pads and object, pads that press with N_1 and N_2 hold the object if
//!
//! |L_t| ≤ μ (N_1 + N_2),  |N_1 − N_2| = L_n,
//!
//! so the larger of the two is at least |L_t| / 2μ + L_n / 2. The least force of an episode is the maximum of this over
//! the control steps in which the object is carried, with L as the mean over the control step and the dynamic μ of the
//! pair: a grip that still holds once a pad has slid. Moments are left out: an object that is gripped off its
//! centre, or by its rim, needs more, so the least force is a lower bound and the ratio an upper one.
//!
//! Human grips exceed the least force by 10 to 40 % (Johansson and Westling, Experimental Brain Research 56, 1984).

use softvt_geometry::Vec3;

use super::{criteria::SuccessCriteria, evidence::GripEvidence};

/// One physics step as [`GripMonitor`] reads it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GripSample {
    /// True if the object is lifted and no release was commanded.
    pub is_carried: bool,
    /// True if both pads touch it.
    pub is_held: bool,
    /// Load of the object and friction of the pair.
    pub grip: GripEvidence,
}

/// Finds the least force that holds the object, and whether both pads kept contact while it was carried.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GripMonitor {
    /// Least force per pad that holds the object on its path so far, N; `None` before it was carried.
    pub least_n: Option<f64>,
    /// True once the object was carried.
    pub was_carried: bool,
    /// True once a pad lost the carried object for [`SuccessCriteria::lost_contact_s`].
    pub lost_contact: bool,
    lost_s: f64,
    control_step: LoadSum,
}

/// Sum over the physics steps of one control step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct LoadSum {
    steps: u32,
    /// Number of steps in which the object was carried by both pads.
    carried: u32,
    load_n: Vec3,
}

impl GripMonitor {
    /// Takes in one physics step of `dt_s`; a control step has `steps_per_control` of them.
    pub fn update(
        &mut self,
        criteria: &SuccessCriteria,
        dt_s: f64,
        steps_per_control: u32,
        sample: &GripSample,
    ) {
        let GripSample { is_carried, is_held, grip } = sample;
        self.was_carried |= is_carried;
        self.lost_s = if *is_carried && !is_held { self.lost_s + dt_s } else { 0.0 };
        self.lost_contact |= self.lost_s > criteria.lost_contact_s - 1e-9;
        let sum = &mut self.control_step;
        sum.steps += 1;
        sum.carried += u32::from(*is_carried && *is_held);
        sum.load_n += grip.load_n;
        if sum.steps < steps_per_control {
            return;
        }
        let sum = std::mem::take(sum);
        if sum.carried < sum.steps {
            return;
        }
        let load_n = sum.load_n / f64::from(sum.steps);
        let along_n = load_n.dot(&grip.axis_w);
        let across_n = (load_n - along_n * grip.axis_w).norm();
        let least_n = across_n / (2.0 * grip.dynamic_mu) + 0.5 * along_n.abs();
        if least_n.is_finite() {
            self.least_n = Some(self.least_n.map_or(least_n, |largest| largest.max(least_n)));
        }
    }

    /// Largest force on a pad over the least; `None` if the object was never carried.
    pub fn ratio(&self, peak_n: f64) -> Option<f64> {
        self.least_n.filter(|least| *least > 0.0).map(|least| peak_n / least)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f64 = 1.0 / 60.0;

    fn sample(load_n: [f64; 3], is_held: bool) -> GripSample {
        let grip = GripEvidence { load_n: Vec3::from(load_n), axis_w: Vec3::y(), dynamic_mu: 1.2 };
        GripSample { is_carried: true, is_held, grip }
    }

    fn run(samples: &[GripSample]) -> GripMonitor {
        let (mut monitor, criteria) = (GripMonitor::default(), SuccessCriteria::default());
        samples.iter().for_each(|sample| monitor.update(&criteria, DT, 3, sample));
        monitor
    }

    #[test]
    fn a_hanging_object_needs_half_of_its_weight_over_the_friction_at_each_pad() {
        let monitor = run(&[sample([0.0, 0.0, 0.6], true); 3]);
        assert!((monitor.least_n.unwrap() - 0.25).abs() < 1e-12);
        assert!((monitor.ratio(0.5).unwrap() - 2.0).abs() < 1e-12);
        assert!(monitor.was_carried && !monitor.lost_contact);
    }

    #[test]
    fn accelerations_count_across_and_along_the_axis_of_the_pads() {
        // 0.8 N forwards and 0.6 N upwards: 1 N across. 0.4 N along the axis: 0.2 N more at one pad.
        let monitor = run(&[sample([0.8, -0.4, 0.6], true); 3]);
        assert!((monitor.least_n.unwrap() - (1.0 / 2.4 + 0.2)).abs() < 1e-12);
    }

    #[test]
    fn the_largest_need_of_the_path_counts_and_vibration_within_a_control_step_does_not() {
        let rest = sample([0.0, 0.0, 0.6], true);
        let shaken = [sample([0.0, 0.0, 1.2], true), sample([0.0, 0.0, 0.0], true), rest];
        assert!((run(&shaken).least_n.unwrap() - 0.25).abs() < 1e-12);
        let hard = sample([0.0, 0.0, 0.9], true);
        assert!(
            (run(&[rest, rest, rest, hard, hard, hard, rest, rest, rest]).least_n.unwrap() - 0.375).abs()
                < 1e-12
        );
    }

    #[test]
    fn an_object_that_is_not_carried_by_both_pads_has_no_least_force() {
        let lying = GripSample { is_carried: false, ..sample([0.0, 0.0, 0.6], true) };
        assert_eq!((run(&[lying; 6]).least_n, run(&[lying; 6]).was_carried), (None, false));
        let one_pad = run(&[sample([0.0, 0.0, 0.6], false); 3]);
        assert_eq!((one_pad.least_n, one_pad.was_carried), (None, true));
        assert_eq!(one_pad.ratio(1.0), None);
    }

    #[test]
    fn contact_is_lost_after_three_control_steps_without_a_pad() {
        let (held, lost) = (sample([0.0; 3], true), sample([0.0; 3], false));
        assert!(!run(&[lost; 8]).lost_contact);
        assert!(run(&[lost; 9]).lost_contact);
        let interrupted: Vec<GripSample> = [[lost; 8].as_slice(), &[held], &[lost; 8]].concat();
        assert!(!run(&interrupted).lost_contact);
    }

    #[test]
    fn without_friction_no_grip_holds() {
        let mut slippery = sample([0.0, 0.0, 0.6], true);
        slippery.grip.dynamic_mu = 0.0;
        assert_eq!(run(&[slippery; 3]).least_n, None);
    }
}
