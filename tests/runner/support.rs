//! Runs of small projects in this process, by the library. Scripts are named by absolute paths, since tests run on
//! threads of one process and share its working folder, the repository; messages are returned without the folder of the
//! project.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::{Arc, LazyLock, Mutex, OnceLock},
    time::Duration,
};

use softvt::{
    benchmark::{ShiftValue, seed::SecretSeed},
    parallel::lock,
    policy::profile::GripCode,
    report::{
        page,
        run_summary::{caveats, summarize_runs},
        tables::{all_tables, formats::markdown},
    },
    runner::{
        BuiltinPolicy, ConfiguredScript, Observer, PolicyConfig, PolicyOptions, RunConfig, RunError,
        RunErrorCause, SuiteChecker, SuiteResult, TraceDetail, conditions,
        episode_selector::EpisodeSelector,
        experiment::{self, ExperimentOutput},
        replay::{self, SecretFile},
        run_suites,
    },
    runs::{
        record::EpisodeRecord,
        shard_merge,
        stored_run::{self, StoredRun},
    },
    script::ExperimentRow,
};

#[path = "../project/mod.rs"]
mod project;

pub use project::{Project, Small, client, files};

/// The module `solids` of the fixtures.
pub const SOLIDS: (&str, &str) = ("solids.lua", include_str!("../fixtures/solids.lua"));
/// A suite that is embedded in the binary.
pub const SPATIAL_SOFT: &str = "suites/spatial_soft.lua";
pub const PUSHED_CUBE: &str = include_str!("../fixtures/pushed.lua");
pub const MISPLACED_CUBE: &str = include_str!("../fixtures/misplaced.lua");

/// Checks that a message has a part.
#[track_caller]
pub fn assert_contains(message: impl AsRef<str>, part: &str) {
    let message = message.as_ref();
    assert!(message.contains(part), "{part:?} is not in:\n{message}");
}

/// Messages and lines of progress.
#[derive(Default)]
pub struct Messages(Mutex<Vec<String>>);

impl Observer for Messages {
    fn notice(&self, message: &str) {
        lock(&self.0).push(message.to_owned());
    }

    fn advance(&self, line: &str) {
        self.notice(line);
    }
}

impl Messages {
    /// All of them, one per line.
    pub fn text(&self) -> String {
        lock(&self.0).join("\n")
    }
}

impl Project {
    /// A project with a script of `tests/data/` as `x.lua`.
    pub fn of(script: &str) -> Self {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(script);
        let text = fs::read_to_string(&path).unwrap_or_else(|e| panic!("{script}: {e}"));
        Self::new(&[("x.lua", &text), SOLIDS])
    }

    /// Replaces a part of a text file.
    pub fn replace(&self, path: &str, from: &str, to: &str) {
        let text = self.text(path);
        assert!(text.contains(from), "{from} in {path}:\n{text}");
        self.write(path, text.replace(from, to).as_bytes());
    }

    /// A new project that tests share. Its folder stays until the next run of the tests.
    pub fn shared(name: &str, files: &[(&str, &str)]) -> Self {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        if folder.exists() {
            fs::remove_dir_all(&folder).expect("removed");
        }
        let project = Self { folder, is_kept: true };
        files.iter().for_each(|(path, text)| project.write(path, text.as_bytes()));
        project
    }

