//! What may be typed: the runner's own flags and, beside them, the options that a script declares.

use std::{
    path::{Path, PathBuf},
    time::Duration,
};

use clap::{Arg, ArgAction, ArgMatches, error::ErrorKind, parser::ValueSource, value_parser};

use super::{
    Failure, code,
    drivers::{Choice, policy_word},
    replay,
    require::{self, Requirement},
    shard::{self, Shard},
};
use crate::{
    benchmark::Suite,
    policy::remote::Protocol,
    script::{self, OptionSpec, OptionValue},
};

/// A command.
#[derive(Debug)]
pub enum Command {
    /// Do what a script's plan says.
    Run(Run),
    /// List what there is.
    List {
        /// Suites, tasks, assets or policies.
        what: String,
        /// As JSON.
        json: bool,
    },
    /// Set up a folder for scripts.
    Init {
        /// The folder.
        dir: PathBuf,
        /// With a suite to start from.
        task: bool,
    },
    /// Say what is wrong with a script, without running it.
    Check(Run),
    /// Compare two runs.
    Compare {
        /// Folder of the first.
        first: PathBuf,
        /// Folder of the second.
        second: PathBuf,
        /// As JSON.
        json: bool,
    },
    /// Put the shards of a run together.
    Merge {
        /// New folder.
        out: PathBuf,
        /// Their folders.
        shards: Vec<PathBuf>,
    },
    /// Simulate a recorded episode again.
    Replay {
        /// Folder of the run.
        dir: PathBuf,
        /// Which of its episodes.
        which: replay::Which,
    },
    /// Write a page about runs.
    Report {
        /// Their folders.
        runs: Vec<PathBuf>,
        /// Where to write.
        out: PathBuf,
    },
    /// Draw one episode.
    View(View),
    /// Check the installation.
    Doctor,
    /// Help or version was shown.
    Shown,
}

/// What to run and how.
#[derive(Clone, Debug)]
pub struct Run {
    /// The script.
    pub file: PathBuf,
    /// Words for the script's own options.
    pub script_words: Vec<String>,
    /// Who drives.
    pub policy: Choice,
    /// Tasks to run: indices or parts of prompts; all if empty.
    pub tasks: Vec<String>,
    /// Episodes a task; the suite's own number if none.
    pub episodes: Option<u32>,
    /// Base seed.
    pub seed: u64,
    /// Threads.
    pub threads: usize,
    /// Shifts by name and value.
    pub shifts: Vec<(String, f64)>,
    /// Whether soft objects are made rigid.
    pub twin: bool,
    /// Settings by path and value.
    pub set: Vec<(String, String)>,
    /// Whether to write a trace, and whether with node positions.
    pub trace: Option<bool>,
    /// Which rollouts to draw.
    pub video: Option<Video>,
    /// Where to write.
    pub out: Option<PathBuf>,
    /// Whether to go on with a run that was broken off.
    pub resume: bool,
    /// The part of the run to do.
    pub shard: Option<Shard>,
    /// What the results must reach.
    pub require: Vec<Requirement>,
    /// Print JSON instead of tables.
    pub json: bool,
}

impl Run {
    /// A script under a policy, one thread, all else as it is by default.
    pub fn of(file: PathBuf, policy: Choice) -> Self {
        Self {
            file,
            policy,
            script_words: Vec::new(),
            tasks: Vec::new(),
            episodes: None,
            seed: 0,
            threads: 1,
            shifts: Vec::new(),
            twin: false,
            set: Vec::new(),
            trace: None,
            video: None,
            out: None,
            resume: false,
            shard: None,
            require: Vec::new(),
            json: false,
        }
    }

    /// A suite's name in results: that of a twin is its own, though its episodes start as the suite's do.
    pub fn name_of(&self, suite: &Suite) -> String {
        let twin = if self.twin { "_rigid_twin" } else { "" };
        format!("{}{twin}", suite.name)
    }
}

/// Which rollouts of a run become videos.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Video {
    /// Those that are not safe.
    Failed,
    /// All.
    All,
    /// These episodes of each task.
    Episodes(Vec<u32>),
}

/// Which episode to draw, and how.
#[derive(Debug)]
pub struct View {
    /// Suite, policy, seed, shifts, settings and folder as for a run; its `tasks` name one.
    pub run: Run,
    /// Episode of the task.
    pub episode: u32,
    /// Whether stills are in the cameras' own size.
    pub native: bool,
}

