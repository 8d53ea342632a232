//! The thread that simulates: the episode that was asked for last, from its start, again when one of its files is
//! saved.

use std::{
    collections::BTreeMap,
    panic::{self, AssertUnwindSafe},
    path::{Path, PathBuf},
    sync::{Arc, Mutex, PoisonError, mpsc::Receiver},
    time::{Duration, SystemTime},
};

use serde::Deserialize;
use serde_json::{Value, json};

use crate::{
    feed::Feed,
    geometry::{MovingObject, scene_message},
    menu::{self, Menu},
    message::Message,
    state::state_message,
    teleop::{DriveInput, TELEOP, TeleopController},
};
use softvt_benchmark::{CONTROL_HZ, Suite, Task};
use softvt_common::{cancel, episode_id::EpisodeSplit};
use softvt_policy::PolicyError;
use softvt_rollout::{Episode, FinishedEpisode, SensingError};
use softvt_runner::{
    ConfiguredScript, ControllerFactory, EpisodeJob, EpisodeList, PolicyConfig, PreparedRun, RunConfig,
    RunError, ServedRuns, SuiteRun,
    suite_selection::{select_episodes, select_tasks, suites_of},
};

/// Interval at which saved files are looked for.
const POLL: Duration = Duration::from_millis(200);

/// Script, first episode and split of a [`Watch`](crate::Watch).
pub struct Program {
    /// The script, the changes of its scenes, and the policy that is offered with the built-in ones.
    pub config: RunConfig,
    pub selection: Selection,
    /// Split of the episodes. Those that are driven from the page and recorded are of the demonstration split.
    pub split: EpisodeSplit,
}

#[derive(Clone, Debug, Default, Deserialize, PartialEq, Eq)]
#[serde(deny_unknown_fields)]
pub struct Selection {
    /// Name of the suite; empty for the first one.
    #[serde(default)]
    pub suite: String,
    #[serde(default)]
    pub task: usize,
    #[serde(default)]
    pub episode: u32,
    /// Name of the policy; empty for that of the configuration.
    #[serde(default)]
    pub policy: String,
}

/// Sizes and times of the files of a script.
type Versions = BTreeMap<PathBuf, Option<(u64, SystemTime)>>;

pub(crate) struct Stage {
    pub(crate) program: Program,
    pub(crate) feed: Arc<Feed>,
    pub(crate) requests: Receiver<Selection>,
    pub(crate) drive: Arc<DriveInput>,
    /// Selections that pages offer at present.
    pub(crate) menu: Arc<Mutex<Menu>>,
    pub(crate) files: Versions,
    /// True once the episode that is simulated was replaced by another, or one of its files was saved.
    pub(crate) is_outdated: bool,
    /// True if the selection is one that a page has just made.
    pub(crate) is_new: bool,
}

impl Stage {
    /// Simulates episode after episode until the program is cancelled.
    pub(crate) fn run(mut self) {
        while !cancel::requested() {
            self.is_outdated = false;
            let simulated = panic::catch_unwind(AssertUnwindSafe(|| self.simulate()));
            match simulated
                .unwrap_or_else(|_| Err(RunError::input("internal error: the simulation has failed")))
            {
                Ok(()) => {}
                Err(_) if self.look_outdated() => continue,
                Err(error) => self.feed.push(plain(json!({ "type": "error", "message": error.to_string() }))),
            }
            while !self.look_outdated() {
                std::thread::sleep(POLL);
            }
        }
    }

    /// True if another episode was asked for, a file was saved, or the program ends. Takes in the request.
    fn look_outdated(&mut self) -> bool {
        if let Some(selection) = self.requests.try_iter().last() {
            self.program.selection = selection;
            (self.is_outdated, self.is_new) = (true, true);
        }
        self.is_outdated |= self.files.iter().any(|(path, version)| version_of(path) != *version);
        self.is_outdated || cancel::requested()
    }

