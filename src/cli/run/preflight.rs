//! A first look at the scenes of a suite: what is wrong with them is told before anything runs.

use std::sync::Arc;

use crate::{
    benchmark::{Goal, ObjectType, Task},
    cli::{error::CliError, run::suite_run::SuiteRun},
    policy::SensorStreams,
    rollout::{
        BuildError, EpisodeError, SensingError, SensorSuite, Simulation, check_sensors, check_support,
        target_asset,
    },
    scene::{Body, Scene},
    script::schema,
};

/// Why a first look at a scene fails.
#[derive(Debug, thiserror::Error)]
enum PreflightError {
    #[error(transparent)]
    Build(#[from] BuildError),
    #[error(transparent)]
    Sense(#[from] SensingError),
}

impl SuiteRun<'_> {
    /// Reads the thresholds of the targets of all tasks, and looks once at whatever will be looked at in the first episode of
    /// each: what is wrong with a scene's senses is told before anything runs.
    ///
    /// # Errors
    /// A layout, a threshold file, a camera, the light or a tactile sensor that is wrong; a server that is not there.
    pub(crate) fn prepare(&mut self, tasks: &[&Task]) -> Result<(), CliError> {
        for task in tasks {
            let first = self.jobs.iter().find(|(of, _)| of.id == task.id).map_or(0, |(_, episode)| *episode);
            let opened = self.open(&self.request(task, first))?;
            self.right_kind(task, &opened.nominal)?;
            self.learn_limit(target_asset(&opened.nominal, task).cloned())?;
            let scene = Arc::new(opened.scene.clone());
            self.has_cameras(&scene, task)?;
            self.drivers.connect()?;
            let streams = (self.drive)(opened, self.brief(task, first))?.streams();
            self.force_observed |= streams.force;
            self.try_out(scene, streams).map_err(|error| self.trial_failure(error, task, first))?;
        }
        Ok(())
    }

    /// What the policy's own file says that it looks at is there.
    fn has_cameras(&self, scene: &Scene, task: &Task) -> Result<(), CliError> {
        let Some((place, streams)) = self.run.policy.looks() else { return Ok(()) };
        let missing = streams.cameras.iter().find(|name| scene.camera(name).is_none());
        missing.map_or(Ok(()), |name| {
            let known = scene.cameras.iter().map(|camera| camera.name.as_str());
            let unknown = schema::unknown("camera", name, known);
            Err(CliError::input(format!("{place}: {unknown} (scene of task {})", task.id)))
        })
    }

    /// Builds the first scene of a task, and looks for all that can be wrong with it before anything moves.
    ///
    /// # Errors
    /// What is wrong.
    pub(crate) fn examine(&self, task: &Task, scene: Scene) -> Result<(), CliError> {
        self.right_kind(task, &scene)?;
        let scene = Arc::new(if self.run.twin { scene.rigid_twin() } else { scene });
        let settings = &self.settings;
        let look = || -> Result<(), PreflightError> {
            check_sensors(&scene, &settings.tactile, &self.looks)?;
            let sim = Simulation::new(scene.clone(), &settings.physics, &settings.robot, &self.cache)?;
            check_support(&sim)?;
            Ok(SensorSuite::new(&sim, &settings.tactile, &self.looks)
                .check_camera_positions(&SensorSuite::frame(&sim))?)
        };
        look().map_err(|error| self.trial_failure(error, task, 0))
    }

    /// What can be deformed is not the target of a suite whose tables say N/A to deformation.
    fn right_kind(&self, task: &Task, scene: &Scene) -> Result<(), CliError> {
        let (Goal::On { object, .. } | Goal::In { object, .. }) = &task.goal;
        let target = scene.objects.iter().find(|known| known.name == *object);
        let soft = target.filter(|object| matches!(object.asset.body, Body::Soft(_)));
        match soft.filter(|_| self.suite.object_type == ObjectType::Rigid && !self.run.twin) {
            None => Ok(()),
            Some(target) => Err(CliError::input(format!(
                "{}: the target of task {}, {object}, is soft, and suite {} has object_type = \"rigid\"; say \
                 \"deformable\"",
                target.placed_at, task.id, self.suite.name
            ))),
        }
    }

    fn trial_failure(&self, error: PreflightError, task: &Task, episode: u32) -> CliError {
        self.episode_failure(&match error {
            PreflightError::Build(error) => EpisodeError::Build(error),
            PreflightError::Sense(source) => EpisodeError::Sense { task: task.id, episode, source },
        })
    }

    /// SensorAssets once at what a policy asks for, and a film shows, of a scene in which nothing has moved yet.
    fn try_out(&self, scene: Arc<Scene>, mut streams: SensorStreams) -> Result<(), PreflightError> {
        let settings = &self.settings;
        check_sensors(&scene, &settings.tactile, &self.looks)?;
        if self.films {
            streams.touch = true;
            streams.cameras.extend(scene.cameras.iter().map(|camera| camera.name.clone()));
        }
        if streams.cameras.is_empty() && !streams.touch {
            return Ok(());
        }
        let sim = Simulation::new(scene, &settings.physics, &settings.robot, &self.cache)?;
        let mut senses = SensorSuite::new(&sim, &settings.tactile, &self.looks);
        Ok(senses.validate(&SensorSuite::frame(&sim), &streams)?)
    }
}
