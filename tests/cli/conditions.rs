//! Conditions: what is printed of them, checked and listed.

use serde_json::Value;

use crate::support::fixtures::{CONDITIONS, conditions_project};

#[test]
fn the_comparison_is_printed_as_a_table_and_as_json() {
    let project = conditions_project(CONDITIONS, "deformable");
    let output = project.succeeds("suites/trial.lua --policy noop --out run");
    let (rows, legend) = output.out.split_once("Δ: ").expect("a legend");
    assert!(rows.contains("Δ Safety") && rows.contains("\nheavy x2"), "{}", output.out);
    assert!(legend.contains("change from the reference"), "{}", output.out);
    assert!(output.err.ends_with("run/conditions.json\n"), "{}", output.err);
    let printed = project.succeeds("suites/trial.lua --policy noop --out json --json").out;
    assert_eq!(project.json("json/conditions.json"), serde_json::from_str::<Value>(&printed).expect("JSON"));
}

#[test]
fn policies_are_printed_side_by_side() {
    let project = conditions_project("{ name = \"other\", policy = \"noop\" },", "deformable");
    let printed = project.succeeds("suites/trial.lua --out run").out;
    assert!(printed.contains("controller") && !printed.contains("change from the reference"), "{printed}");
}

#[test]
fn conditions_are_checked_and_listed() {
    let project = conditions_project(CONDITIONS, "deformable");
    let output = project.succeeds("check suites/trial.lua");
    assert!(output.out.contains("conditions: reference, heavy x2, same, hard, weak\n"), "{}", output.out);
    let output = project.succeeds("list suites --json");
    let rows: Value = serde_json::from_str(&output.out).expect("JSON");
    let row = |name: &str| rows.as_array().into_iter().flatten().find(|row| row["name"] == name).cloned();
    assert_eq!(row("trial").map(|row| row["conditions"].clone()), Some(Value::from(5)));
    let shifts = row("shifts").expect("the standard conditions");
    assert_eq!(
        (&shifts["conditions"], &shifts["file"]),
        (&Value::from(10), &Value::from("suites/shifts.lua"))
    );
    assert!(project.succeeds("check suites/shifts.lua --suite one").out.contains("mass x1.75"));
}
