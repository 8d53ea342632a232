//! Validity of the documentation. Files of a page are written into an empty folder and its commands run there in order;
//! generated pages must be current.

#[path = "../../examples/pictures/calibration.rs"]
mod calibration_picture;
#[path = "../../examples/pictures/results.rs"]
mod results_picture;
#[path = "../../examples/pictures/validation.rs"]
mod validation_picture;

use std::{path::Path, time::Duration};

use softvt::{
    evaluation::{envelope_text::summary_text, thresholds::ThresholdFile},
    script::{self, envelope_plot},
};

use crate::support::{CliOutput, Project, Small, run_command};

/// A fenced block: its info string and its content.
struct Fence {
    info: String,
    text: String,
}

fn read(path: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(path);
    std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

fn fences(page: &str) -> Vec<Fence> {
    let mut found = Vec::new();
    let mut open: Option<Fence> = None;
    for line in read(page).lines() {
        match (line.strip_prefix("```"), &mut open) {
            (Some(info), None) => open = Some(Fence { info: info.to_owned(), text: String::new() }),
            (Some(_), Some(_)) => found.extend(open.take()),
            (None, Some(fence)) => fence.text += &format!("{line}\n"),
            (None, None) => {}
        }
    }
    assert!(open.is_none(), "{page} ends inside of a fence");
    found
}

impl Fence {
    /// Path of a complete file.
    fn file(&self) -> Option<&str> {
        self.info.strip_prefix("lua file=")
    }

    /// The softvt commands of a shell block, without comments.
    fn commands(&self) -> Vec<&str> {
        let lines = self.text.lines().filter(|_| self.info == "sh");
        lines.filter_map(|line| line.split(" #").next()?.trim().strip_prefix("softvt ")).collect()
    }
}

/// The command with fewer episodes and presses. Views are not drawn: their flags alone are checked.
fn shortened(command: &str) -> String {
    let (script, _) = command.split_once(' ').unwrap_or((command, ""));
    match script {
        "scripts/calibrate.lua" => format!("{command} --step-mm 3 --within-mm 1"),
        "view" => format!("{command} --help"),
        script if script.starts_with("suites/") => format!("{command} --episodes 1 --json --out run"),
        _ => command.to_owned(),
    }
}

/// Runs a command that must succeed. The timeout allows for rendering on a busy machine.
fn runs(project: &Project, words: &str) -> CliOutput {
    let mut command = project.command(words);
    command.timeout(Duration::from_secs(600));
    let output = run_command(command);
    assert_eq!(output.code, 0, "softvt {words}\n{}", output.err);
    output
}

/// Safety Success of a run that printed JSON, %; `None` if no episode could be judged.
fn safety(output: &str) -> Option<f64> {
    let summary: serde_json::Value = serde_json::from_str(output).expect("JSON");
    assert_eq!(summary["goal_success_rate"]["rate"], 100.0, "the goal is reached");
    summary["safety_success_rate"]["rate"].as_f64()
}

#[test]
fn the_tutorial_leads_to_a_safe_suite() {
    let project = Project::new(&[]);
    let (mut files, mut rates, mut commands) = (0, Vec::new(), 0);
    for fence in fences("docs/write-a-task.md") {
        if let Some(file) = fence.file() {
            project.write(file, fence.text.as_bytes());
            files += 1;
            continue;
        }
        assert!(fence.info == "sh", "a fence of {:?}: name its file", fence.info);
        for command in fence.commands() {
            commands += 1;
            let output = runs(&project, &shortened(command));
            if command.starts_with("suites/bricks.lua") {
                rates.push(safety(&output.out));
            }
            // The next command writes a folder of the same name.
            let _ = std::fs::remove_dir_all(project.path("run"));
        }
    }
    assert!(files >= 5 && commands >= 6, "{files} files, {commands} commands");
    assert_eq!(
        rates,
        [None, Some(100.0)],
        "nothing is judged before the calibration, everything is safe after it"
    );
    assert!(
        project.path("assets/calibration/brick.json").exists()
            && project.text("sag/sag.svg").contains("sag, mm")
    );
}

#[test]
fn the_readmes_suite_and_object_work() {
    let project = Project::new(&[]);
    let files: Vec<Fence> = fences("README.md").into_iter().filter(|fence| fence.file().is_some()).collect();
    let paths: Vec<&str> = files.iter().filter_map(Fence::file).collect();
    assert_eq!(paths, ["my_suite.lua", "assets/jelly.lua"]);
    files.iter().for_each(|f| project.write(f.file().unwrap_or_default(), f.text.as_bytes()));
    project.succeeds("check my_suite.lua");
    let output = project.succeeds("my_suite.lua --episodes 1 --json --out run");
    assert_eq!(safety(&output.out), None);
    assert!(output.err.contains("jelly is not calibrated"), "{}", output.err);
    // The page shows this message.
    let text = files[0].text.replace("hold_s", "holds");
    project.write("my_suite.lua", text.as_bytes());
    let shown = read("README.md");
    let message = format!("softvt: {}", project.refusal("my_suite.lua"));
    assert!(shown.contains(&format!("`{message}`")), "{message}");
}

#[test]
fn the_policy_and_the_profile_of_the_page_work() {
    let project = Small { task: "budget_steps = 12", ..Small::default() }.project();
    let files: Vec<Fence> =
        fences("docs/policies.md").into_iter().filter(|fence| fence.file().is_some()).collect();
    let paths: Vec<&str> = files.iter().filter_map(Fence::file).collect();
    assert_eq!(paths, ["my_profile.lua", "my_policy.lua"]);
    files.iter().for_each(|f| project.write(f.file().unwrap_or_default(), f.text.as_bytes()));
    let output = project.succeeds("x.lua --policy my_policy.lua --out run");
    assert!(output.err.lines().any(|line| line == "wait"), "it prints the prompt: {}", output.err);
    assert_eq!(project.json("run/run.json")["policy"], "feeler");
    let err = |words: &str| project.softvt(words).err;
    let server = "x.lua --policy ws://127.0.0.1:9 --policy-timeout 0.1 --profile";
    for words in [format!("{server} my_profile.lua"), "check x.lua --profile my_profile.lua".to_owned()] {
        assert!(err(&words).contains("inputs: unknown camera \"side\""), "no layout has added it");
    }
    let third = files[0].text.replace("\"side\"", "\"third_person\"");
    project.write("third.lua", third.as_bytes());
    assert!(err(&format!("{server} third.lua")).contains("no policy server"), "the profile is read");
    project.succeeds("check x.lua --profile third.lua");
    assert!(
        err("check x.lua --profile third.lua --replan 4").contains("--replan: has no effect on the policy")
    );
}

/// Commands that run an embedded suite or script.
#[test]
fn commands_on_the_pages_are_valid() {
    let pages = [
        "README.md",
        "CONTRIBUTING.md",
        "docs/write-a-task.md",
        "docs/assets.md",
        "docs/calibration.md",
        "docs/tactile.md",
        "docs/serve.md",
    ];
    let mut tried = 0;
    for page in pages {
        for line in read(page).lines().filter_map(|line| line.trim().strip_prefix("softvt ")) {
            let words = line.split(" #").next().unwrap_or(line).trim();
            let file = words.split(' ').find(|word| word.ends_with(".lua"));
            let Some(file) = file.filter(|file| script::embedded(file).is_some()) else { continue };
            // With --help at the end nothing runs, but every flag before it is checked.
            // A run folder that an earlier command of the page leaves can be a policy.
            let project = Project::new(&[("runs/mine/run.json", "{}")]);
            let output = project.succeeds(&format!("{words} --help"));
            assert!(output.out.contains("Usage:"), "{page}: {file}");
            tried += 1;
        }
    }
    assert!(tried >= 10, "{tried} commands");
}

#[test]
fn the_asset_page_is_current() {
    let project = Project::new(&[]);
    project.succeeds("scripts/asset_page.lua --pictures=off --out made");
    let (kept, made) = (read("docs/assets.md"), project.text("made/docs/assets.md"));
    assert!(kept == made, "docs/assets.md is out of date: run softvt scripts/asset_page.lua");
    let mut bytes = 0;
    for part in kept.split("src=\"images/").skip(1) {
        let path = part.split('"').next().unwrap_or_default();
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/images").join(path);
        bytes += std::fs::metadata(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display())).len();
    }
    assert!(bytes < 1_500_000, "the images of the page take {bytes} bytes");
    let rows = kept.lines().filter(|line| line.starts_with("| <a id=")).count();
    let assets = script::embedded_scripts("assets").len();
    assert_eq!(rows, assets - 2, "every asset but table and floor");
}

