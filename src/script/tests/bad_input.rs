use std::sync::atomic::{AtomicUsize, Ordering};

use super::*;
use crate::{EpisodeSetup, SceneChanges};

#[test]
fn a_missing_file_is_named() {
    let error = load_with(&PathBuf::from("nowhere/x.lua"), &[], &limits()).unwrap_err().to_string();
    assert_eq!(
        error,
        "nowhere/x.lua: no such file; give the path of a Lua file; the standard suites are in suites/"
    );
    let hint = |path: &str| load_with(&PathBuf::from(path), &[], &limits()).unwrap_err().to_string();
    assert!(hint("object_sotf").ends_with("did you mean suites/object_soft.lua?"), "{}", hint("object_sotf"));
    assert!(
        hint("suites/brick.lua").ends_with("the standard suites are in suites/"),
        "{}",
        hint("suites/brick.lua")
    );
    assert!(error_of_folder().starts_with("suites: is a folder"));
}

fn error_of_folder() -> String {
    Project::new(&[("suites/x.lua", "")]).error("suites", &[])
}

#[test]
fn a_syntax_error_has_its_line() {
    assert_eq!(
        error_of("local a = 1\nlocal b = = 2\n"),
        "suites/x.lua:2: syntax error: unexpected symbol near '='"
    );
}

#[test]
fn a_runtime_error_has_its_line_and_no_traceback() {
    assert_eq!(
        error_of("local t = nil\n\nprint(t.x)"),
        "suites/x.lua:3: attempt to index a nil value (local 't')"
    );
    assert_eq!(error_of("error('oh', 0)"), "suites/x.lua:1: oh");
    assert_eq!(
        error_of("\nsoftvt.suit {}"),
        "suites/x.lua:2: softvt: unknown key \"suit\"; did you mean \"suite\"?"
    );
}

#[test]
fn an_error_object_is_described_without_its_address() {
    assert_eq!(
        error_of("\nerror({ code = 3, what = 'jam' })"),
        "suites/x.lua:2: error object {code = 3, what = \"jam\"}"
    );
    assert_eq!(error_of("error(nil)"), "suites/x.lua:1: error object nil");
}

#[test]
fn endless_loops_are_stopped_everywhere() {
    let expected = "suites/x.lua:1: the script ran for more than 0.3 s; look for an endless loop";
    assert_eq!(
        error_of("local i = 0\n\nwhile true do\n  i = i + 1\nend").replace(":4:", ":3:"),
        expected.replace(":1:", ":3:")
    );
    for text in [
        "while true do end",
        "while true do pcall(function() while true do end end) end",
        "local function f() return f() end f()",
        "local c = coroutine.wrap(function() while true do end end) c()",
        "local c = coroutine.wrap(function() while true do coroutine.yield() end end) while true do c() end",
        "while true do coroutine.resume(coroutine.create(function() while true do end end)) end",
        "while true do xpcall(function() while true do end end, function() while true do end end) end",
        "while true do local x <close> = setmetatable({}, { __close = function() while true do end end }) end",
        "local t = setmetatable({}, { __index = function(t, k) while true do end end }) return t.x",
        "table.sort({ 3, 2, 1 }, function() while true do end end)",
        "for _ in pairs(setmetatable({}, { __pairs = function() return function() return 1 end end })) do end",
        "string.gsub(('x'):rep(10), 'x', function() while true do end end)",
    ] {
        assert_eq!(error_of(text), expected, "{text}");
    }
}

#[test]
fn a_library_function_that_does_not_return_triggers_the_watchdog() {
    static BARKS: AtomicUsize = AtomicUsize::new(0);
    let project = Project::new(&[(
        "x.lua",
        "local s = ('a'):rep(1000)\nstring.find(s, ('a-'):rep(2) .. 'b')\nreturn 1",
    )]);
    let mut limits = limits();
    limits.load = Duration::from_millis(1);
    limits.on_stuck = Arc::new(|message| {
        assert!(
            message.contains("x.lua: the script called a library function that did not return"),
            "{message}"
        );
        BARKS.fetch_add(1, Ordering::SeqCst);
    });
    let start = std::time::Instant::now();
    let _ = project.load_with("x.lua", &[], &limits);
    assert!(start.elapsed() > Duration::from_millis(60), "the pattern is too easy: {:?}", start.elapsed());
    assert_eq!(BARKS.load(Ordering::SeqCst), 1);
}

