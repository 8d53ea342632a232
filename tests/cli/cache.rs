//! The cache of derived data: folder, contents, and results that do not depend on it.

use std::{
    fs,
    path::Path,
    thread,
    time::{Duration, SystemTime},
};

use crate::support::{CliOutput, Project, Small, run_command};

/// A project with an episode of a few steps, and a folder for its cache.
fn short() -> Project {
    Small { task: "budget_steps = 4", ..Small::default() }.project()
}

/// Runs a command with a cache in `folder`.
fn with_cache(project: &Project, folder: &str, words: &str) -> CliOutput {
    let mut command = project.command(words);
    command.env("SOFTVT_CACHE_DIR", folder).env_remove("SOFTVT_NO_CACHE");
    run_command(command)
}

fn succeeds(project: &Project, folder: &str, words: &str) -> CliOutput {
    let output = with_cache(project, folder, words);
    assert_eq!(output.code, 0, "softvt {words}\n{}", output.err);
    output
}

/// Draws an episode into the folder `out`.
fn view(project: &Project, folder: &str, out: &str) -> CliOutput {
    succeeds(project, folder, &format!("view x.lua --out {out}"))
}

/// Names and contents of the files of a folder.
fn contents(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut files: Vec<(String, Vec<u8>)> = fs::read_dir(folder)
        .expect("a folder")
        .map(|file| file.expect("a file").path())
        .map(|path| {
            (path.file_name().unwrap_or_default().to_string_lossy().into(), fs::read(path).expect("read"))
        })
        .collect();
    files.sort();
    files
}

#[test]
fn pictures_and_films_are_the_same_without_a_cache_and_with_a_new_an_old_and_a_damaged_one() {
    let project = short();
    let mut command = project.command("view x.lua --out without");
    command.env("SOFTVT_NO_CACHE", "1").env("SOFTVT_CACHE_DIR", "unused");
    assert_eq!(run_command(command).code, 0);
    assert!(!project.path("unused").exists());
    let expected = contents(&project.path("without"));
    let equals = |out: &str| assert!(contents(&project.path(out)) == expected, "{out} differs");
    view(&project, "kept", "new");
    equals("new");
    let stored = contents(&project.path("kept"));
    assert!(stored.iter().any(|(name, _)| name.starts_with("robot-")), "the robot is kept");
    view(&project, "kept", "old");
    equals("old");
    // Half of the files are cut, the others have a wrong byte.
    for (index, (name, mut bytes)) in stored.into_iter().enumerate() {
        match index % 2 {
            0 => bytes.truncate(bytes.len() / 2),
            _ => bytes[20] ^= 1,
        }
        fs::write(project.path("kept").join(name), bytes).expect("written");
    }
    let output = view(&project, "kept", "damaged");
    equals("damaged");
    assert!(!output.err.contains("cache"), "it repairs itself: {}", output.err);
}

#[test]
fn a_large_image_of_a_mesh_file_is_scaled_down_once() {
    let script = "local shape = softvt.mesh { file = 'm.obj' }\n\
                  return softvt.experiment { name = 'v', grid = { a = { 1 } }, run = function() return { v = shape:volume() } end }";
    let obj = "mtllib m.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\n\
               f 1/1 3/1 2/1\nf 1/1 2/1 4/1\nf 1/1 4/1 3/1\nf 2/1 3/1 4/1\n";
    let project = Project::new(&[("x.lua", script), ("m.obj", obj), ("m.mtl", "newmtl m\nmap_Kd m.png\n")]);
    image::RgbImage::new(2500, 1000).save(project.path("m.png")).expect("written");
    succeeds(&project, "kept", "x.lua");
    let files = fs::read_dir(project.path("kept")).expect("a folder").map(|file| file.expect("a file"));
    let images: Vec<_> =
        files.filter(|file| file.file_name().to_string_lossy().starts_with("image-")).collect();
    assert_eq!(images.len(), 1);
    let file = fs::File::open(images[0].path()).expect("opened");
    let hour = Duration::from_secs(3600);
    file.set_modified(SystemTime::now() - 2 * hour).expect("set");
    succeeds(&project, "kept", "x.lua");
    let used = file.metadata().and_then(|file| file.modified()).expect("a time");
    assert!(used.elapsed().unwrap_or_default() < hour, "the second command reads it");
}

