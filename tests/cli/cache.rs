//! The cache of derived data: folder, contents, and results that do not depend on it.

use std::{
    fs,
    path::Path,
    process, thread,
    time::{Duration, SystemTime},
};

use assert_cmd::cargo::cargo_bin;

use crate::support::{CliOutput, Process, Project, Small, run_command, until};

/// Runs a command that must succeed, with a cache in `folder`.
fn succeeds(project: &Project, folder: &str, words: &str) -> CliOutput {
    let mut command = project.command(words);
    command.env("SOFTVT_CACHE_DIR", folder).env_remove("SOFTVT_NO_CACHE");
    let output = run_command(command);
    assert_eq!(output.code, 0, "softvt {words}\n{}", output.err);
    output
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

/// Checks that views with these states of the cache draw the same pictures: off, new and written by two processes, old
/// and read-only, damaged, and left by processes that were ended while they wrote.
#[cfg(unix)]
#[test]
fn pictures_and_films_do_not_depend_on_the_cache() {
    use std::{fs::Permissions, os::unix::fs::PermissionsExt};
    let project = Small { task: "budget_steps = 4", ..Small::default() }.project();
    let mut command = project.command("view x.lua --out without");
    command.env("SOFTVT_NO_CACHE", "1").env("SOFTVT_CACHE_DIR", "unused");
    assert_eq!(run_command(command).code, 0);
    assert!(!project.path("unused").exists());
    let expected = contents(&project.path("without"));
    let view = |folder: &str, out: &str| {
        let output = succeeds(&project, folder, &format!("view x.lua --out {out}"));
        assert!(contents(&project.path(out)) == expected, "{out} differs");
        assert!(!output.err.contains("cache"), "{out}: {}", output.err);
    };
    thread::scope(|scope| {
        let view = &view;
        for out in ["new", "at_once"] {
            scope.spawn(move || view("kept", out));
        }
    });
    let stored = contents(&project.path("kept"));
    assert!(stored.iter().all(|(name, _)| name.ends_with(".softvt")), "nothing half-written is left");
    assert!(stored.iter().any(|(name, _)| name.starts_with("robot-")), "the robot is kept");
    let permit = |mode| {
        fs::set_permissions(project.path("kept"), Permissions::from_mode(mode)).expect("changed");
    };
    permit(0o555);
    view("kept", "old");
    permit(0o755);
    assert!(contents(&project.path("kept")) == stored);
    // Half of the files are cut, the others have a wrong byte.
    for (index, (name, mut bytes)) in stored.into_iter().enumerate() {
        match index % 2 {
            0 => bytes.truncate(bytes.len() / 2),
            _ => bytes[20] ^= 1,
        }
        fs::write(project.path("kept").join(name), bytes).expect("written");
    }
    view("kept", "damaged");
    let entries = || fs::read_dir(project.path("ended")).map_or(0, Iterator::count);
    for (number, signal) in ["-INT", "-KILL", "-INT", "-KILL"].into_iter().enumerate() {
        let mut command = process::Command::new(cargo_bin!("softvt"));
        command.env("SOFTVT_CACHE_DIR", "ended").env_remove("SOFTVT_NO_CACHE");
        let mut process = Process::start(command, &project, &format!("view x.lua --out ended_{number}"));
        let before = entries();
        until("another entry", || entries() > before || process.is_over());
        process.signal(signal);
        process.wait();
    }
    view("ended", "after");
}

/// A project whose script reads a mesh with a large image, which the cache keeps scaled down.
fn mesh_with_an_image() -> Project {
    let script = "local shape = softvt.mesh { file = 'm.obj' }\n\
                  return softvt.experiment { name = 'v', grid = { a = { 1 } }, run = function() return { v = shape:volume() } end }";
    let obj = "mtllib m.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\n\
               f 1/1 3/1 2/1\nf 1/1 2/1 4/1\nf 1/1 4/1 3/1\nf 2/1 3/1 4/1\n";
    let project = Project::new(&[("x.lua", script), ("m.obj", obj), ("m.mtl", "newmtl m\nmap_Kd m.png\n")]);
    image::RgbImage::new(2500, 1000).save(project.path("m.png")).expect("written");
    project
}

#[test]
fn a_large_image_of_a_mesh_file_is_scaled_down_once() {
    let project = mesh_with_an_image();
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
fn a_folder_that_cannot_be_written_costs_one_line() {
    let project = mesh_with_an_image();
    // Permissions do not stop an administrator; a file in place of the folder stops all.
    fs::write(project.path("file"), "mine").expect("written");
    let output = succeeds(&project, "file/cache", "x.lua");
    let warnings: Vec<&str> = output.err.lines().filter(|line| line.contains("cache")).collect();
    let [warning] = warnings[..] else { panic!("one line about the cache: {}", output.err) };
    assert!(warning.starts_with("softvt: warning: cannot "), "{warning}");
    assert!(warning.contains("file/cache") && warning.contains("SOFTVT_CACHE_DIR"), "{warning}");
    assert_eq!(fs::read_to_string(project.path("file")).expect("read"), "mine");
}

#[test]
fn the_command_shows_the_cache_and_removes_its_entries_alone() {
    let project = mesh_with_an_image();
    let empty = succeeds(&project, "kept", "cache");
    for line in ["folder   kept", "entries  0", "size     0.0 MB", "limit    1073.7 MB"] {
        assert!(empty.out.contains(line), "{line} in\n{}", empty.out);
    }
    assert!(!project.path("kept").exists(), "looking creates nothing");
    succeeds(&project, "kept", "x.lua");
    fs::write(project.path("kept/notes.txt"), "mine").expect("written");
    let shown = succeeds(&project, "kept", "cache").out;
    assert!(!shown.contains("entries  0"), "{shown}");
    let cleared = succeeds(&project, "kept", "cache --clear").out;
    assert!(cleared.starts_with("removed ") && cleared.contains("from kept"), "{cleared}");
    let left: Vec<String> = contents(&project.path("kept")).into_iter().map(|(name, _)| name).collect();
    assert_eq!(left, ["notes.txt"]);
    let mut command = project.command("cache");
    command.env("SOFTVT_NO_CACHE", "1");
    assert_eq!(run_command(command).out, "the cache is off: SOFTVT_NO_CACHE is set\n");
}
