//! The press test of `scripts/calibrate.lua` on objects of the user.

use super::support::Project;

/// Arguments of a calibration that is as short as possible.
const QUICK: &str = "scripts/calibrate.lua --asset brick --step-mm 1 --within-mm 0.5";

/// A project with a small brick of coarse voxels, whose material has the given fields besides.
fn brick(material: &str) -> Project {
    let text = format!(
        "return softvt.asset {{\n  name = 'brick',\n  \
         shape = softvt.shape.box {{ size = {{ 0.04, 0.03, 0.024 }} }}:round(0.003):grounded(),\n  \
         body = softvt.soft {{ youngs_pa = 4e4, poisson = 0.3, density = 300, resolution = 4, grasp_spacing = 0.0015, {material} }},\n}}\n"
    );
    Project::new(&[("assets/brick.lua", &text)])
}

#[test]
fn the_limit_is_the_objects_own_and_its_calibration_repeats_bit_for_bit() {
    let project = brick("collapse_strain = 0.12, damage_strain = 0.3");
    let calibrated = |words: &str| {
        let output = project.succeeds(&format!("{QUICK} {words}"));
        assert!(
            output.out.contains("pressed until 5 % of the volume was beyond the stable strain 0.12"),
            "{}",
            output.out
        );
        ["json", "sweep.jsonl", "svg", "txt"]
            .map(|end| project.text(&format!("assets/calibration/brick.{end}")))
    };
    let first = calibrated("");
    let file: serde_json::Value = serde_json::from_str(&first[0]).expect("JSON");
    assert_eq!((&file["schema_version"], &file["calibration"]["protocol"]), (&2.into(), &"press".into()));
    let envelope = &file["envelopes"]["brick"];
    assert!(envelope["censored"].is_null(), "{envelope}");
    let number = |value: &serde_json::Value| value.as_f64().unwrap_or_else(|| panic!("a number: {value}"));
    let window = &envelope["window"];
    let extent = number(&window["width_lower_mm"]) - number(&window["width_at_tau_mm"]);
    assert!(extent > 0.2 && number(&envelope["width_contact_mm"]) <= 36.0, "{window}");
    assert!(number(&window["force_at_tau_n"]) > number(&window["force_lower_n"]), "{window}");
    assert!(project.text("scripts/calibrated.lua").contains("brick = { width_contact = "));
    assert_eq!(calibrated("--threads 2"), first);
    // The robot's settings do not enter.
    let message = project.refusal(&format!("{QUICK} --set robot.gripper.effort=20 --out again"));
    assert!(message.contains("simulates no robot") && message.contains("changes nothing"), "{message}");
}

#[test]
fn a_material_without_strains_is_calibrated_with_a_warning() {
    let output = brick("").succeeds(QUICK);
    assert!(output.out.contains("censored: the press ended early"), "{}", output.out);
    assert!(output.out.contains("State collapse_strain in its softvt.soft"), "{}", output.out);
}

#[test]
fn a_strain_out_of_range_and_an_empty_window_are_refused() {
    for (strain, got) in
        [("collapse_strain = 0", "0"), ("damage_strain = 1.5", "1.5"), ("damage_strain = -0.1", "-0.1")]
    {
        let message = brick(strain).refusal(QUICK);
        assert!(message.starts_with("assets/brick.lua:4: asset.body"), "{message}");
        assert!(message.contains("above 0") && message.ends_with(&format!("got {got}")), "{message}");
    }
    let message = brick("collapse_strain = 0.002").refusal(QUICK);
    assert!(
        message.contains("brick has no safe window: D passes τ at ") && message.contains("more friction"),
        "{message}"
    );
}
