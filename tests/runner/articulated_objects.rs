//! Articulated objects: experts that read joints, and forces of the pads on a handle.

use serde_json::Value;

use crate::support::Project;

#[test]
fn an_expert_sees_parts_and_joints() {
    let output = Project::of("open_chest.lua").run("x.lua").error();
    assert!(output.ends_with("x.lua:36: all seen"), "{output}");
}

/// Numbers of a list.
fn numbers(list: &Value) -> Vec<f64> {
    list.as_array().into_iter().flatten().filter_map(Value::as_f64).collect()
}

#[test]
fn pad_forces_are_the_normal_forces_at_all_contacts_of_a_pad() {
    let rows = Project::of("handle.lua").run("x.lua").rows();
    let text = serde_json::to_string(&rows).expect("JSON");
    assert!(!text.contains("[-0.0,"), "{text}");
    let case = |name: &str| rows.iter().find(|row| row["case"] == name).expect("both cases");
    for side in 0..2 {
        let row = case("grip");
        let force = numbers(&row["arm"])[side];
        assert!(force > 1.0, "both pads hold the bar: {row:?}");
        // Each pad touches the handle alone.
        assert_eq!(numbers(&row["handle"])[side], force, "{row:?}");
        assert_eq!(numbers(&row["on"])[side], force, "{row:?}");
        // The normals of a bar of 4.5 mm radius, 0.4 mm deep in the gel, are within 25° of the pressing direction.
        let pressing = -numbers(&row["gel"][side])[2];
        assert!(force >= pressing && force < 1.03 * pressing, "{row:?}");
    }
    let row = case("edge");
    let side =
        (0..2).max_by(|a, b| numbers(&row["arm"])[*a].total_cmp(&numbers(&row["arm"])[*b])).unwrap_or(0);
    let (force, gel) = (numbers(&row["arm"])[side], numbers(&row["gel"][side]));
    assert!(force > 1.0 && numbers(&row["on"])[side] == force, "{row:?}");
    // Without friction the force on the gel is the vector sum of the normal forces, here of nearly one direction.
    let resultant = gel.iter().map(|component| component * component).sum::<f64>().sqrt();
    assert!(resultant <= force && force < 1.02 * resultant, "{row:?}");
    // The direction is oblique: the component along the pad's axis is much smaller.
    assert!(force > 1.5 * -gel[2], "{row:?}");
}
