//! Validity of the benchmark on small suites: policies and objects that must fail do so, for the right reason.

use softvt::{
    evaluation::verdict::{Outcome, Verdict},
    runs::record::EpisodeRecord,
};

use crate::support::{Project, Run, spatial_soft, spatial_soft_run};

/// The episodes of the expert under a change.
fn changed(change: impl FnOnce(Run) -> Run) -> Vec<EpisodeRecord> {
    let project = Project::new(&[]);
    change(spatial_soft_run(&project, "expert")).out("run").records()
}

fn all(episodes: &[EpisodeRecord], is_so: impl Fn(&Verdict) -> bool) -> bool {
    episodes.iter().all(|episode| is_so(&episode.verdict))
}

fn d_peak(episode: &EpisodeRecord) -> f64 {
    episode.verdict.object().d_peak.expect("a soft target")
}

#[test]
fn noop_and_random_never_succeed() {
    for policy in ["noop", "random"] {
        let (_, episodes) = spatial_soft(policy);
        assert!(all(episodes, |verdict| !verdict.goal && !verdict.safety), "{policy}: {episodes:?}");
        assert!(episodes.iter().all(|e| e.outcome == Outcome::Budget), "{policy}: {episodes:?}");
    }
}

#[test]
fn stiffer_objects_deform_less() {
    let (_, soft) = spatial_soft("expert");
    assert!(all(soft, |verdict| verdict.safety), "{soft:?}");
    let stiff = changed(|run| run.shift("stiffness", 10.0));
    assert!(all(&stiff, |verdict| verdict.goal), "{stiff:?}");
    for (soft, stiff) in soft.iter().zip(&stiff) {
        assert!(d_peak(stiff) < 0.5 * d_peak(soft), "{soft:?}\n{stiff:?}");
        assert_eq!(soft.verdict.object().tau, stiff.verdict.object().tau, "the threshold stays nominal");
        assert!(soft.verdict.object().tau.is_some());
    }
}

#[test]
fn a_binary_gripper_reaches_the_goal_unsafely() {
    let [careful, binary] = ["expert", "expert-binary"].map(|policy| spatial_soft(policy).1);
    for (careful, binary) in careful.iter().zip(binary) {
        assert!(d_peak(binary) > d_peak(careful), "{careful:?}\n{binary:?}");
    }
    assert!(all(binary, |verdict| verdict.goal && !verdict.safety), "{binary:?}");
}

#[test]
fn nothing_is_carried_without_friction_or_by_weak_fingers() {
    let smooth = changed(|run| {
        run.shift("friction", 0.0).set("robot.pads.static_mu", 0).set("robot.pads.dynamic_mu", 0)
    });
    let weak = changed(|run| run.set("robot.gripper.effort", 0.05));
    for episodes in [smooth, weak] {
        assert!(all(&episodes, |verdict| !verdict.goal), "{episodes:?}");
    }
}