#[test]
fn memory_is_limited() {
    let expected = "the script used more than its 16 MiB of memory; build smaller tables and strings, or keep fewer of them";
    for text in [
        "local t = {} for i = 1, 1e9 do t[i] = { i } end",
        "local s = 'x' while true do s = s .. s end",
        "return ('x'):rep(1 << 30)",
    ] {
        assert_eq!(error_of(text), format!("suites/x.lua: {expected}"), "{text}");
    }
}

#[test]
fn byte_code_is_refused() {
    let project = Project::new(&[]);
    project.write("x.lua", b"\x1bLua\x54\x00\x19\x93");
    assert_eq!(
        project.error("x.lua", &[]),
        "x.lua: is compiled byte code; only Lua source text is run; give the .lua file that it was compiled from"
    );
    assert_eq!(
        error_of("local f, message = load('\\27Lua') error(message, 0)"),
        "suites/x.lua:1: load: compiled byte code is refused; only Lua source text is run"
    );
    project.write("y.lua", b"return '\xff'");
    assert_eq!(project.error("y.lua", &[]), "y.lua:1: is not UTF-8 text; save the file as UTF-8");
}

#[test]
fn files_and_the_system_are_out_of_reach() {
    for name in
        ["io", "os", "debug", "package", "dofile", "loadfile", "collectgarbage", "string.dump", "warn"]
    {
        let read = if name.contains('.') { name.to_owned() } else { format!("rawget(_G, '{name}')") };
        let text = format!("error({read} == nil and 'gone' or 'here', 0)");
        assert_eq!(error_of(&text), "suites/x.lua:1: gone", "{name}");
    }
    assert_eq!(
        error_of("os.exit(0)"),
        "suites/x.lua:1: os is not available to scripts, which reach neither files nor the clock"
    );
    assert!(error_of("setmetatable({}, { __gc = function() end })").contains("__gc"));
}

#[test]
fn require_stays_inside_of_the_project() {
    let paths = "a module is named by words joined with dots, such as \"experts.pick_place\", and lies inside the \
                 project; paths are refused";
    for name in ["../secret", "..secret", "/etc/passwd", "a..b", "a/../../b", "C:\\x", ""] {
        let text = format!("require [[{name}]]");
        assert_eq!(error_of(&text), format!("suites/x.lua:1: require {name:?}: {paths}"));
    }
    let project = Project::new(&[("p/suites/x.lua", "require 'out'"), ("secret.lua", "return 1")]);
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(project.path("secret.lua"), project.path("p/suites/out.lua")).unwrap();
        let error = project.error("p/suites/x.lua", &[]);
        assert_eq!(
            error,
            "p/suites/x.lua:1: require \"out\": p/suites/out.lua is a link that leads out of the project"
        );
    }
}

#[test]
fn modules_are_found_and_circles_are_named() {
    let project = Project::new(&[
        ("suites/x.lua", "local a = require 'lib.a'\nassert(a.n == 1 and require 'lib.a' == a)\nrequire 'b'"),
        ("scripts/lib/a.lua", "return { n = 1 }"),
        ("suites/b.lua", "return require 'c'"),
        ("c.lua", "return require 'b'"),
    ]);
    assert_eq!(
        project.error("suites/x.lua", &[]),
        "c.lua:1: require \"b\": the modules require each other in a circle"
    );
    let missing = error_of("\nrequire 'nothing.here'");
    assert!(
        missing.starts_with("suites/x.lua:2: require \"nothing.here\": no nothing/here.lua in "),
        "{missing}"
    );
}

