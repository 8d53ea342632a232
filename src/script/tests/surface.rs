//! The whole Lua interface, called wrongly: every declared method, field and function, with every kind of value.

use std::{collections::BTreeSet, fmt::Write, time::Duration};

use super::{Project, limits};
use crate::{
    Experiment,
    api::{self, shapes::SHAPES, visuals::MASKS},
    plan::options,
    schema::{Function, Record},
};
use softvt_common::episode_id::{EpisodeId, EpisodeSplit};

/// Makes an object of each class, calls everything with everything, and returns the messages.
const SCRIPT: &str = include_str!("surface.lua");

fn quoted<'a>(names: impl Iterator<Item = &'a str>) -> String {
    names.map(|name| format!("{name:?}")).collect::<Vec<_>>().join(", ")
}

fn names(functions: &'static [Function]) -> impl Iterator<Item = &'static str> {
    functions.iter().map(|function| function.signature.name)
}

fn script() -> String {
    let mut text = String::from("NAMES = {\n");
    for class in api::CLASSES {
        let methods = quoted(class.methods.iter().map(|method| method.name));
        let fields = quoted(class.fields.iter().map(|field| field.name));
        let _ = writeln!(
            text,
            "  [{:?}] = {{ methods = {{ {methods} }}, fields = {{ {fields} }} }},",
            class.name
        );
    }
    let constructors = api::constructors().map(Record::constructor);
    let functions = api::functions().map(|function| function.signature.name).chain(names(options::FUNCTIONS));
    let _ =
        writeln!(text, "}}\nFUNCTIONS = {{ {} }}", quoted(functions.chain(["sorted"]).chain(constructors)));
    let _ = writeln!(text, "SHAPES = {{ {} }}", quoted(names(SHAPES)));
    let _ = writeln!(text, "MASKS = {{ {} }}", quoted(names(MASKS)));
    text + SCRIPT
}

/// Text that belongs to the implementation.
fn leak(message: &str) -> Option<&'static str> {
    let words = [
        "::",
        "[f64",
        "[u8",
        "Option<",
        "Vec<",
        "userdata",
        "error converting",
        "stack traceback",
        "runtime error",
        "bad self",
        "mlua",
        "conversion",
        "Lua table",
        "panicked",
    ];
    let ours = [
        "LuaCamera",
        "LuaShape",
        "LuaMask",
        "LuaImage",
        "LuaPose",
        "LuaScene",
        "LuaObject",
        "LuaLight",
        "LuaMaterial",
        "LuaList",
        "LuaTactileFrame",
        "LuaMarkers",
        "LuaObservation",
    ];
    words.into_iter().chain(ours).find(|word| message.contains(word))
}

#[test]
fn wrong_calls_get_messages_in_terms_of_the_lua_interface() {
    let project = Project::new(&[("x.lua", &script())]);
    let minute = Duration::from_secs(60);
    let limits =
        crate::VmLimits { load: minute, call: minute, point: minute, memory_bytes: 128 << 20, ..limits() };
    let loaded = project.load_with("x.lua", &[], &limits).unwrap();
    let rows = Experiment::open(&loaded).unwrap().run(0).unwrap();
    let folder = format!("{}/", project.path("").display()).replace("//", "/");
    let mut wrong = Vec::new();
    for row in &rows {
        let text = |key: &str| row[key].as_str().unwrap_or_default();
        let (what, message) = (text("what"), text("message").replace(&folder, ""));
        if ["seen", "enough"].contains(&what) {
            continue;
        }
        let placed = message.strip_prefix("x.lua:").and_then(|rest| rest.split_once(": "));
        let placed = placed.is_some_and(|(line, _)| line.parse::<usize>().is_ok());
        if !placed || leak(&message).is_some() || text("kind") != "string" {
            wrong.push(format!("{what} → {message}"));
        }
    }
    assert!(wrong.is_empty(), "{} of {} are wrong:\n{}", wrong.len(), rows.len(), wrong.join("\n"));
    assert!(rows.len() > 2000, "{}", rows.len());
    let seen: BTreeSet<&str> = rows.last().unwrap()["message"].as_str().unwrap().split(' ').collect();
    let listed = api::CLASSES.iter().map(|class| class.name);
    let missing: Vec<&str> = listed.filter(|name| !seen.contains(name)).collect();
    assert_eq!(
        missing,
        [
            "softvt.Deformation",
            "softvt.Measurements",
            "softvt.TactileReading",
            "softvt.Lying",
            "softvt.WindowEnd",
            "softvt.SafeWindow",
            "softvt.Envelope",
            "softvt.Grip",
            "softvt.InstanceWindow",
            "softvt.InstanceState",
            "softvt.Instances",
            "softvt.List",
            "softvt.EpisodeBrief",
            "softvt.Observation",
            "softvt.Fingers",
            "softvt.Forces"
        ],
        "plain tables, and classes with tests of their own"
    );
}

/// Runs a layout for a scene with one ball and returns its error.
fn in_layout(text: &str) -> String {
    let whole = super::SUITE.replace("scene:add { name", &format!("{text} scene:add {{ name"));
    let project = Project::new(&[("x.lua", &(whole + "return suite()"))]);
    let loaded = project.load("x.lua", &[]).unwrap();
    let id = EpisodeId {
        suite: "test".into(),
        task: 0,
        episode: 0,
        base_seed: 0,
        split: EpisodeSplit::Validation,
    };
    let folder = format!("{}/", project.path("").display()).replace("//", "/");
    match crate::EpisodeSetup::open(&loaded, &id, &crate::SceneChanges::default()) {
        Ok(_) => String::new(),
        Err(error) => error.to_string().replace(&folder, ""),
    }
}

