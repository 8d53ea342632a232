//! Images and videos of episodes.

use std::fs;

use crate::support::{Project, Small};

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
    let view = |out: &str| {
        project
            .succeeds(&format!("view x.lua --policy noop --policy random --policy expert-binary --out {out}"))
            .out
    };
    let output = view("seen");
    let lines: Vec<&str> = output.lines().collect();
    let [noop, random, binary, page, video] = lines[..] else { panic!("{output}") };
    let shown = project.text(page);
    for (policy, line) in [("noop", noop), ("random", random), ("expert-binary", binary)] {
        assert!(
            line.starts_with(&format!("{policy}: ○ goal missed: D ")) && shown.contains(line),
            "{output}"
        );
    }
    assert_eq!([page, video], ["seen/index.html", "seen/episode.mp4"]);
    assert_eq!(shown.matches("<img ").count(), 3 * 3 * (7 + 2 * 2));
    assert!(project.path("seen/expert-binary/worst_wrist.png").is_file());
    assert!(!project.path("seen/noop/episode.mp4").exists(), "one video of all");
    let still = fs::read(project.path("seen/episode.png")).expect("written");
    assert_eq!(png_size(&still)[0], 1296, "three columns");
    assert!(shows_something(&still, png_size(&still)));
    view("again");
    for file in ["episode.mp4", "episode.png", "index.html", "random/end_third_person.png"] {
        let of = |out: &str| fs::read(project.path(&format!("{out}/{file}"))).expect("written");
        assert!(of("seen") == of("again"), "{file}");
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
}

/// The layout with a line added to its function.
fn with(line: &str) -> Project {
    let text = Small { task: "budget_steps = 4", ..Small::default() }.text();
    let text =
        text.replace("  scene:add { name = \"post\"", &format!("  {line}\n  scene:add {{ name = \"post\""));
    Project::new(&[("x.lua", &text)])
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
fn visuals_change_the_image() {
    let project = Project::new(&[
        ("x.lua", include_str!("../fixtures/changed_looks.lua")),
        ("small.lua", include_str!("../fixtures/small.lua")),
    ]);
    let output = project.succeeds("x.lua --json").out;
    let rows: Vec<&str> = output.lines().collect();
    assert_eq!(rows[0], rows[1], "reading changes nothing");
    assert!(rows.len() == 6 && rows[2..].iter().all(|row| *row != rows[0]), "{output}");
}
