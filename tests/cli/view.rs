//! Images and videos of episodes.

use std::fs;

use crate::support::{Project, Small, refusal, run_command};

fn png_size(bytes: &[u8]) -> [u32; 2] {
    assert_eq!(&bytes[..8], b"\x89PNG\r\n\x1a\n");
    [16, 20].map(|at| u32::from_be_bytes(bytes[at..at + 4].try_into().expect("four bytes")))
}

/// True if an image is neither black nor of one colour: its file does not compress to almost nothing.
fn shows_something(bytes: &[u8], [width, height]: [u32; 2]) -> bool {
    bytes.len() as f64 > 0.02 * f64::from(width * height)
}

fn short() -> Project {
    Small { task: "budget_steps = 4", ..Small::default() }.project()
}

#[test]
fn view_writes_identical_stills_and_video_each_time() {
    let project = short();
    let output = project.succeeds("view x.lua --out seen");
    assert_eq!(output.out.lines().last(), Some("seen/episode.mp4"));
    let lines: Vec<&str> = output.out.lines().collect();
    assert!(lines[0].starts_with("○ goal missed: D ") && lines[1] == "seen/index.html", "{}", output.out);
    let page = project.text("seen/index.html");
    assert_eq!(
        page.matches("<img ").count(),
        3 * (7 + 2 * 2),
        "two cameras with depth and objects, the target from nearby, two fingers twice"
    );
    let names: Vec<String> = fs::read_dir(project.path("seen"))
        .expect("a folder")
        .map(|entry| entry.expect("a file").file_name().to_string_lossy().into_owned())
        .collect();
    assert_eq!(names.len(), 3 * (2 * 3 + 1 + 2 * 3) + 3, "{names:?}");
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
    for name in names {
        let of = |folder: &str| fs::read(project.path(&format!("{folder}/{name}"))).expect("a file");
        assert!(of("seen") == of("again"), "{name}");
    }
}

#[test]
fn several_policies_are_shown_side_by_side() {
    let project = short();
    let words = "view x.lua --policy expert --policy expert-binary --out seen";
    let output = project.succeeds(words);
    let lines: Vec<&str> = output.out.lines().collect();
    let [expert, binary, page, video] = lines[..] else { panic!("{}", output.out) };
    assert!(expert.starts_with("expert: ○ goal missed: D ") && binary.starts_with("expert-binary: ○ "));
    assert_eq!([page, video], ["seen/index.html", "seen/episode.mp4"]);
    let shown = project.text(page);
    assert!(shown.contains(expert) && shown.contains(binary), "{shown}");
    assert_eq!(shown.matches("<img ").count(), 2 * 3 * (7 + 2 * 2));
    assert!(project.path("seen/expert-binary/worst_wrist.png").is_file());
    assert!(!project.path("seen/expert/episode.mp4").exists(), "one video of both");
    let still = |out: &str| fs::read(project.path(&format!("{out}/episode.png"))).expect("written");
    assert_eq!(png_size(&still("seen"))[0], 1024);
    assert!(shows_something(&still("seen"), png_size(&still("seen"))));
    for out in ["first", "second"] {
        project.succeeds(&format!("view x.lua --policy noop --policy random --policy expert --out {out}"));
    }
    assert_eq!(png_size(&still("first"))[0], 1296, "three columns");
    for file in ["episode.mp4", "episode.png", "index.html", "random/end_third_person.png"] {
        let of = |out: &str| fs::read(project.path(&format!("{out}/{file}"))).expect("written");
        assert!(of("first") == of("second"), "{file}");
    }
}

