//! Invalid scripts: one message with file and line.

use insta::assert_snapshot;

use crate::support::{Project, Small};

fn of(text: &str) -> String {
    Project::new(&[("x.lua", text)]).run("x.lua").error()
}

#[test]
fn syntax_errors_have_their_line() {
    assert_snapshot!(of("return softvt.suite {\n  name = = 3\n}"), @"x.lua:2: syntax error: unexpected symbol near '='");
}

#[test]
fn runtime_errors_have_their_line() {
    assert_snapshot!(of("local x\nreturn x.y"), @"x.lua:2: attempt to index a nil value (local 'x')");
    assert_snapshot!(of("\n\nerror('my own words')"), @"x.lua:3: my own words");
}

#[test]
fn a_script_without_a_plan_is_refused() {
    assert_snapshot!(of("return 3"), @"x.lua: a script returns a plan (softvt.suite{…}, softvt.experiment{…} or a list of suites), got 3");
}

#[test]
fn byte_code_is_refused() {
    let project = Project::new(&[]);
    project.write("x.lua", b"\x1bLua\x54\x00\x19\x93");
    assert_snapshot!(project.run("x.lua").error(), @"x.lua: is compiled byte code; only Lua source text is run; give the .lua file that it was compiled from");
    assert_snapshot!(of("local f, message = load('\\27Lua')\nerror(message)"), @"x.lua:2: load: compiled byte code is refused; only Lua source text is run");
}

#[test]
fn a_script_cannot_require_outside_of_its_project() {
    assert_snapshot!(of("\nreturn require '../secret'"), @r#"x.lua:2: require "../secret": a module is named by words joined with dots, such as "experts.pick_place", and lies inside the project; paths are refused"#);
    assert!(of("\nrequire 'nope'").starts_with("x.lua:2: require \"nope\": no nope.lua in "));
}

#[test]
fn excessive_memory_use_is_stopped() {
    let output = "the script used more than its 256 MiB of memory; build smaller tables and strings, or keep fewer of them";
    assert_eq!(of("local s = 'x'\nwhile true do s = s .. s end"), format!("x.lua: {output}"));
    assert_eq!(of("return ('x'):rep(1 << 30)"), format!("x.lua: {output}"));
}

#[test]
fn unknown_keys_get_a_suggestion() {
    let small = Small { material: "youngs_pa = 2e4, poisson = 0.3, densty = 300", ..Small::default() };
    assert_snapshot!(small.project().run("x.lua").error(), @r#"x.lua:3: asset.body: unknown key "densty"; did you mean "density"?"#);
}

#[test]
fn wrong_types_are_reported_with_the_expected_one() {
    let small = Small { task: "budget_steps = '40'", ..Small::default() };
    assert_snapshot!(small.project().run("x.lua").error(), @r#"x.lua:11: task.budget_steps: expected a whole number in 1..100000, got "40""#);
}

#[test]
fn impossible_materials_are_refused() {
    let with = |material| Small { material, ..Small::default() }.project().run("x.lua").error();
    assert_snapshot!(with("youngs_pa = -2e4, poisson = 0.3, density = 300"), @"x.lua:3: asset.body.youngs_pa: expected pascals above 0, got -20000");
    assert_snapshot!(with("youngs_pa = 2e4, poisson = 0.5, density = 300"), @"x.lua:3: asset.body.poisson: expected a number in 0..below 0.5, got 0.5");
    assert_snapshot!(with("youngs_pa = 2e4, poisson = 0.3, density = 0"), @"x.lua:3: asset.body.density: expected a number (kg/m³) above 0, got 0");
}

#[test]
fn open_meshes_are_refused() {
    let project = Small { shape: "softvt.mesh { file = 'm.obj' }", ..Small::default() }.project();
    project.write("m.obj", b"v 0 0 0\n");
    assert_snapshot!(project.run("x.lua").error(), @"x.lua:2: softvt.mesh: m.obj: the mesh is empty: it has no triangles; export a closed surface");
    project.write("m.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\n");
    assert_snapshot!(project.run("x.lua").error(), @"x.lua:2: softvt.mesh: m.obj: the mesh is open: 3 edges have a triangle on one side only; close its holes");
}
