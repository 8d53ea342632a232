//! `softvt dataset export`: its flags, and what it prints.

use crate::support::{Project, SOLIDS};

/// A rigid cube that a push moves to the middle of its shelf.
const SUITE: &str = r#"
local solids = require "solids"
local layout = softvt.layout("one", function(scene)
  scene:add { name = "floor", asset = solids.floor, position = { 0, 0, 0 } }
  scene:add { name = "shelf", asset = solids.shelf, position = solids.shelf_at }
  scene:add { name = "cube", asset = solids.cube, position = solids.cube_at }
end)
return softvt.suite { name = "one", object_type = "rigid", tasks_differ_in = "spatial", episodes = 1, tasks = {
  softvt.task { prompt = "wait", layout = layout, goal = softvt.on { object = "cube", target = "shelf" }, budget_steps = 30,
    expert = function(arm) solids.push(arm) arm:wait(1) end },
} }
"#;

#[test]
fn exports_are_printed_and_invalid_ones_refused() {
    let project = Project::new(&[("x.lua", SUITE), SOLIDS]);
    project.succeeds("record x.lua --demos 1 --out data --no-privileged --gripper two-width");
    let output = project.succeeds("dataset export data --format lerobot-v2.1 --out a --threads 1").out;
    assert!(output.starts_with("1 episode, ") && output.ends_with(" frames, 1 prompt: a\n"), "{output}");
    project.succeeds("dataset export data/ --format lerobot-v3.0 --gripper binary --task wait --out c/");
    let output = project.succeeds("dataset export data --format rlds --out r").out;
    assert!(output.starts_with("1 episode, ") && output.ends_with(" frames, 1 prompt: r\n"), "{output}");
    assert_eq!(project.json("r/softvt_one/1.0.0/softvt.json")["gripper"], "two-width");
    // The code of the recording, or the given one.
    let code = |out: &str| project.json(&format!("{out}/meta/softvt.json"))["gripper"].clone();
    assert_eq!((code("a"), code("c")), ("two-width".into(), "binary".into()));
    project.write("full/mine", b"mine");
    project.write("broken/recording.json", b"{}");
    for (words, output) in [
        ("data --format lerobot-v3.0 --out full", "full: it holds mine; nothing was written"),
        (
            "data --format lerobot-v3.0 --out x --gripper wide",
            "[possible values: continuous, binary, two-width, force]",
        ),
        ("data --format lerobot-v2.0 --out x", "[possible values: lerobot-v2.1, lerobot-v3.0, rlds]"),
        ("data --out x", "--format"),
        ("data --format lerobot-v2.1", "--out"),
        ("full --format lerobot-v2.1 --out x", "full: dataset.json: it is missing; expected the folder"),
        ("broken --format lerobot-v2.1 --out x", "broken: the recording was interrupted"),
    ] {
        let message = project.refusal(&format!("dataset export {words}"));
        assert!(message.contains(output), "{words}: {message}");
    }
    assert!(!project.path("x").exists() && !project.path("x.part").exists());
}
