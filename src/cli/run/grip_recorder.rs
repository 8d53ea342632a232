//! When an expert means its gripper to hold: the binary code of the gripper, which its closure does not tell, since what is
//! wide is held by a hand that is hardly shut.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex},
};

use crate::{
    cli::{
        run::config::RunConfig,
        run::{policy::expert, suite_run::SuiteRun},
    },
    policy::{Action, Observation, SensorStreams},
    rollout::{ControlError, Controller, Simulation},
    script::ExpertController,
};

/// Whether the gripper was meant to hold in each control step, by task and attempt.
pub(crate) type GripLog = Arc<Mutex<BTreeMap<(usize, u32), Vec<bool>>>>;

/// Lets the experts of a batch say when the gripper is meant to hold; others have only their closure.
pub(crate) fn note_grips(run: &RunConfig, batch: &mut SuiteRun, grips: &GripLog) {
    let Some(hand) = run.policy.hand() else { return };
    let grips = grips.clone();
    batch.drive = Box::new(move |opened, brief| {
        Ok(Box::new(GripRecorder {
            driver: expert(opened, hand)?,
            shut: Vec::new(),
            whose: (brief.task, brief.episode),
            grips: grips.clone(),
        }))
    });
}

/// An expert whose grip is noted.
struct GripRecorder {
    driver: ExpertController,
    shut: Vec<bool>,
    whose: (usize, u32),
    grips: GripLog,
}

impl Controller for GripRecorder {
    fn streams(&self) -> SensorStreams {
        self.driver.streams()
    }

    fn gave_up(&self) -> Option<&str> {
        self.driver.gave_up()
    }

    fn act(&mut self, sim: &Simulation, observation: &Observation) -> Result<Option<Action>, ControlError> {
        let action = self.driver.act(sim, observation)?;
        self.shut.push(self.driver.gripping());
        Ok(action)
    }

    fn finish(&mut self) {
        if let Ok(mut all) = self.grips.lock() {
            all.insert(self.whose, std::mem::take(&mut self.shut));
        }
    }
}
