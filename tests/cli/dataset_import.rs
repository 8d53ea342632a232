//! `softvt dataset import`: what it prints, and how its datasets are checked.

use crate::support::{Project, SOLIDS, fixtures::PUSHED_CUBE};

/// A project with a dataset of two demonstrations of task 0.
fn recorded() -> Project {
    let project = Project::new(&[("x.lua", PUSHED_CUBE), SOLIDS]);
    project.succeeds("record x.lua --task 0 --demos 2 --out data --images video --no-privileged");
    project
}

const OWN: &str = "data/hdf5/one_task0_demo.hdf5";

#[test]
fn imports_are_printed_and_checked() {
    let project = recorded();
    let line = format!("dataset import x.lua {OWN} --out again --images video");
    let output = project.succeeds(&line);
    assert!(output.err.contains("one_task0_demo.hdf5: softvt, 2 demonstrations"), "{}", output.err);
    let checked = project.succeeds("dataset check again --replay all").out;
    assert!(checked.contains("2 of 2 byte-identical, 2 of 2 reach the goal"), "{checked}");
    assert!(project.succeeds("replay again/attempts/one 0/1").out.contains("byte-identical"));
    let once_more = project.succeeds(&line);
    assert!(once_more.err.contains("is already complete"), "{}", once_more.err);
    project
        .succeeds(&format!("dataset import x.lua {OWN} --out layout --images video --ignore-recorded-poses"));
    let message = project.refusal(&format!("dataset import x.lua {OWN} --task 7 --out new"));
    assert!(message.contains("--task 7: suite one has no such task"), "{message}");
    for data in ["data", OWN] {
        let output = project.refusal(&format!("x.lua --policy {data} --out run"));
        assert!(output.contains("is a dataset, not a policy"), "{output}");
    }
}