    /// A run of a script of the project or of the repository.
    pub fn run(&self, file: &str) -> Run<'_> {
        let messages = Arc::new(Messages::default());
        let config = RunConfig { observer: messages.clone(), ..RunConfig::of(self.found(file)) };
        Run { project: self, config, policy: PolicyOptions::default(), messages }
    }

    /// A file of the project, or else of the repository.
    fn found(&self, file: &str) -> PathBuf {
        let own = self.path(file);
        if own.exists() || !Path::new(file).exists() { own } else { file.into() }
    }

    /// A text without the folder of the project.
    pub fn relative(&self, text: impl ToString) -> String {
        let folder = self.path("").display().to_string();
        text.to_string().replace(&folder, "").replace(folder.trim_end_matches('/'), ".")
    }

    /// The message of an error, without the folder of the project.
    pub fn message<T>(&self, outcome: Result<T, impl ToString>) -> String {
        match outcome {
            Ok(_) => panic!("no error"),
            Err(error) => self.relative(error),
        }
    }

    /// The runs in a folder.
    pub fn stored(&self, folder: &str) -> Result<Vec<StoredRun>, String> {
        stored_run::load(&self.path(folder)).map_err(|error| self.relative(error))
    }

    /// Merges the runs of shards into `out`.
    pub fn merge(&self, out: &str, shards: &[&str]) -> Result<(), String> {
        let shards: Vec<PathBuf> = shards.iter().map(|shard| self.path(shard)).collect();
        shard_merge::merge(&self.path(out), &shards).map(drop).map_err(|error| self.relative(error))
    }

    /// The report of the runs in some folders, as `softvt report` writes it into the folder `page`.
    pub fn report(&self, runs: &[&str]) -> Report {
        let stored =
            runs.iter().flat_map(|run| self.stored(run).unwrap_or_else(|message| panic!("{message}")));
        let summaries = summarize_runs(stored.collect());
        let warnings = caveats(&summaries).into_iter().map(|warning| self.relative(warning)).collect();
        let markdown: Vec<String> = all_tables(&summaries).iter().map(markdown).collect();
        let html = page::page(&summaries, &page::Thumbnails::new(), &self.path("page"));
        Report { html: self.relative(html), markdown: self.relative(markdown.join("\n")), warnings }
    }

    /// Simulates an episode of a run again. Returns the first difference from its record.
    pub fn replay(&self, run: &str, episode: &str, secret: Option<&str>) -> Result<Option<String>, String> {
        let stored = self.stored(run)?;
        let [stored] = &stored[..] else { panic!("{run} has {} runs", stored.len()) };
        let secret = secret.map(|file| SecretFile {
            path: file.into(),
            secret: SecretSeed::new(self.text(file).as_bytes()),
        });
        let simulate = || {
            let episode = episode.parse::<EpisodeSelector>().expect("an episode");
            let observer = Arc::new(Messages::default());
            Ok(replay::replay_episode(stored, episode, secret.as_ref(), false, observer)?.difference)
        };
        simulate().map_err(|error: RunError| self.relative(error))
    }

    /// True if the simulation of an episode by its actions gives its record, byte by byte.
    pub fn is_reproduced(&self, run: &str, episode: &str) -> bool {
        let difference = self.replay(run, episode, None).unwrap_or_else(|message| panic!("{message}"));
        difference.is_none()
    }
}

/// A report of runs.
pub struct Report {
    pub html: String,
    pub markdown: String,
    /// Problems of the runs.
    pub warnings: Vec<String>,
}

/// A run that is to be made: its configuration, and the policy that it loads.
#[derive(Clone)]
pub struct Run<'a> {
    pub project: &'a Project,
    pub config: RunConfig,
    pub policy: PolicyOptions,
    pub messages: Arc<Messages>,
}

/// Results of a run, and its messages.
pub struct Finished {
    pub results: Vec<SuiteResult>,
    pub messages: String,
}

