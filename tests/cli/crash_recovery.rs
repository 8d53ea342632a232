//! Runs that are killed or meet a full disk can be resumed; the result is that of an uninterrupted run.
#![cfg(unix)]

use std::{collections::BTreeMap, fs, path::Path, process::Command};

use assert_cmd::cargo::cargo_bin;

use crate::support::{Project, Small, files, until};

const LINE: &str = "x.lua --policy random --threads 2 --resume";

fn same(project: &Project, run: &str, whole: &BTreeMap<String, Vec<u8>>) {
    let found = files(&project.path(run));
    assert!(found.keys().eq(whole.keys()), "{:?}", found.keys());
    for (name, bytes) in whole {
        assert!(found[name] == *bytes, "{run}/{name} differs from that of the unbroken run");
    }
}

/// Bytes in a folder that is being written.
fn written(folder: &Path) -> u64 {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let bytes = entries.map(|entry| match entry.metadata() {
        Ok(found) if found.is_dir() => written(&entry.path()),
        Ok(found) => found.len(),
        Err(_) => 0,
    });
    bytes.sum()
}

#[test]
fn a_killed_run_resumes_to_identical_bytes() {
    let project = Small { task: "budget_steps = 12", ..Default::default() }.project();
    let line = |run: &str| format!("{LINE} --episodes 8 --out {run}");
    project.succeeds(&line("whole"));
    let whole = files(&project.path("whole"));
    let (total, mut cut_off) = (written(&project.path("whole")), 0);
    // Moments at which the run has written the first file, and further shares of its bytes.
    for (number, share) in [0.0, 0.1, 0.2, 0.35, 0.5, 0.65, 0.8].into_iter().enumerate() {
        let run = format!("run{number}");
        let mut process = project.start(&line(&run));
        let moment = (share * total as f64) as u64;
        until("some bytes", || written(&project.path(&run)) > moment || process.is_over());
        cut_off += usize::from(!process.is_over());
        process.signal("-KILL");
        process.wait();
        project.succeeds(&line(&run));
        same(&project, &run, &whole);
        fs::remove_dir_all(project.path(&run)).expect("removed");
    }
    assert!(cut_off >= 4, "only {cut_off} runs were still under way when they were killed");
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
