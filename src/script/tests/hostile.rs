//! Hostile scripts: each ends in one message, in bounded time and memory.

use std::sync::{
    Arc,
    atomic::{AtomicUsize, Ordering},
};

use super::*;
use crate::Experiment;
use softvt_common::episode_id::{EpisodeId, EpisodeSplit};

/// Runs `text` in an experiment; returns its rows as JSON, or the message.
fn run(text: &str) -> Result<String, String> {
    let project = Project::new(&[(
        "x.lua",
        &format!(
            "return softvt.experiment {{ name = 'e', grid = {{ a = {{ 1 }} }}, run = function()\n{text}\nend }}"
        ),
    )]);
    let folder = format!("{}/", project.path("").display()).replace("//", "/");
    let loaded = project.load("x.lua", &[]).map_err(|e| e.to_string().replace(&folder, ""))?;
    let rows =
        Experiment::open(&loaded).and_then(|e| e.run(0)).map_err(|e| e.to_string().replace(&folder, ""))?;
    Ok(serde_json::to_string(&rows).unwrap())
}

fn refused(text: &str, expected: &str) {
    let message = run(text).expect_err(text);
    assert!(message.starts_with("x.lua") && message.contains(expected), "{text}\n{message}");
}

#[test]
fn doubling_is_stopped_before_memory_is() {
    let doubled = |make: &str, how: &str| format!("local x = {make}\nfor i = 1, 64 do x = x:{how} end");
    let mask = "softvt.mask.weave { pitch_m = 1 }";
    let shape = "softvt.shape.sphere { radius = 1 }";
    refused(&doubled(mask, "intersect(x)"), "x.lua:3: mask: is made of 384 masks; at most 200 can be drawn");
    refused(&doubled(mask, "inverted():intersect(x:inverted())"), "x.lua:3: mask: is made of ");
    for how in [
        "union(x)",
        "smooth_union(x, 0.1)",
        "intersect(x)",
        "subtract(x)",
        "subtract(x, 0.1)",
        "paint { material = 1, region = x }",
    ] {
        refused(&doubled(shape, how), "x.lua:3: shape: ");
    }
    refused(
        &format!("local x = {shape}\nfor i = 1, 200 do x = x:round(0.1) end"),
        "x.lua:3: shape: is made of 101 shapes, 101 deep; at most 2000 and 100 can be evaluated",
    );
    refused(
        &format!("local x = {shape}\nfor i = 1, 20 do x = x:subtract({shape}) end"),
        "x.lua:3: shape: cuts or unions are nested too deeply",
    );
    let row = "local x = softvt.shape.sphere { radius = 1 } for i = 1, 300 do x = x:union(x.sphere) end";
    refused(row, "shape: unknown key \"sphere\"");
    assert!(run(&format!("local s = {shape} local x = s for i = 1, 300 do x = x:union(s):translate(0, 0, 0) end return {{ a = 1 }}")).is_err());
    assert!(
        run(&format!(
            "local s = {shape} local x = s for i = 1, 300 do x = x:union(s) end return {{ a = 1 }}"
        ))
        .is_ok()
    );
}

#[test]
fn memory_of_host_objects_is_limited_per_virtual_machine() {
    let hoard = |make: &str| format!("local kept = {{}}\nfor i = 1, 1e9 do kept[i] = {make} end");
    let full = "the script holds more than 512 MiB of images, shapes and masks; keep fewer or smaller ones";
    let image = "softvt.image { width = 4096, height = 4096, colour = { 0, 0, 0 } }";
    refused(&hoard(image), full);
    refused(&format!("local big = {image}\n{}", hoard("big:crop { 0, 0, 4096, 4096 }")), full);
    refused(
        "return softvt.image { width = 8192, height = 8192, colour = { 0, 0, 0 } }:resize(8191, 8192)",
        full,
    );
    refused(
        "softvt.image { width = 8192, height = 8192, colour = { 0, 0, 0 } }:text('a', { at = { 0, 9 }, colour = { 0, 0, 0 } })",
        full,
    );
    // Dropped objects release their memory, and virtual machines do not share a budget.
    let churn = format!("for i = 1, 40 do local p = {image} end return {{ a = 1 }}");
    std::thread::scope(|scope| {
        (0..2).for_each(|_| drop(scope.spawn(|| assert_eq!(run(&churn), Ok("[{\"a\":1}]".into())))));
    });
}

