//! Carrying out a plan: a policy on suites, or an experiment.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::PathBuf,
    sync::Arc,
};

use serde::Serialize;

use super::{Failure, args::Run, code, experiment, files, files::Calibrated, print, progress::Progress};
use crate::{
    benchmark::{Plan, Suite, Task, seed::Split, settings::Settings},
    evaluation::{
        record::{EpisodeRecord, Identity},
        safety::Limit,
        summary::Summary,
        thresholds::Thresholds,
    },
    policy::{Policy, builtin},
    report::{
        interchange::{self, DebugFrame, DebugShape},
        run_folder::{RUN, RunFolder, RunFolderError, SUMMARY, replace},
        terminal,
    },
    rollout::{
        ControlError, Controller, Episode, EpisodeError, EpisodeSpec, Finished, RestCache, ScoreFrame,
        SettleError, batch, stop,
    },
    scene::{Asset, Body, Scene},
    script::{self, ExpertController, Loaded},
};

/// Carries out the plan of a script.
///
/// # Errors
/// Anything that is wrong with the script, the flags, the folder or the policy.
pub fn run(run: &Run) -> Result<(), Failure> {
    let loaded = script::load(&run.file, &run.script_words).map_err(Failure::input)?;
    match &loaded.plan {
        Plan::Suite(suite) => {
            let summary = evaluate(run, &loaded, suite, out_dir(run, &suite.name, None))?;
            show(run, &[summary], false);
            Ok(())
        }
        Plan::Suites { suites } => {
            let mut names = BTreeSet::new();
            if let Some(twice) = suites.iter().find(|suite| !names.insert(plain(&suite.name))) {
                let message = format!(
                    "{}: two suites are named {:?}, and would share one folder; rename one",
                    run.file.display(),
                    twice.name
                );
                return Err(Failure::input(message));
            }
            let mut summaries = Vec::new();
            for suite in suites {
                summaries.push(evaluate(run, &loaded, suite, out_dir(run, &suite.name, Some(&suite.name)))?);
            }
            show(run, &summaries, true);
            Ok(())
        }
        Plan::Experiment { name, points, columns } => experiment::run(run, &loaded, name, *points, columns),
    }
}

/// Tables, or one JSON document: an object for a suite, an array for a list of suites.
fn show(run: &Run, summaries: &[Summary], list: bool) {
    match summaries {
        _ if !run.json => summaries.iter().for_each(|summary| print(&terminal::table(summary))),
        [summary] if !list => print(&format!("{:#}\n", serde_json::json!(summary))),
        _ => print(&format!("{:#}\n", serde_json::json!(summaries))),
    }
}

/// A name as part of a path: it is the script's, and must not lead out of the folder.
fn plain(name: &str) -> String {
    name.replace(|c: char| !(c.is_alphanumeric() || c == '_' || c == '-'), "_")
}

/// The folder that was asked for (with one more level for one of several suites), or the next free one under `runs/`.
fn out_dir(run: &Run, suite: &str, level: Option<&str>) -> PathBuf {
    let suite = plain(suite);
    let level = level.map(plain);
    match &run.out {
        Some(dir) => level.map_or(dir.clone(), |level| dir.join(level)),
        None => (1..)
            .map(|n| PathBuf::from(format!("runs/{suite}-{}-{n:03}", run.policy)))
            .find(|dir| !dir.exists())
            .unwrap_or_default(),
    }
}

/// Everything needed to repeat a run.
#[derive(Serialize)]
struct RunInfo<'a> {
    softvt: &'a str,
    script: String,
    suite: &'a str,
    policy: &'a str,
    privileged: bool,
    seed: u64,
    split: &'a str,
    tasks: Vec<usize>,
    episodes: u32,
    shifts: &'a [(String, f64)],
    options: BTreeMap<String, String>,
    settings: &'a Settings,
    sources: BTreeMap<String, String>,
    thresholds: BTreeMap<String, Option<f64>>,
}

/// One suite under way.
struct Batch<'a> {
    run: &'a Run,
    loaded: &'a Loaded,
    suite: &'a Suite,
    settings: Settings,
    jobs: Vec<(&'a Task, u32)>,
    limits: BTreeMap<String, Option<Limit>>,
    /// The thresholds in use as one file of SoftVTBench's form.
    released: Thresholds,
    /// SHA-256 of every file that the results depend on.
    sources: BTreeMap<String, String>,
    cache: RestCache,
    out: PathBuf,
}

