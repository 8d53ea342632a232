//! Pictures and videos that a user asks for.

use std::fs;

use crate::support::{Project, Small, refusal, said};

fn png_size(bytes: &[u8]) -> [u32; 2] {
    assert_eq!(&bytes[..8], b"\x89PNG\r\n\x1a\n");
    [16, 20].map(|at| u32::from_be_bytes(bytes[at..at + 4].try_into().expect("four bytes")))
}

/// Whether a picture is neither black nor one colour: it does not shrink to nothing.
fn shows_something(bytes: &[u8], [width, height]: [u32; 2]) -> bool {
    bytes.len() as f64 > 0.02 * f64::from(width * height)
}

fn short() -> Project {
    Small { task: "budget_steps = 4", ..Small::default() }.project()
}

#[test]
fn view_writes_stills_of_every_stream_and_a_video_and_the_same_ones_again() {
    let project = short();
    let said = project.succeeds("view x.lua --out seen");
    assert_eq!(said.out.lines().last(), Some("seen/episode.mp4"));
    assert_eq!(said.out.lines().count(), 3 * (2 * 3 + 2 * 3) + 2, "{}", said.out);
    for moment in ["start", "worst", "end"] {
        for (stream, size) in [
            ("third_person", [224, 224]),
            ("wrist", [224, 224]),
            ("tactile_left", [320, 240]),
            ("tactile_right_markers", [320, 240]),
            ("tactile_right_arrows", [320, 240]),
        ] {
            let bytes = fs::read(project.path(&format!("seen/{moment}_{stream}.png"))).expect("written");
            assert_eq!(png_size(&bytes), size, "{moment}_{stream}");
            assert!(shows_something(&bytes, size), "{moment}_{stream}: {} bytes", bytes.len());
        }
    }
    // The floor is 0.71 m below the camera and farther along most of its axes; the cube is object 2.
    let numbers = |name: &str| image::open(project.path(name)).expect("a picture").into_luma16().into_raw();
    let depth = numbers("seen/start_third_person_depth.png");
    assert!(depth.iter().all(|d| *d > 5000) && depth.iter().any(|d| *d < 12000), "tenths of a millimetre");
    let objects = numbers("seen/start_third_person_segmentation.png");
    assert!(objects.contains(&1) && objects.contains(&2) && objects.contains(&1000));
    let video = fs::read(project.path("seen/episode.mp4")).expect("written");
    assert_eq!(&video[4..8], b"ftyp");
    project.succeeds("view x.lua --out again");
    for line in said.out.lines() {
        let again = line.replace("seen/", "again/");
        assert!(
            fs::read(project.path(line)).expect("a file") == fs::read(project.path(&again)).expect("a file"),
            "{line}"
        );
    }
}

#[test]
fn native_stills_are_large() {
    let project = short();
    project.succeeds("view x.lua --native --policy noop --out seen");
    let size = |name: &str| png_size(&fs::read(project.path(name)).expect("written"));
    assert_eq!((size("seen/end_third_person.png"), size("seen/end_wrist.png")), ([1024, 1024], [512, 512]));
}

#[test]
fn a_run_draws_the_episodes_that_were_asked_for() {
    let project = short();
    let drawn = |flag: &str, out: &str| {
        project.succeeds(&format!("x.lua --episodes 2 {flag} --out {out}"));
        [0, 1].map(|e| project.path(&format!("{out}/video/task_000/episode_0000{e}.mp4")).exists())
    };
    assert_eq!(drawn("", "none"), [false, false]);
    assert_eq!(drawn("--video=1", "chosen"), [false, true]);
    assert_eq!(drawn("--video", "failed"), [true, true], "waiting is not safe");
    assert_eq!(drawn("--video=all", "all"), [true, true]);
    // Of what is not safe there is a still of the worst moment, as large as a picture of the video.
    let still = fs::read(project.path("failed/video/task_000/episode_00001.png")).expect("written");
    assert_eq!(png_size(&still), [1024, 1056]);
    assert!(shows_something(&still, [1024, 1056]));
    assert!(!project.path("chosen/video/task_000/episode_00000.png").exists());
    assert_eq!(
        project.text("none/episodes.jsonl"),
        project.text("all/episodes.jsonl"),
        "looking changes nothing"
    );
    let message = project.refusal("x.lua --video=some");
    assert!(message.contains("expected failed, all, or episodes such as 0,3"), "{message}");
}

