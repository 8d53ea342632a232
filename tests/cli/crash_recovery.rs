//! Runs that are killed or meet a full disk can be resumed; the result is that of an uninterrupted run.
#![cfg(unix)]

use std::{
    collections::BTreeMap,
    fs,
    process::{Command, Stdio},
    thread::sleep,
    time::Instant,
};

use assert_cmd::cargo::cargo_bin;

use crate::support::{Project, Small, files};

const LINE: &str = "x.lua --policy random --threads 2 --resume";

fn same(project: &Project, run: &str, whole: &BTreeMap<String, Vec<u8>>) {
    let found = files(&project.path(run));
    assert!(found.keys().eq(whole.keys()), "{:?}", found.keys());
    for (name, bytes) in whole {
        assert!(found[name] == *bytes, "{run}/{name} differs from that of the unbroken run");
    }
}

#[test]
fn a_killed_run_resumes_to_identical_bytes() {
    let project = Small { task: "budget_steps = 12", ..Default::default() }.project();
    let line = |run: &str| format!("{LINE} --episodes 8 --out {run}");
    let start = Instant::now();
    project.succeeds(&line("whole"));
    let time = start.elapsed();
    let whole = files(&project.path("whole"));
    let mut cut_off = 0;
    for k in 0..20 {
        let run = format!("run{k}");
        let mut child = Command::new(cargo_bin!("softvt"))
            .current_dir(project.path(""))
            .args(line(&run).split_whitespace())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("started");
        // Multiples of the golden ratio spread the moments over the run.
        sleep(time.mul_f64((0.618_034 * f64::from(k)).fract()));
        cut_off += i32::from(child.try_wait().expect("a child").is_none());
        child.kill().expect("killed");
        child.wait().expect("over");
        project.succeeds(&line(&run));
        same(&project, &run, &whole);
        fs::remove_dir_all(project.path(&run)).expect("removed");
    }
    assert!(cut_off >= 10, "only {cut_off} runs were still under way when they were killed");
}

#[test]
fn a_full_disk_loses_no_finished_episode() {
    let project = Small { task: "budget_steps = 4", ..Default::default() }.project();
    let line = |run: &str| format!("{LINE} --episodes 40 --out {run}");
    project.succeeds(&line("whole"));
    let whole = files(&project.path("whole"));
    let half_kib = whole["episodes.jsonl"].len() / 2048;
    let largest =
        whole.iter().filter(|(name, _)| *name != "episodes.jsonl").map(|(_, bytes)| bytes.len()).max();
    assert!(largest.expect("other files") < half_kib * 1024, "the limit would hit other files first");
    // A limit on file sizes simulates a full disk. The list of episodes reaches it first, after half of the episodes.
    let script = format!("trap '' XFSZ; ulimit -f {half_kib}; exec \"$0\" {}", line("run"));
    let output = Command::new("bash")
        .current_dir(project.path(""))
        .args(["-c", &script])
        .arg(cargo_bin!("softvt"))
        .output()
        .expect("started");
    let err = String::from_utf8(output.stderr).expect("text");
    assert_eq!(output.status.code(), Some(2), "{err}");
    assert!(err.contains("cannot write to run/episodes.jsonl") && !err.contains("panicked"), "{err}");
    project.succeeds(&line("run"));
    same(&project, "run", &whole);
}
