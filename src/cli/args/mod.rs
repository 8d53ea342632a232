//! What was typed, as commands: the words themselves are in [`super::flags`].

pub(crate) mod flags;
pub(crate) mod policy;

use std::path::{Path, PathBuf};

use clap::{ArgMatches, error::ErrorKind, parser::ValueSource};

use crate::{
    benchmark::seed::Split,
    cli::{
        args::policy::{PolicyArgs, PolicySpec},
        commands::{
            dataset::{export, import::Import},
            record::Record,
            replay,
        },
        error::CliError,
        run::{config::RunConfig, policy::PolicyConfig, recording::RecordingConfig},
    },
    dataset::lerobot::ExportConfig,
    policy::{profile::Profile, remote::Protocol},
    script::{self, OptionSpec},
};

/// A command.
#[derive(Debug)]
pub(crate) enum Command {
    /// Do what a script's plan says.
    Run(RunConfig),
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
    Check(RunConfig),
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
        which: replay::EpisodeSelector,
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
    /// Serve episodes to clients.
    Serve(Box<Serve>),
    /// Record demonstrations.
    Record(Record),
    /// Say what is wrong with a data set.
    DatasetCheck {
        /// Its folder, or one of its files.
        path: PathBuf,
        /// Most demonstrations to simulate again.
        replays: usize,
    },
    /// Re-execute demonstrations of other worlds.
    DatasetImport(Box<Import>),
    /// Say what is in a data set.
    DatasetStats {
        /// Its folder, or one of its files.
        path: PathBuf,
        /// Where to draw.
        out: Option<PathBuf>,
        /// As JSON.
        json: bool,
    },
    /// Export a data set for those who train.
    DatasetExport(ExportConfig),
    /// Check the installation.
    Doctor,
    /// Help or version was shown.
    Shown,
}

/// Which rollouts of a run become videos.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum VideoSelection {
    /// Those that are not safe.
    Failed,
    /// All.
    All,
    /// These episodes of each task.
    Episodes(Vec<u32>),
}

/// Which episode to draw, and how.
#[derive(Debug)]
pub(crate) struct View {
    /// Suite, policy, seed, shifts, settings and folder as for a run; its `tasks` name one.
    pub run: RunConfig,
    /// Episode of the task.
    pub episode: u32,
    /// Whether stills are in the cameras' own size.
    pub native: bool,
}

/// What to serve, where and to how many.
#[derive(Debug)]
pub(crate) struct Serve {
    /// Suite, seed, shifts and settings as for a run.
    pub run: RunConfig,
    /// What clients are shown and what their numbers mean.
    pub profile: Profile,
    /// Address to listen at.
    pub host: String,
    /// Port to listen at; 0 is any that is free.
    pub port: u16,
    /// Most clients at once.
    pub seats: usize,
    /// Which list of episodes, where a client names none.
    pub split: Split,
    /// Whether clients are told the true state.
    pub privileged: bool,
}

/// Reads the command line.
///
/// # Errors
/// Usage errors, with what was meant where it can be guessed.
pub(crate) fn parse(words: &[String]) -> Result<Command, CliError> {
    let options = match script_file(words) {
        Some(file) => script::declared_options(Path::new(file)).map_err(CliError::input)?,
        None => Vec::new(),
    };
    let named = |failure: CliError| match script_file(words) {
        Some(file) => CliError { message: format!("{file}: {}", failure.message), ..failure },
        None => failure,
    };
    let command = flags::command(&options).map_err(named)?;
    let matches = match command.try_get_matches_from(words) {
        Ok(matches) => matches,
        Err(error) if matches!(error.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion) => {
            crate::cli::output::print(&error.to_string());
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
            let which = m.get_one("episode").copied().unwrap_or(replay::EpisodeSelector::Line(0));
            Ok(Command::Replay { dir: PathBuf::from(text(m, "run")), which })
        }
        Some(("report", m)) => {
            let runs = many(m, "runs").into_iter().map(PathBuf::from).collect();
            Ok(Command::Report { runs, out: PathBuf::from(text(m, "out")) })
        }
        Some(("check", m)) => driven(common(m, &options).map_err(named)?, m).map(Command::Check),
        Some(("serve", m)) => {
            serve(common(m, &options).map_err(named)?, m).map(|serve| Command::Serve(Box::new(serve)))
        }
        Some(("doctor", _)) => Ok(Command::Doctor),
        Some(("record", m)) => {
            let record = record(m, &options).map_err(named)?;
            let output = RecordingConfig { run: driven(record.output.run, m)?, ..record.output };
            Ok(Command::Record(Record { output, ..record }))
        }
        Some(("dataset", m)) => dataset(m, &options).map_err(named),
        Some(("view", m)) => {
            let view = view(m, &options).map_err(named)?;
            Ok(Command::View(View { run: driven(view.run, m)?, ..view }))
        }
        _ => driven(run(&matches, &options).map_err(named)?, &matches).map(Command::Run),
    }
}

