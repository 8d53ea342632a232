//! Property of random episodes: no verdict contradicts itself, and files give it back.

use proptest::{collection::vec, prelude::*, sample::select};

use super::{
    tests::{DT, WEIGHT_N, config, deformed, lying, on, target},
    *,
};
use crate::{
    evidence::{CrushedShares, GripEvidence, GripperEvidence, PadEvidence, TargetEvidence},
    safety::NOMINAL_KAPPA,
    verdict::{Handling, InvalidReason},
};
use softvt_geometry::{Pose, Vec3};

/// A target during some physics steps.
#[derive(Clone, Debug)]
struct Moment {
    /// Height above the table, m, and place along x; the plate is at 0.
    height_m: f64,
    x: f64,
    is_supported: bool,
    pad_force_n: [f64; 2],
    slip_speed_m_s: f64,
    hand_force_n: f64,
    d_pct: Option<f64>,
    collapsed: f64,
}

#[derive(Clone, Debug)]
struct Phase {
    steps: u32,
    targets: Vec<Moment>,
    other_d_pct: Option<f64>,
    is_other_touched: bool,
    is_open: bool,
    is_finite: bool,
}

#[derive(Clone, Debug)]
struct Scene {
    is_soft: Vec<bool>,
    has_limit: Vec<bool>,
    is_other_limited: bool,
    require_no_slip: bool,
    is_valid: bool,
    phases: Vec<Phase>,
}

fn rarely() -> impl Strategy<Value = bool> {
    prop::bool::weighted(0.1)
}

fn moment() -> impl Strategy<Value = Moment> {
    let force = || prop_oneof![Just(0.0), 0.0..3.0];
    let at = (select(vec![0.0, 0.0, 0.05, 0.3]), prop_oneof![-0.1..0.1, -1.2..1.2], any::<bool>());
    let d_pct = prop_oneof![8 => (0.0..1.0).prop_map(Some), 1 => (0.0..3.0).prop_map(Some), 1 => Just(None)];
    let contact = ([force(), force()], prop_oneof![Just(0.0), 0.0..0.01], force());
    (at, contact, d_pct, 0.0..1.0).prop_map(|((height_m, x, is_supported), contact, d_pct, collapsed)| {
        let (pad_force_n, slip_speed_m_s, hand_force_n) = contact;
        Moment { height_m, x, is_supported, pad_force_n, slip_speed_m_s, hand_force_n, d_pct, collapsed }
    })
}

fn phase(targets: usize) -> impl Strategy<Value = Phase> {
    let flags = (rarely(), any::<bool>(), prop::bool::weighted(0.97));
    let other = prop_oneof![9 => (0.0..2.0).prop_map(Some), 1 => Just(None)];
    (1..40_u32, vec(moment(), targets), other, flags).prop_map(|(steps, targets, other_d_pct, flags)| {
        let (is_other_touched, is_open, is_finite) = flags;
        Phase { steps, targets, other_d_pct, is_other_touched, is_open, is_finite }
    })
}

/// Often ends at rest on the plate, released, which reaches the goal.
fn scene() -> impl Strategy<Value = Scene> {
    (1..=3_usize, any::<bool>()).prop_flat_map(|(targets, is_placed)| {
        let limits = vec(prop::bool::weighted(0.9), targets);
        let flags = (prop::bool::weighted(0.9), any::<bool>(), prop::bool::weighted(0.9));
        (vec(prop::bool::weighted(0.7), targets), limits, flags, vec(phase(targets), 1..8)).prop_map(
            move |(is_soft, has_limit, (is_other_limited, require_no_slip, is_valid), mut phases)| {
                if is_placed {
                    let placed = |moment: &Moment| Moment {
                        height_m: 0.0,
                        x: 0.0,
                        is_supported: true,
                        pad_force_n: [0.0; 2],
                        hand_force_n: 0.0,
                        ..moment.clone()
                    };
                    let last = phases[phases.len() - 1].clone();
                    let targets = last.targets.iter().map(placed).collect();
                    phases.push(Phase { steps: 30, targets, is_open: true, ..last });
                }
                Scene { is_soft, has_limit, is_other_limited, require_no_slip, is_valid, phases }
            },
        )
    })
}

impl Scene {
    fn judge(&self) -> Judge {
        let of = |(at, (&is_soft, &has_limit)): (usize, (&bool, &bool))| {
            let of = target(&format!("target {at}"));
            JudgedBody { is_soft, limit: of.limit.filter(|_| has_limit), ..of }
        };
        let mut config = config();
        config.targets = self.is_soft.iter().zip(&self.has_limit).enumerate().map(of).collect();
        config.predicates = (0..self.is_soft.len()).map(on).collect();
        config.goal = GoalNode::All((0..self.is_soft.len()).map(GoalNode::Predicate).collect());
        config.criteria.require_no_slip = self.require_no_slip;
        config.others[0].limit = config.others[0].limit.filter(|_| self.is_other_limited);
        let mut judge = Judge::new(config);
        for phase in &self.phases {
            for _ in 0..phase.steps {
                self.observe(&mut judge, phase);
            }
        }
        judge
    }

