//! Usage errors, options of scripts, and help.

use insta::assert_snapshot;

use crate::support::{Project, SPATIAL_SOFT, Small};

fn small(words: &str) -> String {
    Small::default().project().refusal(&format!("x.lua --out run {words}"))
}

const WITH_OPTIONS: &str = r#"local opt = softvt.options {
  gap_mm = { default = { 48, 46 }, unit = "mm", min = 1, max = 60, help = "Distance of the pads" },
  shape = { default = "cube", choices = { "cube", "ball" }, help = "What is squeezed" },
  fast = { default = false, help = "Whether to hurry" },
}
return softvt.experiment { name = "e", options = opt, grid = { gap = opt.gap_mm },
  run = function(point) return { gap = point.gap, square = point.gap * point.gap } end,
  finish = function(rows) return { text = "rows: " .. #rows, files = { ["deep/rows.json"] = rows } } end }
"#;

fn with_options(words: &str) -> String {
    Project::new(&[("x.lua", WITH_OPTIONS)]).refusal(&format!("x.lua {words}"))
}

#[test]
fn unknown_policies_get_a_suggestion() {
    assert_snapshot!(small("--policy noob"), @r"
    x.lua: invalid value 'noob' for '--policy <POLICY>': expected expert, expert-binary, tactile-servo, fixed-closure, size-seen, contact-depth, one-force, one-force-for-all, drives, look-retry, weigh, noop, random, a Lua file such as my_policy.lua, a server such as ws://host:8000, or a run folder; did you mean noop?

    For more information, try '--help'.
    ");
}

#[test]
fn unknown_flags_get_a_suggestion() {
    assert_snapshot!(small("--polcy noop"), @r"
    x.lua: unexpected argument '--polcy' found

      tip: a similar argument exists: '--policy'

    Usage: softvt [OPTIONS] <FILE.lua>
           softvt <COMMAND>

    For more information, try '--help'.
    ");
    assert!(small("--frob 1").starts_with("x.lua: unexpected argument '--frob' found"));
}

#[test]
fn unknown_tasks_shifts_and_settings_are_reported() {
    assert_snapshot!(small("--task 7"), @r#"x.lua: --task 7: suite one has no such task; give an index below 1, or a part of a prompt such as "wait""#);
    let words = ["x.lua", "--out", "run", "--task", ""];
    let project = Small::default().project();
    let mut command = project.command("");
    command.args(words);
    assert!(
        crate::support::refusal(crate::support::run_command(command), "")
            .starts_with("x.lua: --task: expected an index")
    );
    assert!(small("--seed -1").contains("expected a whole number in 0..18446744073709551615"));
    assert!(small("--set physics.dt=0.02").contains("dt must divide 0.05 s"));
    assert_snapshot!(small("--shift stiffness=2"), @r#"x.lua: --shift: unknown shift "stiffness"; the suite declares none"#);
    assert_snapshot!(small("--shift stiffness"), @r#"x.lua: --shift: expected NAME=VALUE, got "stiffness""#);
    assert_snapshot!(small("--set robot.pad=1"), @r#"x.lua: --set: no setting "robot.pad"; did you mean robot.pads?"#);
    assert_snapshot!(small("--set robot.mass=1"), @r#"x.lua: --set: no setting "robot.mass"; robot has: arm, gripper, pads, ik, width_sensor, latency, disturbance"#);
    assert_snapshot!(small("--set robot.pads.static_mu=1 --set robot.pads.dynamic_mu=2"), @"x.lua: --set: robot.pads.dynamic_mu: expected a number in 0..1, got 2");
    let shift = Project::new(&[]).refusal(&format!("{SPATIAL_SOFT} --out run --shift stiffnes=2"));
    assert_snapshot!(shift, @r#"suites/spatial_soft.lua: --shift: unknown shift "stiffnes"; did you mean "stiffness"?"#);
}

#[test]
fn options_of_scripts_are_checked() {
    assert_snapshot!(with_options("--gap-mm=abc"), @r#"x.lua:1: option --gap-mm: expected numbers joined by commas in 1..60 (mm), got "abc""#);
    assert_snapshot!(with_options("--gap-mm 48,70"), @r#"x.lua:1: option --gap-mm: expected numbers joined by commas in 1..60 (mm), got "48,70""#);
    assert_snapshot!(with_options("--shape box"), @r#"x.lua:1: option --shape: expected one of cube, ball, got "box""#);
    assert_snapshot!(with_options("--fast=maybe"), @r#"x.lua:1: option --fast: expected on or off, got "maybe""#);
    assert!(with_options("--shap ball").contains("x.lua: unexpected argument '--shap' found"));
    assert!(with_options("--shap ball").contains("tip: a similar argument exists: '--shape'"));
}

#[test]
fn scripts_cannot_redefine_flags() {
    let project = Project::new(&[("x.lua", "softvt.options { seed = { default = 1 } }")]);
    assert_snapshot!(project.refusal("x.lua"), @"x.lua: the script declares the option --seed, which is a flag of softvt; rename it");
}

#[test]
fn help_lists_the_options_of_the_script() {
    let project = Project::new(&[("x.lua", WITH_OPTIONS)]);
    // Line breaks depend on the terminal.
    let help = project.succeeds("x.lua --help").out.split_whitespace().collect::<Vec<_>>().join(" ");
    for part in [
        "Options of the script:",
        "--gap-mm <NUMBER>",
        "Distance of the pads [numbers joined by commas in 1..60 (mm); default 48,46]",
        "What is squeezed [one of cube, ball; default \"cube\"]",
        "Whether to hurry [on or off; default off]",
        "--episodes <N>",
        "130 interrupted",
    ] {
        assert!(help.contains(part), "{part} is not in\n{help}");
    }
    assert!(!project.succeeds("--help").out.contains("Options of the script"));
}

#[test]
fn options_reach_rows_and_files() {
    let project = Project::new(&[("x.lua", WITH_OPTIONS)]);
    let output = project.succeeds("x.lua --gap-mm 3,4 --json --out made");
    assert_eq!(output.out, "{\"gap\":3.0,\"square\":9.0}\n{\"gap\":4.0,\"square\":16.0}\n");
    assert_eq!(project.json("made/deep/rows.json")[1]["square"], 16.0);
    let table = project.succeeds("x.lua --gap-mm=3,4 --fast --shape=ball --out again");
    assert_eq!(table.out, "gap  square\n  3       9\n  4      16\nrows: 2\n");
}