/// A usage error as it is told: the file first, since a script brings options of its own.
fn usage(file: Option<&str>, text: &str) -> CliError {
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
    CliError::input(message.trim_end())
}

/// The script among the words: the first that ends in `.lua`, unless it is the value of a flag that takes such a file.
fn script_file(words: &[String]) -> Option<&str> {
    let mut previous = "";
    for word in words.iter().skip(1) {
        if word.ends_with(".lua") && !word.starts_with('-') && !["--policy", "--profile"].contains(&previous)
        {
            return Some(word);
        }
        previous = word;
    }
    None
}

/// A flag's text; empty if it was not given.
pub(crate) fn text(matches: &ArgMatches, name: &str) -> String {
    matches.get_one::<String>(name).cloned().unwrap_or_default()
}

fn view(matches: &ArgMatches, options: &[OptionSpec]) -> Result<View, CliError> {
    let episode = matches.get_one("episode").copied().unwrap_or(0);
    let run = common(matches, options)?;
    let tasks = vec![text(matches, "task")];
    Ok(View { run: RunConfig { tasks, ..run }, episode, native: matches.get_flag("native") })
}

fn serve(run: RunConfig, matches: &ArgMatches) -> Result<Serve, CliError> {
    let given = |name: &&&str| matches.value_source(name) == Some(ValueSource::CommandLine);
    if let Some(flag) = flags::DRIVERS.iter().find(given) {
        return Err(CliError::input(format!("--{flag}: with softvt serve the client drives; leave it out")));
    }
    Ok(Serve {
        run,
        profile: typed(matches).profile()?.0,
        host: text(matches, "host"),
        port: matches.get_one("port").copied().unwrap_or_default(),
        seats: matches.get_one::<u16>("threads").map_or(1, |n| usize::from(*n)),
        split: matches.get_one("split").copied().unwrap_or_default(),
        privileged: matches.get_flag("privileged"),
    })
}

fn record(matches: &ArgMatches, options: &[OptionSpec]) -> Result<Record, CliError> {
    let demos = matches.get_one("demos").copied().unwrap_or(50);
    Ok(Record {
        output: output(matches, options)?,
        demos,
        attempts: matches.get_one("attempts").copied().unwrap_or(demos.saturating_mul(4).max(20)),
    })
}

/// What is common to all commands that make data sets.
fn output(matches: &ArgMatches, options: &[OptionSpec]) -> Result<RecordingConfig, CliError> {
    Ok(RecordingConfig {
        run: RunConfig {
            tasks: many(matches, "task"),
            threads: threads(matches),
            resume: matches.get_flag("resume"),
            // What touched what, and how hard, comes from it.
            trace: Some(false),
            ..common(matches, options)?
        },
        pictures: text(matches, "images") == "hdf5",
        privileged: !matches.get_flag("no-privileged"),
    })
}

fn import(matches: &ArgMatches, options: &[OptionSpec]) -> Result<Import, CliError> {
    let RecordingConfig { run, pictures, privileged } = output(matches, options)?;
    Ok(Import {
        output: RecordingConfig {
            run: RunConfig { policy: PolicyConfig::import(), ..run },
            pictures,
            privileged,
        },
        files: many(matches, "files").into_iter().map(PathBuf::from).collect(),
        attempts: matches.get_one("attempts").copied(),
        layout: matches.get_flag("layout"),
    })
}

fn dataset(matches: &ArgMatches, options: &[OptionSpec]) -> Result<Command, CliError> {
    Ok(match matches.subcommand() {
        Some(("stats", m)) => Command::DatasetStats {
            path: PathBuf::from(text(m, "path")),
            out: m.get_one::<String>("out").map(PathBuf::from),
            json: m.get_flag("json"),
        },
        Some(("export", m)) => Command::DatasetExport(export::typed(m)),
        Some(("import", m)) => Command::DatasetImport(Box::new(import(m, options)?)),
        Some((_, m)) => Command::DatasetCheck {
            path: PathBuf::from(text(m, "path")),
            replays: m.get_one("replay").copied().unwrap_or(1),
        },
        None => Command::Shown,
    })
}

