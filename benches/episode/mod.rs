//! The expert's episodes, for benches.

use std::sync::Arc;

use softvt::{
    benchmark::{Plan, seed::Split},
    evaluation::record::Identity,
    rollout::EpisodeSpec,
    script::{self, EpisodeRequest, ExpertController, LoadedScript},
};

/// The suite.
pub const SUITE: &str = "suites/spatial_soft.lua";

/// The suite, read.
pub fn load() -> LoadedScript {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(SUITE);
    script::load(&path, &[]).expect("the suite loads")
}

/// The first episode of a task and its controller.
pub fn open(loaded: &LoadedScript, task: usize, film: bool) -> (EpisodeSpec, ExpertController) {
    let Plan::Suite(suite) = &loaded.plan else { panic!("{SUITE} is a suite") };
    let request = EpisodeRequest {
        suite: suite.name.clone(),
        task,
        episode: 0,
        base_seed: 0,
        split: Split::Validation,
        shifts: Vec::new(),
    };
    let opened = script::EpisodeSetup::open(loaded, &request).expect("it opens");
    let (task, settings) = (suite.tasks[task].clone(), suite.settings.clone());
    let spec = EpisodeSpec {
        identity: Identity {
            suite: suite.name.clone(),
            task: task.id,
            prompt: task.prompt.clone(),
            layout: task.layout.clone(),
            episode: 0,
            seed: 0,
            split: Split::Validation.name().to_owned(),
            policy: "expert".to_owned(),
            privileged: true,
            asset: String::new(),
            soft: true,
            origin: None,
        },
        task,
        scene: Arc::new(opened.scene.clone()),
        limit: None,
        criteria: settings.criteria,
        params: settings.physics,
        robot: settings.robot,
        tactile: settings.tactile,
        record_states: film,
        record_trace: false,
        trace_nodes: false,
    };
    let expert = opened.expert().expect("an expert");
    (spec, ExpertController::new(expert, false))
}