#[test]
fn lists_of_objects_are_live() {
    for text in [
        "scene.base[1] = 0.25 assert(scene.base[1] == 0.25)",
        "local b = scene.base b[1] = 0.5 scene.base = b assert(scene.base[1] == 0.5)",
        "local q = scene.start_q for i = 1, #q do q[i] = q[i] + 0.5 end scene.start_q = q assert(#q == 7 and scene.start_q[7] == q[7])",
        "scene.light.colour[2] = 0.5 assert(scene.light.colour[2] == 0.5)",
        "local n = 0 for i, x in ipairs(scene.gravity) do n = n + i * x end assert(n == 3 * -9.81)",
        "local n = 0 for i, x in pairs(scene.gravity) do n = n + i * x end assert(n == 3 * -9.81)",
        "local n = 0 for i, x in softvt.sorted(scene.gravity) do n = n + i * x end assert(n == 3 * -9.81)",
        "scene.gravity = { 0, 0, -1 } local x, y, z, more = table.unpack(scene.gravity) assert(z == -1 and more == nil)",
        "scene.gravity = { 1, 2, 3 } assert(table.concat(scene.gravity, ' ') == '1.0 2.0 3.0' and scene.gravity[4] == nil)",
        "assert(tostring(scene.gravity) == '{0, 0, -9.81}' and ('%s'):format(scene.gravity) == '{0, 0, -9.81}')",
        "scene.workspace_min = scene.base assert(scene.workspace_min[1] == scene.base[1])",
        "assert(softvt.pose { position = scene.base }.x == scene.base[1] and rng:choice(scene.base))",
        "assert(#scene.objects == 0 and #rng:shuffle(scene.objects) == 0)",
    ] {
        assert_eq!(in_layout(text), "", "{text}");
    }
}

#[test]
fn errors_of_read_only_lists_name_the_way_to_change_the_object() {
    let line = super::SUITE.lines().position(|line| line.contains("scene:add")).unwrap() + 1;
    for (text, expected) in [
        ("scene.base[1] = 'a'", "scene.base[1]: expected a number, got \"a\""),
        ("scene.base[1] = 0/0", "scene.base[1]: expected a number, got NaN, which is not a finite number"),
        ("scene.base[4] = 1", "scene.base: has places 1 to 3, got 4"),
        ("scene.base.x = 1", "scene.base: has places 1 to 3, got \"x\""),
        ("local _ = scene.base.x", "scene.base: expected a place in the list, 1 or more, got \"x\""),
        ("table.insert(scene.base, 1)", "scene.base: has places 1 to 3, got 4"),
        (
            "scene.light.colour = { 1, 0.5, 0.25 } scene.light.colour[1] = -1",
            "scene.light.colour[1]: expected a number in 0..20, got -1",
        ),
        ("scene.objects[1] = 3", "scene.objects: cannot be written; scene:add{…} adds an object"),
        (
            "scene:camera('wrist').quaternion[1] = 0",
            "scene:camera(\"wrist\").quaternion: cannot be written; its numbers belong together: write camera.quaternion = { w, x, y, z }",
        ),
        (
            "softvt.pose { position = { 0, 0, 0 } }.position[1] = 1",
            "pose.position: cannot be written; a pose never changes: make another with softvt.pose{…}, or with translated",
        ),
        (
            "scene.light = 'x'",
            "scene.light: cannot be replaced; its numbers are written one by one, as in scene.light.strength = …",
        ),
        ("scene.objects = {}", "scene.objects: is read-only"),
        ("scene.add = 1", "scene.add: is a method and cannot be written; call it as scene:add(…)"),
        (
            "scene.add {}",
            "scene:add: expected a softvt.Scene before the colon, got a table; call it as scene:add(…)",
        ),
        (
            "scene:camera('wrist'):look_at('abc')",
            "scene:camera(\"wrist\"):look_at: point: expected a list of 3 numbers in -100..100 (m, frame of the mount), got \"abc\"",
        ),
        (
            "scene:camera('wrist').quaternion = { 0, 0, 0, 0 }",
            "scene:camera(\"wrist\").quaternion: expected a quaternion, got one of length 0",
        ),
        (
            "softvt.pose { position = { 0, 0, 0 }, quaternion = { 1e-300, 0, 0, 0 } }",
            "softvt.pose.quaternion: expected a quaternion, got one of length 0",
        ),
        (
            "local _ = softvt.image { width = 1, height = 1, colour = { 0, 0, 0 } }.widht",
            "image: unknown key \"widht\"; did you mean \"width\"?",
        ),
        ("scene.base = { 1e300, 0, 0 }", "scene.base[1]: expected a number in -1000..1000, got 1e300"),
    ] {
        assert_eq!(in_layout(text), format!("x.lua:{line}: {expected}"), "{text}");
    }
}

#[test]
fn quaternions_and_directions_of_any_length_are_accepted() {
    for text in [
        "local c = scene:camera 'wrist' c.quaternion = { 1e200, 0, 0, 1e200 } assert(math.abs(c.quaternion[1] - 0.5 ^ 0.5) < 1e-12)",
        "assert(math.abs(softvt.pose { position = { 0, 0, 0 }, quaternion = { 0, 1e308, -1e308, 0 } }.quaternion[2]) > 0.7)",
        "local l = scene.light l.direction = { 1e308, 1e308, 0 } assert(math.abs(l.direction[1] - 0.5 ^ 0.5) < 1e-12)",
        "local l = scene.light l.direction = { 0, 3, 4 } assert(l.direction[2] == 3)",
    ] {
        assert_eq!(in_layout(text), "", "{text}");
    }
}
