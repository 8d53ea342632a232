//! Every flag acts, or is refused: the command line of experiments, `--out` folders, standard output, and replays from
//! other folders.

use std::{
    fs::{self, OpenOptions},
    process::{Command, Stdio},
};

use assert_cmd::cargo::cargo_bin;

use crate::support::{Project, Small, files, refusal, run_command, until};

const OPTIONS: &str = include_str!("../fixtures/options.lua");

const SQUEEZE: &str = include_str!("../fixtures/squeeze.lua");

fn rows(project: &Project, words: &str) -> Vec<serde_json::Value> {
    let out = project.succeeds(&format!("x.lua --json {words}")).out;
    out.lines().map(|line| serde_json::from_str(line).expect("a row")).collect()
}

#[test]
fn settings_and_seed_reach_the_simulations_of_an_experiment() {
    let project = Project::new(&[("x.lua", SQUEEZE)]);
    let plain = rows(&project, "");
    assert_eq!(rows(&project, "--threads 2"), plain);
    let slow = rows(&project, "--set robot.gripper.speed=0.01");
    assert_ne!(slow[0]["width"], plain[0]["width"], "the robot's settings act on softvt.simulate");
    assert_eq!((&slow[1], &slow[2]), (&plain[1], &plain[2]));
    let fine = rows(&project, "--set physics.dt=0.025");
    assert_ne!(fine[1]["height"], plain[1]["height"], "the physics acts on softvt.world");
    let seeded = rows(&project, "--seed 3");
    assert_ne!(seeded[2]["drawn"], plain[2]["drawn"]);
    assert_eq!(seeded[1], plain[1]);
}

#[test]
fn an_experiment_writes_its_rows_and_its_command_line() {
    let finish = "columns = { 'part' }, finish = function(rows) return { files = { ['assets/n.json'] = { n = #rows } } } end }";
    let project = Project::new(&[("x.lua", &(SQUEEZE.trim_end().trim_end_matches('}').to_owned() + finish))]);
    let refused = project.refusal("x.lua --set robot.gripper.speed=0.01");
    assert!(refused.contains("--set robot.gripper.speed: give an output folder"), "{refused}");
    assert!(project.refusal("x.lua --seed 1").contains("--seed 1: give an output folder"));
    assert!(
        !project.path("assets").exists(),
        "a file of the project is not replaced by one of changed settings"
    );
    let printed = project.succeeds("x.lua --json --out run --seed 1 --set robot.gripper.speed=0.01").out;
    assert_eq!(project.text("run/rows.jsonl"), printed);
    assert!(project.text("run/rows.csv").lines().count() == 4, "{}", project.text("run/rows.csv"));
    assert_eq!(project.json("run/assets/n.json")["n"], 3);
    let run = project.json("run/run.json");
    assert_eq!((&run["experiment"], &run["seed"], &run["script"]), (&"e".into(), &1.into(), &"x.lua".into()));
    assert_eq!(run["set"], serde_json::json!([["robot.gripper.speed", "0.01"]]));
    assert!(project.refusal("x.lua --out run").contains("run already holds a run (run.json)"));
    let before = files(&project.path("run"));
    for name in ["rows.jsonl", "rows.csv", "assets/n.json"] {
        fs::remove_file(project.path("run").join(name)).expect("removed");
    }
    let points = project.text("run/points.jsonl");
    let whole: String = points.split_inclusive('\n').take(1).collect();
    project.write("run/points.jsonl", format!("{whole}{{\"poi").as_bytes());
    let other = project.refusal("x.lua --resume --out run --seed 2 --set robot.gripper.speed=0.01");
    assert!(other.contains("seed: 1 before, 2 now"), "{other}");
    let resumed = project.succeeds("x.lua --json --resume --out run --seed 1 --set robot.gripper.speed=0.01");
    assert!(resumed.out == printed && files(&project.path("run")) == before, "{}", resumed.err);
    assert!(project.refusal("report run").contains("run holds an experiment, not a run of a suite"));
}

#[test]
fn a_problem_of_an_experiment_is_reported_after_its_files_are_written() {
    let project = Project::new(&[("options.lua", OPTIONS)]);
    let problem = project.problem("options.lua --kappa 1 --out worse");
    assert!(problem.ends_with("options.lua: one is too much"), "{problem}");
    assert_eq!(project.json("worse/deep/rows.json")[1]["square"], 2116.0);
    assert!(project.path("worse/run.json").exists());
}

#[test]
fn help_lists_the_options_of_the_script() {
    let project = Project::new(&[("options.lua", OPTIONS)]);
    // Line breaks depend on the terminal.
    let help = project.succeeds("options.lua --help").out.split_whitespace().collect::<Vec<_>>().join(" ");
    for part in [
        "Options of the script:",
        "--gap-mm <NUMBER>",
        "Distance of the pads [numbers joined by commas in 1..60 (mm); default 48,46]",
        "What is squeezed [one of cube, ball; default \"cube\"]",
        "Whether to hurry [on or off; default off]",
        "Pause, only with --shape ball",
        "--episodes <N>",
        "130 interrupted",
    ] {
        assert!(help.contains(part), "{part} is not in\n{help}");
    }
    assert!(!project.succeeds("--help").out.contains("Options of the script"));
}

