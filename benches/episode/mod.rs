//! The expert's episodes, for benches.

use softvt::{
    benchmark::Plan,
    episode_id::{EpisodeId, EpisodeSplit},
    rollout::EpisodeSpec,
    script::{self, EpisodeSetup, ExpertController, ExpertGrip, LoadedScript, SceneChanges},
};

/// Suite of the episodes.
pub const SUITE: &str = "suites/spatial_soft.lua";

/// The suite, read.
pub fn load() -> LoadedScript {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(SUITE);
    script::load(&path, &[]).expect("the suite loads")
}

/// The first episode of a task and its controller.
pub fn open(loaded: &LoadedScript, task: usize, film: bool) -> (EpisodeSpec, ExpertController) {
    let Plan::Suite(suite) = &loaded.plan else { panic!("{SUITE} is a suite") };
    let id = EpisodeId {
        suite: suite.name.clone(),
        task,
        episode: 0,
        base_seed: 0,
        split: EpisodeSplit::Validation,
    };
    let opened = EpisodeSetup::open(loaded, &id, &SceneChanges::default()).expect("it opens");
    let mut spec = EpisodeSpec {
        record_states: film,
        ..EpisodeSpec::new(
            id,
            "expert",
            &suite.tasks[task],
            &opened.nominal,
            opened.scene.clone(),
            &suite.settings,
        )
    };
    spec.header.privileged = true;
    (spec, opened.expert(ExpertGrip::Commanded).expect("an expert"))
}
