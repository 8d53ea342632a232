//! `softvt view`: one episode as a video and stills.

use std::path::{Path, PathBuf};

use clap::Args;

use crate::{
    args::{ComparedPolicyArgs, ScriptArgs, parse_folder, select_one_task},
    error::CliError,
    output::Progress,
};
use softvt_benchmark::Plan;
use softvt_common::{
    cancel,
    episode_id::EpisodeSplit,
    files::{self, FileError},
    parallel,
};
use softvt_report::{
    episode_page::{self, DeformationTimes, PolicyPart},
    mcap::write_mcap,
    video::{self, FilmedEpisode, worst_state, write_stills},
};
use softvt_rollout::{FinishedEpisode, StateRecording};
use softvt_runner::{
    ConfiguredScript, EpisodeJob, EpisodeList, PreparedRun, RunConfig, RunError, SuiteRun,
    suite_selection::path_component,
};
use softvt_runs::{record::EpisodeRecord, run_folder::RunFolder};

/// Render one episode: a video, and stills of every camera and tactile sensor
#[derive(Args, Clone, Debug)]
#[command(override_usage = "softvt view [OPTIONS] --out <DIR> <FILE.lua>")]
pub(crate) struct ViewArgs {
    #[command(flatten)]
    pub(super) script: ScriptArgs,
    #[command(flatten)]
    policies: ComparedPolicyArgs,
    /// The task: its index or part of its prompt
    #[arg(long, value_name = "TASK", default_value = "0")]
    task: String,
    /// Episode of the task
    #[arg(long, value_name = "N", default_value = "0")]
    episode: u32,
    /// Stills at the full size of the cameras: 1024 and 512 pixels instead of 224
    #[arg(long)]
    full_size: bool,
    /// Also write animation.png, a loop at twice the speed for web pages, 320 pixels wide per policy
    #[arg(long)]
    animation: bool,
    /// Also write the episode as episode.mcap, for Foxglove and Rerun
    #[arg(long)]
    mcap: bool,
    /// Output folder
    #[arg(long, value_name = "DIR", value_parser = parse_folder)]
    out: PathBuf,
}

/// Runs one episode and writes `episode.mp4`, a picture with the verdict as `episode.png`, stills of the first, worst
/// and last state of every camera and tactile sensor and of the target from nearby, and a page that shows them. Under
/// several policies, video and picture show them side by side, and the stills of each are in a folder of its name.
/// The files of an earlier view in the folder are removed.
pub(super) fn run(args: ViewArgs) -> Result<(), CliError> {
    let ConfiguredScript { config, script: loaded } = args.script.clone().config()?.load()?;
    // Set after loading: a script of another kind is refused for what it is, not for the default task.
    let config = RunConfig { tasks: vec![args.task.clone()], ..config };
    let policies = args.policies.load()?;
    let Plan::Suite(suite) = &loaded.plan else {
        let message = "expected a single suite; name a file that returns softvt.suite";
        return Err(config.error(message).into());
    };
    let job = EpisodeJob { task: select_one_task(&config, suite)?, episode: args.episode };
    let configs: Vec<RunConfig> =
        policies.into_iter().map(|policy| config.clone().with_policy(policy)).collect();
    let prepare = |config| {
        let jobs = EpisodeList::listed(vec![job]);
        SuiteRun::new(config, &loaded, suite, jobs, EpisodeSplit::Validation)?.rendered().prepare()
    };
    let runs: Vec<PreparedRun> = configs.iter().map(prepare).collect::<Result<_, _>>()?;
    RunFolder::check_vacant(&args.out).map_err(|error| CliError::input(format_args!("--out: {error}")))?;
    if let Some(found) = foreign_file(&args.out)? {
        bail!("--out: {} exists and is not of an earlier view; give another folder", found.display());
    }
    files::create_writable_folder(&args.out)?;
    config.observer.work("simulating the episode");
    let simulate = |number: usize| runs[number].run_episode(job, true, &runs[number].controllers);
    let mut episodes = Vec::new();
    parallel::run_in_order(runs.len(), config.thread_count(), cancel::requested, simulate, |_, finished| {
        episodes.push(finished);
        Ok::<_, RunError>(())
    })?;
    config.observer.end();
    let mut seen = Vec::new();
    for FinishedEpisode { record, recording, .. } in episodes {
        // A request to stop ends the episodes early.
        let Some(states) = recording else { return Err(CliError::interrupted("")) };
        seen.push(SeenEpisode { record, states });
    }
    if seen.len() < runs.len() {
        return Err(CliError::interrupted(""));
    }
    remove_earlier(&args.out)?;
    show(&args, &config, seen)
}

const ANIMATION: &str = "animation.png";
const MCAP: &str = "episode.mcap";
/// Moments of the stills, with which the names of their files begin.
const MOMENTS: [&str; 3] = ["start", "worst", "end"];

/// Files of a view besides its stills.
const FILES: [&str; 5] = [episode_page::PAGE, episode_page::VIDEO, episode_page::FRAME, ANIMATION, MCAP];

/// The first file in the folder `dir` that a view would replace, unless an earlier view wrote into the folder; an
/// interrupted one is recognised by its stills.
fn foreign_file(dir: &Path) -> Result<Option<PathBuf>, FileError> {
    let Some(found) = FILES.map(|name| dir.join(name)).into_iter().find(|path| path.exists()) else {
        return Ok(None);
    };
    let names = entries(dir)?;
    let is_view = dir.join(episode_page::FRAME).is_file() && dir.join(episode_page::PAGE).is_file()
        || has_stills(&names)
        || names.iter().any(|path| is_policy_folder(path).unwrap_or(false));
    Ok((!is_view).then_some(found))
}