#[test]
fn a_view_replaces_an_earlier_one_and_keeps_other_files() {
    let project = short();
    project.succeeds("view x.lua --policy noop --policy expert --animation --out seen");
    project.write("seen/noop/notes.txt", b"mine");
    project.succeeds("view x.lua --policy noop --out seen");
    for gone in ["expert", "animation.png", "noop/worst_wrist.png"] {
        assert!(!project.path(&format!("seen/{gone}")).exists(), "{gone}");
    }
    for kept in ["noop/notes.txt", "episode.mp4", "index.html"] {
        assert!(project.path(&format!("seen/{kept}")).is_file(), "{kept}");
    }
    // A view in the folder of another one stays.
    project.succeeds("view x.lua --policy noop --out seen/mine");
    project.succeeds("view x.lua --policy noop --out seen");
    assert!(project.path("seen/mine/worst_wrist.png").is_file());
    // The folder of something else.
    project.write("page/index.html", b"mine");
    assert_eq!(
        project.refusal("view x.lua --policy noop --out page"),
        "--out: page/index.html exists and is not of an earlier view; give another folder"
    );
    assert_eq!(project.text("page/index.html"), "mine");
    project.write("pictures/episode.png", b"mine");
    assert_eq!(
        project.refusal("view x.lua --policy noop --out pictures"),
        "--out: pictures/episode.png exists and is not of an earlier view; give another folder"
    );
    assert_eq!(project.text("pictures/episode.png"), "mine");
    // One that was interrupted before its page.
    fs::remove_file(project.path("seen/index.html")).expect("is there");
    project.succeeds("view x.lua --policy noop --out seen");
    project.write("other/end_of_study.png", b"mine");
    project.succeeds("view x.lua --policy noop --out other");
    assert!(project.path("other/end_of_study.png").is_file());
}

#[test]
fn views_of_policies_that_cannot_be_compared_are_refused() {
    let project = short();
    for (flags, message) in [
        ("--policy noop --policy noop", "--policy noop: named twice; name each policy once"),
        ("--policy noop --policy random --name a", "--name: applies to one policy"),
        ("--policy noop --policy random --replan 2", "has no effect on the policy noop, random"),
        (
            "--policy noop --policy random --policy expert --policy drives --policy one-force",
            "--policy: expected at most 4 policies side by side, got 5",
        ),
        ("--policy noop --policy exprt", "did you mean expert?"),
    ] {
        let output = project.refusal(&format!("view x.lua {flags} --out seen"));
        assert!(output.contains(message), "{flags}\n{output}");
    }
    let message = project.refusal("x.lua --policy noop --policy random --out run");
    assert!(message.contains("'--policy <POLICY>' cannot be used multiple times"), "{message}");
    assert!(!project.path("seen").exists());
}

#[test]
fn native_stills_have_the_native_size() {
    let project = short();
    project.succeeds("view x.lua --full-size --policy noop --out seen");
    let size = |name: &str| png_size(&fs::read(project.path(name)).expect("written"));
    assert_eq!((size("seen/end_third_person.png"), size("seen/end_wrist.png")), ([1024, 1024], [512, 512]));
}

#[test]
fn the_mcap_file_of_a_view_is_that_of_a_run_and_of_its_replay() {
    let project = short();
    project.succeeds("x.lua --episodes 1 --mcap=all --threads 1 --out run");
    let of_run = fs::read(project.path("run/mcap/task_000/episode_00000.mcap")).expect("written");
    assert!(of_run.starts_with(b"\x89MCAP0\r\n"), "{:?}", &of_run[..8]);
    project.succeeds("replay run 0/0 --mcap replayed/episode.mcap");
    project.succeeds("view x.lua --policy expert --policy noop --mcap --out seen");
    for path in ["replayed/episode.mcap", "seen/expert/episode.mcap"] {
        assert!(fs::read(project.path(path)).expect("written") == of_run, "{path}");
    }
    assert!(fs::read(project.path("seen/noop/episode.mcap")).expect("written") != of_run);
    let refused = project.refusal("x.lua --episodes 1 --mcap=3");
    assert!(refused.contains("--mcap 3: suite one runs the episodes below 1 of each task"), "{refused}");
    project.succeeds("replay run 0/0 --mcap replayed/episode.mcap");
    let results = fs::read(project.path("run/episodes.jsonl")).expect("written");
    for path in ["run", "run/episodes.jsonl", "x.lua"] {
        let refused = project.refusal(&format!("replay run 0/0 --mcap {path}"));
        assert_eq!(refused, format!("--mcap {path}: it exists and is no MCAP file; give another name"));
    }
    assert!(fs::read(project.path("run/episodes.jsonl")).expect("there") == results);
}

