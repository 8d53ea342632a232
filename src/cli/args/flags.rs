//! The words that may be typed, as clap knows them.

use std::time::Duration;

use clap::{Arg, ArgAction, value_parser};

use crate::{
    cli::{
        args::policy::{self, policy_word, profile_word},
        commands::{dataset::export, merge, replay},
        error::CliError,
        run::requirements,
    },
    script::{OptionSpec, OptionValue},
    serve::split_named,
};

/// The whole command with the script's options in a section of their own.
pub(crate) fn command(options: &[OptionSpec]) -> Result<clap::Command, CliError> {
    let mut command = runner();
    let own: Vec<String> = command
        .get_arguments()
        .filter_map(|a| a.get_long())
        .map(str::to_owned)
        .chain(["help".into(), "version".into()])
        .collect();
    for option in options {
        let long = option.flag().trim_start_matches("--").to_owned();
        if own.contains(&long) {
            let message =
                format!("the script declares the option --{long}, which is the runner's own; rename it");
            return Err(CliError::input(message));
        }
        command = command
            .arg(script_arg(option, long.clone()))
            .mut_subcommand("check", |check| check.arg(script_arg(option, long.clone())))
            .mut_subcommand("serve", |serve| serve.arg(script_arg(option, long.clone())))
            .mut_subcommand("view", |view| view.arg(script_arg(option, long.clone())))
            .mut_subcommand("record", |record| record.arg(script_arg(option, long.clone())))
            .mut_subcommand("dataset", |dataset| {
                dataset.mut_subcommand("import", |import| import.arg(script_arg(option, long)))
            });
    }
    Ok(command)
}

fn script_arg(option: &OptionSpec, long: String) -> Arg {
    let about = format!("{} [{}; default {}]", option.help, option.expects(), shown(&option.default));
    let arg = Arg::new(format!("script:{}", option.name))
        .long(long)
        .help(about)
        .help_heading("Options of the script");
    match option.default {
        OptionValue::Flag(_) => {
            arg.num_args(0..=1).require_equals(true).default_missing_value("on").value_name("on|off")
        }
        _ => arg.num_args(1).allow_hyphen_values(true).value_name(if option.unit.is_empty() {
            "VALUE"
        } else {
            "NUMBER"
        }),
    }
}

fn shown(value: &OptionValue) -> String {
    let joined = |parts: Vec<String>| parts.join(",");
    match value {
        OptionValue::Number(n) => n.to_string(),
        OptionValue::Integer(n) => n.to_string(),
        OptionValue::Text(text) => format!("{text:?}"),
        OptionValue::Flag(on) => if *on { "on" } else { "off" }.to_owned(),
        OptionValue::Numbers(list) => joined(list.iter().map(f64::to_string).collect()),
        OptionValue::Texts(list) => joined(list.clone()),
    }
}

/// A flag.
pub(crate) fn flag(name: &'static str, help: &'static str) -> Arg {
    Arg::new(name).long(name).help(help)
}

/// A flag whose values may be joined by commas, or given one by one.
pub(crate) fn list(name: &'static str, help: &'static str) -> Arg {
    flag(name, help).action(ArgAction::Append).value_delimiter(',')
}

/// A command on a script with what decides how an episode goes: who drives, and in what.
fn on_script(command: clap::Command) -> clap::Command {
    on_scenes(driver(command))
}

/// Who drives.
fn driver(command: clap::Command) -> clap::Command {
    command
        .arg(
            flag("policy", "Who drives")
                .value_name("POLICY")
                .default_value("expert")
                .value_parser(policy_word),
        )
        .arg(
            flag("profile", "What a policy gets and what its numbers mean")
                .value_name("PROFILE")
                .default_value(policy::PROFILE)
                .value_parser(profile_word),
        )
        .arg(
            flag("protocol", "How a policy's server talks")
                .value_name("PROTOCOL")
                .default_value("openpi")
                .value_parser(["openpi", "vla-eval"]),
        )
        .arg(
            flag("gripper", "Whether a policy's gripper is only open or shut, if its profile says otherwise")
                .value_name("CODE")
                .value_parser(["binary", "continuous"]),
        )
        .arg(
            flag("replan", "Actions of each of a policy's answers that are carried out")
                .value_name("N")
                .default_value("10")
                .value_parser(value_parser!(u16).range(1..)),
        )
        .arg(
            flag("policy-timeout", "Longest wait for a policy's server and for each of its answers, s")
                .value_name("SECONDS")
                .default_value("60")
                .value_parser(patience),
        )
        .arg(flag("name", "How results call the policy").value_name("NAME").value_parser(policy_name))
}