#[test]
fn a_wrong_table_is_reported_with_key_and_line() {
    let on =
        |rest: &str| error_of(&format!("\nsoftvt.on {{\n  object = 'a',\n  target = 'b',\n  {rest}\n}}"));
    assert_eq!(
        on("hold_s = '0.4'"),
        "suites/x.lua:5: task.goal.hold_s: expected seconds in 0..10, got \"0.4\""
    );
    assert_eq!(
        on("hold_s = 0 / 0"),
        "suites/x.lua:5: task.goal.hold_s: expected seconds in 0..10, got NaN, which is not a finite number"
    );
    assert_eq!(on("hold = 1"), "suites/x.lua:2: task.goal: unknown key \"hold\"; did you mean \"hold_s\"?");
    assert_eq!(
        on("[1] = 2"),
        "suites/x.lua:2: task.goal: unexpected entry [1]; the keys are object, target, hold_s"
    );
    assert_eq!(
        error_of("softvt.on { object = 'a' }"),
        "suites/x.lua:1: task.goal.target: missing; expected a string that is not empty"
    );
    assert_eq!(
        error_of("softvt.on 'a'"),
        "suites/x.lua:1: task.goal: expected a table of object, target, hold_s, got \"a\""
    );
}

#[test]
fn wrong_settings_are_named_with_their_line_and_a_close_name() {
    let message = |settings: &str| {
        error_of(&format!(
            "{SUITE}local tasks = suite().tasks\nreturn softvt.suite {{\n  name = 'a', object_type = 'deformable', \
             tasks_differ_in = 'spatial', tasks = tasks,\n  settings = {settings},\n}}"
        ))
    };
    let line = SUITE.lines().count() + 4;
    for (settings, expected) in [
        (
            "{ robot = { gripper = { kpp = 1 } } }",
            ": no setting \"robot.gripper.kpp\"; did you mean robot.gripper.kp?",
        ),
        (
            "{ nonsense = { a = 1 } }",
            ": no setting \"nonsense.a\"; the root has: physics, robot, criteria, tactile, cameras",
        ),
        ("{ physics = { dt = 'a' } }", ".physics.dt: expected a number, got \"a\""),
    ] {
        assert_eq!(message(settings), format!("suites/x.lua:{line}: suite.settings{expected}"));
    }
    assert!(
        message("{ physics = { dt = 0.4 } }").starts_with(&format!("suites/x.lua:{line}: suite.settings: "))
    );
}

#[test]
fn shapes_in_wrong_units_are_refused() {
    let message = |call: &str| {
        error_of(&format!("local box = softvt.shape.box {{ size = {{ 0.1, 0.04, 0.04 }} }}\nbox:{call}"))
    };
    for (call, expected) in [
        ("rotate { axis = 'z', angle = 90 }", "-6.2832..6.2832, got 90"),
        ("shell(2)", "suites/x.lua:2: shape:shell: a wall of 2 m fills the shape; lengths are in metres"),
        ("bend { along = 'x', towards = 'z', curvature = -60 }", "an arc of radius 0.016"),
        ("bend { along = 'x', towards = 'y', curvature = 40 }", "a script returns a plan"),
        ("shell(0.01)", "a script returns a plan"),
    ] {
        assert!(message(call).contains(expected), "{call}: {}", message(call));
    }
}

#[test]
fn ridges_whose_sides_are_too_steep_are_refused() {
    let message = |pitch: &str| {
        error_of(&format!(
            "softvt.shape.sphere {{ radius = 0.03 }}:ridges {{ pitch = {pitch}, height = -0.0015 }}"
        ))
    };
    let steep = "suites/x.lua:1: shape:ridges: ridges of 0.0015 m at a distance of 0.0001 m are too steep";
    assert!(message("1e-4").starts_with(steep), "{}", message("1e-4"));
    assert!(message("1e-3").contains("a script returns a plan"), "{}", message("1e-3"));
}

