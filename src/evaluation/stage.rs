//! Stages of a pick-and-place episode, and the one at which an episode failed.
//!
//! The stages come in order; an episode is in the first one that it has not completed. A stage that is completed stays
//! so, whatever happens later. The stages are computed from the true state, which policies never see.

use serde::{Deserialize, Serialize};

/// A stage, with the event that completes it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TaskStage {
    /// Until a pad touches the target.
    #[default]
    Reach,
    /// Until both pads touch it at once.
    Grasp,
    /// Until it is lifted while a pad touches it.
    Lift,
    /// Until its centre is over the goal region.
    Carry,
    /// Until it is in the goal region and supported, at the end of a control step.
    Place,
    /// Until it has rested there, released, for long enough: Goal Success.
    Release,
}

impl TaskStage {
    /// All stages, in order.
    pub const ALL: [Self; 6] =
        [Self::Reach, Self::Grasp, Self::Lift, Self::Carry, Self::Place, Self::Release];

    /// Name in files of results.
    pub fn name(self) -> &'static str {
        match self {
            Self::Reach => "reach",
            Self::Grasp => "grasp",
            Self::Lift => "lift",
            Self::Carry => "carry",
            Self::Place => "place",
            Self::Release => "release",
        }
    }
}

/// One physics step as [`StageMonitor`] reads it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StageEvidence {
    /// True for each pad that touches the target.
    pub touch: [bool; 2],
    /// True if the target is lifted.
    pub is_lifted: bool,
    /// True if its centre is over the goal region, at any height.
    pub is_over_goal: bool,
    /// True if it is in the goal region and supported, at the end of a control step.
    pub is_placed: bool,
}

/// Finds the stage of an episode.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StageMonitor {
    /// The stage that the episode is in.
    pub stage: TaskStage,
}

impl StageMonitor {
    /// Takes in one physics step, which may complete several stages.
    pub fn update(&mut self, sample: &StageEvidence) {
        let [left, right] = sample.touch;
        loop {
            self.stage = match self.stage {
                TaskStage::Reach if left || right => TaskStage::Grasp,
                TaskStage::Grasp if left && right => TaskStage::Lift,
                TaskStage::Lift if sample.is_lifted && (left || right) => TaskStage::Carry,
                TaskStage::Carry if sample.is_over_goal => TaskStage::Place,
                TaskStage::Place if sample.is_placed => TaskStage::Release,
                _ => return,
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_are_completed_in_order() {
        let mut monitor = StageMonitor::default();
        let mut after = |sample: StageEvidence| {
            monitor.update(&sample);
            monitor.stage
        };
        let none = StageEvidence::default();
        assert_eq!(
            after(StageEvidence { is_over_goal: true, is_placed: true, ..none }),
            TaskStage::Reach,
            "not touched"
        );
        assert_eq!(after(StageEvidence { touch: [false, true], is_lifted: true, ..none }), TaskStage::Grasp);
        assert_eq!(after(StageEvidence { touch: [true, true], ..none }), TaskStage::Lift);
        assert_eq!(after(none), TaskStage::Lift, "stages stay completed");
        assert_eq!(after(StageEvidence { is_lifted: true, ..none }), TaskStage::Lift, "thrown, not held");
        let carried = StageEvidence { touch: [true, true], is_lifted: true, ..none };
        assert_eq!(after(carried), TaskStage::Carry);
        assert_eq!(after(StageEvidence { is_over_goal: true, ..carried }), TaskStage::Place);
        assert_eq!(after(StageEvidence { is_over_goal: true, is_placed: true, ..none }), TaskStage::Release);
        assert!(TaskStage::ALL.is_sorted());
    }
}
