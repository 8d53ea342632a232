//! Files that cannot be read, and limits of time, memory and text that a fixture does not reach.

use std::sync::atomic::{AtomicUsize, Ordering};

use super::*;
use crate::{EpisodeSetup, Experiment, SceneChanges};

#[test]
fn a_missing_file_is_named() {
    let message = |path: &str| load_with(&PathBuf::from(path), &[], &limits()).unwrap_err().to_string();
    let standard = "the standard suites are in suites/";
    assert_eq!(
        message("nowhere/x.lua"),
        format!("nowhere/x.lua: no such file; give the path of a Lua file; {standard}")
    );
    assert!(message("object_sotf").ends_with("did you mean suites/object_soft.lua?"));
    assert!(message("suites/brick.lua").ends_with(standard));
    assert!(Project::new(&[("suites/x.lua", "")]).error("suites", &[]).starts_with("suites: is a folder"));
}

#[test]
fn byte_code_bytes_that_are_no_text_and_files_without_end_are_refused() {
    let project = Project::new(&[("big.lua", "require 'large'"), ("bytes.lua", "require 'y'")]);
    project.write("x.lua", b"\x1bLua\x54\x00\x19\x93");
    project.write("y.lua", b"return '\xff'");
    project.write("large.lua", &vec![b' '; (64 << 20) + 1]);
    let is_byte_code =
        "is compiled byte code; only Lua source text is run; give the .lua file that it was compiled from";
    assert_eq!(project.error("x.lua", &[]), format!("x.lua: {is_byte_code}"));
    for file in ["y.lua", "bytes.lua"] {
        assert_eq!(project.error(file, &[]), "y.lua:1: is not UTF-8 text; save the file as UTF-8");
    }
    assert!(project.error("big.lua", &[]).contains("large.lua: is larger than 64 MiB"));
    #[cfg(unix)]
    {
        let error = load_with(&PathBuf::from("/dev/zero"), &[], &limits()).unwrap_err().to_string();
        assert_eq!(error, "/dev/zero: cannot be read: is a pipe or a device, not a file");
    }
}

#[cfg(unix)]
#[test]
fn a_link_that_leads_out_of_the_project_is_refused() {
    let project = Project::new(&[("p/suites/x.lua", "require 'out'"), ("secret.lua", "return 1")]);
    std::os::unix::fs::symlink(project.path("secret.lua"), project.path("p/suites/out.lua")).unwrap();
    assert_eq!(
        project.error("p/suites/x.lua", &[]),
        "p/suites/x.lua:1: require \"out\": p/suites/out.lua is a link that leads out of the project"
    );
}

#[test]
fn images_of_mesh_files_are_found_beside_them_by_either_kind_of_path() {
    let mesh = "mtllib ./c.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\nusemtl a\n\
                f 1/1 3/1 2/1\nf 1/1 2/1 4/1\nf 1/1 4/1 3/1\nf 2/1 3/1 4/1\n";
    let script = "local shape = softvt.mesh { file = 'parts/c.obj', scale = 0.05 }
        softvt.fingerprint(softvt.asset { name = 'c', shape = shape, body = softvt.static {} }) error('fine', 0)";
    let project = Project::new(&[("parts/c.obj", mesh), ("x.lua", script)]);
    let mut png = std::io::Cursor::new(Vec::new());
    image::RgbImage::new(3, 2).write_to(&mut png, image::ImageFormat::Png).expect("a PNG file");
    project.write("parts/wood.png", png.get_ref());
    for path in ["wood.png", ".\\..\\parts\\wood.png"] {
        project.write("parts/c.mtl", format!("newmtl a\nmap_Kd {path}\n").as_bytes());
        assert_eq!(project.error("x.lua", &[]), "x.lua:2: fine", "{path}");
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
fn deep_recursion_ends_at_one_of_two_limits() {
    let message = error_of("local function deep() return 1 + deep() end return deep()");
    assert!(
        message.contains("stack overflow") || message.contains("more than its 16 MiB of memory"),
        "{message}"
    );
}

#[test]
fn virtual_machines_do_not_share_a_budget_of_memory() {
    let text = "return softvt.experiment { name = 'e', grid = { a = { 1 } }, run = function()
        for i = 1, 40 do local p = softvt.image { width = 4096, height = 4096, colour = { 0, 0, 0 } } end
        return { a = 1 } end }";
    let project = Project::new(&[("x.lua", text)]);
    let loaded = project.load("x.lua", &[]).unwrap();
    let run = || assert_eq!(Experiment::open(&loaded).unwrap().run(0).unwrap()[0]["a"], 1);
    std::thread::scope(|scope| (0..2).for_each(|_| drop(scope.spawn(run))));
}

#[test]
fn printed_text_is_limited() {
    let printed = Arc::new(AtomicUsize::new(0));
    let seen = printed.clone();
    let text = "for i = 1, 4e4 do print(('x'):rep(100)) end print(('x'):rep(4e6)) error('end', 0)";
    let limits = VmLimits {
        print: Arc::new(move |text| {
            seen.fetch_add(text.len(), Ordering::SeqCst);
        }),
        load: Duration::from_secs(20),
        ..limits()
    };
    let error = Project::new(&[("x.lua", text)]).load_with("x.lua", &[], &limits).unwrap_err();
    assert!(error.to_string().ends_with("x.lua:1: end"));
    assert!((1 << 19..(1 << 20) + 100).contains(&printed.load(Ordering::SeqCst)), "{printed:?}");
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
    let error =
        EpisodeSetup::open(&loaded, &episode_id(0, 0), &SceneChanges::default()).err().expect("an error");
    assert_eq!(error.message, "scene:add: a scene holds at most 1000 objects");
}

#[test]
fn texts_that_are_shared_are_counted_each_time() {
    // A list of the same suite, whose tasks are all the same.
    let many = SUITE
        .replace("prompt = \"lift the ball\"", "prompt = ('x'):rep(4000)")
        .replace("tasks = { softvt.task {", "tasks = many(softvt.task {")
        .replace("    } },\n  }\nend", "    }),\n  }\nend");
    let many =
        format!("local function many(x) local t = {{}} for i = 1, 2000 do t[i] = x end return t end\n{many}");
    for (result, expected) in [
        ("return suite()", "task.prompt: tasks 0 and 1 of suite \"test\" are both"),
        (
            "return many(suite())",
            "the script returns more than 64 MiB of tables and texts, where each counts as often as it is used",
        ),
    ] {
        let project = Project::new(&[("x.lua", &format!("{many}{result}"))]);
        let limits = VmLimits { load: Duration::from_secs(20), memory_bytes: 64 << 20, ..limits() };
        let message = project.load_with("x.lua", &[], &limits).unwrap_err().to_string();
        assert!(message.contains(expected) && message.contains("x.lua:1"), "{message}");
    }
}

#[test]
fn a_calibration_is_read_when_the_plan_is_made_and_no_later() {
    let late = "local none = softvt.calibration 'absent'
        return softvt.experiment { name = 'e', grid = { a = { 1 } }, run = function()
        return { none = tostring(none), late = pcall(softvt.calibration, 'sphere') and 'given' or 'refused' } end }";
    let project = Project::new(&[("x.lua", late)]);
    let loaded = project.load("x.lua", &[]).expect("loads");
    // A file that was absent stays absent in later virtual machines, even if it exists by then.
    project.write("assets/calibration/absent.json", b"{}");
    let rows = Experiment::open(&loaded).expect("opens").run(0).expect("a row");
    assert_eq!(
        (&rows[0]["none"], &rows[0]["late"]),
        (&"nil".into(), &"refused".into()),
        "requested too late"
    );
}