/// Threads: as many as there are processors if it is not said.
pub(crate) fn threads(matches: &ArgMatches) -> usize {
    let available = std::thread::available_parallelism().map_or(1, |n| n.get());
    matches.get_one::<u16>("threads").map_or(available, |n| usize::from(*n))
}

/// What commands on scripts share.
fn common(matches: &ArgMatches, options: &[OptionSpec]) -> Result<RunConfig, CliError> {
    let mut script_words = Vec::new();
    for option in options {
        let id = format!("script:{}", option.name);
        if matches.value_source(&id) == Some(ValueSource::CommandLine) {
            script_words.push(format!("{}={}", option.flag(), text(matches, &id)));
        }
    }
    let out = matches.get_one::<String>("out");
    if out.is_some_and(|dir| dir.trim().is_empty()) {
        return Err(CliError::input("--out: expected a folder, got \"\"; \".\" is the one you are in"));
    }
    Ok(RunConfig {
        script_words,
        seed: matches.get_one("seed").copied().unwrap_or(0),
        shifts: many(matches, "shift").iter().map(|word| shift(word)).collect::<Result<_, _>>()?,
        twin: matches.contains_id("twin"),
        set: many(matches, "set").iter().map(|word| pair("--set", word)).collect::<Result<_, _>>()?,
        out: out.map(PathBuf::from),
        ..RunConfig::of(PathBuf::from(text(matches, "file")), PolicyConfig::expert())
    })
}

/// The same with the policy that was typed. What is wrong with its files names those files itself.
fn driven(run: RunConfig, matches: &ArgMatches) -> Result<RunConfig, CliError> {
    Ok(RunConfig { policy: policy::choose(typed(matches))?, ..run })
}

fn typed(matches: &ArgMatches) -> PolicyArgs {
    let given = |name: &str| matches.value_source(name) == Some(ValueSource::CommandLine);
    let protocol = || match text(matches, "protocol").as_str() {
        "vla-eval" => Protocol::VlaEval,
        _ => Protocol::Openpi,
    };
    PolicyArgs {
        word: matches.get_one("policy").cloned().unwrap_or(PolicySpec::Noop),
        name: matches.get_one("name").cloned(),
        profile: given("profile").then(|| text(matches, "profile")),
        protocol: given("protocol").then(protocol),
        replan: matches.get_one::<u16>("replan").filter(|_| given("replan")).map(|n| usize::from(*n)),
        binary: matches.get_one::<String>("gripper").map(|code| code == "binary"),
        patience: matches.get_one("policy-timeout").filter(|_| given("policy-timeout")).copied(),
    }
}

/// All values of a flag.
pub(crate) fn many(matches: &ArgMatches, name: &str) -> Vec<String> {
    matches.get_many::<String>(name).unwrap_or_default().cloned().collect()
}

fn run(matches: &ArgMatches, options: &[OptionSpec]) -> Result<RunConfig, CliError> {
    let video = matches.get_one::<String>("video").map(|word| match word.as_str() {
        "failed" => VideoSelection::Failed,
        "all" => VideoSelection::All,
        list => VideoSelection::Episodes(list.split(',').filter_map(|part| part.parse().ok()).collect()),
    });
    Ok(RunConfig {
        tasks: many(matches, "task"),
        episodes: matches.get_one("episodes").copied(),
        threads: threads(matches),
        trace: matches.get_one::<String>("trace").map(|kind| kind == "nodes"),
        video,
        resume: matches.get_flag("resume"),
        shard: matches.get_one("shard").copied(),
        require: matches.get_many("require").unwrap_or_default().cloned().collect(),
        json: matches.get_flag("json"),
        ..common(matches, options)?
    })
}

fn pair(flag: &str, word: &str) -> Result<(String, String), CliError> {
    let split = word.split_once('=').filter(|(name, value)| !name.is_empty() && !value.is_empty());
    let (name, value) =
        split.ok_or_else(|| CliError::input(format!("{flag}: expected NAME=VALUE, got {word:?}")))?;
    Ok((name.to_owned(), value.to_owned()))
}

fn shift(word: &str) -> Result<(String, f64), CliError> {
    let (name, value) = pair("--shift", word)?;
    let number = value.parse::<f64>().ok().filter(|n| n.is_finite());
    let number =
        number.ok_or_else(|| CliError::input(format!("--shift {name}: expected a number, got {value:?}")))?;
    Ok((name, number))
}
