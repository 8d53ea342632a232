//! Scales of objects, and suites whose objects vary from episode to episode.

use super::*;
use crate::load_variation;
use softvt_benchmark::Plan;
use softvt_evaluation::thresholds::ThresholdFile;
use softvt_scene::{HiddenProperties, Object};

const ASSETS: &str = include_str!("lua/varied_suite.lua");

fn project(rest: &str) -> Project {
    Project::new(&[("x.lua", &format!("{ASSETS}{rest}"))])
}

fn open(loaded: &LoadedScript, task: usize, episode: u32) -> Result<EpisodeSetup, ScriptError> {
    super::open(loaded, &EpisodeId { task, ..episode_id(episode, 3) })
}

fn opened(rest: &str) -> EpisodeSetup {
    open(&project(rest).load("x.lua", &[]).expect("a suite"), 0, 0).expect("an episode")
}

fn object<'a>(setup: &'a EpisodeSetup, name: &str) -> &'a Object {
    setup.scene.objects.iter().find(|object| object.name == name).expect("placed")
}

#[test]
fn an_object_is_placed_at_another_size() {
    let by_field = opened(
        "return suite(function(scene) scene:add { name = 'left', asset = soft, at = { 0, 0 }, scale = 1.2 }
           scene:add { name = 'right', asset = soft, at = { 0.2, 0 } } end)",
    );
    let by_property = opened(
        "return suite(function(scene) pair(scene, { uniform = function() return 0 end })
           local left = scene:object 'left'
           left.scale = 0.7
           left.youngs_pa = left.youngs_pa * 3
           left.scale = 1.2
           assert(left.scale == 1.2 and math.abs(left:mass() / scene:object('right'):mass() - 1.2 ^ 3) < 1e-9) end)",
    );
    let [first, second] = [&by_field, &by_property].map(|setup| object(setup, "left"));
    assert_eq!(first.asset.shape, second.asset.shape, "the last scale counts");
    assert!((first.asset.hints["grasp_height_m"] - 0.036).abs() < 1e-12);
    assert_eq!(first.nominal.fingerprint(), object(&by_field, "right").asset.fingerprint());
    assert_eq!((first.scale, second.youngs_factor()), (1.2, Some(3.0)));
}

#[test]
fn both_tasks_of_a_pair_vary_alike_and_the_two_instances_differ() {
    let project = project("return suite(pair, softvt.variation(ranges))");
    let loaded = project.load("x.lua", &[]).expect("a suite");
    let [first, second] = [0, 1].map(|task| open(&loaded, task, 4).expect("an episode"));
    assert_eq!(first.scene, second.scene);
    assert_eq!(first.variation, second.variation);
    let [left, right] = ["left", "right"].map(|name| object(&first, name));
    assert!(left.scale != right.scale && left.asset.visuals != right.asset.visuals);
    assert!(left.youngs_factor() != right.youngs_factor() && left.density_factor() != right.density_factor());
    assert_eq!(left.nominal, right.nominal);
    let drawn = first.variation.as_ref().expect("varied").objects["left"];
    assert_eq!((drawn.scale, Some(drawn.youngs_factor)), (left.scale, left.youngs_factor()));
    assert_eq!(first.nominal, first.scene, "deformation limits are those of the varied objects");
}

#[test]
fn draws_cover_their_ranges_and_leave_places_alone() {
    let project = project("return suite(pair, softvt.variation(ranges))");
    let loaded = project.load("x.lua", &[]).expect("a suite");
    let plain = self::project("return suite(pair)");
    let plain = plain.load("x.lua", &[]).expect("a suite");
    let (mut stiffness, mut sizes) = (Vec::new(), Vec::new());
    for episode in 0..200 {
        let [varied, same] = [&loaded, &plain].map(|loaded| open(loaded, 0, episode).expect("an episode"));
        assert_eq!(object(&varied, "left").pose_w, object(&same, "left").pose_w);
        assert_eq!(same.variation, None);
        assert_eq!(same.scene.lighting, softvt_scene::Lighting::default());
        let drawn = varied.variation.expect("varied");
        assert!((0.7..=1.4).contains(&drawn.light.strength));
        assert_eq!(
            drawn.cameras.keys().collect::<Vec<_>>(),
            ["third_person"],
            "the camera on the hand stays"
        );
        stiffness.extend(drawn.objects.values().map(|drawn| drawn.youngs_factor.log2()));
        sizes.extend(drawn.objects.values().map(|drawn| drawn.scale));
    }
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    assert!(stiffness.iter().all(|x| (-1.0..=1.0).contains(x)) && mean(&stiffness).abs() < 0.1);
    assert!(sizes.iter().all(|x| (0.9..=1.1).contains(x)) && (mean(&sizes) - 1.0).abs() < 0.01);
    let product: Vec<f64> = stiffness.iter().zip(&sizes).map(|(a, b)| a * (b - 1.0)).collect();
    assert!(mean(&product).abs() < 0.01, "stiffness and size are independent");
}

