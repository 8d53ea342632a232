use super::*;
use crate::{
    benchmark::Plan,
    cli::{
        args::{self, Command},
        info::{self, RunInfo},
    },
    policy::{Action, ActionChunk, ChunkedPolicy, Observation, Policy, PolicyError, SensorStreams},
    report::run_folder::{EPISODES, RUN},
};

/// Asks for the true forces, holds still, and complains if it does not get them.
struct Feeler;

impl Policy for Feeler {
    fn name(&self) -> &str {
        "feeler"
    }

    fn streams(&self) -> SensorStreams {
        SensorStreams { force: true, ..SensorStreams::default() }
    }

    fn act(&mut self, seen: &Observation) -> Result<ActionChunk, PolicyError> {
        seen.forces.as_ref().ok_or(PolicyError::Action("no forces".to_owned()))?;
        Ok(Action { position_b: seen.ee_position_b, axis_angle_b: seen.ee_axis_angle_b, closure: 0.0 }.into())
    }
}

fn feeler(_: script::Episode, brief: TaskBrief) -> Result<Box<dyn Controller>, Failure> {
    Ok(Box::new(ChunkedPolicy::new(Box::new(Feeler), brief, 1)))
}

#[test]
fn every_file_of_a_run_says_whether_the_policy_saw_true_forces() {
    let words = ["softvt", "suites/spatial_soft.lua", "--threads", "1"].map(str::to_owned);
    let Ok(Command::Run(run)) = args::parse(&words) else { panic!("a run") };
    let loaded = script::load(&run.file, &[]).expect("it loads");
    let Plan::Suite(suite) = &loaded.plan else { panic!("a suite") };
    let mut suite = suite.clone();
    suite.tasks.truncate(1);
    suite.tasks[0].budget_steps = 3;
    let tasks: Vec<&Task> = suite.tasks.iter().collect();
    let root = tempfile::tempdir().expect("a folder");
    for (out, felt) in [("blind", false), ("felt", true)] {
        let dir = root.path().join(out);
        let mut batch = Batch::new(&run, &loaded, &suite, (vec![(tasks[0], 0)], dir.clone())).expect("made");
        if felt {
            batch.drive = Box::new(feeler);
        }
        batch.prepare(&tasks).expect("nothing is wrong");
        let folder = RunFolder::create(&dir).expect("a folder");
        info::write(&folder, &RunInfo::of(&batch, &tasks, 1)).expect("written");
        batch.go(folder, Vec::new()).expect("it runs");
        for file in [RUN, EPISODES, SUMMARY] {
            let text = std::fs::read_to_string(dir.join(file)).expect("written");
            let value: serde_json::Value = serde_json::from_str(&text).expect("one document");
            assert_eq!(value["force_observed"], felt, "{out}/{file}");
        }
    }
}