/// The script, and what changes its scenes and their physics.
fn on_scenes(command: clap::Command) -> clap::Command {
    command
        .arg(
            Arg::new("file").value_name("FILE.lua").help("The script whose plan to carry out").required(true),
        )
        .arg(
            flag("seed", "Base seed")
                .value_name("S")
                .default_value("0")
                .allow_hyphen_values(true)
                .value_parser(seed),
        )
        .arg(
            list("shift", "Changes of the scene that the suite declares, such as stiffness=0.5")
                .value_name("NAME=VALUE"),
        )
        .arg(
            flag("twin", "Makes every soft object rigid: same shapes, masses and looks")
                .value_name("KIND")
                .value_parser(["rigid"]),
        )
        .arg(
            flag("set", "Changes a setting, such as robot.gripper.effort=20")
                .value_name("PATH=VALUE")
                .action(ArgAction::Append),
        )
}

/// What says who drives: with `softvt serve` that is the client.
pub(crate) const DRIVERS: [&str; 5] = ["policy", "protocol", "replan", "policy-timeout", "name"];

fn server() -> clap::Command {
    let command = clap::Command::new("serve")
        .about("Serves episodes over a websocket, for somebody else to drive: docs/serve.md")
        .arg(
            flag("host", "Address of this machine to listen at")
                .value_name("HOST")
                .default_value("127.0.0.1"),
        )
        .arg(
            flag(
                "port",
                "Port to listen at; 0 is any that is free, and the first line of the output says which",
            )
            .value_name("PORT")
            .default_value("8765")
            .value_parser(value_parser!(u16)),
        )
        .arg(
            flag("threads", "Most clients at once; each has a thread and an episode of its own")
                .value_name("N")
                .default_value("8")
                .value_parser(value_parser!(u16).range(1..=1024)),
        )
        .arg(
            flag("split", "Which list of episodes, where a client names none")
                .value_name("SPLIT")
                .default_value("validation")
                .value_parser(|word: &str| split_named(word)),
        )
        .arg(
            flag(
                "privileged",
                "Tells clients the true state: poses, deformation, contact forces, limits, verdict",
            )
            .action(ArgAction::SetTrue),
        );
    let hidden = |command: clap::Command, name: &&'static str| command.mut_arg(*name, |arg| arg.hide(true));
    DRIVERS.iter().fold(on_script(command), hidden)
}