#[test]
fn a_range_changes_only_its_own_factor() {
    let with = |change: &str| {
        opened(&format!("{change} return suite(pair, softvt.variation(ranges))")).variation.expect("varied")
    };
    let (all, sized) = (with(""), with("ranges.size = { 1, 1 }"));
    for (name, drawn) in &all.objects {
        let other = sized.objects[name];
        assert_eq!(other.scale, 1.0);
        assert_eq!(softvt_scene::ObjectVariation { scale: drawn.scale, ..other }, *drawn);
    }
    assert_eq!((&all.cameras, all.light), (&sized.cameras, sized.light));
}

#[test]
fn the_standard_variation_applies_to_any_suite_of_soft_objects() {
    let standard = format!("{}/../../{}", env!("CARGO_MANIFEST_DIR"), crate::STANDARD_VARIATION);
    let (ranges, sources) = load_variation(std::path::Path::new(&standard)).expect("a variation");
    assert_eq!(sources.len(), 1);
    let project = project("return suite(pair)");
    let mut loaded = project.load("x.lua", &[]).expect("a suite");
    loaded.vary(&ranges).expect("it varies");
    let setup = open(&loaded, 0, 0).expect("an episode");
    assert_eq!(setup.variation.expect("varied").objects.len(), 2);
    let Plan::Suite(suite) = &loaded.plan else { panic!("a suite") };
    assert_eq!(suite.vary.as_ref(), Some(&ranges));
    let again = loaded.vary(&ranges).expect_err("it varies already");
    assert!(again.contains("suite test varies already"), "{again}");
}

/// Checks `experts.blind_grips` in Lua against a search over numbers and other instances.
const BLIND_GRIPS: &str = include_str!("lua/blind_grips.lua");

#[test]
fn controllers_without_touch_suit_most_instances_of_a_sample() {
    // It takes 0.2 s of processor time, and twice as much on other machines.
    let limits = VmLimits { load: Duration::from_secs(10), ..limits() };
    project(BLIND_GRIPS).load_with("x.lua", &[], &limits).unwrap_or_else(|error| panic!("{error}"));
}

/// A suite of the calibrated sphere with hidden properties, after a `change` of its ranges.
fn hidden(change: &str) -> Project {
    let suite = include_str!("lua/hidden_suite.lua");
    project(&format!("{suite} {change} return suite(placed(sphere), softvt.variation(ranges))"))
}

#[test]
fn hidden_properties_change_material_limit_and_surface_within_the_window() {
    let project = hidden("");
    let loaded = project.load("x.lua", &[]).expect("a suite");
    for episode in 0..20 {
        let setup = open(&loaded, 0, episode).expect("an episode");
        for (name, drawn) in &setup.variation.as_ref().expect("varied").objects {
            let (object, hidden) = (object(&setup, name), drawn.hidden.expect("hidden"));
            let near =
                |value: Option<f64>, expected: f64| (value.expect("soft") / expected - 1.0).abs() < 1e-9;
            // Drawn within 1.5 to 2.2 by the draw reference; the ratio stated is by the calibration.
            assert!((1.4..=2.4).contains(&hidden.window_ratio) && hidden.draws >= 1, "{hidden:?}");
            assert!(near(object.youngs_factor(), hidden.aeration.powi(2) * hidden.staling));
            assert!(near(object.density_factor(), hidden.aeration * hidden.filling));
            assert!(near(object.strain_factor(), hidden.staling.powf(-0.7)));
            let friction = object.asset.friction;
            assert_eq!((friction.static_mu, friction.coated), (hidden.coating, true));
            assert!((friction.dynamic_mu / friction.static_mu - 0.8).abs() < 1e-12);
        }
    }
}