impl Run<'_> {
    /// With a changed configuration.
    pub fn with(mut self, change: impl FnOnce(&mut RunConfig)) -> Self {
        change(&mut self.config);
        self
    }

    /// With other options of the policy.
    pub fn with_policy(mut self, change: impl FnOnce(&mut PolicyOptions)) -> Self {
        change(&mut self.policy);
        self
    }

    /// With a policy: a name, a file, a run or an address.
    pub fn policy(self, word: &str) -> Self {
        let found = self.project.found(word);
        let is_path = BuiltinPolicy::named(word).is_none() && found.exists();
        let word = if is_path { found.display().to_string() } else { word.to_owned() };
        self.with_policy(|policy| policy.policy = word.parse().expect("a policy"))
    }

    /// By a profile: a name, or a file of the project.
    pub fn profile(self, word: &str) -> Self {
        let file = self.project.path(word);
        let word = if file.exists() { file.display().to_string() } else { word.to_owned() };
        self.with_policy(|policy| policy.profile = Some(word))
    }

    pub fn timeout(self, timeout: Duration) -> Self {
        self.with_policy(|policy| policy.timeout = Some(timeout))
    }

    pub fn replan(self, count: u16) -> Self {
        self.with_policy(|policy| policy.replan = Some(count))
    }

    pub fn gripper(self, code: GripCode) -> Self {
        self.with_policy(|policy| policy.gripper = Some(code))
    }

    pub fn episodes(self, count: u32) -> Self {
        self.with(|config| config.episodes = Some(count))
    }

    pub fn tasks(self, tasks: &[usize]) -> Self {
        self.with(|config| config.tasks = tasks.iter().map(ToString::to_string).collect())
    }

    pub fn threads(self, count: u16) -> Self {
        self.with(|config| config.threads = Some(count))
    }

    pub fn shard(self, shard: &str) -> Self {
        self.with(|config| config.shard = Some(shard.parse().expect("a shard")))
    }

    pub fn seed(self, seed: u64) -> Self {
        self.with(|config| config.seed = seed)
    }

    /// With the secret in a file of the project.
    pub fn secret(self, file: &str) -> Self {
        let secret = SecretSeed::new(self.project.text(file).as_bytes());
        self.with(|config| config.secret = Some(secret))
    }

    pub fn shift(self, name: &str, value: f64) -> Self {
        self.with(|config| config.shifts.push(ShiftValue { name: name.to_owned(), value }))
    }

    pub fn set(self, path: &str, value: impl ToString) -> Self {
        self.with(|config| config.settings.push((path.to_owned(), value.to_string())))
    }

    /// With soft objects that are made rigid.
    pub fn twin(self) -> Self {
        self.with(|config| config.rigid_twin = true)
    }

    /// Varied by a file.
    pub fn vary(self, file: &str) -> Self {
        let file = self.project.found(file);
        self.with(|config| config.vary = Some(file))
    }

    pub fn trace(self, detail: TraceDetail) -> Self {
        self.with(|config| config.trace = Some(detail))
    }

    /// Into a folder of the project.
    pub fn out(self, folder: &str) -> Self {
        let folder = self.project.path(folder);
        self.with(|config| config.out = Some(folder))
    }

    pub fn resume(self) -> Self {
        self.with(|config| config.resume = true)
    }

    /// With values of the options of the script, such as `--asset=brick`.
    pub fn options(self, options: &str) -> Self {
        self.with(|config| config.options.extend(options.split_whitespace().map(str::to_owned)))
    }

    /// The script and the policy.
    pub fn load(&self) -> Result<ConfiguredScript, RunError> {
        let ConfiguredScript { config, script } = self.config.clone().load()?;
        Ok(ConfiguredScript { config: config.with_policy(PolicyConfig::load(&self.policy)?), script })
    }

    /// The messages so far, without the folder of the project.
    pub fn told(&self) -> String {
        self.project.relative(self.messages.text())
    }

    fn results(&self) -> Result<Vec<SuiteResult>, RunError> {
        run_suites(&self.load()?, |_| ())
    }

    /// Runs it. It must succeed.
    pub fn finish(self) -> Finished {
        let messages = self.messages.clone();
        self.attempt().unwrap_or_else(|(_, message)| panic!("{message}\n{}", messages.text()))
    }

    /// The records of its only suite.
    pub fn records(self) -> Vec<EpisodeRecord> {
        self.finish().records()
    }

    /// The record of its only episode.
    pub fn record(self) -> EpisodeRecord {
        let mut records = self.records();
        assert_eq!(records.len(), 1);
        records.swap_remove(0)
    }

    /// Runs it. Returns the cause and the message of the error that ends it.
    pub fn attempt(self) -> Result<Finished, (RunErrorCause, String)> {
        match self.results() {
            Ok(results) => Ok(Finished { results, messages: self.told() }),
            Err(error) => Err((error.cause, self.project.relative(error))),
        }
    }

    /// The message for invalid input.
    pub fn error(self) -> String {
        self.failure(RunErrorCause::Input)
    }

    /// The message of a policy that fails.
    pub fn policy_error(self) -> String {
        self.failure(RunErrorCause::Policy)
    }

    fn failure(self, expected: RunErrorCause) -> String {
        match self.attempt() {
            Err((cause, message)) if cause == expected => message,
            Err(other) => panic!("{other:?}"),
            Ok(finished) => panic!("it succeeds\n{}", finished.messages),
        }
    }

    /// Checks the scenes of the suites of the script. Returns the warnings.
    pub fn check(self) -> Result<Vec<String>, String> {
        let mut warnings = Vec::new();
        let mut checked = || -> Result<(), RunError> {
            let run = self.load()?;
            let checker = SuiteChecker::new(&run);
            for suite in run.script.plan.suites() {
                let episodes = run.config.episodes.unwrap_or(1);
                checker.check(suite, episodes, |warning| warnings.push(warning))?;
            }
            Ok(())
        };
        checked().map(|()| warnings).map_err(|error| self.project.relative(error))
    }

    /// Checks the conditions of the script, without the scenes of its suites.
    pub fn check_conditions(self) -> Result<(), String> {
        let checked = || conditions::check(&self.load()?).map(drop);
        checked().map_err(|error: RunError| self.project.relative(error))
    }

    /// Runs the experiment of the script. Returns its rows and its text, or the error. Without an output folder its
    /// files would be written into the repository.
    pub fn experiment(&self) -> (Vec<ExperimentRow>, Result<String, String>) {
        let (mut rows, mut text) = (Vec::new(), String::new());
        let mut run = || {
            experiment::run(&self.load()?, |output| -> Result<(), RunError> {
                match output {
                    ExperimentOutput::Rows(found) => rows = found.to_vec(),
                    ExperimentOutput::Text(found) => found.clone_into(&mut text),
                }
                Ok(())
            })
        };
        let outcome = run().map_err(|error: RunError| self.project.relative(error));
        (rows, outcome.map(|()| text))
    }

    /// The rows of the experiment of the script.
    pub fn rows(self) -> Vec<ExperimentRow> {
        let (rows, outcome) = self.experiment();
        outcome.unwrap_or_else(|message| panic!("{message}"));
        rows
    }
}