#[test]
fn an_unknown_field_of_a_standard_module_is_an_error_of_the_script() {
    let message = error_of("local shifts = require 'shifts'\nreturn shifts.sofd");
    assert_eq!(message, "suites/x.lua:2: shifts: unknown field \"sofd\"; did you mean \"soft\"?");
    let module = "local grasp = require 'experts.grasp'\ngrasp.own = 1\n\
                  for key in pairs(grasp) do if key == 'own' then error('added ' .. grasp.own) end end";
    assert_eq!(error_of(module), "suites/x.lua:3: added 1");
}

#[test]
fn a_prompt_of_several_lines_is_refused() {
    // A character that reverses what follows hides it as well.
    for (written, shown) in [("\\n", "\\n"), ("\\u{202E}", "\\u{202e}")] {
        let script = SUITE.replacen("prompt = ", &format!("prompt = 'a{written}' .. "), 1);
        assert_ne!(script, SUITE);
        let message = error_of(&format!("{script}return suite()"));
        assert!(
            message.contains(&format!("task.prompt: expected one line of text, got \"a{shown}")),
            "{message}"
        );
    }
}

#[test]
fn placements_of_the_standard_layouts_are_checked_at_the_line_of_the_script() {
    let message = |placements: &str| {
        let script = format!(
            "{SUITE}local arrange = require 'layouts.arrange'\nlocal plate = require 'assets.plate'\n\
             local s = suite()\ns.tasks[1].layout = softvt.layout('other', function(scene, rng)\n\
             arrange.add(scene, rng, {{ {placements} }}, 0.02)\nend)\nreturn s"
        );
        let project = Project::new(&[("suites/x.lua", &script)]);
        let loaded = project.load("suites/x.lua", &[]).expect("it loads");
        let folder = format!("{}/", project.path("").display()).replace("//", "/");
        let error =
            EpisodeSetup::open(&loaded, &episode_id(0, 1), &SceneChanges::default()).err().expect("an error");
        error.to_string().replace(&folder, "")
    };
    let line = SUITE.lines().count() + 5;
    for (placements, expected) in [
        (
            "{ name = 'a', asset = plate, at = { 0, 0, 0.2 } }",
            "objects[1].at: expected a list of 2 numbers, x and y",
        ),
        (
            "{ name = 'a', asset = plate, at = { 0, 0 }, position_range = -0.02 }",
            "objects[1].position_range: expected a number of 0 or more, got -0.02",
        ),
    ] {
        assert_eq!(message(placements), format!("suites/x.lua:{line}: arrange.add: {expected}"));
    }
}

#[test]
fn an_impossible_material_is_refused() {
    let soft = |rest: &str| error_of(&format!("softvt.soft {{ density = 200, {rest} }}"));
    assert_eq!(
        soft("youngs_pa = -1, poisson = 0.3"),
        "suites/x.lua:1: asset.body.youngs_pa: expected pascals above 0, got -1"
    );
    assert_eq!(
        soft("youngs_pa = 1e4, poisson = 0.5"),
        "suites/x.lua:1: asset.body.poisson: expected a number in 0..below 0.5, got 0.5"
    );
    assert!(
        error_of(
            "softvt.asset { name = 'a', shape = softvt.shape.sphere { radius = 1 }, body = softvt.static {}, \
             friction = { static_mu = 0.1 } }"
        )
        .contains("asset.friction: dynamic_mu 0.5 is above static_mu 0.1")
    );
    assert!(
        error_of("softvt.shape.sphere { radius = -1 }")
            .contains("shape.sphere.radius: expected metres above 0, got -1")
    );
    assert!(error_of("softvt.shape.box { size = { 1, 0, 1 } }").contains("half extent is 0"));
}