#[test]
fn size_and_looks_do_not_depend_on_what_is_hidden() {
    let drawn = |change: &str| {
        let loaded = hidden(change).load("x.lua", &[]).expect("a suite");
        let setup = open(&loaded, 0, 7).expect("an episode");
        setup.variation.expect("varied").objects.into_values().collect::<Vec<_>>()
    };
    let (varied, plain) = (drawn(""), drawn("ranges.hidden = nil"));
    for (one, other) in varied.iter().zip(&plain) {
        assert_eq!((one.scale, one.colour), (other.scale, other.colour));
    }
    assert!(plain.iter().all(|one| one.hidden.is_none()));
}

/// Hidden properties of the objects of an episode, in the order of names.
fn hidden_of(setup: EpisodeSetup) -> Vec<HiddenProperties> {
    let objects = setup.variation.expect("varied").objects;
    objects.into_values().map(|drawn| drawn.hidden.expect("hidden")).collect()
}

#[test]
fn another_calibration_changes_the_stated_windows_and_no_draw() {
    let project = hidden("");
    let drawn = || -> Vec<HiddenProperties> {
        let loaded = project.load("x.lua", &[]).expect("a suite");
        (0..5).flat_map(|episode| hidden_of(open(&loaded, 0, episode).expect("an episode"))).collect()
    };
    let before = drawn();
    let path = "assets/calibration/sphere.json";
    let shipped = crate::embedded(path).expect("shipped");
    let mut other: serde_json::Value = serde_json::from_slice(shipped).expect("JSON");
    // A press with 1.3 times the force gives windows with 1.3 times the ratio.
    for variant in other["envelopes"]["sphere"]["variants"].as_array_mut().expect("presses") {
        for row in variant["rows"].as_array_mut().expect("rows") {
            row["force_n"] = (1.3 * row["force_n"].as_f64().expect("a force")).into();
        }
    }
    project.write(path, other.to_string().as_bytes());
    for (before, after) in before.into_iter().zip(drawn()) {
        assert!((after.window_ratio / before.window_ratio - 1.3).abs() < 1e-9, "{before:?} {after:?}");
        assert_eq!(HiddenProperties { window_ratio: before.window_ratio, ..after }, before);
    }
}

#[test]
fn instances_without_a_safe_grip_by_the_calibration_are_drawn() {
    let project = hidden("");
    let path = "assets/calibration/sphere.json";
    let text = std::str::from_utf8(crate::embedded(path).expect("shipped")).expect("UTF-8");
    let mut file = ThresholdFile::parse(text, path).expect("a calibration");
    let (mut none, kappa) = (file.envelopes["sphere"].clone(), file.calibration.kappa);
    none.holds.clear();
    file.insert("sphere", none.recomputed(kappa));
    project.write(path, file.to_text().as_bytes());
    let loaded = project.load("x.lua", &[]).expect("a suite");
    let drawn = hidden_of(open(&loaded, 0, 0).expect("an episode"));
    assert!(drawn.iter().all(|hidden| hidden.window_ratio == 1.0), "{drawn:?}");
}

#[test]
fn the_hidden_suites_draw_the_published_instances() {
    let drawn = |suite: &str| -> String {
        let project = Project::new(&[("x.lua", &format!("return require 'suites.{suite}'"))]);
        let limits = VmLimits { load: Duration::from_secs(10), ..limits() };
        let loaded = project.load_with("x.lua", &[], &limits).unwrap_or_else(|error| panic!("{error}"));
        let line = |task: usize| {
            let id = EpisodeId { suite: suite.to_owned(), task, ..episode_id(0, 0) };
            let setup = super::open(&loaded, &id).expect("an episode");
            let properties = hidden_of(setup).into_iter().map(|one| {
                let HiddenProperties { aeration, staling, filling, coating, draws, .. } = one;
                format!("aeration {aeration:.3} staling {staling:.3} filling {filling:.3} coating {coating:.3} draws {draws}")
            });
            properties.collect::<Vec<_>>().join(", ") + "\n"
        };
        (0..10).map(line).collect()
    };
    // They change only if the rule of the draws does, which makes published results incomparable.
    for suite in ["object_hidden", "spatial_hidden"] {
        insta::assert_snapshot!(suite, drawn(suite));
    }
}