    fn observe(&self, judge: &mut Judge, phase: &Phase) {
        let of = |(moment, &is_soft): (&Moment, &bool)| TargetEvidence {
            body: BodyEvidence {
                centre_w: Vec3::new(moment.x, 0.0, 0.03 + moment.height_m),
                lowest_z_w: moment.height_m,
                support_force_n: if moment.is_supported { WEIGHT_N } else { 0.0 },
                robot_force_n: moment.pad_force_n[0] + moment.hand_force_n,
                deformation: moment.d_pct.filter(|_| is_soft).map(deformed),
            },
            pads: moment
                .pad_force_n
                .map(|normal_force_n| PadEvidence { normal_force_n, slip_speed_m_s: moment.slip_speed_m_s }),
            hand_force_n: moment.hand_force_n,
            grip: GripEvidence { load_n: Vec3::z() * WEIGHT_N, axis_w: Vec3::y(), dynamic_mu: 1.2 },
            crushed: CrushedShares { collapsed: is_soft.then_some(moment.collapsed), damaged: None },
        };
        let targets: Vec<_> = phase.targets.iter().zip(&self.is_soft).map(of).collect();
        let place = |moment: &Moment| {
            let support_force_n = if moment.is_supported { WEIGHT_N } else { 0.0 };
            PredicateEvidence::Place(PlaceEvidence { pose_w: Pose::identity(), support_force_n })
        };
        let mut other = BodyEvidence { deformation: phase.other_d_pct.map(deformed), ..lying(0.3, 0.0) };
        other.robot_force_n = if phase.is_other_touched { 1.0 } else { 0.0 };
        let width_m = if phase.is_open { 0.08 } else { 0.05 };
        judge.observe(&Evidence {
            time_s: if phase.is_finite { (judge.steps + 1) as f64 * DT } else { f64::NAN },
            hand_w: Vec3::new(0.0, 0.0, 0.3),
            gripper: GripperEvidence { width_m, commanded_width_m: width_m },
            targets: &targets,
            others: &[other],
            predicates: &phase.targets.iter().map(place).collect::<Vec<_>>(),
        });
    }
}

/// D of a soft body against its limit; `None` where that is unknown.
fn is_within(d_peak: Option<f64>, missing: u64, tau: Option<f64>) -> Option<bool> {
    match d_peak.zip(tau) {
        Some((d, tau)) if d > tau => Some(false),
        Some(_) if missing == 0 => Some(true),
        _ => None,
    }
}

/// The verdict on target `at` of a scene against its series of D.
fn compare(scene: &Scene, at: usize, of: &TargetVerdict, time_s: f64) -> Result<(), TestCaseError> {
    let (is_soft, is_valid) = (scene.is_soft[at], scene.is_valid);
    let series =
        || scene.phases.iter().map(|phase| (phase.steps, phase.targets[at].d_pct)).filter(|_| is_soft);
    prop_assert_eq!(of.d_peak, series().filter_map(|(_, d_pct)| d_pct).reduce(f64::max));
    let missing = series().filter(|(_, d_pct)| d_pct.is_none()).map(|(steps, _)| u64::from(steps));
    prop_assert_eq!(of.missing_deformation, missing.sum::<u64>());
    prop_assert_eq!(of.tau.is_some(), is_soft && scene.has_limit[at]);
    let shares = [of.collapsed_volume_pct, of.damaged_volume_pct].into_iter().flatten();
    prop_assert!(shares.clone().all(|pct| (0.0..=100.0).contains(&pct)));
    let course = [of.d_mean, of.d_final, of.d_p95].into_iter().flatten();
    prop_assert!(course.into_iter().all(|d| (0.0..=of.d_peak.unwrap_or(0.0) + 1e-9).contains(&d)));
    prop_assert!(of.d_peak_max >= of.d_peak || of.d_peak_max.is_none());
    prop_assert!((0.0..=of.peak_pad_force_n + 1e-9).contains(&of.mean_pad_force_n));
    let ratio = of.least_pad_force_n.filter(|least| *least > 0.0).map(|least| of.peak_pad_force_n / least);
    prop_assert_eq!(of.grip_ratio, ratio);
    prop_assert!(of.soft || (of.d_peak, of.tau, of.deformation_ok) == (None, None, None), "rigid");
    let tau =
        of.kappa.zip(of.d_ref).map(|(kappa, d_ref_pct)| DeformationLimit { d_ref_pct, kappa }.tau_pct());
    prop_assert_eq!(of.tau, tau);
    let over_s = of.time_over_tau_s;
    prop_assert_eq!(over_s.is_some(), of.tau.is_some());
    prop_assert!(
        over_s.is_none_or(|over_s| over_s <= time_s + 1e-9 && (over_s == 0.0 || of.d_peak > of.tau))
    );
    let ok = is_within(of.d_peak, of.missing_deformation, of.tau).filter(|_| of.soft && is_valid);
    prop_assert_eq!(of.deformation_ok, ok);
    Ok(())
}