    /// Simulates the selected episode and publishes its states.
    fn simulate(&mut self) -> Result<(), RunError> {
        let config = self.program.config.clone();
        let main = config.file.clone();
        // Versions are those before the script is read, so that no later one is missed. Until it is loaded, its
        // files are those of before, and all scripts in its folder: one of them may have the error.
        self.files.entry(main.clone()).or_default();
        for path in scripts_near(&main) {
            self.files.entry(path).or_default();
        }
        self.files.iter_mut().for_each(|(path, version)| *version = version_of(path));
        let name = config.file.display().to_string();
        let loaded = config.load();
        let ConfiguredScript { mut config, script } = match loaded {
            Ok(loaded) => loaded,
            Err(error) => {
                self.begin(&name, &[]);
                return Err(error);
            }
        };
        let suites = suites_of(&script.plan);
        self.begin(&name, suites);
        let names = script.file_hashes().into_keys().map(PathBuf::from);
        let before = std::mem::take(&mut self.files);
        let version = |path: &PathBuf| before.get(path).copied().unwrap_or_else(|| version_of(path));
        self.files = names.map(|path| (path.clone(), version(&path))).collect();
        let is_new = std::mem::take(&mut self.is_new);
        config.policy = self.policy()?;
        let is_known = suites.iter().any(|suite| suite.name == self.program.selection.suite);
        if !is_new && !is_known {
            // The script was saved with another name of the suite.
            self.program.selection.suite.clear();
        }
        let found = menu::find_task(suites, &self.program.selection);
        let (suite, task) = found.map_err(|problem| config.error(problem))?;
        let job = EpisodeJob { task, episode: self.program.selection.episode };
        let is_recorded = config.policy.name == TELEOP && config.out.is_some();
        let (jobs, split) = if is_recorded {
            (select_episodes(&config, suite, &select_tasks(&config, suite)?), EpisodeSplit::Demonstration)
        } else {
            (EpisodeList::listed(vec![job]), self.program.split)
        };
        let mut run = SuiteRun::new(&config, &script, suite, jobs, split)?;
        run.out = config.out.clone().filter(|_| is_recorded);
        if config.policy.name == TELEOP {
            run.controllers = self.teleop();
        }
        let run = run.rendered().prepare()?;
        if is_recorded {
            return self.drive_and_record(&config, &run, job);
        }
        let finished = match config.policy.name.as_str() {
            TELEOP => self.drive(&run, job)?,
            _ => self.simulate_shown(&run, job)?,
        };
        self.feed.push(end_message(&finished));
        Ok(())
    }

    /// Begins the messages of an episode with the choices of the page.
    fn begin(&self, file: &str, suites: &[Suite]) {
        let menu = Menu::new(suites, &self.program.config.policy.name);
        *self.menu.lock().unwrap_or_else(PoisonError::into_inner) = menu;
        self.feed.begin(plain(opening(file, suites, &self.program)));
    }

    /// Simulates an episode and publishes its states.
    fn simulate_shown(&mut self, run: &PreparedRun, job: EpisodeJob) -> Result<FinishedEpisode, RunError> {
        let mut moving: Option<Vec<MovingObject>> = None;
        run.run_episode_watched(job, &mut |episode| self.publish(episode, &mut moving))
    }

    /// Simulates an episode that is driven from the page.
    fn drive(&mut self, run: &PreparedRun, job: EpisodeJob) -> Result<FinishedEpisode, RunError> {
        let driven = self.simulate_shown(run, job);
        // A page that is loaded again may come back.
        while driven.is_ok() && self.feed.is_unwatched() && !self.feed.is_abandoned() {
            std::thread::sleep(POLL);
        }
        match !self.is_outdated && self.feed.is_abandoned() {
            true => {
                Err(RunError::input("the page was closed, which ended the drive; select the episode again"))
            }
            false => driven,
        }
    }

    /// Simulates an episode that is driven from the page, and adds it to the run folder of the configuration. Whether
    /// it can be added is known before it is driven.
    fn drive_and_record(
        &mut self,
        config: &RunConfig,
        run: &PreparedRun,
        job: EpisodeJob,
    ) -> Result<(), RunError> {
        let id = run.episode_id(job.task, job.episode);
        let served = ServedRuns::open(config, std::slice::from_ref(run), Arc::default())?;
        let recorder = served.recorder();
        let (out, index) = (config.out.as_deref().unwrap_or(Path::new("")).display(), id.index());
        let driven = if (recorder.selects)(&id) {
            self.drive(run, job).inspect_err(|_| {
                config.notice(format!(
                    "{}: the drive of {index} was not finished and is not recorded",
                    id.suite
                ));
            })
        } else if run.jobs.find(index).is_some() {
            Err(RunError::input(format!("{out} has {index} already; select another episode")))
        } else {
            let last = run.jobs.episodes_of(job.task.id).last().unwrap_or_default();
            Err(RunError::input(format!("{out} has no {index}: select one of the episodes 0 to {last}")))
        };
        let recorded = driven.and_then(|finished| {
            let told = end_message(&finished);
            let recorded = (recorder.record)(finished).map_err(|error| RunError::input(error.to_string()));
            self.feed.push(told);
            recorded
        });
        drop(recorder);
        let (_, written) = served.finish();
        recorded.and(written)
    }