#[test]
fn a_run_renders_the_requested_episodes() {
    let project = short();
    let drawn = |flag: &str, out: &str| {
        project.succeeds(&format!("x.lua --episodes 2 {flag} --out {out}"));
        [0, 1].map(|e| project.path(&format!("{out}/video/task_000/episode_0000{e}.mp4")).exists())
    };
    assert_eq!(drawn("", "none"), [false, false]);
    assert_eq!(drawn("--video=1", "chosen"), [false, true]);
    assert_eq!(drawn("--video", "failed"), [true, true], "waiting is not safe");
    assert_eq!(drawn("--video=all", "all"), [true, true]);
    // Unsafe episodes have a picture with the verdict, as large as a frame of the video.
    let still = fs::read(project.path("failed/video/task_000/episode_00001.png")).expect("written");
    assert_eq!(png_size(&still), [1024, 1152]);
    assert!(shows_something(&still, [1024, 1152]));
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
fn invalid_views_are_refused() {
    let project = short();
    project.write("e.lua", b"return softvt.experiment { name = \"e\", grid = { a = { 1 } }, run = function() return { b = 1 } end }");
    let message = project.refusal("view e.lua --out seen");
    assert!(message.contains("e.lua: expected a single suite"), "{message}");
    let message = project.refusal("view x.lua --task 3 --out seen");
    assert!(message.contains("--task 3: suite one has no such task"), "{message}");
    let message = project.refusal("view x.lua");
    assert!(message.contains("--out <DIR>"), "{message}");
    project.write("file", b"");
    let message = project.refusal("view x.lua --out file");
    assert!(message.contains("cannot create the folder file"), "{message}");
}

/// The layout with a line added to its function.
fn with(line: &str) -> Project {
    let text = Small { task: "budget_steps = 4", ..Small::default() }.text();
    let text =
        text.replace("  scene:add { name = \"post\"", &format!("  {line}\n  scene:add {{ name = \"post\""));
    Project::new(&[("x.lua", &text)])
}

#[test]
fn visuals_are_checked_with_their_line() {
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
        (
            "scene:camera(\"wrist\").position = { 0/0, 0, 0 }",
            ".position[1]: expected a number in -100..100, got NaN",
        ),
        (
            "scene:camera(\"wrist\").quaternion = { 0, 0, 0, 0 }",
            ".quaternion: expected a quaternion, got one of length 0",
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
            "x.lua:7: scene:camera(\"wrist\"):look_at: point[2]: expected a number in -100..100, got NaN",
        ),
        (
            "scene:camera(\"wrist\"):look_at { 0, 1e7, 1 }",
            ":look_at: point[2]: expected a number in -100..100, got 10000000",
        ),
        ("scene.light = 3", "x.lua:7: scene.light: cannot be replaced; its numbers are written one by one"),
        ("scene:camera(\"wrist\"):look_at({ 0, 0, 1 }, { 0, 0, 0 })", "give another up"),
        (
            "scene:object(\"cube\").materials[1].albedo = { 2, 0, 0 }",
            "material.albedo[1]: expected a number in 0..1, got 2",
        ),
        ("scene:object(\"cube\").materials[1].shine = 2", "material: unknown key \"shine\""),
    ] {
        let output = with(line).refusal("view x.lua --out seen");
        assert!(output.contains(message), "{line}\n{output}");
    }
}