#[test]
fn a_cut_or_a_relief_that_changes_nothing_is_refused() {
    let of = |rest: &str| error_of(&format!("softvt.shape.box {{ size = {{ 0.04, 0.04, 0.04 }} }}:{rest}"));
    let ball = "softvt.shape.sphere { radius = 0.005 }";
    assert_eq!(
        of(&format!("subtract({ball}:translate(0, 0, 17))")),
        "suites/x.lua:1: shape:subtract: the other shape lies outside of this one, so that nothing is removed; lengths are in \
         metres"
    );
    assert_eq!(
        of("ridges { height = 0.003 }"),
        "suites/x.lua:1: shape:ridges: without a count, pitch or radial_pitch it adds nothing; give one"
    );
    let beside = format!("paint {{ material = 1, region = {ball}:translate(0.2, 0, 0) }}");
    assert!(of(&beside).starts_with("suites/x.lua:1: shape:paint: the region lies outside of the shape"));
    let masked = "mask = { axis = 'z', from = 4, to = 10 }";
    assert_eq!(
        of(&format!("ridges {{ height = 0.003, count = 8, {masked} }}")),
        "suites/x.lua:1: shape:ridges.mask: its weight is 0 on the whole shape, which reaches from -0.02 to 0.02 m along z"
    );
    assert!(
        of(&format!("bumps {{ height = 1e-3, radius = 1e-3, spacing = 4e-3, {masked} }}"))
            .contains("bumps.mask")
    );
}

#[test]
fn a_shift_whose_default_is_out_of_its_range_is_refused() {
    let of =
        |range: &str| error_of(&format!("softvt.shift {{ name = 's', {range}, apply = function() end }}"));
    assert_eq!(
        of("default = 1, min = 2"),
        "suites/x.lua:1: shift.default: 1 is outside of min and max; expected the value that changes nothing"
    );
    assert_eq!(
        of("default = 1, min = 3, max = 0.1"),
        "suites/x.lua:1: shift.min: 3 is above max, 0.1; swap them"
    );
}

#[test]
fn invalid_meshes_are_refused_with_their_file() {
    let tetrahedron = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\n";
    let project = Project::new(&[
        ("open.obj", tetrahedron),
        ("empty.obj", "v 0 0 0\n"),
        ("good.obj", &format!("{tetrahedron}f 2 3 4\n")),
        ("mesh.doc", ""),
    ]);
    let error = |file: &str| {
        project.write("x.lua", format!("error(tostring(softvt.mesh {{ file = '{file}' }}), 0)").as_bytes());
        project.error("x.lua", &[])
    };
    assert_eq!(
        error("open.obj"),
        "x.lua:1: softvt.mesh: open.obj: the mesh is open: 3 edges have a triangle on one side only; close its holes"
    );
    assert!(
        error("empty.obj").starts_with("x.lua:1: softvt.mesh: empty.obj: the mesh is empty"),
        "{}",
        error("empty.obj")
    );
    assert!(error("mesh.doc").contains("\"doc\" is not a supported mesh format"));
    assert!(error("../a.obj").contains("leads out of the project"));
    assert!(
        error("none.obj")
            .starts_with("x.lua:1: softvt.mesh.file: no file \"none.obj\" next to x.lua, nor in ")
    );
    assert_eq!(error("good.obj"), "x.lua:1: softvt.Shape");
}

