//! [`record`]: demonstrations of the tasks of suites by their teachers.

use std::collections::BTreeMap;

use serde_json::json;

use crate::{
    config::{ConfiguredScript, RunConfig},
    episode_list::EpisodeList,
    error::RunError,
    policy::{ControllerFactory, PolicyConfig, PolicyOptions, expert_controller},
    recording::{HoldingLog, RecordingOptions, RecordingSummary, SuiteRecording, record_all},
    suite_run::SuiteRun,
    suite_selection::{select_suites, select_tasks},
};
use softvt_benchmark::{Suite, Teacher};
use softvt_common::{episode_id::EpisodeIndex, parallel};
use softvt_geometry::Vec3;
use softvt_policy::{Action, Observation, PolicyError, SensorStreams};
use softvt_robot::GripTarget;
use softvt_rollout::{Controller, Simulation};
use softvt_script::ExpertController;

/// Attempts per demonstration, and the least number per task, unless [`DemoCount::attempts`] says otherwise.
const ATTEMPTS_PER_DEMO: u32 = 4;
const MIN_ATTEMPTS: u32 = 20;

#[derive(Clone, Copy, Debug)]
pub struct DemoCount {
    /// Demonstrations that are safe and reach the goal.
    pub demos: u32,
    /// Maximum number of attempts, kept or not; by default 4 per demonstration and at least 20.
    pub attempts: Option<u32>,
}

/// Records demonstrations of the selected tasks of every suite of a script, by the policy that `policy_of` returns for
/// the teacher of the suite. Returns `None` if the folder contains the complete recording. The policy, the output, the
/// number of episodes, the shard, the trace and the videos of the configuration are ignored.
pub fn record(
    ConfiguredScript { config, script }: &ConfiguredScript,
    policy_of: impl Fn(Teacher) -> PolicyOptions,
    count: DemoCount,
    options: &RecordingOptions,
) -> Result<Option<RecordingSummary>, RunError> {
    let suites = select_suites(config, &script.plan)?;
    let names: Vec<String> = suites.iter().map(|suite| config.suite_name(suite)).collect();
    let mut request = json!({
        "softvt": env!("CARGO_PKG_VERSION"),
        "demos": count.demos,
        "pictures": options.has_images,
        "privileged": options.has_privileged,
        "suites": names,
    });
    options.describe(&mut request);
    if let Some(code) = options.gripper {
        request["gripper"] = json!(code);
    }
    let taught = |suite: &Suite| {
        let policy = PolicyConfig::load(&policy_of(suite.teacher))?;
        let own =
            RunConfig { out: None, episodes: None, shard: None, trace: None, video: None, ..config.clone() };
        Ok::<_, RunError>(own.with_policy(policy))
    };
    let configs: Vec<RunConfig> = suites.iter().map(taught).collect::<Result<_, _>>()?;
    record_all(options, &request, || {
        let prepare = |(suite, config)| {
            let default = count.demos.saturating_mul(ATTEMPTS_PER_DEMO).max(MIN_ATTEMPTS);
            let attempts = count.attempts.unwrap_or(default);
            let jobs = EpisodeList::of_tasks(&select_tasks(config, suite)?, attempts, None);
            SuiteRecording::new(config, options, script, suite, jobs, Some(count.demos), |run, log| {
                Ok(record_grips(run, log))
            })
        };
        suites.iter().zip(&configs).map(prepare).collect()
    })
}

/// Makes the experts of a run record their intent into `log`. Other policies are left unchanged.
fn record_grips<'a>(run: SuiteRun<'a>, log: &HoldingLog) -> SuiteRun<'a> {
    let Some(policy) = run.config.policy.expert() else { return run };
    let log = log.clone();
    let controllers: ControllerFactory = Box::new(move |opened, brief| {
        Ok(Box::new(GripRecorder {
            expert: expert_controller(opened, policy)?,
            steps: Vec::new(),
            index: brief.index(),
            log: log.clone(),
        }))
    });
    SuiteRun { controllers, ..run }
}

/// An expert whose intent to hold is recorded.
///
/// The binary gripper code of a dataset needs this intent. The commanded closure does not show it: a hand around a wide
/// object is nearly open while it holds.
struct GripRecorder {
    expert: ExpertController,
    steps: Vec<GripStep>,
    index: EpisodeIndex,
    log: HoldingLog,
}

impl Controller for GripRecorder {
    fn streams(&self) -> SensorStreams {
        self.expert.streams()
    }

    fn gave_up(&self) -> Option<&str> {
        self.expert.gave_up()
    }

    fn unended(&mut self) -> Option<String> {
        self.expert.unended()
    }

    fn notes(&self) -> BTreeMap<String, f64> {
        self.expert.notes()
    }

    fn act(&mut self, sim: &Simulation, observation: &Observation) -> Result<Option<Action>, PolicyError> {
        let action = self.expert.act(sim, observation)?;
        let is_gripping = self.expert.is_gripping;
        self.steps.extend(action.map(|Action { position_b, grip, .. }| GripStep {
            is_gripping,
            position_b,
            grip,
        }));
        Ok(action)
    }

    fn finish(&mut self) -> Result<(), PolicyError> {
        parallel::lock(&self.log).insert(self.index, closing_or_holding(&std::mem::take(&mut self.steps)));
        Ok(())
    }
}

/// Command of an expert in a control step.
#[derive(Clone, Copy, Debug)]
struct GripStep {
    is_gripping: bool,
    position_b: Vec3,
    grip: GripTarget,
}

/// True for the steps in which the hand holds, or closes at one place in order to hold.
///
/// An expert closes fast until just before the object and grips from there. A binary hand closes in one go, so that its
/// code is closed from the first of these steps on.
fn closing_or_holding(steps: &[GripStep]) -> Vec<bool> {
    let mut found: Vec<bool> = steps.iter().map(|step| step.is_gripping).collect();
    for at in (1..steps.len().saturating_sub(1)).rev() {
        let [before, step] = [steps[at - 1], steps[at]];
        let closes = match (before.grip, step.grip) {
            (GripTarget::Closure(from), GripTarget::Closure(to)) => to > from,
            _ => false,
        };
        found[at] |= found[at + 1] && closes && before.position_b == step.position_b;
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hand_is_closed_from_the_step_on_in_which_it_begins_to_close_in_order_to_hold() {
        let step = |x: f64, closure: f64, is_gripping: bool| GripStep {
            is_gripping,
            position_b: Vec3::new(x, 0.0, 0.0),
            grip: GripTarget::Closure(closure),
        };
        let steps = [
            step(0.0, 0.0, false),
            step(0.1, 0.1, false), // Closes on the way.
            step(0.2, 0.2, false),
            step(0.2, 0.4, false), // Closes fast.
            step(0.2, 0.6, false),
            step(0.2, 0.65, true),
            step(0.2, 0.65, true),
            step(0.5, 0.2, false), // Lets go.
        ];
        assert_eq!(closing_or_holding(&steps), [false, false, false, true, true, true, true, false]);
    }
}