impl Finished {
    /// The results of its only suite.
    pub fn result(mut self) -> SuiteResult {
        assert_eq!(self.results.len(), 1);
        self.results.swap_remove(0)
    }

    /// The records of its only suite.
    pub fn records(self) -> Vec<EpisodeRecord> {
        self.result().records
    }
}

/// The first episodes of two tasks of Spatial-Soft with different objects, by a policy, on two threads and with traces.
/// Tests share the runs.
pub fn spatial_soft(policy: &str) -> (&'static Project, &'static [EpisodeRecord]) {
    static PROJECT: LazyLock<Project> = LazyLock::new(|| Project::shared("spatial_soft", &[]));
    static RUNS: [OnceLock<Vec<EpisodeRecord>>; 4] = [const { OnceLock::new() }; 4];
    let policies = ["expert", "expert-binary", "noop", "random"];
    let records = &RUNS[policies.iter().position(|name| *name == policy).expect("a shared run")];
    (&PROJECT, records.get_or_init(|| spatial_soft_run(&PROJECT, policy).threads(2).out(policy).records()))
}

/// The run of [`spatial_soft`] in another project.
pub fn spatial_soft_run<'a>(project: &'a Project, policy: &str) -> Run<'a> {
    project.run(SPATIAL_SOFT).tasks(&[0, 9]).episodes(1).policy(policy).trace(TraceDetail::State)
}