#[test]
fn colours_of_mesh_files_are_those_of_assets_without_visuals() {
    let cube = "mtllib c.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\nvt 0 0\nusemtl a\n\
        f 4/1 3/1 2/1 1/1\nf 5/1 6/1 7/1 8/1\nf 1/1 2/1 6/1 5/1\nf 2/1 3/1 7/1 6/1\nf 3/1 4/1 8/1 7/1\nf 4/1 1/1 5/1 8/1\n";
    let asset = |more: &str| {
        format!(
            "return {{ asset = softvt.asset {{ name = 'c', shape = softvt.mesh {{ file = 'parts/c.obj', scale = 0.05 }}\n  \
             :grounded(), body = softvt.static {{}}, {more} }} }}"
        )
    };
    let project = Project::new(&[("parts/c.obj", cube)]);
    let error = |more: &str| {
        project.write("a.lua", asset(more).as_bytes());
        project.write("x.lua", b"softvt.fingerprint(require('a').asset)\nerror('fine', 0)");
        project.error("x.lua", &[])
    };
    assert!(error("").contains("c.mtl"), "{}", error(""));
    assert_eq!(error("visuals = { { albedo = { 1, 0, 0 } } }"), "x.lua:2: fine", "its own visuals");
    project.write("parts/c.mtl", b"newmtl a\nmap_Kd wood.png\n");
    assert!(error("").contains("no file \"parts/wood.png\""), "{}", error(""));
    project.write("parts/wood.png", b"not a picture");
    assert!(
        error("").contains("wood.png: ") && error("").contains("give a PNG or JPEG file"),
        "{}",
        error("")
    );
    let mut png = std::io::Cursor::new(Vec::new());
    image::RgbImage::new(3, 2).write_to(&mut png, image::ImageFormat::Png).expect("a PNG file");
    project.write("parts/wood.png", png.get_ref());
    assert_eq!(error(""), "x.lua:2: fine");
    project.write("parts/c.obj", cube.replace("c.mtl", "./c.mtl").as_bytes());
    project.write("parts/c.mtl", b"newmtl a\nmap_Kd .\\..\\parts\\wood.png\n");
    assert_eq!(error(""), "x.lua:2: fine");
    project.write("parts/c.mtl", b"newmtl a\nmap_Kd /home/me/wood.png\n");
    assert!(
        error("")
            .contains("parts/c.obj: \"/home/me/wood.png\" is an absolute path; name the file by its path"),
        "{}",
        error("")
    );
    project.write("parts/c.obj", cube.replace("usemtl a", "usemtl b").as_bytes());
    assert!(error("").contains("parts/c.obj: c.mtl has no material b; add it there"), "{}", error(""));
}

#[test]
fn meshes_are_searched_next_to_the_requesting_file() {
    let closed = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    let own = "return { shape = softvt.mesh { file = 'm.obj' } }";
    let project = Project::new(&[
        ("assets/a.lua", own),
        ("assets/m.obj", closed),
        ("assets/far/b.lua", own),
        ("assets/far/m.obj", &closed.replace("v 0 0 1", "v 0 0 2")),
        ("assets/lonely/c.lua", own),
        ("m.obj", &closed.replace("v 0 0 1", "v 0 0 3")),
        (
            "suites/x.lua",
            "local heights = {}\nfor _, name in ipairs { 'a', 'far.b', 'lonely.c' } do\n\
             local _, high = require('assets.' .. name).shape:bounds() heights[#heights + 1] = high[3] end\n\
             error(table.concat(heights, ' '), 0)",
        ),
    ]);
    assert_eq!(project.error("suites/x.lua", &[]), "suites/x.lua:4: 1.0 2.0 3.0");
}

#[test]
fn an_invalid_list_of_numbers_is_reported_with_the_wrong_entry() {
    let message = |list: &str| error_of(&format!("softvt.shape.box {{\n  size = {list}\n}}"));
    let at = "suites/x.lua:2: shape.box.size";
    for (list, expected) in [
        ("{ 1, 0 / 0, 1 }", "[2]: expected a number, got NaN, which is not a finite number"),
        ("{ 1, 1, 1 / 0 }", "[3]: expected a number, got inf, which is not a finite number"),
        ("{ 'a', 1, 1 }", "[1]: expected a number, got \"a\""),
        ("{ 1, 1 }", ": expected a list of 3 numbers (m), got a list of 2"),
        ("{ 1, 1, 1, 1 }", ": expected a list of 3 numbers (m), got a list of 4"),
        ("{ 1, 1, x = 1 }", ": expected a list of 3 numbers (m), got a table"),
        ("0 / 0", ": expected a list of 3 numbers (m), got NaN, which is not a finite number"),
    ] {
        assert_eq!(message(list), format!("{at}{expected}"), "{list}");
    }
}

