//! The shifts of `scripts/shifts.lua` and the rigid twins: what each changes, and what it leaves.

use std::{path::Path, time::Duration};

use crate::{EpisodeSetup, LoadedScript, SceneChanges, VmLimits, check_shift, load_with};
use softvt_benchmark::{Plan, ShiftValue};
use softvt_common::episode_id::EpisodeId;
use softvt_scene::{Body, Scene};

fn loaded(suite: &str) -> LoadedScript {
    // Builds without optimisation on a busy machine need longer than users do.
    let long = Duration::from_secs(120);
    let limits = VmLimits { load: long, call: long, ..VmLimits::default() };
    load_with(Path::new(&format!("suites/{suite}.lua")), &[], &limits).expect("it loads")
}

fn episode(loaded: &LoadedScript, suite: &str, task: usize, shifts: &[(&str, f64)]) -> EpisodeSetup {
    let id = EpisodeId { suite: suite.to_owned(), task, ..super::episode_id(3, 1) };
    let shift = |(name, value): &(&str, f64)| ShiftValue { name: (*name).to_owned(), value: *value };
    let shifts: Vec<ShiftValue> = shifts.iter().map(shift).collect();
    EpisodeSetup::open(loaded, &id, &SceneChanges { shifts, ..SceneChanges::default() }).expect("a scene")
}

/// The objects whose density or Young's modulus a shift has multiplied by `factor`. All others must be unchanged.
fn multiplied(setup: &EpisodeSetup, factor: f64) -> Vec<String> {
    let numbers = |body: &Body| match body {
        Body::Soft(material) => vec![material.elastic.density(), material.elastic.youngs_pa()],
        Body::Rigid { density } => vec![*density],
        _ => Vec::new(),
    };
    let objects = setup.scene.objects.iter().zip(&setup.nominal.objects);
    let changed = objects.filter(|(now, before)| {
        let ratios =
            numbers(&now.asset.body).into_iter().zip(numbers(&before.asset.body)).map(|(a, b)| a / b);
        let ratios: Vec<f64> = ratios.collect();
        assert!(ratios.iter().all(|ratio| (ratio - 1.0).abs() < 1e-9 || (ratio - factor).abs() < 1e-9));
        ratios.iter().any(|ratio| (ratio - factor).abs() < 1e-9)
    });
    changed.map(|(now, _)| now.name.clone()).collect()
}

#[test]
fn shifts_of_the_target_leave_all_other_objects() {
    let suite = loaded("spatial_soft");
    let Plan::Suite(plan) = &suite.plan else { panic!("a suite") };
    let target = plan.tasks[0].object.clone();
    assert_eq!(check_shift(&plan.shifts, "mass", 2.0), Ok(()));
    let refused = "shift mass: expected a number in 0.01..100 (1), got 0".to_owned();
    assert_eq!(check_shift(&plan.shifts, "mass", 0.0), Err(refused));
    for (shift, factor) in [("target_mass", 2.5), ("target_stiffness", 0.5)] {
        let setup = episode(&suite, "spatial_soft", 0, &[(shift, factor)]);
        assert_eq!(multiplied(&setup, factor), std::slice::from_ref(&target), "{shift}");
        let all = episode(&suite, "spatial_soft", 0, &[(&shift["target_".len()..], factor)]);
        assert!(multiplied(&all, factor).len() > 1, "{shift} of all objects");
    }
}

#[test]
fn perturbations_act_are_reproducible_and_leave_the_layout() {
    let suite = loaded("object_soft");
    let plain = episode(&suite, "object_soft", 6, &[]);
    let poses = |scene: &Scene| -> Vec<_> {
        scene.objects[..plain.scene.objects.len()].iter().map(|object| object.pose_w).collect()
    };
    for (shift, value) in [("camera", 2.0), ("distractors", 3.0), ("prompt", 2.0), ("light", 4.0 / 3.0)] {
        let setup = episode(&suite, "object_soft", 6, &[(shift, value)]);
        let again = episode(&suite, "object_soft", 6, &[(shift, value)]);
        assert!(setup.scene == again.scene && setup.prompt == again.prompt, "{shift} is reproducible");
        assert!(setup.scene != plain.scene || setup.prompt != plain.prompt, "{shift} acts");
        assert!(setup.nominal == plain.nominal && poses(&setup.scene) == poses(&plain.scene), "{shift}");
        assert_eq!(setup.scene.start_q, plain.scene.start_q, "{shift} leaves the stream of the arm");
        let both = episode(&suite, "object_soft", 6, &[("mass", 2.0), (shift, value)]);
        assert_eq!(both.scene.cameras, setup.scene.cameras, "{shift} does not depend on other shifts");
    }
    let moved = episode(&suite, "object_soft", 6, &[("camera", 2.0)]).scene;
    let [before, after] = [&plain.scene, &moved].map(|scene| scene.camera("third_person").expect("it").pose);
    assert!(((before.translation.vector - after.translation.vector).norm() - 0.02).abs() < 1e-9);
    assert!((before.rotation.angle_to(&after.rotation).to_degrees() - 2.0).abs() < 1e-6);
    assert_eq!(moved.camera("wrist"), plain.scene.camera("wrist"));
    let more = episode(&suite, "object_soft", 6, &[("distractors", 3.0)]).scene;
    assert_eq!(more.objects.len(), plain.scene.objects.len() + 3);
    let said = |value| episode(&suite, "object_soft", 6, &[("prompt", value)]).prompt;
    assert_eq!(plain.prompt, "pick up the soft cube and place it in the basket");
    assert_eq!(said(1.0), "put the soft cube in the basket");
    assert_eq!(said(2.0), "take the soft cube and set it down in the basket");
    assert_eq!(said(0.0), plain.prompt);
}

#[test]
fn a_twin_suite_has_the_initial_states_of_its_original() {
    for kind in ["object", "spatial"] {
        let (soft, twin) = (format!("{kind}_soft"), format!("{kind}_twin"));
        let (soft_suite, twin_suite) = (loaded(&soft), loaded(&twin));
        let original = episode(&soft_suite, &soft, 7, &[]);
        let rigid = episode(&twin_suite, &twin, 7, &[]);
        assert!(original.scene.clone().rigid_twin() == rigid.scene, "{twin}");
        assert_eq!(original.prompt, rigid.prompt);
        assert!(!rigid.scene.objects.iter().any(|object| matches!(object.asset.body, Body::Soft(_))));
        assert_eq!(rigid.seed, original.seed);
    }
}