#[test]
fn two_processes_share_a_new_cache() {
    let project = short();
    let outs = ["first", "second"];
    thread::scope(|scope| {
        for out in outs {
            let project = &project;
            scope.spawn(move || view(project, "kept", out));
        }
    });
    let [first, second] = outs.map(|out| contents(&project.path(out)));
    assert!(first == second);
    let left = contents(&project.path("kept"));
    assert!(left.iter().all(|(name, _)| name.ends_with(".softvt")), "nothing half-written is left");
}

#[cfg(unix)]
#[test]
fn a_process_that_ends_while_it_writes_leaves_a_sound_cache() {
    use std::{
        process::{Command, Stdio},
        time::Duration,
    };
    let project = short();
    view(&project, "whole", "expected");
    let expected = contents(&project.path("expected"));
    for (number, signal) in ["-INT", "-KILL", "-INT", "-KILL"].into_iter().enumerate() {
        let mut child = Command::new(assert_cmd::cargo::cargo_bin!("softvt"))
            .current_dir(project.path(""))
            .args(["view", "x.lua", "--out", &format!("ended{number}")])
            .env("SOFTVT_CACHE_DIR", "kept")
            .env_remove("SOFTVT_NO_CACHE")
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("started");
        // The first entries are written after some tens of milliseconds.
        thread::sleep(Duration::from_millis(60 + 120 * number as u64));
        let killed =
            Command::new("kill").args([signal, &child.id().to_string()]).status().expect("kill runs");
        assert!(killed.success() || child.try_wait().expect("asked").is_some());
        child.wait().expect("ended");
    }
    let output = view(&project, "kept", "after");
    assert!(contents(&project.path("after")) == expected && !output.err.contains("cache"), "{}", output.err);
}

#[test]
fn a_folder_that_cannot_be_written_costs_one_line() {
    let project = short();
    // Permissions do not stop an administrator; a file in place of the folder stops all.
    fs::write(project.path("file"), "mine").expect("written");
    let output = view(&project, "file/cache", "seen");
    let warnings: Vec<&str> = output.err.lines().filter(|line| line.contains("cache")).collect();
    let [warning] = warnings[..] else { panic!("one line about the cache: {}", output.err) };
    assert!(warning.starts_with("softvt: warning: cannot "), "{warning}");
    assert!(warning.contains("file/cache") && warning.contains("SOFTVT_CACHE_DIR"), "{warning}");
    assert_eq!(fs::read_to_string(project.path("file")).expect("read"), "mine");
}

#[cfg(unix)]
#[test]
fn a_read_only_cache_is_read() {
    use std::{fs::Permissions, os::unix::fs::PermissionsExt};
    let project = short();
    view(&project, "kept", "new");
    let folder = project.path("kept");
    fs::set_permissions(&folder, Permissions::from_mode(0o555)).expect("changed");
    let before = contents(&folder);
    view(&project, "kept", "old");
    fs::set_permissions(&folder, Permissions::from_mode(0o755)).expect("changed");
    assert!(contents(&folder) == before && contents(&project.path("new")) == contents(&project.path("old")));
}

#[test]
fn the_command_shows_the_cache_and_removes_its_entries_alone() {
    let project = short();
    let empty = succeeds(&project, "kept", "cache");
    for line in ["folder   kept", "entries  0", "size     0.0 MB", "limit    1073.7 MB"] {
        assert!(empty.out.contains(line), "{line} in\n{}", empty.out);
    }
    assert!(!project.path("kept").exists(), "looking creates nothing");
    view(&project, "kept", "seen");
    fs::write(project.path("kept/notes.txt"), "mine").expect("written");
    let shown = succeeds(&project, "kept", "cache").out;
    assert!(!shown.contains("entries  0") && !shown.contains("size     0.0"), "{shown}");
    let cleared = succeeds(&project, "kept", "cache --clear").out;
    assert!(cleared.starts_with("removed ") && cleared.contains("from kept"), "{cleared}");
    let left: Vec<String> = contents(&project.path("kept")).into_iter().map(|(name, _)| name).collect();
    assert_eq!(left, ["notes.txt"]);
    let mut command = project.command("cache");
    command.env("SOFTVT_NO_CACHE", "1");
    assert_eq!(run_command(command).out, "the cache is off: SOFTVT_NO_CACHE is set\n");
}
