//! Recording of when an expert intends its gripper to hold an object.
//!
//! The binary gripper code of a dataset needs this intent. The commanded closure does not show it: a hand around a wide
//! object is nearly open while it holds.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex},
};

use crate::{
    cli::run::{config::RunConfig, policy::expert_controller, suite_run::SuiteRun},
    evaluation::episode_id::EpisodeIndex,
    parallel,
    policy::{Action, Observation, SensorStreams},
    rollout::{ControlError, Controller, Simulation},
    script::ExpertController,
};

/// Per attempt and control step: true if the gripper is intended to hold.
pub(crate) type GripLog = Arc<Mutex<BTreeMap<EpisodeIndex, Vec<bool>>>>;

/// Makes the experts of a run record their intent into `log`. Other policies are left unchanged.
pub(crate) fn record_grips(config: &RunConfig, run: &mut SuiteRun, log: &GripLog) {
    let Some(mode) = config.policy.grip_mode() else { return };
    let log = log.clone();
    run.controllers = Box::new(move |opened, brief| {
        Ok(Box::new(GripRecorder {
            expert: expert_controller(opened, mode)?,
            is_holding: Vec::new(),
            index: brief.index(),
            log: log.clone(),
        }))
    });
}

/// An expert whose intent to hold is recorded.
struct GripRecorder {
    expert: ExpertController,
    is_holding: Vec<bool>,
    index: EpisodeIndex,
    log: GripLog,
}

impl Controller for GripRecorder {
    fn streams(&self) -> SensorStreams {
        self.expert.streams()
    }

    fn gave_up(&self) -> Option<&str> {
        self.expert.gave_up()
    }

    fn act(&mut self, sim: &Simulation, observation: &Observation) -> Result<Option<Action>, ControlError> {
        let action = self.expert.act(sim, observation)?;
        self.is_holding.push(self.expert.gripping());
        Ok(action)
    }

    fn finish(&mut self) {
        parallel::lock(&self.log).insert(self.index, std::mem::take(&mut self.is_holding));
    }
}
