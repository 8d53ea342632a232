//! Output of the binary for each fixture of `tests/fixtures/<topic>/`, compared with its snapshot.
//!
//! A fixture is a Lua file, whose messages (standard error) are compared, or a `.cmd` file of commands, whose standard
//! output is compared too. The commands are the lines `-- $ softvt …` of a Lua file, by default `softvt check` of the
//! file, and the lines `$ …` of a `.cmd` file, for the shell of Linux. They run in order in a copy of the folder of the
//! topic. Lua files in `tests/fixtures/` are modules of all topics, and subfolders of a topic hold its other files.

use std::{
    collections::BTreeSet,
    env,
    fmt::Write,
    fs,
    panic::{AssertUnwindSafe, catch_unwind},
    path::{Path, PathBuf},
    time::Duration,
};

use assert_cmd::{Command, cargo::cargo_bin};

/// Topics, each of which is a test and a folder.
macro_rules! topics {
    ($($topic:ident),* $(,)?) => {
        $(
            #[test]
            fn $topic() {
                compare_fixtures(stringify!($topic));
            }
        )*

        #[test]
        fn every_folder_of_fixtures_is_a_topic() {
            let folders = entries(&fixtures()).into_iter().filter(|path| path.is_dir());
            let folders: BTreeSet<String> = folders.map(|path| stem(&path)).collect();
            assert_eq!(folders, BTreeSet::from([$(stringify!($topic).to_owned()),*]));
        }
    };
}

topics!(
    cache,
    calibration,
    cheats,
    conditions,
    datasets,
    experiments,
    experts,
    goals,
    policies,
    reports,
    runs,
    scenes,
    scripts,
    usage,
    views,
    warnings
);

fn fixtures() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures")
}

/// Paths in a folder, in order.
fn entries(folder: &Path) -> Vec<PathBuf> {
    let mut paths: Vec<PathBuf> =
        fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path()).collect();
    paths.sort();
    paths
}

fn stem(path: &Path) -> String {
    path.file_stem().expect("a name").to_string_lossy().into_owned()
}

fn has_extension(path: &Path, extensions: &[&str]) -> bool {
    path.is_file() && path.extension().is_some_and(|found| extensions.iter().any(|one| found == *one))
}

/// Compares the output of every fixture of a topic, and fails after the last one if any differs.
fn compare_fixtures(topic: &str) {
    let folder = fixtures().join(topic);
    let (found, snapshots): (Vec<PathBuf>, Vec<PathBuf>) = entries(&folder)
        .into_iter()
        .filter(|path| has_extension(path, &["lua", "cmd", "snap"]))
        .partition(|path| has_extension(path, &["lua", "cmd"]));
    let names: BTreeSet<String> = found.iter().map(|path| stem(path)).collect();
    assert_eq!(names.len(), found.len(), "two fixtures of {topic} share a snapshot");
    let differing: Vec<String> =
        found.iter().filter(|fixture| can_run(fixture) && !is_as_before(fixture)).map(|f| stem(f)).collect();
    assert!(differing.is_empty(), "the output of {} differs from its snapshot", differing.join(", "));
    let orphans: Vec<String> =
        snapshots.iter().map(|path| stem(path)).filter(|name| !names.contains(name)).collect();
    assert!(orphans.is_empty(), "snapshots of no fixture: {}", orphans.join(", "));
}

/// True on Linux, and for a fixture without commands for its shell.
fn can_run(fixture: &Path) -> bool {
    cfg!(target_os = "linux") || has_extension(fixture, &["lua"])
}

/// Compares the output of a fixture with its snapshot, and prints the difference.
fn is_as_before(fixture: &Path) -> bool {
    let output = session(fixture);
    let mut settings = insta::Settings::clone_current();
    settings.set_snapshot_path(fixture.parent().expect("a folder"));
    settings.set_prepend_module_to_snapshot(false);
    settings.set_omit_expression(true);
    let compare = || settings.bind(|| insta::assert_snapshot!(stem(fixture), output));
    catch_unwind(AssertUnwindSafe(compare)).is_ok()
}

/// Commands of a fixture with their output, as a terminal shows them.
fn session(fixture: &Path) -> String {
    let folder = tempfile::tempdir().expect("a folder");
    let topic = fixture.parent().expect("a folder");
    for module in entries(&fixtures()).iter().filter(|path| has_extension(path, &["lua"])) {
        fs::copy(module, folder.path().join(module.file_name().expect("a name"))).expect("copied");
    }
    let run_in = folder.path().join(topic.file_name().expect("a name"));
    copy(topic, &run_in);
    let text = fs::read_to_string(fixture).expect("text");
    let mut commands: Vec<&str> =
        text.lines().filter_map(|line| line.trim_start_matches("-- ").strip_prefix("$ ")).collect();
    let check = format!("softvt check {}", fixture.file_name().expect("a name").to_string_lossy());
    let binary = cargo_bin!("softvt").parent().expect("a folder");
    let path = env::var_os("PATH").unwrap_or_default();
    let path =
        env::join_paths([binary.to_owned()].into_iter().chain(env::split_paths(&path))).expect("paths");
    if commands.is_empty() {
        commands.push(&check);
    }
    let before = entries(&run_in);
    let mut session = String::new();
    for line in commands {
        let mut command = Command::new("sh");
        command
            .current_dir(&run_in)
            .env("PATH", &path)
            .env("LC_ALL", "C")
            .args(["-c", line])
            .timeout(Duration::from_secs(110));
        let output = command.output().expect("started");
        writeln!(session, "$ {line}").expect("written");
        if has_extension(fixture, &["cmd"]) {
            session += &String::from_utf8_lossy(&output.stdout);
        }
        let messages = String::from_utf8_lossy(&output.stderr);
        messages.lines().filter(|line| !is_delayed(line)).for_each(|line| session += &format!("{line}\n"));
        match output.status.code() {
            Some(0) => {}
            code => writeln!(session, "exit code {}", code.unwrap_or(-1)).expect("written"),
        }
    }
    for path in entries(&run_in).iter().filter(|path| !before.contains(path)) {
        writeln!(session, "left: {}", stem(path)).expect("written");
    }
    session.replace(env!("CARGO_PKG_VERSION"), "VERSION").replace(&*folder.path().to_string_lossy(), "FOLDER")
}

/// True for a message that the binary prints when work has taken a second.
fn is_delayed(message: &str) -> bool {
    let works = ["checking", "running", "recording", "drawing", "rendering"];
    works.iter().any(|work| message.starts_with(&format!("softvt: {work} ")))
}

/// Copies the files of a folder and of its subfolders, without snapshots.
fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).expect("made");
    for path in entries(from).iter().filter(|path| !has_extension(path, &["snap", "new"])) {
        let target = to.join(path.file_name().expect("a name"));
        match path.is_dir() {
            true => copy(path, &target),
            false => drop(fs::copy(path, &target).expect("copied")),
        }
    }
}