    fn teleop(&self) -> ControllerFactory {
        let input = self.drive.clone();
        Box::new(move |_, _| Ok(Box::new(TeleopController::new(input.clone()))))
    }

    /// Publishes the present state, and the scene before the first one.
    fn publish(
        &mut self,
        episode: &mut Episode,
        moving: &mut Option<Vec<MovingObject>>,
    ) -> Result<(), PolicyError> {
        let is_driven = self.program.selection.policy == TELEOP;
        if self.look_outdated() || is_driven && self.feed.is_abandoned() {
            return Err(PolicyError::Interrupted);
        }
        let failed = |error: SensingError| PolicyError::Action(error.to_string());
        if moving.is_none() {
            let spec = episode.spec();
            let about = json!({
                "prompt": spec.task.prompt,
                "control_hz": CONTROL_HZ,
            });
            let (message, objects) = scene_message(episode, about).map_err(failed)?;
            self.feed.push(message);
            *moving = Some(objects);
        }
        let message = state_message(episode, moving.as_deref().unwrap_or_default()).map_err(failed)?;
        self.feed.push(message);
        Ok(())
    }

    /// The policy of the selection.
    fn policy(&self) -> Result<PolicyConfig, RunError> {
        let (name, given) = (&self.program.selection.policy, &self.program.config.policy);
        if let Some(problem) = menu::unknown_policy(&menu::policies(&given.name), name) {
            return Err(RunError::input(problem));
        }
        match name.as_str() {
            // The page shows the true state.
            TELEOP => {
                let mut policy = PolicyConfig::external(TELEOP);
                policy.privileged = true;
                Ok(policy)
            }
            name if name.is_empty() || name == given.name => Ok(given.clone()),
            name => PolicyConfig::named(name),
        }
    }
}

fn scripts_near(script: &Path) -> Vec<PathBuf> {
    let folder = script.parent().unwrap_or(Path::new(""));
    let listed = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let entries = std::fs::read_dir(listed).into_iter().flatten().filter_map(Result::ok);
    let names = entries.map(|entry| folder.join(entry.file_name()));
    names.filter(|path| path.extension().is_some_and(|extension| extension == "lua")).collect()
}

fn version_of(path: &PathBuf) -> Option<(u64, SystemTime)> {
    let metadata = std::fs::metadata(path).ok()?;
    Some((metadata.len(), metadata.modified().ok()?))
}

/// Contents of the first message of an episode: the choices of the page, and the present one.
fn opening(file: &str, suites: &[Suite], program: &Program) -> Value {
    let given = program.config.policy.name.as_str();
    let task = |task: &Task| json!({ "id": task.id, "prompt": task.prompt });
    let suite = |suite: &Suite| {
        json!({
            "name": suite.name,
            "episodes": suite.episodes,
            "tasks": suite.tasks.iter().map(task).collect::<Vec<_>>(),
        })
    };
    let Selection { suite: selected, task: index, episode, policy } = &program.selection;
    let selected = suites.iter().find(|suite| suite.name == *selected).or(suites.first());
    json!({
        "type": "open",
        "file": file,
        "suites": suites.iter().map(suite).collect::<Vec<_>>(),
        "policies": menu::policies(given),
        "selected": {
            "suite": selected.map(|suite| suite.name.as_str()),
            "task": index,
            "episode": episode,
            "policy": if policy.is_empty() { given } else { policy.as_str() },
        },
    })
}

fn plain(content: Value) -> Vec<u8> {
    Message::default().finish(content)
}

fn end_message(finished: &FinishedEpisode) -> Vec<u8> {
    let record = &finished.record;
    plain(json!({
        "type": "end",
        "outcome": record.outcome,
        "verdict": record.verdict,
        "gave_up": record.stats.gave_up,
    }))
}