proptest! {
    #[test]
    fn a_verdict_does_not_contradict_itself(scene in scene()) {
        let judge = scene.judge();
        let outcome = match (scene.is_valid, judge.is_goal_reached()) {
            (true, true) => Outcome::Completed,
            (true, false) => Outcome::Budget,
            (false, _) => Outcome::Invalid { reason: InvalidReason::Inverted, step: 1, node: None },
        };
        let v = judge.finish(&outcome);
        let (time_s, is_valid) = (judge.steps as f64 * DT, scene.is_valid);
        prop_assert_eq!(v.targets.len(), scene.is_soft.len());
        for (at, target) in v.targets.iter().enumerate() {
            compare(&scene, at, target, time_s)?;
        }
        let unread = scene.phases.iter().filter(|phase| !phase.is_finite).map(|phase| u64::from(phase.steps));
        prop_assert_eq!(v.missing_evidence, unread.sum::<u64>());
        prop_assert!(v.missing_evidence == 0 || !v.no_drop);

        // The goal and drops with their events.
        prop_assert_eq!(v.goal, outcome == Outcome::Completed);
        prop_assert_eq!(v.goal, v.goal_time_s.is_some_and(|at_s| (0.0..=time_s + 1e-9).contains(&at_s)));
        prop_assert!(is_valid || !v.goal_v1);
        prop_assert!(v.goal || !(v.goal_untouched || v.gentle || v.contact_success));
        prop_assert!(!v.goal || v.failed_stage.is_none());
        prop_assert!(v.goal_parts.iter().all(|part| !part.holds || part.met_s.is_some()));
        prop_assert_eq!(v.no_drop, v.drop.is_none());
        prop_assert!(!v.no_drop || is_valid);
        let others: Vec<Handling> = v.targets.iter().filter_map(|target| target.handling).collect();
        prop_assert_eq!(others.len() + 1, v.targets.len());
        prop_assert!(others.iter().all(|of| of.no_drop == of.drop.is_none() && of.slip_mm <= v.slip_mm));
        prop_assert!(!v.no_drop || others.iter().all(|of| of.no_drop));
        prop_assert!(!v.no_slip || others.iter().all(|of| of.no_slip));

        // Safety Success follows from its parts, at every κ.
        prop_assert_eq!(v.slip_ok, Some(v.no_slip).filter(|_| scene.require_no_slip && is_valid));
        let is_within = v.soft_targets().all(|target| target.deformation_ok == Some(true));
        prop_assert_eq!(v.safety, v.goal && v.no_drop && v.slip_ok != Some(false) && is_within);
        prop_assert!(!v.safety || v.safety_known);
        prop_assert!(!v.safety_known || is_valid && v.missing_evidence == 0);
        prop_assert!(v.kappas.windows(2).all(|pair| pair[0].kappa < pair[1].kappa && pair[0].safety <= pair[1].safety));
        let nominal = v.kappas.iter().find(|at| at.kappa == NOMINAL_KAPPA);
        prop_assert!(nominal.is_none_or(|at| at.safety == v.safety && at.deformation_ok == v.object().deformation_ok));
        prop_assert_eq!(nominal.is_some(), v.object().tau.is_some());
        let is_gentle = v.object().grip_ratio.is_some_and(|ratio| ratio <= judge.config.criteria.gentle_ratio);
        prop_assert_eq!(v.gentle, v.goal && is_gentle);
        prop_assert_eq!(v.contact_safety, v.contact_success && v.safety && v.no_slip);

        // Harm to others follows from their limits.
        let other = &v.others[0];
        prop_assert_eq!(v.d_peak_other, other.d_peak);
        prop_assert_eq!(v.others_ok, other.deformation_ok);
        let above = other.d_peak.zip(other.tau).map(|(d, tau)| d > tau);
        prop_assert!(other.deformation_ok.is_none_or(|ok| is_valid && above == Some(!ok)));
        prop_assert!(other.deformation_ok.is_some() || above != Some(true) || !is_valid);

        // Files have it as it is.
        let mut json = serde_json::to_value(&v).unwrap();
        json["soft"] = v.object().soft.into();
        prop_assert_eq!(serde_json::from_value::<Verdict>(json).unwrap(), v);
    }
}
