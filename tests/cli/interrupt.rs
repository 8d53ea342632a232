//! Ctrl-C during a command.
#![cfg(unix)]

use std::{
    collections::BTreeSet,
    io::{BufRead, BufReader, Read},
    process::{ChildStderr, Command, Stdio},
    thread::sleep,
    time::{Duration, Instant},
};

use assert_cmd::cargo::cargo_bin;

use crate::support::{Project, Small};

#[test]
fn finished_episodes_survive_an_interrupt() {
    let project = Small { task: "budget_steps = 100", ..Default::default() }.project();
    let mut child = Command::new(cargo_bin!("softvt"))
        .current_dir(project.path(""))
        .args(["x.lua", "--policy", "random", "--threads", "2", "--episodes", "100000", "--out", "run"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("started");
    await_lines(&project, 3);
    let killed = Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill runs");
    assert!(killed.success());
    let start = Instant::now();
    while child.try_wait().expect("a child").is_none() {
        if start.elapsed() > Duration::from_secs(60) {
            child.kill().expect("ended");
            panic!("the run goes on after an interrupt");
        }
        sleep(Duration::from_millis(20));
    }
    let output = child.wait_with_output().expect("output");
    let err = String::from_utf8(output.stderr).expect("text");
    assert_eq!(output.status.code(), Some(130), "{err}");
    assert!(output.stdout.is_empty(), "no table of a run that was cut off");
    let episodes = project.lines("run/episodes.jsonl");
    let indices: BTreeSet<_> = episodes.iter().map(|e| e["episode"].as_u64().expect("an index")).collect();
    assert!(indices.len() >= 3 && indices.len() < 100_000);
    assert_eq!(indices.len(), episodes.len(), "no episode is listed twice");
    let kept = format!("interrupted; {} of 100000 episodes are in run", episodes.len());
    assert!(err.contains(&kept) && err.contains("--resume --out run"), "{err}");
    assert!(!err.contains("panicked"), "{err}");
    assert!(project.json("run/run.json").is_object());
    assert!(!project.path("run/summary.json").exists());
}

/// An experiment of 100 points. The first ends at once, the others would run for days.
const SLOW: &str = r#"local points = {}
for i = 1, 100 do points[i] = { i = i } end
return softvt.experiment { name = "e", options = {}, points = function() return points end, run = function(point)
  if point.i == 1 then return { i = 1 } end
  local world = softvt.world { sleeping = false, gravity = { 0, 0, 0 } }
  world:soft { name = "cube", shape = softvt.shape.box { size = { 0.05, 0.05, 0.05 } }, body = softvt.soft { youngs_pa = 3e4, poisson = 0.4, density = 300 }, position = { 0, 0, 1 } }
  for _ = 1, 1e9 do pcall(world.step, world) end
  return { i = point.i }
end }
"#;

#[test]
fn an_interrupted_experiment_prints_its_rows() {
    let project = Project::new(&[("x.lua", SLOW)]);
    let mut child = Command::new(cargo_bin!("softvt"))
        .current_dir(project.path(""))
        .args(["x.lua", "--threads", "2", "--json"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("started");
    let mut messages = await_message(child.stderr.take().expect("messages"), "[1/100]", 1);
    let start = Instant::now();
    let killed = Command::new("kill").args(["-TERM", &child.id().to_string()]).status().expect("kill runs");
    assert!(killed.success());
    let output = child.wait_with_output().expect("output");
    assert!(start.elapsed() < Duration::from_secs(10), "it took {:?}", start.elapsed());
    let mut err = String::new();
    messages.read_to_string(&mut err).expect("text");
    assert_eq!(output.status.code(), Some(130), "{err}");
    assert_eq!(String::from_utf8(output.stdout).expect("text"), "{\"i\":1}\n");
    assert!(err.contains("interrupted; the rows of 1 of 100 points"), "{err}");
}

#[test]
fn errors_before_an_interrupt_keep_their_exit_code() {
    // The second task fails at once, the first runs for long.
    let text = Small { task: "budget_steps = 100000", ..Small::default() }.text();
    let (suite, task) = text.trim_end().trim_end_matches("} }").split_once("  softvt.task").expect("a task");
    let failing =
        task.replace("arm:wait(1)", "print('begun') arm:wait_for_ever()").replace("\"wait\"", "\"fail\"");
    let both = format!("{suite}  softvt.task{task}  softvt.task{failing}}} }}");
    let project = Project::new(&[("x.lua", &both)]);
    // The run tells nothing of the error before its end.
    let line = ["x.lua", "--threads", "2", "--out", "run"];
    let (code, _, err) = interrupted(&project, &line, 1, Duration::from_secs(1));
    assert_eq!(code, Some(2), "{err}");
    assert!(err.contains("unknown key \"wait_for_ever\""), "{err}");
}

fn await_lines(project: &Project, count: usize) {
    let start = Instant::now();
    let path = project.path("run/episodes.jsonl");
    while std::fs::read_to_string(&path).unwrap_or_default().lines().count() < count {
        assert!(start.elapsed() < Duration::from_secs(60), "no episode in a minute");
        sleep(Duration::from_millis(20));
    }
}

/// Reads messages until `count` of them contain `part`. Returns those that follow.
fn await_message(err: ChildStderr, part: &str, count: usize) -> BufReader<ChildStderr> {
    let (mut messages, mut before) = (BufReader::new(err), String::new());
    while before.matches(part).count() < count {
        assert_ne!(messages.read_line(&mut before).expect("text"), 0, "it ended: {before}");
    }
    messages
}

/// Starts softvt, waits until scripts have printed "begun" `count` times, and for `longer`, and sends a signal. Returns
/// exit code, time from the signal to the end, and the messages of that time.
fn interrupted(
    project: &Project,
    words: &[&str],
    count: usize,
    longer: Duration,
) -> (Option<i32>, Duration, String) {
    let mut child = Command::new(cargo_bin!("softvt"))
        .current_dir(project.path(""))
        .args(words)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("started");
    let mut messages = await_message(child.stderr.take().expect("messages"), "begun", count);
    sleep(longer);
    let start = Instant::now();
    let killed = Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill runs");
    assert!(killed.success());
    let mut err = String::new();
    messages.read_to_string(&mut err).expect("text");
    (child.wait().expect("ended").code(), start.elapsed(), err)
}

/// Defines `step_for_ever()`, which spends nearly all its time in the physics.
const STEPS: &str = r#"local function step_for_ever()
  local world = softvt.world { sleeping = false, gravity = { 0, 0, 0 } }
  world:soft { name = "cube", shape = softvt.shape.box { size = { 0.05, 0.05, 0.05 } }, body = softvt.soft { youngs_pa = 3e4, poisson = 0.4, density = 300 }, position = { 0, 0, 1 } }
  print("begun")
  while true do pcall(world.step, world) end
end
"#;

#[test]
fn scripts_end_soon_after_an_interrupt() {
    // Endless loading, a calibration, and a library function that never returns.
    let stuck = "print('begun') return string.find(('a'):rep(40), ('.-'):rep(40) .. 'b')";
    let physics = format!("{STEPS}step_for_ever()");
    let laying_out =
        Small::default().text().replace("function(scene)\n", "function(scene)\nstep_for_ever()\n");
    let laying_out = format!("{STEPS}{laying_out}");
    let simulating = "return softvt.experiment { name = 'e', grid = { a = { 1 } }, run = function()\n\
         local sim = softvt.simulate { layout = softvt.layout('l', function() end) }\n\
         print('begun')\n\
         while true do pcall(sim.wait, sim, 600) end\nend }";
    // It prints when it is loaded, and when a thread opens it.
    let calibrating = format!("print('begun') {}", include_str!("../../scripts/calibrate.lua"));
    for (name, text, words, count) in [
        ("loading", "print('begun') while true do end", vec!["x.lua"], 1),
        ("calibrating", &calibrating, vec!["x.lua", "--asset", "sesame_bun"], 2),
        ("stuck", stuck, vec!["x.lua"], 1),
        ("loading physics", &physics, vec!["x.lua"], 1),
        ("laying out with physics", &laying_out, vec!["x.lua", "--out", "run"], 1),
        ("simulating", simulating, vec!["x.lua"], 1),
    ] {
        let project = Project::new(&[("x.lua", text)]);
        let (code, took, err) = interrupted(&project, &words, count, Duration::ZERO);
        assert_eq!(code, Some(130), "{name}: {err}");
        // The library function ends only with the process, three seconds after the signal; a busy machine takes longer.
        assert!(took < Duration::from_secs(8), "{name}: {took:?}");
        assert!(!err.contains("panicked"), "{name}: {err}");
    }
}