#[test]
fn the_calibration_page_is_current() {
    let page = read("docs/calibration.md");
    let soft = fences("docs/calibration.md");
    assert_eq!(soft.len(), 17);
    for fence in soft {
        let asset = fence.text.split(':').next().expect("a name").to_owned();
        let path = format!("assets/calibration/{asset}.json");
        let file = ThresholdFile::parse(&read(&path), &path).expect("a threshold file");
        let envelope = &file.envelopes[&asset];
        let text = summary_text(&asset, envelope, file.limit(&asset));
        assert_eq!(fence.text, text, "{asset} is out of date: run softvt scripts/calibrate.lua");
        assert_eq!(read(&format!("assets/calibration/{asset}.txt")), text, "{asset}");
        assert!(page.contains(&format!("| [{asset}](#{asset}) | ")), "{asset}");
        let shown = read(&format!("assets/calibration/{asset}.svg"));
        assert_eq!(shown, envelope_plot(&asset, envelope, file.limit(&asset)), "{asset}");
        assert_eq!(envelope.censored, None, "{asset}");
        assert!(
            envelope.window.extent_mm().is_some_and(|extent| extent >= 1.0),
            "{asset}: {:?}",
            envelope.window
        );
    }
}

#[test]
fn the_pictures_of_committed_results_are_current() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let calibration = calibration_picture::svg(root).expect("calibrations");
    assert_eq!(
        (
            calibration.matches("class=\"curve safe\"").count(),
            calibration.matches("class=\"hatched\"").count()
        ),
        (17, 1)
    );
    for (path, drawn) in [
        (calibration_picture::IMAGE, calibration),
        (results_picture::IMAGE, results_picture::svg(root).expect("results")),
        (validation_picture::IMAGE, validation_picture::svg(root).expect("claims")),
    ] {
        assert!(read(path) == drawn, "{path}: run .ci/regenerate pictures");
    }
}

#[test]
fn the_architecture_page_names_files_that_exist() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let page = read("docs/architecture.md");
    let is_path = |word: &&str| {
        let is_plain = word.chars().all(|c| c.is_ascii_alphanumeric() || "_./".contains(c));
        is_plain && (word.contains('/') || word.ends_with(".rs"))
    };
    let paths: Vec<&str> = page.split('`').skip(1).step_by(2).filter(is_path).collect();
    assert!(paths.len() > 100, "{paths:?}");
    for path in paths {
        let exists = ["", "src", "src/physics"].iter().any(|folder| root.join(folder).join(path).exists());
        assert!(exists, "docs/architecture.md names {path}, which does not exist");
    }
}
