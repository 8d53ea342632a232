//! `softvt check`: what it prints of valid scripts, its warnings and its messages.

use crate::support::{Project, Small};

#[test]
fn valid_suites_are_listed() {
    let output = Small::default().project().succeeds("check x.lua");
    assert_eq!(output.out, "suite one: 1 task, 1 episode each\n   0 wait: cube on post\nx.lua: OK\n");
}

#[test]
fn standard_suites_are_valid() {
    let output = Project::new(&[]).succeeds("check suites/all.lua");
    assert_eq!(output.out.matches(" tasks, ").count(), 6);
    assert!(!output.err.contains("warning"), "{}", output.err);
    for words in ["check suites/household.lua", "check suites/household.lua --rigid-twin"] {
        let output = Project::new(&[]).succeeds(words);
        assert!(!output.err.contains("warning"), "{}", output.err);
    }
}

#[test]
fn warnings_are_printed_and_errors_refused() {
    let light = Small { material: "youngs_pa = 40, poisson = 0.3, density = 0.3", ..Small::default() };
    let output = light.project().succeeds("check x.lua");
    assert!(output.err.contains("softvt: warning: x.lua:3: asset.body.youngs_pa: 40 Pa"), "{}", output.err);
    // Its post is out of reach.
    let of_post = Small::default().project().succeeds("check x.lua").err;
    assert!(
        of_post.contains("warning: object post: it is at (0, 2) m")
            && of_post.matches("warning").count() == 1
    );
    let short = Small { task: "budget_steps = 4", ..Small::default() }.project().succeeds("check x.lua").err;
    let expected = "task 0: the goal must hold for 0.4 s, and the budget is 0.2 s: no episode can reach it";
    assert!(short.contains(expected), "{short}");
    let sunk = Small { at: "position = { 0, 0.1, -0.012 }", ..Small::default() };
    assert_eq!(
        sunk.project().refusal("check x.lua"),
        "x.lua:6: objects cube and floor (placed at x.lua:5) overlap by 12 mm at the start; move them apart"
    );
}

#[test]
fn a_shape_that_a_script_does_not_use_is_a_warning() {
    let text = Small::default().text();
    let of = |line: &str| {
        let text = format!(
            "local shape = softvt.shape.box {{ size = {{ 1, 1, 1 }} }}\n{line}\nprint(shape:volume())\n{text}"
        );
        Project::new(&[("x.lua", &text)]).succeeds("check x.lua").err
    };
    let expected =
        "softvt: warning: x.lua:2: makes a shape that is not used; the methods of a shape return a new one";
    assert!(of("shape:translate(0, 0, 1)").contains(expected), "{}", of("shape:translate(0, 0, 1)"));
    assert!(!of("shape = shape:translate(0, 0, 1)").contains("a shape"));
}

#[test]
fn a_twin_of_a_rigid_suite_is_refused() {
    let text = Small::default().text().replace("\"deformable\"", "\"rigid\"");
    assert_eq!(
        Project::new(&[("x.lua", &text)]).refusal("check x.lua --rigid-twin"),
        "x.lua: --rigid-twin: has no effect on a suite of rigid objects; leave it out"
    );
}