#[test]
fn cameras_inside_of_objects_are_refused() {
    let expected = "x.lua:7: camera mole: position: it is inside floor; move it out";
    let mole = "scene:add_camera { name = \"mole\", position = { 0, 0, -0.02 }, look_at = { 1, 0, -0.02 } }";
    let project = with(mole);
    for words in ["view x.lua --out seen", "x.lua --episodes 2 --video=all --out seen"] {
        let message = project.refusal(words);
        assert!(message.contains(expected), "{message}");
        assert!(!project.path("seen").exists());
    }
    project.succeeds("x.lua --episodes 2 --out blind");
    let project = with("scene:camera(\"third_person\").position = { 0, 0.1, 0.02 }");
    let message = project.refusal("x.lua --video --out run");
    let expected = "x.lua:7: camera third_person: position: it is inside cube; move it out";
    assert!(message.contains(expected), "{message}");
    let project = with("scene:camera(\"wrist\").position = { 0, 0, 0.03 }");
    let message = project.refusal("view x.lua --out seen");
    assert!(message.contains("x.lua:7: camera wrist: position: it is inside"), "{message}");
}

#[test]
fn simulations_report_cameras_inside_of_objects() {
    let mole = "scene:add_camera { name = \"mole\", position = { 0, 0, -0.02 }, look_at = { 1, 0, -0.02 } }";
    let text = with(mole).text("x.lua");
    let (layout, _) = text.split_once("return softvt.suite").expect("a suite");
    let run = "return softvt.experiment { name = \"e\", grid = { a = { 1 } }, run = function()\n\
               local sim = softvt.simulate { layout = layout }\nsim:render { camera = \"mole\" }\nreturn { b = 1 } end }";
    let message = Project::new(&[("x.lua", &format!("{layout}{run}"))]).refusal("x.lua");
    let expected = "simulation:render: x.lua:7: camera mole: position: it is inside floor; move it out";
    assert!(message.contains(expected), "{message}");
}

#[test]
fn an_enclosed_camera_does_not_end_the_video() {
    // A block falls over the camera while the scene settles.
    let block = "local block = softvt.asset { name = \"block\", shape = softvt.shape.box { size = { 0.1, 0.1, 0.05 } }:grounded(), body = softvt.rigid { density = 300 } }";
    let lines = "scene:add { name = \"block\", asset = block, position = { 0.3, 0.1, 0.03 } } \
                 scene:add_camera { name = \"mole\", position = { 0.3, 0.1, 0.01 }, look_at = { -0.5, 0.1, 0.1 } }";
    let project = with(lines);
    project.write("x.lua", format!("{block}\n{}", project.text("x.lua")).as_bytes());
    project.succeeds("view x.lua --out seen");
    let bytes = fs::read(project.path("seen/end_mole.png")).expect("written");
    assert!(shows_something(&bytes, [224, 224]), "{} bytes", bytes.len());
}

#[test]
fn missing_tactile_tables_are_reported() {
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
fn videos_of_episodes_that_are_not_run_are_refused() {
    let project = short();
    let message = project.refusal("x.lua --episodes 2 --video=1,7 --out run");
    assert!(
        message.contains("x.lua: --video 7: suite one runs the episodes below 2 of each task"),
        "{message}"
    );
    assert!(!project.path("run").exists());
}

#[test]
fn blank_folders_are_refused() {
    let project = short();
    for words in
        [["view", "x.lua", "--out", ""].as_slice(), &["x.lua", "--out", ""], &["x.lua", "--out", " "]]
    {
        let mut command = project.command("");
        command.args(words);
        let message = refusal(run_command(command), "--out");
        assert!(message.contains("for '--out <DIR>': expected a folder"), "{message}");
    }
    assert_eq!(fs::read_dir(project.path("")).expect("a folder").count(), 1, "x.lua alone");
}

#[test]
fn visuals_change_the_image() {
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
        "scene:object(\"cube\").materials[1].albedo = { 0.9, 0.1, 0.1 }",
    ] {
        assert!(plain != still(line), "{line}");
    }
}