#[test]
fn memory_of_worlds_is_limited() {
    let full = "x.lua:3: the script holds more than 4096 MiB of worlds and simulations; keep fewer, or give bodies a lower resolution";
    let body = |resolution: u32| {
        format!(
            "softvt.world {{}}:soft {{ name = 'b', shape = softvt.shape.sphere {{ radius = 0.01 }}, position = {{ 0, 0, 0 }}, body = softvt.soft {{ youngs_pa = 1e4, poisson = 0.3, density = 300, grasp_spacing = 0.005, resolution = {resolution} }} }}"
        )
    };
    refused(&format!("local kept = {{}}\nfor i = 1, 1e9 do kept[i] = {} end", body(28)), full);
    let solids = "softvt.world {}:static { name = 's', shape = ball, position = { 0, 0, 0 } }";
    let hoard = format!(
        "local ball, world, kept = softvt.shape.sphere {{ radius = 1 }}, nil, {{}}\nfor i = 1, 20 do kept[i] = {solids} end return {{ a = 1 }}"
    );
    assert_eq!(run(&hoard), Ok("[{\"a\":1}]".into()));
    // Dropped worlds release their memory.
    let churn = format!("for i = 1, 12 do local body = {} end return {{ a = 1 }}", body(28));
    assert_eq!(run(&churn), Ok("[{\"a\":1}]".into()));
}

#[test]
fn endless_data_is_refused() {
    refused("local t = {} t.t = t return { a = t }", "tables are nested too deeply");
    refused(
        "local t = { 1 } for i = 1, 30 do t = { t, t } end return { a = t }",
        "the data has more than 1000000 values",
    );
    refused("local t = {} for i = 1, 1e5 do t = { t } end softvt.stable(t)", "softvt.stable");
    refused("return { depth = 1/0 }", "experiment.run: row.depth: expected a finite number, got inf");
    refused(
        "return { { a = 1 }, { b = { c = 0/0 } } }",
        "experiment.run: row.b.c: expected a finite number, got NaN",
    );
    refused(
        "return { a = softvt.pose { position = { 0, 0, 0 } } }",
        "experiment.run: row.a: expected data, got a softvt.Pose",
    );
    assert_eq!(
        run("return { a = softvt.pose { position = { 1, 2, 3 } }.position }"),
        Ok("[{\"a\":[1.0,2.0,3.0]}]".into())
    );
}

#[test]
fn printed_text_is_limited() {
    let printed = Arc::new(AtomicUsize::new(0));
    let (seen, project) = (
        printed.clone(),
        Project::new(&[(
            "x.lua",
            "for i = 1, 4e4 do print(('x'):rep(100)) end print(('x'):rep(4e6)) error('end', 0)",
        )]),
    );
    let limits = VmLimits {
        print: Arc::new(move |text| {
            seen.fetch_add(text.len(), Ordering::SeqCst);
        }),
        load: Duration::from_secs(20),
        ..limits()
    };
    assert!(project.load_with("x.lua", &[], &limits).unwrap_err().to_string().ends_with("x.lua:1: end"));
    assert!((1 << 19..(1 << 20) + 100).contains(&printed.load(Ordering::SeqCst)), "{printed:?}");
}

