//! [`run_suites`]: the suites of a script under a policy.

use crate::{
    config::ConfiguredScript,
    error::RunError,
    evaluate::{SuiteResult, run_suite},
    suite_run::SuiteRun,
    suite_selection::{check_episodes, next_run_dir, run_dir, select_suites},
};
use softvt_benchmark::Plan;
use softvt_runs::record::EpisodeRecord;

/// Runs the suites of a script as its configuration says, and calls `on_episode` for each episode that it has run, in
/// the order in which they end. Returns the results of each suite, with the episodes that the output folder had before.
/// Without an output folder, nothing is written.
///
/// # Errors
/// The script has no suite; a scene, a setting or the policy is not valid; a folder contains something else; a trace,
/// videos, MCAP files or a resumed run without an output folder; or a request to stop. The output folder keeps
/// the episodes that have finished.
///
/// ```
/// use softvt_runner::{PolicyConfig, RunConfig, run_suites};
///
/// let config = RunConfig {
///     policy: PolicyConfig::named("noop")?,
///     tasks: vec!["0".to_owned()],
///     episodes: Some(1),
///     ..RunConfig::of("suites/spatial_soft.lua")
/// };
/// let results = run_suites(&config.load()?, |_| ())?;
/// assert_eq!(results[0].records.len(), 1);
/// assert!(!results[0].records[0].verdict.goal);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn run_suites(
    ConfiguredScript { config, script }: &ConfiguredScript,
    mut on_episode: impl FnMut(&EpisodeRecord),
) -> Result<Vec<SuiteResult>, RunError> {
    let is_list = matches!(script.plan, Plan::Suites { .. });
    let suites = select_suites(config, &script.plan)?;
    let needs_folder =
        config.trace.is_some() || config.video.is_some() || config.mcap.is_some() || config.resume;
    if needs_folder && config.out.is_none() && !config.is_numbered {
        return Err(config.error("a trace, videos, MCAP files and a resumed run need an output folder"));
    }
    check_episodes(config, suites)?;
    let run = |suite| {
        let numbered = || config.is_numbered.then(|| next_run_dir(config, &config.suite_name(suite)));
        let out = run_dir(config, suite, is_list).or_else(numbered);
        run_suite(&SuiteRun::selected(config, script, suite, out)?.prepare()?, &mut on_episode)
    };
    suites.iter().map(run).collect()
}
