//! Conditions: what is printed of them, checked and listed.

use serde_json::Value;

use crate::support::{Project, Small};

/// The small suite with shifts, under the given conditions.
fn project(conditions: &str) -> Project {
    let small = Small { expert: "arm:close_to(1, { rate = 2 })", ..Small::default() };
    let shifts = "local shifts = require \"shifts\"\n";
    let declared = "shifts = shifts.soft, episodes = 2,";
    let text = small.text().replacen("episodes = 1,", declared, 1);
    let plan = format!(
        "return softvt.conditions {{ name = \"trial\", suites = {{ require \"suites.one\" }}, conditions = {{\n{conditions}\n}} }}\n"
    );
    Project::new(&[("suites/one.lua", &format!("{shifts}{text}")), ("suites/trial.lua", &plan)])
}

const THREE: &str = "{ name = \"heavy x2\", shift = { mass = 2 } },
  { name = \"same\", shift = { mass = 1, light = 0.5 } },
  { name = \"hard\", shift = { stiffness = 2 }, only = \"deformable\" },
  { name = \"weak\", set = { [\"robot.gripper.effort\"] = 3 } },";

#[test]
fn the_comparison_is_printed_as_a_table_and_as_json() {
    let project = project(THREE);
    let output = project.succeeds("suites/trial.lua --policy noop --out run");
    let (_, against) = output.out.split_once("change from the reference").expect("a second table");
    assert!(against.contains("95 % interval") && against.contains("\nheavy x2"), "{}", output.out);
    assert!(output.err.ends_with("run/conditions.json\n"), "{}", output.err);
    let printed = project.succeeds("suites/trial.lua --policy noop --out json --json").out;
    assert_eq!(project.json("json/conditions.json"), serde_json::from_str::<Value>(&printed).expect("JSON"));
}

#[test]
fn policies_are_printed_side_by_side() {
    let project = project("{ name = \"other\", policy = \"noop\" },");
    let printed = project.succeeds("suites/trial.lua --out run").out;
    assert!(printed.contains("controller") && !printed.contains("change from the reference"), "{printed}");
}

#[test]
fn conditions_are_checked_and_listed() {
    let project = project(THREE);
    let output = project.succeeds("check suites/trial.lua");
    assert!(output.out.contains("conditions: reference, heavy x2, same, hard, weak\n"), "{}", output.out);
    let output = project.succeeds("list suites --json");
    let rows: Value = serde_json::from_str(&output.out).expect("JSON");
    let row = |name: &str| rows.as_array().into_iter().flatten().find(|row| row["name"] == name).cloned();
    assert_eq!(row("all").map(|row| row["tasks"].clone()), Some(Value::from(60)));
    assert_eq!(row("trial").map(|row| row["conditions"].clone()), Some(Value::from(5)));
    for name in [
        "object_soft",
        "spatial_soft",
        "object_rigid",
        "spatial_rigid",
        "object_hidden",
        "spatial_hidden",
        "one",
    ] {
        assert!(row(name).is_some(), "{name}");
    }
    let shifts = row("shifts").expect("the standard conditions");
    assert_eq!(
        (&shifts["conditions"], &shifts["file"]),
        (&Value::from(10), &Value::from("suites/shifts.lua"))
    );
    assert!(project.succeeds("check suites/shifts.lua --suite one").out.contains("mass x1.75"));
}