#[test]
fn what_cannot_be_drawn_is_told() {
    let project = short();
    project.write("e.lua", b"return softvt.experiment { name = \"e\", grid = { a = { 1 } }, run = function() return { b = 1 } end }");
    let message = project.refusal("view e.lua --out seen");
    assert!(message.contains("e.lua: softvt view needs a single suite"), "{message}");
    let message = project.refusal("view x.lua --task 3 --out seen");
    assert!(message.contains("--task 3: suite one has no such task"), "{message}");
    let message = project.refusal("view x.lua");
    assert!(message.contains("--out <DIR>"), "{message}");
    project.write("file", b"");
    let message = project.refusal("view x.lua --out file");
    assert!(message.contains("cannot make the folder file"), "{message}");
}

/// The layout with a line added to its function.
fn with(line: &str) -> Project {
    let text = Small { task: "budget_steps = 4", ..Small::default() }.text();
    let text =
        text.replace("  scene:add { name = \"post\"", &format!("  {line}\n  scene:add {{ name = \"post\""));
    Project::new(&[("x.lua", &text)])
}

#[test]
fn light_cameras_and_looks_are_checked_where_they_are_written() {
    for (line, message) in [
        ("scene.light.strength = -1", "x.lua:7: scene.light.strength: expected a number in 0..1000, got -1"),
        ("scene.light.brightness = 1", "x.lua:7: scene.light: unknown key \"brightness\""),
        ("scene.light.direction = { 0, 0, 0 }", "scene.light.direction: expected a direction"),
        (
            "scene.light.direction = { 0, 0/0, 1 }",
            "x.lua:7: scene.light.direction[2]: expected a number, got NaN, which is not a finite number",
        ),
        ("scene:camera(\"wirst\").width = 64", "unknown camera \"wirst\"; did you mean \"wrist\"?"),
        (
            "scene:camera(\"wrist\").width = 0",
            "x.lua:7: scene:camera(\"wrist\").width: expected a whole number in 1..4096, got 0",
        ),
        (
            "scene:camera(\"wrist\").height = 100000",
            ".height: expected a whole number in 1..4096, got 100000",
        ),
        ("scene:camera(\"wrist\").position = { 0/0, 0, 0 }", ".position[1]: expected a number, got NaN"),
        (
            "scene:camera(\"wrist\").quat = { 0, 0, 0, 0 }",
            ".quat: expected a quaternion other than 0, got {0, 0, 0, 0}",
        ),
        (
            "scene:add_camera { name = \"top\", position = { 0, 0, 1 }, look_at = { 0, 0, 0 } }",
            "give another up",
        ),
        (
            "scene:add_camera { name = \"wrist\", position = { 0, 0, 1 }, look_at = { 1, 0, 0 } }",
            "there is a camera \"wrist\" already",
        ),
        (
            "scene:camera(\"wrist\"):look_at { 0, 0/0, 1 }",
            "x.lua:7: scene:camera(\"wrist\"):look_at: point[2]: expected a number, got NaN",
        ),
        (
            "scene:camera(\"wrist\"):look_at { 0, 1e7, 1 }",
            ":look_at: expected numbers within ±1e6, got {0, 10000000, 1}",
        ),
        ("scene.light = 3", "x.lua:7: scene.light: cannot be replaced; its numbers are written one by one"),
        ("scene:camera(\"wrist\"):look_at({ 0, 0, 1 }, { 0, 0, 0 })", "give another up"),
        ("scene:object(\"cube\").looks[1].albedo = { 2, 0, 0 }", "look.albedo: expected linear RGB in 0..1"),
        ("scene:object(\"cube\").looks[1].shine = 2", "look: unknown key \"shine\""),
    ] {
        let said = with(line).refusal("view x.lua --out seen");
        assert!(said.contains(message), "{line}\n{said}");
    }
}

#[test]
fn a_camera_inside_of_something_is_told_before_anything_runs_and_leaves_no_picture() {
    let told = "x.lua:7: camera mole: position: it is inside floor; move it out";
    let mole = "scene:add_camera { name = \"mole\", position = { 0, 0, -0.02 }, look_at = { 1, 0, -0.02 } }";
    let project = with(mole);
    for words in ["view x.lua --out seen", "x.lua --episodes 2 --video=all --out seen"] {
        let message = project.refusal(words);
        assert!(message.contains(told), "{message}");
        assert!(!project.path("seen").exists());
    }
    project.succeeds("x.lua --episodes 2 --out blind");
    let project = with("scene:camera(\"third_person\").position = { 0, 0.1, 0.02 }");
    let message = project.refusal("x.lua --video --out run");
    let told = "x.lua:7: camera third_person: position: it is inside cube; move it out";
    assert!(message.contains(told), "{message}");
    let project = with("scene:camera(\"wrist\").position = { 0, 0, 0.03 }");
    let message = project.refusal("view x.lua --out seen");
    assert!(message.contains("x.lua:7: camera wrist: position: it is inside"), "{message}");
}