/// Runs the first episode of one task of a suite and writes nothing.
///
/// # Errors
/// The script is no suite, or the episode cannot be run.
pub fn single(run: &Run, task: usize) -> Result<EpisodeRecord, Failure> {
    let loaded = script::load(&run.file, &run.script_words).map_err(Failure::input)?;
    let Plan::Suite(suite) = &loaded.plan else {
        return Err(Failure::input(format!("{} is not a suite", run.file.display())));
    };
    let tasks = suite.tasks.iter().filter(|t| t.id == task);
    let jobs = tasks.map(|task| (task, 0)).collect();
    let settings = suite.settings.clone();
    let batch = Batch::new(run, &loaded, suite, settings, (jobs, PathBuf::new()));
    batch.episode(0).map(|finished| finished.record)
}

fn evaluate(run: &Run, loaded: &Loaded, suite: &Suite, out: PathBuf) -> Result<Summary, Failure> {
    let settings = suite.settings.with_all(&run.set);
    let settings = settings.map_err(|e| Failure::input(format!("{}: --set: {e}", run.file.display())))?;
    for (name, value) in &run.shifts {
        script::check_shift(&suite.shifts, name, *value)
            .map_err(|e| Failure::input(format!("{}: --shift: {e}", run.file.display())))?;
    }
    let tasks = chosen(run, suite)?;
    if let Some(task) = tasks.iter().find(|t| !t.expert && run.policy.starts_with("expert")) {
        let message =
            format!("{}: task {} has no expert; give one, or another --policy", run.file.display(), task.id);
        return Err(Failure::input(message));
    }
    let episodes = run.episodes.unwrap_or(suite.episodes);
    let jobs = tasks.iter().flat_map(|task| (0..episodes).map(move |e| (*task, e))).collect();
    let mut batch = Batch::new(run, loaded, suite, settings, (jobs, out));
    batch.find_limits(&tasks)?;
    let folder =
        RunFolder::create(&batch.out).map_err(|e| Failure::input(format!("{}: {e}", run.file.display())))?;
    batch.write_info(&folder, &tasks, episodes)?;
    batch.go(folder)
}

/// The tasks that `--task` names.
fn chosen<'a>(run: &Run, suite: &'a Suite) -> Result<Vec<&'a Task>, Failure> {
    let mut found: Vec<&Task> = Vec::new();
    for word in &run.tasks {
        if word.trim().is_empty() {
            let message = format!(
                "{}: --task: expected an index or part of a prompt, got {word:?}",
                run.file.display()
            );
            return Err(Failure::input(message));
        }
        let index = word.parse::<usize>().ok();
        let fits = |task: &&Task| match index {
            Some(index) => task.id == index,
            None => task.prompt.contains(word.as_str()),
        };
        let before = found.len();
        found.extend(suite.tasks.iter().filter(fits));
        if found.len() == before {
            let message = format!(
                "{}: --task {word}: suite {} has no such task; it has 0 to {}: see softvt list tasks",
                run.file.display(),
                suite.name,
                suite.tasks.len().saturating_sub(1)
            );
            return Err(Failure::input(message));
        }
    }
    if run.tasks.is_empty() {
        found.extend(&suite.tasks);
    }
    found.sort_by_key(|task| task.id);
    found.dedup_by_key(|task| task.id);
    Ok(found)
}