#[test]
fn blank_values_are_refused() {
    let project = Small::default().project();
    for (words, expected) in [
        (["view", "x.lua", "--out", ""].as_slice(), "for '--out <DIR>': expected a folder"),
        (&["x.lua", "--out", " "], "for '--out <DIR>': expected a folder"),
        (&["x.lua", "--task", ""], "--task: expected an index"),
    ] {
        let mut command = project.command("");
        command.args(words);
        let message = refusal(run_command(command), &words.join(" "));
        assert!(message.contains(expected), "{message}");
    }
    assert_eq!(fs::read_dir(project.path("")).expect("a folder").count(), 1, "x.lua alone");
}

#[test]
fn a_folder_with_other_files_is_refused() {
    let project = Small { task: "budget_steps = 1", ..Small::default() }.project();
    project.write("mine/notes.txt", b"mine");
    project.write("list.lua", b"return { (require \"x\") }");
    let refused = project.refusal("x.lua --policy noop --out mine");
    assert!(refused.contains("mine is not empty and holds no run (it contains notes.txt)"), "{refused}");
    assert_eq!(fs::read_dir(project.path("mine")).expect("there").count(), 1);
    fs::create_dir(project.path("empty")).expect("made");
    project.write("empty/.gitignore", b"*");
    project.succeeds("x.lua --policy noop --out empty");
    project.succeeds("list.lua --policy noop --out many");
    project.succeeds("list.lua --policy noop --out many");
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_device_is_an_error_and_a_closed_pipe_is_not() {
    let project = Small { task: "budget_steps = 1", ..Small::default() }.project();
    project.succeeds("x.lua --policy noop --out run");
    project.succeeds("x.lua --policy random --out random");
    for words in [
        "list policies",
        "list profiles --json",
        "--version",
        "compare run random",
        "x.lua --policy noop --json --out run",
        "check x.lua",
    ] {
        let full = OpenOptions::new().write(true).open("/dev/full").expect("the device");
        let output = Command::new(cargo_bin!("softvt"))
            .current_dir(project.path(""))
            .args(words.split_whitespace())
            .stdout(Stdio::from(full))
            .stderr(Stdio::piped())
            .output()
            .expect("started");
        let err = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{words}: {err}");
        assert!(err.contains("cannot write to standard output"), "{words}: {err}");
        let mut process = project.start(words);
        process.close_stdout();
        let output = process.wait();
        assert!(output.code == 0 && !output.err.contains("standard output"), "{words}: {}", output.err);
    }
}

#[cfg(unix)]
#[test]
fn billions_of_episodes_start_at_once_and_can_be_interrupted() {
    let project = Small { task: "budget_steps = 1", ..Small::default() }.project();
    let mut process = project.start("x.lua --policy noop --threads 1 --episodes 4294967295 --out run");
    until("an episode", || {
        assert!(!process.is_over(), "it ended early");
        fs::read(project.path("run/episodes.jsonl")).is_ok_and(|text| !text.is_empty())
    });
    #[cfg(target_os = "linux")]
    {
        let status = fs::read_to_string(format!("/proc/{}/status", process.id())).expect("it runs");
        let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).expect("a peak");
        let kilobytes: u64 = peak.trim().trim_end_matches(" kB").parse().expect("a number");
        assert!(kilobytes < 500_000, "{kilobytes} kB");
    }
    process.signal("-INT");
    let output = process.wait();
    assert_eq!(output.code, 130, "{}", output.err);
    assert!(output.err.contains("[1/4294967295]"), "{}", output.err);
}

#[cfg(unix)]
#[test]
fn a_named_pipe_is_refused_without_waiting() {
    let project = Project::new(&[("y.lua", "return require 'pipe'")]);
    let made = Command::new("mkfifo").arg(project.path("pipe.lua")).status().expect("mkfifo runs");
    assert!(made.success());
    let refused = project.refusal("check pipe.lua");
    assert!(refused.contains("pipe.lua: cannot be read: is a pipe or a device, not a file"), "{refused}");
    assert!(project.refusal("check y.lua").contains("pipe"), "a module that is a pipe");
}

