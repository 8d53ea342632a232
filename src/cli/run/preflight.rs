//! Checks of the scenes of a suite before any episode runs.

use std::sync::Arc;

use crate::{
    benchmark::{ObjectType, Task},
    cli::{
        error::CliError,
        run::{policy::policy_failure, suite_run::SuiteRun},
    },
    policy::SensorStreams,
    rollout::{BuildError, EpisodeError, SensingError, SensorSuite, Simulation, check_sensors, target_asset},
    scene::{Body, Scene},
    text::unknown_name,
};

#[derive(Debug, thiserror::Error)]
enum PreflightError {
    #[error(transparent)]
    Build(#[from] BuildError),
    #[error(transparent)]
    Sense(#[from] SensingError),
}

impl SuiteRun<'_> {
    /// Reads the deformation limits of all targets, connects to the policy server, and renders once what the policy
    /// observes at the start of the first episode of each task.
    ///
    /// # Errors
    /// A layout, calibration file, camera, light or tactile sensor that is not valid; a server that cannot be reached.
    pub(crate) fn prepare(&mut self, tasks: &[&Task]) -> Result<(), CliError> {
        for task in tasks {
            let first = self.jobs.iter().find(|job| job.task.id == task.id).map_or(0, |job| job.episode);
            let opened = self.open_episode(&self.episode_id(task, first))?;
            self.check_object_type(task, &opened.nominal)?;
            self.read_limit(target_asset(&opened.nominal, task).cloned())?;
            let scene = Arc::new(opened.scene.clone());
            self.check_declared_cameras(&scene, task)?;
            if let Some(connections) = &self.connections {
                connections.check().map_err(policy_failure)?;
            }
            let streams = (self.controllers)(opened, self.brief(task, first))?.streams();
            self.force_observed |= streams.force;
            self.check_streams(scene, streams).map_err(|error| self.preflight_error(error, task, first))?;
        }
        Ok(())
    }

    /// Builds the first scene of a task and checks all that can be checked before anything moves.
    ///
    /// # Errors
    /// A scene or sensor that is not valid.
    pub(crate) fn check_scene(&self, task: &Task, scene: Scene) -> Result<(), CliError> {
        self.check_object_type(task, &scene)?;
        let scene = Arc::new(if self.config.is_rigid_twin { scene.rigid_twin() } else { scene });
        let settings = &self.settings;
        let check = || -> Result<(), PreflightError> {
            check_sensors(&scene, &settings.tactile, &self.sensor_assets)?;
            let sim = Simulation::new(scene.clone(), &settings.physics, &settings.robot, &self.assets)?;
            sim.check_support()?;
            let mut sensors = SensorSuite::new(&sim, &settings.tactile, &self.sensor_assets);
            Ok(sensors.check_camera_positions(&SensorSuite::frame(&sim))?)
        };
        check().map_err(|error| self.preflight_error(error, task, 0))
    }

    /// Checks that the scene has the cameras that the file of the policy declares.
    fn check_declared_cameras(&self, scene: &Scene, task: &Task) -> Result<(), CliError> {
        let Some((place, streams)) = self.config.policy.declared_streams() else { return Ok(()) };
        let missing = streams.cameras.iter().find(|name| scene.camera(name).is_none());
        missing.map_or(Ok(()), |name| {
            let known = scene.cameras.iter().map(|camera| camera.name.as_str());
            let unknown = unknown_name("camera", name, known);
            Err(CliError::input(format!("{place}: {unknown} (scene of task {})", task.id)))
        })
    }

    /// Checks that a suite of rigid objects, whose tables have no deformation, has no soft target.
    fn check_object_type(&self, task: &Task, scene: &Scene) -> Result<(), CliError> {
        if self.suite.object_type != ObjectType::Rigid || self.config.is_rigid_twin {
            return Ok(());
        }
        let name = &task.goal.object;
        let target = scene.objects.iter().find(|object| object.name == *name);
        match target.filter(|object| matches!(object.asset.body, Body::Soft(_))) {
            None => Ok(()),
            Some(target) => Err(CliError::input(format!(
                "{}: the target of task {}, {name}, is soft, but suite {} has object_type = \"rigid\"; set \
                 \"deformable\"",
                target.placed_at, task.id, self.suite.name
            ))),
        }
    }

    fn preflight_error(&self, error: PreflightError, task: &Task, episode: u32) -> CliError {
        self.episode_error(&match error {
            PreflightError::Build(error) => EpisodeError::Build(error),
            PreflightError::Sense(source) => EpisodeError::Sense { task: task.id, episode, source },
        })
    }

    /// Renders each stream of the policy and of videos once, in the initial scene.
    fn check_streams(&self, scene: Arc<Scene>, mut streams: SensorStreams) -> Result<(), PreflightError> {
        let settings = &self.settings;
        check_sensors(&scene, &settings.tactile, &self.sensor_assets)?;
        if self.renders_episodes {
            streams.touch = true;
            streams.cameras.extend(scene.cameras.iter().map(|camera| camera.name.clone()));
        }
        if streams.cameras.is_empty() && !streams.touch {
            return Ok(());
        }
        let sim = Simulation::new(scene, &settings.physics, &settings.robot, &self.assets)?;
        let mut sensors = SensorSuite::new(&sim, &settings.tactile, &self.sensor_assets);
        Ok(sensors.validate(&SensorSuite::frame(&sim), &streams)?)
    }
}