#[test]
fn an_invalid_plan_is_reported_at_the_line_that_made_it() {
    let suite = |tasks: &str| {
        let project = Project::new(&[(
            "x.lua",
            &format!(
                "local layout = softvt.layout('l', function() end)\nlocal function task(prompt, goal)\n\
                 return softvt.task {{ prompt = prompt, layout = layout,\n  goal = goal }}\nend\n\
                 return softvt.suite {{ name = 's', object_type = 'rigid', tasks_differ_in = 'spatial',\n  tasks = {tasks} }}"
            ),
        )]);
        project.error("x.lua", &[])
    };
    let to = "softvt.on { object = 'a', target = 'b' }";
    assert_eq!(suite("{}"), "x.lua:7: suite.tasks: suite \"s\" has no tasks; give at least one");
    assert_eq!(
        suite(&format!("{{ task('p', {to}), task('q', {to}),\n task('p', {to}) }}")),
        "x.lua:3: task.prompt: tasks 0 and 2 of suite \"s\" are both \"p\" in the layout \"l\"; a policy could not distinguish them"
    );
    assert_eq!(
        suite(&format!(
            "{{ task('p', {to}), task('q',\n softvt.inside {{ object = 'a',\n\n target = 'a' }}) }}"
        )),
        "x.lua:10: task.goal.target: is \"a\", which is the object itself; name what it must reach"
    );
}

#[test]
fn a_script_must_return_a_plan() {
    let expected = "a script returns a plan (softvt.suite{…}, softvt.experiment{…} or a list of suites), got";
    assert_eq!(error_of("return 3"), format!("suites/x.lua: {expected} 3"));
    assert_eq!(error_of(""), format!("suites/x.lua: {expected} nothing"));
    assert_eq!(error_of("return {}"), format!("suites/x.lua: {expected} a table"));
}

#[test]
fn text_never_holds_an_address_and_pairs_has_one_order() {
    let text = "local t = {} for _, k in ipairs { 'z', 'b', 'q', 'a' } do t[k] = 1 end t[2] = 1 t[1] = 1 t[true] = 1\n\
                local keys = {} for k in pairs(t) do keys[#keys + 1] = tostring(k) end\n\
                error(table.concat(keys, ' ') .. tostring({}) .. tostring(print) .. ('%s'):format({}) \
                .. tostring(softvt.pose { position = { 0, 0, 0 } }) .. tostring(softvt.on { object = 'a', target = 'b' }), 0)";
    assert_eq!(
        error_of(text),
        "suites/x.lua:3: 1 2 a b q z truetablefunctiontablepose(0.0000, 0.0000, 0.0000)softvt.on"
    );
    assert!(error_of("string.format('%p', {})").contains("%p prints an address"));
}

#[test]
fn next_has_the_order_of_pairs_and_keys_without_an_order_are_refused() {
    let text = "local t = {} for i = 40, 1, -1 do t['k' .. i] = i end t[3] = 1 t[true] = 1\n\
                local first, second = {}, {} for k, v in pairs(t) do first[#first + 1] = tostring(k) .. v end\n\
                for k, v in next, t do second[#second + 1] = tostring(k) .. v if v == 7 then t[k] = nil end end\n\
                assert(#first == 42 and table.concat(first, ' ') == table.concat(second, ' '))\n\
                assert(next(t, 'k6') == 'k8' and next(t, 3) == 'k1' and next(t, true) == nil and next {} == nil)\n\
                local one = { [{}] = 1, a = 2 } local n = 0 for _, v in pairs(one) do n = 10 * n + v end assert(n == 21)\n\
                local two = { [{}] = 1, [print] = 2 }\n";
    let expected =
        "several keys are neither numbers, strings nor booleans, and have no order; keep a list of them";
    for name in ["pairs", "next"] {
        assert_eq!(error_of(&format!("{text}{name}(two)")), format!("suites/x.lua:8: {name}: {expected}"));
    }
    let missing = error_of("local t = { a = 1 }\nnext(t, 'b')");
    assert_eq!(missing, "suites/x.lua:2: next: the table has no such key");
}

#[test]
fn math_random_is_the_same_in_every_run() {
    let draw = || error_of("error(math.random() .. ' ' .. math.random(10) .. ' ' .. math.random(-3, 3), 0)");
    assert_eq!(draw(), draw());
    assert!(error_of("math.randomseed(1)").contains("--seed"));
    assert!(error_of("math.random(2, 1)").contains("the range 2..1 is empty"));
}