#[test]
fn changed_tables_are_checked_again() {
    let suite = |change: &str| {
        let project = Project::new(&[("x.lua", &format!("{SUITE}\nlocal s = suite() {change}\nreturn s"))]);
        project.error("x.lua", &[])
    };
    for (change, expected) in [
        (
            "s.tasks = nil",
            "suite.tasks: missing; expected a list of results of softvt.task{…} (changed after it was made)",
        ),
        (
            "s.tasks[1].prompt = 3",
            "task.prompt: expected a string that is not empty, got 3 (changed after it was made)",
        ),
        (
            "s.tasks[1].goal.hold_s = 'x'",
            "task.goal.hold_s: expected seconds in 0..10, got \"x\" (changed after it was made)",
        ),
        (
            "s.tasks[1].layout.build = 1",
            "layout.build: expected a function, fun(scene: softvt.Scene, rng: softvt.Rng), got 1 (changed after it was made)",
        ),
        (
            "s.tasks[1] = setmetatable({}, { __index = function() while true do end end })",
            "suite.tasks[1]: expected the result of softvt.task{…}, got a table (changed after it was made)",
        ),
    ] {
        assert_eq!(suite(change), format!("x.lua: {expected}"), "{change}");
    }
}

#[test]
fn changes_of_the_base_library_affect_only_the_script() {
    for text in [
        "tostring = nil print(1) return { a = 1 }",
        "string.format, table.unpack, pcall, error, setmetatable, pairs = nil for _ in ipairs {} do end return { a = 1 }",
    ] {
        assert_eq!(run(text), Ok("[{\"a\":1}]".into()), "{text}");
    }
    refused("setmetatable(softvt, {})", "cannot change a protected metatable");
    refused("getmetatable('').__index = nil return ('x'):rep(3)", "attempt to");
}

#[test]
fn errors_of_every_kind_end_in_a_line_of_text() {
    for (text, expected) in [
        (
            "string.format('%99999d', 1)",
            "x.lua:2: string.format: invalid conversion specification: '%99999d'",
        ),
        ("string.format('%d', 'x')", "x.lua:2: string.format: argument #2 (number expected, got string)"),
        (
            "error(setmetatable({}, { __tostring = function() while true do end end }))",
            "x.lua:2: the script ran for more than 0.3 s",
        ),
        ("error(setmetatable({}, { __tostring = function() error('again') end }))", "x.lua:2: again"),
        ("error(function() end)", "x.lua:2: error object a function"),
        ("error(softvt.pose { position = { 0, 0, 0 } })", "x.lua:2: pose(0.0000, 0.0000, 0.0000)"),
        ("coroutine.yield(1)", "x.lua:2: attempt to yield from outside a coroutine"),
        (
            "local function deep() return 1 + deep() end return deep()",
            "stack overflow|more than its 16 MiB of memory",
        ),
        ("local f f = function() return pcall(f) end local ok, m = f() error(m, 0)", "x.lua:2: true"),
        ("local s = ('x'):rep(100, ('y'):rep(1e9))", "the script used more than its 16 MiB of memory"),
        (
            "local function w(n) return coroutine.wrap(function() return w(n + 1) end)() end return w(0)",
            "x.lua:2: C stack overflow",
        ),
        ("local f f = function(s) return s:gsub('.', f) end f('x')", "x.lua:2: C stack overflow"),
        ("local _, m = load(('('):rep(1e5)) error('<' .. m .. '>')", "x.lua:2: <C stack overflow>"),
        (
            "local t = setmetatable({}, {}) getmetatable(t).__index = t return { a = t.x }",
            "x.lua:2: '__index' chain too long; possible loop",
        ),
        (
            "local _, m = pcall(softvt.pose, 3) error(m, 0)",
            "x.lua:2: softvt.pose: expected a table of position, yaw, quaternion, got 3",
        ),
        (
            "local _, m = pcall(softvt.pose, 3) error('so: ' .. m)",
            "x.lua:2: so: x.lua:2: softvt.pose: expected a table of position, yaw, quaternion, got 3",
        ),
    ] {
        let message = match run(text) {
            Ok(rows) => panic!("{text} gave {rows}"),
            Err(message) => message,
        };
        let plain =
            !["::", "userdata", "traceback", "softvt:", "0x", "\n"].iter().any(|word| message.contains(word));
        // Either of two limits may be reached first.
        let is_expected = expected.split('|').any(|part| message.contains(part));
        assert!(message.starts_with("x.lua") && is_expected && plain, "{text}\n{message}");
    }
}