/// True for the contents of a folder with stills of every moment.
fn has_stills(names: &[PathBuf]) -> bool {
    MOMENTS.iter().all(|moment| names.iter().any(|path| is_still(path, moment)))
}

/// Removes the files of an earlier view from a folder, and the folders of its policies.
fn remove_earlier(dir: &Path) -> Result<(), CliError> {
    if ![episode_page::PAGE, episode_page::FRAME].iter().all(|name| dir.join(name).is_file()) {
        return Ok(());
    }
    for entry in entries(dir)? {
        if is_policy_folder(&entry)? {
            entries(&entry)?
                .iter()
                .filter(|path| is_of_view(path))
                .try_for_each(|path| files::remove_if_present(path))?;
            // One with other files stays.
            let _ = std::fs::remove_dir(&entry);
        } else if is_of_view(&entry) {
            files::remove_if_present(&entry)?;
        }
    }
    Ok(())
}

/// True for a file with a name that views write.
fn is_of_view(path: &Path) -> bool {
    let is_named = FILES.iter().any(|name| path.ends_with(name));
    path.is_file() && (is_named || MOMENTS.iter().any(|moment| is_still(path, moment)))
}

/// True for a folder with the stills of a policy. Other than a view of its own, it has no picture of the result.
fn is_policy_folder(path: &Path) -> Result<bool, FileError> {
    if path.is_symlink() || !path.is_dir() || path.join(episode_page::FRAME).exists() {
        return Ok(false);
    }
    Ok(has_stills(&entries(path)?))
}

fn is_still(path: &Path, moment: &str) -> bool {
    let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    name.ends_with(".png") && name.strip_prefix(moment).is_some_and(|rest| rest.starts_with('_'))
}

fn entries(dir: &Path) -> Result<Vec<PathBuf>, FileError> {
    let listed = std::fs::read_dir(dir).and_then(|entries| entries.map(|entry| Ok(entry?.path())).collect());
    listed.map_err(FileError::io("read", dir))
}

struct SeenEpisode {
    record: EpisodeRecord,
    states: StateRecording,
}

/// Draws the stills of an episode into a folder, and writes its MCAP file if it is asked for.
fn write_parts(
    args: &ViewArgs,
    config: &RunConfig,
    SeenEpisode { record, states }: &mut SeenEpisode,
    dir: &Path,
) -> Result<(), CliError> {
    let [start, worst, end] = MOMENTS;
    let moments = [(start, 0), (worst, worst_state(states)), (end, states.frames.len().saturating_sub(1))];
    config.observer.work("drawing the stills");
    write_stills(states, &moments, args.full_size, dir, config.thread_count(), cancel::requested)?;
    config.observer.end();
    if args.mcap {
        let progress = Progress::new(states.frames.len(), "writing the MCAP file");
        let (path, threads) = (dir.join(MCAP), config.thread_count());
        write_mcap(states, record, &path, threads, cancel::requested, || progress.step())?;
    }
    Ok(())
}

/// Draws an episode under one policy, or under several, side by side.
fn show(args: &ViewArgs, config: &RunConfig, mut seen: Vec<SeenEpisode>) -> Result<(), CliError> {
    let (dir, is_single) = (&args.out, seen.len() == 1);
    let (mut parts, mut episodes) = (Vec::<PolicyPart>::new(), Vec::new());
    for seen in &mut seen {
        let mut folder = if is_single { String::new() } else { path_component(&seen.record.header.policy) };
        if parts.iter().any(|part| part.folder == folder) {
            folder = format!("{folder}_{}", parts.len() + 1);
        }
        files::create_folder(&dir.join(&folder))?;
        write_parts(args, config, seen, &dir.join(&folder))?;
        let SeenEpisode { record, states } = seen;
        parts.push(PolicyPart { record, times: DeformationTimes::new(states), folder });
        episodes.push(FilmedEpisode { record, states });
    }
    video::write_decisive_frame(&mut episodes, &dir.join(episode_page::FRAME))?;
    let frames = episodes.iter().map(|episode| episode.states.frames.len()).max().unwrap_or(0);
    let progress = Progress::new(frames, "rendering the video");
    let (path, threads) = (dir.join(episode_page::VIDEO), config.thread_count());
    video::write_video(&mut episodes, &path, threads, cancel::requested, || progress.step())?;
    drop(progress);
    if args.animation {
        config.observer.work("rendering the animation");
        video::write_animation(&mut episodes, &dir.join(ANIMATION), threads, cancel::requested)?;
        config.observer.end();
    }
    let sentences: Vec<String> = match &parts[..] {
        [PolicyPart { record, times, .. }] => {
            episode_page::write(record, times, dir)?;
            vec![episode_page::sentence(record, times)]
        }
        _ => {
            episode_page::write_several(&parts, dir)?;
            parts.iter().map(PolicyPart::sentence).collect()
        }
    };
    let files = [episode_page::PAGE, ANIMATION, episode_page::VIDEO].map(|name| dir.join(name));
    let written = files.iter().filter(|file| args.animation || !file.ends_with(ANIMATION));
    let written: String = written.map(|file| format!("{}\n", file.display())).collect();
    out!("{}\n{written}", sentences.join("\n"))
}