fn runner() -> clap::Command {
    let json = flag("json", "Print JSON on the standard output: one object for a suite or for conditions, an array for a list of suites, a line a row for an experiment").action(ArgAction::SetTrue);
    let about = "A safety-aware visuo-tactile manipulation benchmark for soft objects, on an ordinary CPU";
    on_script(clap::Command::new("softvt").version(env!("CARGO_PKG_VERSION")).about(about))
        .after_help("softvt FILE.lua --help shows the options of that script too.\nExit codes: 0 ok, 1 our own fault, 2 your input, 3 policy or transport, 99 --require not met, 130 interrupted.")
        .subcommand_negates_reqs(true)
        .args_conflicts_with_subcommands(true)
        .arg(list("task", "Only these tasks: indices or parts of prompts, joined by commas").value_name("TASK"))
        .arg(flag("episodes", "Episodes a task").value_name("N").value_parser(value_parser!(u32).range(1..)))
        .arg(flag("threads", "Threads; results do not depend on it").value_name("N").value_parser(value_parser!(u16).range(1..=1024)))
        .arg(flag("trace", "Writes a record of every control step; =nodes with node positions").num_args(0..=1).require_equals(true).default_missing_value("state").value_parser(["state", "nodes"]))
        .arg(flag("video", "Draws rollouts: those that are not safe, =all, or episodes such as =0,3").value_name("WHICH").num_args(0..=1).require_equals(true).default_missing_value("failed").value_parser(video))
        .arg(flag("out", "Where to write; a folder without a run in it").value_name("DIR"))
        .arg(flag("resume", "Goes on with the run in --out, if one was broken off there").action(ArgAction::SetTrue).requires("out"))
        .arg(flag("shard", "Does the I-th of N parts of the run; softvt merge puts them together").value_name("I/N").value_parser(merge::parse))
        .arg(flag("require", "What each suite's results must reach, such as \"safety>=0.9\"; exit code 99 if not").value_name("RULE").action(ArgAction::Append).value_parser(requirements::parse))
        .arg(json.clone())
        .subcommand(
            clap::Command::new("list")
                .about("Lists suites, tasks, assets or policies")
                .arg(Arg::new("what").required(true).value_parser(["suites", "tasks", "assets", "policies", "profiles"]))
                .arg(json.clone()),
        )
        .subcommand(
            clap::Command::new("replay")
                .about("Simulates a recorded episode again: exit code 0 if every byte comes out the same")
                .arg(Arg::new("run").value_name("RUN").required(true).help("The folder of a run"))
                .arg(Arg::new("episode").value_name("EPISODE").required(true).help("TASK/EPISODE, or the number of its line from 0").value_parser(replay::which)),
        )
        .subcommand(
            clap::Command::new("report")
                .about("Writes one page about runs (report.html), and its tables as markdown and LaTeX")
                .arg(Arg::new("runs").value_name("RUN").required(true).num_args(1..).help("Folders of runs, or folders with runs in them"))
                .arg(flag("out", "Where to write").value_name("DIR").default_value("report")),
        )
        .subcommand(
            clap::Command::new("merge")
                .about("Puts the shards of a run together: the folder that one run would have left")
                .arg(Arg::new("out").value_name("OUT").required(true).help("A new folder"))
                .arg(Arg::new("shards").value_name("SHARD").required(true).num_args(1..).help("The folders of all shards")),
        )
        .subcommand(
            clap::Command::new("compare")
                .about("Compares two runs of the same episodes, episode by episode")
                .arg(Arg::new("first").value_name("A").required(true).help("A run's folder, or one with runs in it"))
                .arg(Arg::new("second").value_name("B").required(true).help("Another"))
                .arg(json),
        )
        .subcommand(
            clap::Command::new("init")
                .about("Writes editor stubs for Lua scripts into a folder")
                .args_conflicts_with_subcommands(true)
                .arg(Arg::new("dir").default_value("."))
                .subcommand(
                    clap::Command::new("task")
                        .about("Writes a commented suite and its object to start from, too")
                        .arg(Arg::new("dir").default_value(".")),
                ),
        )
        .subcommand(on_script(
            clap::Command::new("check").about("Says what is wrong with a script, without running it"),
        ))
        .subcommand(
            on_script(clap::Command::new("view").about("Draws one episode: a video and stills of every stream"))
                .arg(flag("task", "The task: its index or part of its prompt").value_name("TASK").default_value("0"))
                .arg(flag("episode", "The episode of the task").value_name("N").default_value("0").value_parser(value_parser!(u32)))
                .arg(flag("native", "Stills in the cameras' own size: 1024 and 512 pixels instead of 224").action(ArgAction::SetTrue))
                .arg(flag("out", "Where to write").value_name("DIR").required(true)),
        )
        .subcommand(server())
        .subcommand(record())
        .subcommand(dataset())
        .subcommand(clap::Command::new("doctor").about("Checks the installation and runs a golden episode"))
}

fn record() -> clap::Command {
    let about = "Records demonstrations: HDF5, videos, and a manifest";
    data_set(on_script(clap::Command::new("record").about(about)))
        .arg(
            flag("demos", "Demonstrations a task")
                .value_name("N")
                .default_value("50")
                .value_parser(value_parser!(u32).range(1..=100_000)),
        )
        .arg(
            list("task", "Only these tasks: indices or parts of prompts, joined by commas")
                .value_name("TASK"),
        )
        .arg(
            flag(
                "attempts",
                "Most attempts at a task, kept or not [default: 4 a demonstration, at least 20]",
            )
            .value_name("N")
            .value_parser(value_parser!(u32).range(1..=1_000_000)),
        )
}

