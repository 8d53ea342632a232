//! The whole Lua interface, called wrongly: every declared method, field and function, with every kind of value.

use std::{collections::BTreeSet, fmt::Write, time::Duration};

use super::{Project, limits};
use crate::{
    Experiment,
    api::{self, shapes::SHAPES, visuals::MASKS},
    plan::options,
    schema::{Function, Record},
};

/// Makes an object of each class, calls everything with everything, and returns the messages.
const SCRIPT: &str = include_str!("lua/surface.lua");

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
        let fields = quoted((class.fields)().iter().map(|field| field.name));
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
        ":: [f64 [u8 Option< Vec< userdata mlua conversion panicked",
        "LuaCamera LuaShape LuaMask LuaImage LuaPose",
        "LuaScene LuaObject LuaLight LuaMaterial LuaList LuaTactileFrame LuaMarkers LuaObservation",
    ];
    let phrases = ["error converting", "stack traceback", "runtime error", "bad self", "Lua table"];
    words.into_iter().flat_map(|words| words.split(' ')).chain(phrases).find(|word| message.contains(word))
}

#[test]
fn wrong_calls_get_messages_in_terms_of_the_lua_interface() {
    let project = Project::new(&[("x.lua", &script())]);
    let minute = Duration::from_secs(60);
    let limits =
        crate::VmLimits { load: minute, call: minute, point: minute, memory_bytes: 128 << 20, ..limits() };
    let loaded = project.load_with("x.lua", &[], &limits).unwrap();
    let rows = Experiment::open(&loaded).unwrap().run(0).unwrap();
    let mut wrong = Vec::new();
    for row in &rows {
        let text = |key: &str| row[key].as_str().unwrap_or_default();
        let (what, message) = (text("what"), project.shorten(text("message")));
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
    // Plain tables, and classes with tests of their own.
    let expected = "Deformation Measurements TactileReading Lying WindowEnd SafeWindow Envelope Grip InstanceWindow InstanceState \
                    Instances List EpisodeBrief Observation Fingers Forces";
    assert_eq!(missing.join(" ").replace("softvt.", ""), expected);
}