impl<'a> Batch<'a> {
    fn new(
        run: &'a Run,
        loaded: &'a Loaded,
        suite: &'a Suite,
        settings: Settings,
        (jobs, out): (Vec<(&'a Task, u32)>, PathBuf),
    ) -> Self {
        let made_by = format!("softvt {}", env!("CARGO_PKG_VERSION"));
        Self {
            run,
            loaded,
            suite,
            settings,
            jobs,
            limits: BTreeMap::new(),
            released: Thresholds::new(0.5, Vec::new(), made_by),
            sources: loaded.bundle.hashes(),
            cache: RestCache::default(),
            out,
        }
    }

    fn request(&self, task: &Task, episode: u32) -> script::EpisodeRequest {
        script::EpisodeRequest {
            suite: self.suite.name.clone(),
            task: task.id,
            episode: u64::from(episode),
            base_seed: self.run.seed,
            split: Split::Validation,
            shifts: self.run.shifts.clone(),
        }
    }

    /// Thresholds of the targets of all tasks, read before anything runs.
    fn find_limits(&mut self, tasks: &[&Task]) -> Result<(), Failure> {
        for task in tasks {
            let opened =
                script::Episode::open(self.loaded, &self.request(task, 0)).map_err(Failure::input)?;
            let Some(asset) = target_asset(&opened.nominal, task) else { continue };
            if matches!(asset.body, Body::Soft(_)) && !self.limits.contains_key(&asset.name) {
                let limit = self.find_limit(&asset)?;
                self.limits.insert(asset.name.clone(), limit);
            }
        }
        Ok(())
    }

    fn find_limit(&mut self, asset: &Asset) -> Result<Option<Limit>, Failure> {
        let name = &asset.name;
        let cure = format!("its episodes cannot count as safe; softvt scripts/calibrate.lua --asset {name}");
        match files::calibrated(&self.run.file, asset)? {
            Calibrated::Never => {
                eprintln!("softvt: {name} is not calibrated (assets/calibration/{name}.json): {cure}")
            }
            Calibrated::Another(path) => {
                eprintln!(
                    "softvt: {path} is about another {name} (its shape, material or friction differ): {cure}"
                );
            }
            Calibrated::Yes { limit, file, path, text } => {
                self.sources.insert(path, script::sha256(text.as_bytes()));
                self.released.merge(*file);
                return Ok(limit);
            }
        }
        Ok(None)
    }

    /// The limit of an object as its layout made it in this episode, whatever a shift makes of it then.
    fn limit_of(&self, asset: &Asset) -> Option<Limit> {
        let limit = self.limits.get(&asset.name).copied().flatten()?;
        let known = self.released.fingerprints.get(&asset.name);
        known.is_none_or(|known| *known == asset.fingerprint()).then_some(limit)
    }

    fn write_info(&self, folder: &RunFolder, tasks: &[&Task], episodes: u32) -> Result<(), Failure> {
        let options =
            self.loaded.options.iter().map(|o| (o.name.clone(), format!("{:?}", o.value))).collect();
        let info = RunInfo {
            softvt: env!("CARGO_PKG_VERSION"),
            script: self.loaded.main.clone(),
            suite: &self.suite.name,
            policy: &self.run.policy,
            privileged: self.run.policy.starts_with("expert"),
            seed: self.run.seed,
            split: Split::Validation.name(),
            tasks: tasks.iter().map(|t| t.id).collect(),
            episodes,
            shifts: &self.run.shifts,
            options,
            settings: &self.settings,
            sources: self.sources.clone(),
            thresholds: self.limits.iter().map(|(a, l)| (a.clone(), l.map(|l| l.tau_pct()))).collect(),
        };
        folder.write_json(RUN, &info).map_err(folder_failure)
    }

    fn go(&self, mut folder: RunFolder) -> Result<Summary, Failure> {
        let mut progress = Progress::new(self.jobs.len(), &self.suite.name);
        let mut records: Vec<EpisodeRecord> = Vec::new();
        let outcome = batch::run(
            self.jobs.len(),
            self.run.threads,
            &stop::FLAG,
            |job| self.episode(job),
            |job, finished| {
                folder.append(job, &finished.record).map_err(folder_failure)?;
                self.write_trace(&finished)?;
                self.write_debug_log(&finished)?;
                progress.tick(&line(&finished.record));
                records.push(finished.record);
                Ok(())
            },
        );
        progress.finish();
        folder.flush().map_err(folder_failure)?;
        let kept = format!("{} of {} episodes are in {}", records.len(), self.jobs.len(), self.out.display());
        if stop::requested() {
            return Err(Failure::interrupted(format!("interrupted; {kept}")));
        }
        if let Err(failure) = outcome {
            if records.is_empty() {
                // Nothing would be lost, and the same command must work once the mistake is mended.
                folder.discard().map_err(folder_failure)?;
                return Err(failure);
            }
            return Err(Failure { message: format!("{}\n{kept}", failure.message), ..failure });
        }
        let summary = Summary::of(&self.suite.name, &self.run.policy, &records);
        folder.write_json(SUMMARY, &summary).map_err(folder_failure)?;
        records.sort_by_key(|r| (r.identity.task, r.identity.episode));
        interchange::write_scores(&self.out, &records, &self.released).map_err(folder_failure)?;
        eprintln!("softvt: {}", self.out.display());
        Ok(summary)
    }

    fn episode(&self, job: usize) -> Result<Finished, Failure> {
        let (task, episode) = self.jobs[job];
        let opened =
            script::Episode::open(self.loaded, &self.request(task, episode)).map_err(Failure::input)?;
        let target = target_asset(&opened.nominal, task);
        let limit = target.as_ref().and_then(|asset| self.limit_of(asset));
        let soft = target.as_ref().is_some_and(|asset| matches!(asset.body, Body::Soft(_)));
        let asset = target.map_or(String::new(), |asset| asset.name.clone());
        let spec = EpisodeSpec {
            identity: Identity {
                suite: self.suite.name.clone(),
                task: task.id,
                prompt: task.prompt.clone(),
                layout: task.layout.clone(),
                episode,
                seed: self.run.seed,
                split: Split::Validation.name().to_owned(),
                policy: self.run.policy.clone(),
                asset,
                soft,
            },
            task: task.clone(),
            scene: Arc::new(opened.scene.clone()),
            limit,
            rules: self.settings.rules.clone(),
            params: self.settings.physics.clone(),
            robot: self.settings.robot.clone(),
            trace: self.run.trace,
        };
        let driver = self.driver(opened)?;
        let mut driver = batch::Stoppable { driver, stop: &stop::FLAG };
        let started = Episode::start(spec, &self.cache).map_err(|e| self.episode_failure(&e))?;
        started.run(&mut driver).map_err(|e| self.episode_failure(&e))
    }

    fn driver(&self, opened: script::Episode) -> Result<Box<dyn Controller>, Failure> {
        let boxed = |policy: Box<dyn Policy>| -> Box<dyn Controller> { Box::new(policy) };
        match self.run.policy.as_str() {
            "noop" => Ok(boxed(Box::<builtin::Noop>::default())),
            "random" => {
                let mut stream = opened.seed.stream(crate::benchmark::seed::Stream::Script);
                Ok(boxed(Box::new(builtin::Random::new(rand::RngCore::next_u64(&mut stream)))))
            }
            policy => {
                let expert = opened.expert().map_err(Failure::input)?;
                let expert = expert.ok_or_else(|| Failure::input("the task has no expert"))?;
                Ok(Box::new(ExpertController::new(expert, policy == "expert-binary")))
            }
        }
    }

    fn episode_failure(&self, error: &EpisodeError) -> Failure {
        let code = match error {
            EpisodeError::Control { source: ControlError::Policy(_), .. } => code::POLICY,
            EpisodeError::Control { source: ControlError::Interrupted, .. }
            | EpisodeError::Settle { source: SettleError::Interrupted, .. } => code::INTERRUPTED,
            _ => code::INPUT,
        };
        Failure { code, message: format!("{}: {error}", self.run.file.display()) }
    }

    /// SoftVTBench's log of every control step, which its own scorer reads.
    fn write_debug_log(&self, finished: &Finished) -> Result<(), Failure> {
        let identity = &finished.record.identity;
        let frame = |(step, frame): (usize, &ScoreFrame)| {
            let measured = finished.reference.as_ref().zip(frame.deformation.as_ref());
            let shape = DebugShape::new(&identity.asset, measured);
            DebugFrame::new(identity, step as u32, frame.success_now, shape)
        };
        let frames: Vec<DebugFrame> = finished.frames.iter().enumerate().map(frame).collect();
        interchange::write_debug_log(&self.out, identity, &frames).map(|_| ()).map_err(folder_failure)
    }

    fn write_trace(&self, finished: &Finished) -> Result<(), Failure> {
        if self.run.trace.is_none() {
            return Ok(());
        }
        let id = &finished.record.identity;
        let dir = self.out.join(format!("trace/task_{:03}", id.task));
        std::fs::create_dir_all(&dir)
            .map_err(|e| Failure::input(format!("cannot make the folder {}: {e}", dir.display())))?;
        let mut text = String::new();
        for step in &finished.trace {
            text += &serde_json::to_string(step).map_err(Failure::input)?;
            text.push('\n');
        }
        replace(&dir.join(format!("episode_{:05}.jsonl", id.episode)), &text).map_err(folder_failure)
    }
}

fn folder_failure(error: RunFolderError) -> Failure {
    Failure::input(error)
}

fn target_asset(scene: &Scene, task: &Task) -> Option<Arc<Asset>> {
    let name = task.goal.object();
    scene.objects.iter().find(|o| o.name == name).map(|o| o.asset.clone())
}

/// One episode in one line.
fn line(record: &EpisodeRecord) -> String {
    let v = &record.verdict;
    let d = v.d_peak.map_or(String::new(), |d| format!(", D {d:.2} %"));
    let outcome = match (record.outcome.is_valid(), v.safety, v.goal) {
        (false, _, _) => "invalid",
        (_, true, _) => "safe",
        (_, false, true) => "goal, not safe",
        _ => "failed",
    };
    format!(
        "task {} episode {}: {outcome}{d}, {:.1} s",
        record.identity.task, record.identity.episode, record.stats.time_s
    )
}
