//! Invalid scripts: exit code 2 and one message with file and line.

use insta::assert_snapshot;

use crate::support::{Project, Small};

#[test]
fn missing_files_are_named() {
    let project = Project::new(&[("suites/spatial_soft.lua", "")]);
    assert_snapshot!(project.refusal("none.lua"), @"none.lua: no such file; give the path of a Lua file; the standard suites are in suites/");
    assert_snapshot!(project.refusal("object_soft"), @"object_soft: no such file; did you mean suites/object_soft.lua?");
    assert_snapshot!(project.refusal("suites/spatial_sof.lua"), @"suites/spatial_sof.lua: no such file; did you mean suites/spatial_soft.lua?");
}

#[test]
fn errors_of_scripts_have_their_line() {
    let of = |text: &str| Project::new(&[("x.lua", text)]).refusal("x.lua");
    assert_snapshot!(of("return softvt.suite {\n  name = = 3\n}"), @"x.lua:2: syntax error: unexpected symbol near '='");
    assert_snapshot!(of("\n\nerror('my own words')"), @"x.lua:3: my own words");
}

#[test]
fn errors_of_scenes_and_experts_have_their_line() {
    let refusal = |small: Small| small.project().refusal("x.lua --out run");
    let fallen = refusal(Small { at: "position = { 0, 0.8, 0.1 }", ..Small::default() });
    assert!(
        fallen.starts_with("x.lua:6: layout one, episode 0: object cube fell out of the world"),
        "{fallen}"
    );
    let expert = refusal(Small { expert: "\n  arm:move_too()", ..Small::default() });
    assert_snapshot!(expert, @r#"x.lua: task 0, episode 0: x.lua:13: arm: unknown key "move_too"; did you mean "move_to"?"#);
}

#[test]
fn control_characters_of_scripts_are_escaped() {
    let text = Small { expert: "arm:give_up('wait\\27[2Jfor it')", ..Small::default() }.text();
    let project = Project::new(&[("x.lua", &format!("print('\\27]0;mine\\7')\n{text}"))]);
    let output = project.succeeds("x.lua --out run");
    assert!(
        !output.out.contains('\u{1b}') && !output.err.contains('\u{1b}'),
        "{} {}",
        output.out,
        output.err
    );
    assert!(
        output.out.contains("wait\\u{1b}[2Jfor it") && output.err.contains("\\u{1b}]0;mine\\u{7}"),
        "{}",
        output.err
    );
    project.write("x.lua", b"error('\\27[31mred')");
    assert!(project.refusal("x.lua").contains("\\u{1b}[31mred"));
}
