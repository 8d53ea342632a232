//! Suites whose objects vary from episode to episode: records, names, reproducibility, and what is refused.

use serde_json::Value;

use crate::support::{Project, Small};

fn project() -> Project {
    Small::default().project()
}

fn drawn<'a>(episode: &'a Value, factor: &str) -> &'a Value {
    &episode["variation"]["objects"]["cube"][factor]
}

#[test]
fn records_have_the_drawn_numbers_and_the_suite_a_name_of_its_own() {
    let project = project();
    for (out, threads) in [("one", 1), ("two", 2)] {
        project.succeeds(&format!("x.lua --vary --episodes 3 --threads {threads} --out {out}"));
    }
    assert_eq!(project.text("one/episodes.jsonl"), project.text("two/episodes.jsonl"));
    let episodes = project.lines("one/episodes.jsonl");
    let scales: Vec<f64> = episodes.iter().map(|e| drawn(e, "scale").as_f64().expect("a number")).collect();
    assert!(scales.iter().all(|scale| (0.88..=1.12).contains(scale)), "{scales:?}");
    assert!(scales[0] != scales[1] && scales[1] != scales[2], "{scales:?}");
    assert!(episodes.iter().all(|episode| episode["suite"] == "one_varied"));
    let manifest = project.json("one/run.json");
    assert_eq!(manifest["variation"]["size"]["max"], 1.12);
    assert_eq!(manifest["suite"], "one");
    let replayed = project.succeeds("replay one 0/1");
    assert!(!replayed.out.is_empty());
}

#[test]
fn a_suite_without_variation_has_no_drawn_numbers() {
    let project = project();
    project.succeeds("x.lua --out run");
    let text = project.text("run/episodes.jsonl");
    assert!(text.contains(r#""suite":"one""#) && !text.contains("variation"), "{text}");
    assert!(project.json("run/run.json")["variation"].is_null());
}

#[test]
fn a_variation_in_a_file_replaces_the_standard_one() {
    let project = project();
    let ranges = r#"return softvt.variation { name = "small", size = { 0.5, 0.5 }, stiffness = { 2, 2 }, density = { 1, 1 },
        friction = { 1, 1 }, colour = 0, light = { 1, 1 }, camera_offset = 0, camera_rotation = 0 }"#;
    project.write("small.lua", ranges.as_bytes());
    project.succeeds("x.lua --vary=small.lua --out run");
    let episode = &project.lines("run/episodes.jsonl")[0];
    assert_eq!(
        (drawn(episode, "scale"), drawn(episode, "youngs_factor")),
        (&Value::from(0.5), &Value::from(2.0))
    );
    project.write("small.lua", ranges.replace("{ 2, 2 }", "{ 2, 1 }").as_bytes());
    let message = project.refusal("x.lua --vary=small.lua --out other");
    assert!(message.contains("small.lua:1") && message.contains("variation.stiffness"), "{message}");
}

#[test]
fn what_cannot_vary_is_refused_before_anything_runs() {
    let project = project();
    for (words, reason) in [
        ("suites/object_rigid.lua --vary", "suite object_rigid has object_type = \"rigid\""),
        ("suites/object_varied.lua --vary", "suite object_varied varies already"),
        ("scripts/imprints.lua --vary", "experiment"),
        ("x.lua --vary=nowhere.lua", "nowhere.lua"),
    ] {
        let message = project.refusal(&format!("{words} --out run"));
        assert!(message.contains("--vary") && message.contains(reason), "{words}: {message}");
    }
    assert!(!project.path("run").exists());
}

#[test]
fn conditions_may_name_a_built_in_policy() {
    let project = project();
    let plan = |policy: &str| {
        format!(
            "return softvt.conditions {{ name = \"trial\", suites = {{ require \"x\" }}, conditions = {{
               {{ name = \"other\", policy = \"{policy}\" }} }} }}"
        )
    };
    project.write("trial.lua", plan("noop").as_bytes());
    project.succeeds("trial.lua --out run");
    let policy = |folder: &str| project.lines(&format!("run/{folder}/episodes.jsonl"))[0]["policy"].clone();
    assert_eq!((policy("reference"), policy("other")), (Value::from("expert"), Value::from("noop")));
    assert_eq!(project.json("run/conditions.json")["suites"][0]["rows"][1]["policy"], "noop");
    let printed = project.succeeds("trial.lua --out other").out;
    assert!(printed.contains("controller") && !printed.contains("change from the reference"), "{printed}");
    project.write("trial.lua", plan("size-seen").as_bytes());
    let printed = project.succeeds("trial.lua --out blind").out;
    assert!(
        printed.contains("\nother *") && printed.contains("best without touch, one: other, Safety"),
        "{printed}"
    );
    project.write("trial.lua", plan("exprt").as_bytes());
    let message = project.refusal("trial.lua --out again");
    assert!(
        message.contains("condition \"other\": policy:") && message.contains("did you mean expert?"),
        "{message}"
    );
}

#[test]
fn an_expert_that_ignores_the_controller_is_refused_at_its_grasp() {
    let project = Small { expert: "arm:grasp(0.5)", ..Small::default() }.project();
    let message = project.refusal("x.lua --policy size-seen --out run");
    assert!(
        message.contains("x.lua:12") && message.contains("has no grip for --policy size-seen"),
        "{message}"
    );
    let expert = "local name = arm.grip_controller arm:note(\"length\", #name) arm:grasp(0.5)";
    let project = Small { expert, ..Small::default() }.project();
    project.succeeds("x.lua --policy contact-depth --out run");
    assert_eq!(project.lines("run/episodes.jsonl")[0]["notes"]["length"], 13.0);
    let manifest = project.json("run/run.json");
    assert_eq!((&manifest["privileged"], &manifest["policy"]), (&true.into(), &"contact-depth".into()));
}
