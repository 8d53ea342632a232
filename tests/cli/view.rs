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