#[test]
fn runs_and_datasets_are_replayed_from_any_folder() {
    let project =
        Project::new(&[("suites/x.lua", &Small { task: "budget_steps = 3", ..Small::default() }.text())]);
    project.succeeds("suites/x.lua --policy noop --out runs/one");
    project.write("elsewhere/note.txt", b"");
    let elsewhere = |words: &str| {
        let mut command = project.command(words);
        command.current_dir(project.path("elsewhere"));
        run_command(command)
    };
    let output = elsewhere("replay ../runs/one 0/0");
    assert_eq!(output.code, 0, "{}", output.err);
    assert!(output.out.contains("byte-identical"), "{}", output.out);
    // Both commands of the report work from the folder of the report.
    let report = elsewhere("report ../runs/one --out page");
    assert_eq!(report.code, 0, "{}", report.err);
    let page = project.text("elsewhere/page/report.html");
    let (_, view) = page.split_once("<code>softvt view ").expect("a command");
    let (script, _) = view.split_once(' ').expect("a script");
    assert!(project.path("elsewhere").join(script).is_file(), "{script}");
    assert!(page.contains("softvt replay ../runs/one 0/0"));
    // The run has moved, and its script is gone: the run has a copy.
    let moved = tempfile::tempdir().expect("a folder");
    let copied = moved.path().join("one");
    fs::rename(project.path("runs/one"), &copied).expect("moved");
    let from = project.path("suites/x.lua");
    fs::remove_file(&from).expect("removed");
    let replay = format!("replay {} 0/0", copied.display());
    let output = elsewhere(&replay);
    assert!(output.code == 0 && output.out.contains("byte-identical"), "{}{}", output.out, output.err);
    // Without it, the message names the folders that were searched.
    fs::remove_file(copied.join("scripts.zip")).expect("removed");
    let refused = refusal(elsewhere(&replay), "replay");
    let folder = project.path("").canonicalize().expect("there").display().to_string();
    assert!(refused.contains("suites/x.lua is not in the working folder or in"), "{refused}");
    assert!(refused.contains(folder.trim_end_matches('/')), "{refused}");
}

#[test]
fn latency_delays_the_response_by_control_steps() {
    let small = Small { expert: "arm:close_to(1, { rate = 2 }) arm:wait(1)", ..Small::default() };
    let project = small.project();
    let widths = |out: &str, words: &str| -> Vec<f64> {
        project.succeeds(&format!("x.lua --trace --out {out} {words}"));
        let steps = project.lines(&format!("{out}/trace/task_000/episode_00000.jsonl"));
        steps.iter().map(|step| step["gripper_width_m"].as_f64().expect("a width")).collect()
    };
    let plain = widths("plain", "");
    let late = widths("late", "--set robot.latency=3");
    assert!(plain[1] < 0.079, "the hand closes at once: {plain:?}");
    assert!(late[..3].iter().all(|width| (width - 0.08).abs() < 1e-6), "{late:?}");
    for (step, width) in plain.iter().enumerate().take(8) {
        assert!((late[step + 3] - width).abs() < 1e-9, "step {step}: {} and {width}", late[step + 3]);
    }
}

#[test]
fn a_disturbance_moves_the_robot_and_not_its_commands() {
    let small = Small { expert: "arm:wait(1)", ..Small::default() };
    let project = small.project();
    let run = |out: &str, words: &str| {
        project.succeeds(&format!("x.lua --trace --out {out} {words}"));
        let heights: Vec<f64> = project
            .lines(&format!("{out}/trace/task_000/episode_00000.jsonl"))
            .iter()
            .map(|step| step["ee_position_b"][2].as_f64().expect("a height"))
            .collect();
        let actions = std::fs::read(project.path(&format!("{out}/actions/task_000/episode_00000.npy")));
        (heights, actions.expect("actions"))
    };
    let disturbed = "--set robot.disturbance.position=0.005";
    let (plain, commands) = run("plain", "");
    let (moved, same_commands) = run("moved", disturbed);
    let spread = |heights: &[f64]| {
        let (low, high) = heights.iter().fold((f64::MAX, f64::MIN), |(l, h), z| (l.min(*z), h.max(*z)));
        high - low
    };
    assert!(spread(&plain) < 1e-4 && spread(&moved) > 3e-3, "{plain:?} {moved:?}");
    assert_eq!(commands, same_commands, "a demonstration holds what was commanded");
    assert_eq!(run("again", disturbed).0, moved);
    project.succeeds("replay moved 0/0");
}

#[test]
fn a_rigid_twin_is_paired_with_its_soft_original() {
    let text = Small { task: "budget_steps = 1", ..Small::default() }.text();
    let twin = "local soft = require \"x\"\nreturn softvt.suite { name = \"one_twin\", object_type = \"rigid\", twin_of = soft.name, tasks_differ_in = soft.tasks_differ_in, episodes = soft.episodes, tasks = soft.tasks }\n";
    let conditions = "return softvt.conditions { name = \"c\", suites = { (require \"x\") }, conditions = { { name = \"twin\", rigid_twin = true } } }\n";
    let project = Project::new(&[("x.lua", &text), ("twin.lua", twin), ("c.lua", conditions)]);
    project.succeeds("x.lua --policy noop --out soft");
    project.succeeds("twin.lua --policy noop --out twin");
    let compared = project.succeeds("compare soft twin").out.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(compared.contains("1 paired episode"), "{compared}");
    assert!(
        compared.contains("one_twin is the rigid twin of one; their episodes are paired by task and episode"),
        "{compared}"
    );
    assert_eq!(project.json("twin/run.json")["twin_of"], "one");
    project.succeeds("c.lua --policy noop --out conditions");
    let rows = project.json("conditions/conditions.json")["suites"][0]["rows"].clone();
    assert_eq!((&rows[1]["rigid_twin"], &rows[1]["outcome"]["paired"]["pairs"]), (&true.into(), &1.into()));
}