#[test]
fn a_simulation_of_a_script_tells_of_a_camera_inside_of_something_where_it_was_put() {
    let mole = "scene:add_camera { name = \"mole\", position = { 0, 0, -0.02 }, look_at = { 1, 0, -0.02 } }";
    let text = with(mole).text("x.lua");
    let (layout, _) = text.split_once("return softvt.suite").expect("a suite");
    let run = "return softvt.experiment { name = \"e\", grid = { a = { 1 } }, run = function()\n\
               local sim = softvt.simulate { layout = layout }\nsim:see { camera = \"mole\" }\nreturn { b = 1 } end }";
    let message = Project::new(&[("x.lua", &format!("{layout}{run}"))]).refusal("x.lua");
    let told = "simulation:see: x.lua:7: camera mole: position: it is inside floor; move it out";
    assert!(message.contains(told), "{message}");
}

#[test]
fn what_gets_around_a_camera_in_an_episode_does_not_end_its_film() {
    // A block falls over it while the scene settles.
    let block = "local block = softvt.asset { name = \"block\", shape = softvt.shape.box { size = { 0.1, 0.1, 0.05 } }:grounded(), body = softvt.rigid { density = 300 } }";
    let lines = "scene:add { name = \"block\", asset = block, xyz = { 0.3, 0.1, 0.03 } } \
                 scene:add_camera { name = \"mole\", position = { 0.3, 0.1, 0.01 }, look_at = { -0.5, 0.1, 0.1 } }";
    let project = with(lines);
    project.write("x.lua", format!("{block}\n{}", project.text("x.lua")).as_bytes());
    project.succeeds("view x.lua --out seen");
    let bytes = fs::read(project.path("seen/end_mole.png")).expect("written");
    assert!(shows_something(&bytes, [224, 224]), "{} bytes", bytes.len());
}

#[test]
fn tables_of_a_tactile_model_that_are_missing_are_told_before_anything_runs() {
    let text = Small { task: "budget_steps = 4", ..Small::default() }.text();
    let settings = "settings = { tactile = { optics = { model = \"taxim\", tables = \"nowhere\" } } },";
    let text = text.replace("episodes = 1,", &format!("episodes = 1, {settings}"));
    let project = Project::new(&[("x.lua", &text)]);
    let message = project.refusal("x.lua --episodes 2 --out run");
    assert!(message.contains("x.lua: task 0, episode 0: tactile.optics.tables:"), "{message}");
    assert!(message.contains("nowhere"), "{message}");
    assert!(!project.path("run").exists());
}

#[test]
fn a_video_of_an_episode_that_is_not_run_is_an_error() {
    let project = short();
    let message = project.refusal("x.lua --episodes 2 --video=1,7 --out run");
    assert!(message.contains("x.lua: --video=7: suite one runs episodes 0 to 1 of each task"), "{message}");
    assert!(!project.path("run").exists());
}

#[test]
fn a_folder_without_a_name_is_an_error() {
    let project = short();
    for words in
        [["view", "x.lua", "--out", ""].as_slice(), &["x.lua", "--out", ""], &["x.lua", "--out", " "]]
    {
        let mut command = project.command("");
        command.args(words);
        let message = refusal(said(command), "--out");
        assert!(message.contains("--out: expected a folder"), "{message}");
    }
    assert_eq!(fs::read_dir(project.path("")).expect("a folder").count(), 1, "x.lua alone");
}

#[test]
fn light_camera_and_looks_change_the_picture() {
    let still = |line: &str| {
        let project = with(line);
        project.succeeds("view x.lua --out seen");
        fs::read(project.path("seen/end_third_person.png")).expect("written")
    };
    let plain = still("");
    assert!(plain == still("local _ = scene.light.strength"), "reading changes nothing");
    for line in [
        "scene.light.strength = 0.1 * scene.light.strength",
        "scene:camera(\"third_person\").fovy = 0.4",
        "scene:camera(\"third_person\"):look_at({ 0.1, 0.1, 0 })",
        "scene:object(\"cube\").looks[1].albedo = { 0.9, 0.1, 0.1 }",
    ] {
        assert!(plain != still(line), "{line}");
    }
}
