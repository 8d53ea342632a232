//! `softvt dataset export`: its flags, and what it prints.

use crate::support::{Project, SOLIDS, fixtures::PUSHED_CUBE};

#[test]
fn exports_are_printed_and_invalid_ones_refused() {
    let project = Project::new(&[("x.lua", PUSHED_CUBE), SOLIDS]);
    project.succeeds("record x.lua --task 0 --demos 1 --out data --no-privileged --gripper two-width");
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
    let message = project.refusal("dataset export data --format lerobot-v3.0 --out full");
    assert!(message.contains("full: it holds mine; nothing was written"), "{message}");
}