#[test]
fn a_scene_holds_no_more_than_can_be_computed() {
    let crowd = SUITE.replace(
        "scene:add { name",
        "for i = 1, 1e6 do scene:add { name = 'b' .. i, asset = ball, position = { 0, 0, 0 } } end scene:add { name",
    );
    let project = Project::new(&[("x.lua", &(crowd + "return suite()"))]);
    let limits = VmLimits { call: Duration::from_secs(20), ..limits() };
    let loaded = project.load_with("x.lua", &[], &limits).unwrap();
    let id = EpisodeId {
        suite: "test".into(),
        task: 0,
        episode: 0,
        base_seed: 0,
        split: EpisodeSplit::Validation,
    };
    let error =
        crate::EpisodeSetup::open(&loaded, &id, &crate::SceneChanges::default()).map(|_| ()).unwrap_err();
    assert_eq!(error.message, "scene:add: a scene holds at most 1000 objects");
}

#[test]
fn a_file_that_never_ends_is_refused() {
    #[cfg(unix)]
    {
        let error = load_with(&PathBuf::from("/dev/zero"), &[], &limits()).unwrap_err().to_string();
        assert_eq!(error, "/dev/zero: cannot be read: is a pipe or a device, not a file");
    }
    let project = Project::new(&[("suites/x.lua", "require 'big'"), ("suites/big.lua", "")]);
    project.write("suites/big.lua", &vec![b' '; (64 << 20) + 1]);
    assert!(project.error("suites/x.lua", &[]).contains("suites/big.lua: is larger than 64 MiB"));
    project.write("suites/big.lua", b"return '\xff\xfe'");
    assert_eq!(
        project.error("suites/x.lua", &[]),
        "suites/big.lua:1: is not UTF-8 text; save the file as UTF-8"
    );
}

#[test]
fn texts_that_are_shared_are_counted_each_time() {
    let piece = "local n, piece = 0, ('local a = 1 '):rep(1e4)";
    let pieces = "load(function() n = n + 1 return n <= 100 and piece or nil end)";
    refused(&format!("{piece}\n{pieces}"), "x.lua:3: load: the text is longer than 1 MiB; load it in parts");
    refused("local text = ('-'):rep(2e6)\nload(text)", "x.lua:3: load: the text is longer than 1 MiB");
    assert_eq!(run("return { a = load('return 7')() }"), Ok("[{\"a\":7}]".into()));
    refused(
        "return { a = ('x'):rep(6e5), b = ('x'):rep(6e5) }",
        "experiment.run: a row has more than 1 MiB of text; return long texts as finish.files",
    );
    refused(
        "local row, rows = { a = ('x'):rep(1e6) }, {} for i = 1, 300 do rows[i] = row end return rows",
        "experiment.run: the rows have more than 256 MiB of text",
    );
    let long = SUITE.replace("prompt = \"lift the ball\"", "prompt = ('x'):rep(5000)");
    let message = error_of(&(long + "return suite()"));
    assert!(
        message.starts_with("suites/x.lua:13: task.prompt: expected a text of at most 4096 bytes, got \"xxx"),
        "{message}"
    );
    // A list of the same suite, whose tasks are all the same.
    let many = SUITE.replace("prompt = \"lift the ball\"", "prompt = ('x'):rep(4000)");
    let many = many
        .replace("tasks = { softvt.task {", "tasks = many(softvt.task {")
        .replace("    } },\n  }\nend", "    }),\n  }\nend");
    let many =
        format!("local function many(x) local t = {{}} for i = 1, 2000 do t[i] = x end return t end\n{many}");
    for result in ["return suite()", "return many(suite())"] {
        let project = Project::new(&[("x.lua", &format!("{many}{result}"))]);
        let limits = VmLimits { load: Duration::from_secs(20), memory_bytes: 64 << 20, ..limits() };
        let message = project.load_with("x.lua", &[], &limits).unwrap_err().to_string();
        let expected = match result {
            "return suite()" => "task.prompt: tasks 0 and 1 of suite \"test\" are both",
            _ => {
                "the script returns more than 64 MiB of tables and texts, where each counts as often as it is used"
            }
        };
        assert!(message.contains(expected) && message.contains("x.lua:1"), "{message}");
    }
}
