//! Ctrl-C during a command, and functions that never return.
#![cfg(unix)]

use std::{
    collections::BTreeSet,
    time::{Duration, Instant},
};

use crate::support::{Process, Project, Small, until};

#[test]
fn finished_episodes_survive_an_interrupt() {
    let project = Small { task: "budget_steps = 100", ..Default::default() }.project();
    let mut process = project.start("x.lua --policy random --threads 2 --episodes 100000 --out run");
    let lines =
        || std::fs::read_to_string(project.path("run/episodes.jsonl")).unwrap_or_default().lines().count();
    until("three episodes", || lines() >= 3);
    process.signal("-INT");
    until("the end of the run", || process.is_over());
    let output = process.wait();
    let err = output.err;
    assert_eq!((output.code, output.out.as_str()), (130, ""), "no table of a run that was cut off: {err}");
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
    let mut process = project.start("x.lua --threads 2 --json");
    process.await_message("[1/100]", 1);
    let start = Instant::now();
    process.signal("-TERM");
    let output = process.wait();
    assert!(start.elapsed() < Duration::from_secs(10), "it took {:?}", start.elapsed());
    assert_eq!((output.code, output.out.as_str()), (130, "{\"i\":1}\n"), "{}", output.err);
    assert!(output.err.contains("interrupted; the rows of 1 of 100 points"), "{}", output.err);
}

/// True if a worker thread waits for work: it has ended its job, and no further one starts.
#[cfg(target_os = "linux")]
fn a_worker_is_idle(process: &Process) -> bool {
    let threads = std::fs::read_dir(format!("/proc/{}/task", process.id())).expect("a process");
    let states =
        threads.flatten().filter_map(|thread| std::fs::read_to_string(thread.path().join("stat")).ok());
    states.filter(|stat| stat.contains("(worker-")).any(|stat| stat.contains(") S "))
}

#[cfg(target_os = "linux")]
#[test]
fn errors_before_an_interrupt_keep_their_exit_code() {
    // The second task fails at once, the first runs for long.
    let text = Small { task: "budget_steps = 100000", ..Small::default() }.text();
    let (suite, task) = text.trim_end().trim_end_matches("} }").split_once("  softvt.task").expect("a task");
    let failing =
        task.replace("arm:wait(1)", "print('begun') arm:wait_for_ever()").replace("\"wait\"", "\"fail\"");
    let both = format!("{suite}  softvt.task{task}  softvt.task{failing}}} }}");
    let project = Project::new(&[("x.lua", &both)]);
    let mut process = project.start("x.lua --threads 2 --out run");
    process.await_message("begun", 1);
    // The run tells nothing of the error before its end.
    until("an idle worker", || a_worker_is_idle(&process));
    process.signal("-INT");
    let output = process.wait();
    assert_eq!(output.code, 2, "{}", output.err);
    assert!(output.err.contains("unknown key \"wait_for_ever\""), "{}", output.err);
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
        ("loading", "print('begun') while true do end", "x.lua", 1),
        ("calibrating", &calibrating, "x.lua --asset sesame_bun", 2),
        ("stuck", stuck, "x.lua", 1),
        ("loading physics", &physics, "x.lua", 1),
        ("laying out with physics", &laying_out, "x.lua --out run", 1),
        ("simulating", simulating, "x.lua", 1),
    ] {
        let project = Project::new(&[("x.lua", text)]);
        let mut process = project.start(words);
        process.await_message("begun", count);
        let start = Instant::now();
        process.signal("-INT");
        let output = process.wait();
        assert_eq!(output.code, 130, "{name}: {}", output.err);
        // The library function ends only with the process, three seconds after the signal; a busy machine takes longer.
        assert!(start.elapsed() < Duration::from_secs(8), "{name}: {:?}", start.elapsed());
        assert!(!output.err.contains("panicked"), "{name}: {}", output.err);
    }
}

#[test]
#[ignore = "nightly: the process ends after 10 s"]
fn a_library_function_that_does_not_return_ends_the_process() {
    let text = "return (('a'):rep(100000)):find(('.-'):rep(20) .. 'b')";
    assert_eq!(
        Project::new(&[("x.lua", text)]).refusal("x.lua"),
        "x.lua: the script called a library function that did not return within 10 s; look for a string pattern that never \
         comes to an end, or a huge repeat count"
    );
}