fn import() -> clap::Command {
    let about = "Re-executes demonstrations of robomimic, LIBERO, SoftVTBench or softvt in a suite, and records those that are safe and \
                 reach the goal";
    data_set(on_scenes(clap::Command::new("import").about(about)))
        .arg(
            Arg::new("files").value_name("FILE.hdf5").required(true).num_args(1..).help("Files of demonstrations"),
        )
        .arg(
            flag("task", "The task of all these demonstrations, if they do not say it: its index or part of its prompt")
                .value_name("TASK")
                .action(ArgAction::Append),
        )
        .arg(
            flag("attempts", "Most demonstrations of a task to re-execute, the first ones [default: all]")
                .value_name("N")
                .value_parser(value_parser!(u32).range(1..=1_000_000)),
        )
        .arg(
            flag("layout", "Objects start where the suite's layouts put them, whatever the files say")
                .action(ArgAction::SetTrue),
        )
}

/// What commands have in common that make data sets.
fn data_set(command: clap::Command) -> clap::Command {
    command
        .arg(
            flag("out", "Where to write: a new folder, or with --resume that of a recording")
                .value_name("DIR")
                .required(true),
        )
        .arg(
            flag("images", "Where pictures are: in the HDF5 files and as videos, or only as videos")
                .value_name("WHERE")
                .default_value("hdf5")
                .value_parser(["hdf5", "video"]),
        )
        .arg(
            flag("no-privileged", "Leaves out the true state: node positions, deformation, contact, forces")
                .action(ArgAction::SetTrue),
        )
        .arg(
            flag("threads", "Threads; the data do not depend on it")
                .value_name("N")
                .value_parser(value_parser!(u16).range(1..=1024)),
        )
        .arg(
            flag("resume", "Goes on with the recording in --out, if one was broken off there")
                .action(ArgAction::SetTrue),
        )
}

fn dataset() -> clap::Command {
    let path =
        || Arg::new("path").value_name("DATASET").required(true).help("Its folder, or one of its HDF5 files");
    clap::Command::new("dataset")
        .about("Inspects recorded demonstrations, exports them, and takes in those of others")
        .subcommand_required(true)
        .arg_required_else_help(true)
        .subcommand(
            clap::Command::new("check")
                .about("Says what is wrong with a data set: counts, shapes, rates, numbers, videos, and whether it can be repeated")
                .arg(path())
                .arg(flag("replay", "Demonstrations to simulate again, spread over the tasks: a number, or all").value_name("N").default_value("1").value_parser(replays)),
        )
        .subcommand(export::command(path()))
        .subcommand(import())
        .subcommand(
            clap::Command::new("stats")
                .about("Prints and draws the distributions of actions, lengths and deformations")
                .arg(path())
                .arg(flag("out", "Where to draw [default: stats.svg in the folder of the data set]").value_name("FILE.svg"))
                .arg(flag("json", "Print JSON on the standard output").action(ArgAction::SetTrue)),
        )
}

fn video(word: &str) -> Result<String, String> {
    let episodes = || word.split(',').all(|part| part.parse::<u32>().is_ok());
    if matches!(word, "failed" | "all") || episodes() {
        Ok(word.to_owned())
    } else {
        Err("expected failed, all, or episodes such as 0,3".to_owned())
    }
}

fn replays(word: &str) -> Result<usize, String> {
    match word {
        "all" => Ok(usize::MAX),
        number => number.parse().map_err(|_| "expected a number, or all".to_owned()),
    }
}

fn patience(word: &str) -> Result<Duration, String> {
    let seconds = word.parse().ok().filter(|seconds| (0.01..=86_400.0).contains(seconds));
    seconds.map(Duration::from_secs_f64).ok_or_else(|| "expected seconds in 0.01..86400".to_owned())
}

fn policy_name(word: &str) -> Result<String, String> {
    let fits = !word.trim().is_empty() && word.len() <= 80 && !word.chars().any(char::is_control);
    if fits { Ok(word.to_owned()) } else { Err("expected a name of 1 to 80 letters".to_owned()) }
}

fn seed(word: &str) -> Result<u64, String> {
    word.parse().map_err(|_| format!("expected a whole number in 0..{}", u64::MAX))
}