/// Reads the command line.
///
/// # Errors
/// Usage errors, with what was meant where it can be guessed.
pub fn parse(words: &[String]) -> Result<Command, Failure> {
    let options = match script_file(words) {
        Some(file) => script::declared_options(Path::new(file)).map_err(Failure::input)?,
        None => Vec::new(),
    };
    let named = |failure: Failure| match script_file(words) {
        Some(file) => Failure { message: format!("{file}: {}", failure.message), ..failure },
        None => failure,
    };
    let command = command(&options).map_err(named)?;
    let matches = match command.try_get_matches_from(words) {
        Ok(matches) => matches,
        Err(error) if matches!(error.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion) => {
            super::print(&error.to_string());
            return Ok(Command::Shown);
        }
        Err(error) => return Err(usage(script_file(words), &error.to_string())),
    };
    match matches.subcommand() {
        Some(("list", m)) => Ok(Command::List { what: text(m, "what"), json: m.get_flag("json") }),
        Some(("init", m)) => {
            let task = m.subcommand_matches("task");
            Ok(Command::Init { dir: PathBuf::from(text(task.unwrap_or(m), "dir")), task: task.is_some() })
        }
        Some(("compare", m)) => {
            let [first, second] = ["first", "second"].map(|name| PathBuf::from(text(m, name)));
            Ok(Command::Compare { first, second, json: m.get_flag("json") })
        }
        Some(("merge", m)) => {
            let shards = many(m, "shards").into_iter().map(PathBuf::from).collect();
            Ok(Command::Merge { out: PathBuf::from(text(m, "out")), shards })
        }
        Some(("replay", m)) => {
            let which = m.get_one("episode").copied().unwrap_or(replay::Which::Line(0));
            Ok(Command::Replay { dir: PathBuf::from(text(m, "run")), which })
        }
        Some(("report", m)) => {
            let runs = many(m, "runs").into_iter().map(PathBuf::from).collect();
            Ok(Command::Report { runs, out: PathBuf::from(text(m, "out")) })
        }
        Some(("check", m)) => common(m, &options).map(Command::Check).map_err(named),
        Some(("doctor", _)) => Ok(Command::Doctor),
        Some(("view", m)) => view(m, &options).map(Command::View).map_err(named),
        _ => run(&matches, &options).map(Command::Run).map_err(named),
    }
}

/// A usage error as it is told: the file first, since a script brings options of its own.
fn usage(file: Option<&str>, text: &str) -> Failure {
    // A value that looks like a flag is never meant here: scripts take no positional words.
    let told = text.lines().filter(|line| !line.contains("tip: to pass '"));
    let mut message = file.map_or(String::new(), |file| format!("{file}: "));
    let mut blank = false;
    for line in told.map(|line| line.strip_prefix("error: ").unwrap_or(line)) {
        if !(blank && line.is_empty()) {
            message += line;
            message.push('\n');
        }
        blank = line.is_empty();
    }
    Failure { code: code::INPUT, message: message.trim_end().to_owned() }
}

/// The script among the words: the first that ends in `.lua`, unless it is the value of `--policy`.
fn script_file(words: &[String]) -> Option<&str> {
    let mut previous = "";
    for word in words.iter().skip(1) {
        if word.ends_with(".lua") && !word.starts_with('-') && previous != "--policy" {
            return Some(word);
        }
        previous = word;
    }
    None
}

fn text(matches: &ArgMatches, name: &str) -> String {
    matches.get_one::<String>(name).cloned().unwrap_or_default()
}

/// The whole command with the script's options in a section of their own.
fn command(options: &[OptionSpec]) -> Result<clap::Command, Failure> {
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
            return Err(Failure::input(message));
        }
        command = command
            .arg(script_arg(option, long.clone()))
            .mut_subcommand("check", |check| check.arg(script_arg(option, long.clone())))
            .mut_subcommand("view", |view| view.arg(script_arg(option, long)));
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

fn flag(name: &'static str, help: &'static str) -> Arg {
    Arg::new(name).long(name).help(help)
}

fn list(name: &'static str, help: &'static str) -> Arg {
    flag(name, help).action(ArgAction::Append).value_delimiter(',')
}

/// A command on a script with what decides how an episode goes.
fn on_script(command: clap::Command) -> clap::Command {
    command
        .arg(
            Arg::new("file").value_name("FILE.lua").help("The script whose plan to carry out").required(true),
        )
        .arg(
            flag("policy", "Who drives")
                .value_name("POLICY")
                .default_value("expert")
                .value_parser(policy_word),
        )
        .arg(
            flag("profile", "What a policy gets and what its numbers mean")
                .value_name("PROFILE")
                .default_value("visuo_tactile"),
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
        .arg(flag("shard", "Does the I-th of N parts of the run; softvt merge puts them together").value_name("I/N").value_parser(shard::parse))
        .arg(flag("require", "What each suite's results must reach, such as \"safety>=0.9\"; exit code 99 if not").value_name("RULE").action(ArgAction::Append).value_parser(require::parse))
        .arg(json.clone())
        .subcommand(
            clap::Command::new("list")
                .about("Lists suites, tasks, assets or policies")
                .arg(Arg::new("what").required(true).value_parser(["suites", "tasks", "assets", "policies"]))
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
        .subcommand(clap::Command::new("doctor").about("Checks the installation and runs a golden episode"))
}

fn video(word: &str) -> Result<String, String> {
    let episodes = || word.split(',').all(|part| part.parse::<u32>().is_ok());
    if matches!(word, "failed" | "all") || episodes() {
        Ok(word.to_owned())
    } else {
        Err("expected failed, all, or episodes such as 0,3".to_owned())
    }
}

fn view(matches: &ArgMatches, options: &[OptionSpec]) -> Result<View, Failure> {
    let episode = matches.get_one("episode").copied().unwrap_or(0);
    let run = common(matches, options)?;
    let tasks = vec![text(matches, "task")];
    Ok(View { run: Run { tasks, ..run }, episode, native: matches.get_flag("native") })
}

/// What commands on scripts share.
fn common(matches: &ArgMatches, options: &[OptionSpec]) -> Result<Run, Failure> {
    let mut script_words = Vec::new();
    for option in options {
        let id = format!("script:{}", option.name);
        if matches.value_source(&id) == Some(ValueSource::CommandLine) {
            script_words.push(format!("{}={}", option.flag(), text(matches, &id)));
        }
    }
    let out = matches.get_one::<String>("out");
    if out.is_some_and(|dir| dir.trim().is_empty()) {
        return Err(Failure::input("--out: expected a folder, got \"\"; \".\" is the one you are in"));
    }
    Ok(Run {
        script_words,
        seed: matches.get_one("seed").copied().unwrap_or(0),
        shifts: many(matches, "shift").iter().map(|word| shift(word)).collect::<Result<_, _>>()?,
        twin: matches.contains_id("twin"),
        set: many(matches, "set").iter().map(|word| pair("--set", word)).collect::<Result<_, _>>()?,
        out: out.map(PathBuf::from),
        ..Run::of(PathBuf::from(text(matches, "file")), choice(matches))
    })
}

fn choice(matches: &ArgMatches) -> Choice {
    Choice {
        word: text(matches, "policy"),
        name: matches.get_one("name").cloned(),
        profile: text(matches, "profile"),
        protocol: match text(matches, "protocol").as_str() {
            "vla-eval" => Protocol::VlaEval,
            _ => Protocol::Openpi,
        },
        replan: matches.get_one::<u16>("replan").map_or(10, |n| usize::from(*n)),
        binary: matches.get_one::<String>("gripper").map(|code| code == "binary"),
        patience: matches.get_one("policy-timeout").copied().unwrap_or_default(),
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

fn many(matches: &ArgMatches, name: &str) -> Vec<String> {
    matches.get_many::<String>(name).unwrap_or_default().cloned().collect()
}

fn run(matches: &ArgMatches, options: &[OptionSpec]) -> Result<Run, Failure> {
    let available = std::thread::available_parallelism().map_or(1, |n| n.get());
    let video = matches.get_one::<String>("video").map(|word| match word.as_str() {
        "failed" => Video::Failed,
        "all" => Video::All,
        list => Video::Episodes(list.split(',').filter_map(|part| part.parse().ok()).collect()),
    });
    Ok(Run {
        tasks: many(matches, "task"),
        episodes: matches.get_one("episodes").copied(),
        threads: matches.get_one::<u16>("threads").map_or(available, |n| usize::from(*n)),
        trace: matches.get_one::<String>("trace").map(|kind| kind == "nodes"),
        video,
        resume: matches.get_flag("resume"),
        shard: matches.get_one("shard").copied(),
        require: matches.get_many("require").unwrap_or_default().cloned().collect(),
        json: matches.get_flag("json"),
        ..common(matches, options)?
    })
}

fn seed(word: &str) -> Result<u64, String> {
    word.parse().map_err(|_| format!("expected a whole number in 0..{}", u64::MAX))
}

fn pair(flag: &str, word: &str) -> Result<(String, String), Failure> {
    let split = word.split_once('=').filter(|(name, value)| !name.is_empty() && !value.is_empty());
    let (name, value) =
        split.ok_or_else(|| Failure::input(format!("{flag}: expected NAME=VALUE, got {word:?}")))?;
    Ok((name.to_owned(), value.to_owned()))
}

fn shift(word: &str) -> Result<(String, f64), Failure> {
    let (name, value) = pair("--shift", word)?;
    let number = value.parse::<f64>().ok().filter(|n| n.is_finite());
    let number =
        number.ok_or_else(|| Failure::input(format!("--shift {name}: expected a number, got {value:?}")))?;
    Ok((name, number))
}
