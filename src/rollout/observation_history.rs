//! The states of the last control steps, as far back as observations reach.

use std::{collections::VecDeque, sync::Arc};

use super::sensors::{SensingError, Sensors};
use softvt_physics::world::WorldSnapshot;
use softvt_policy::{
    CameraImage, Observation, PastStep, RobotState, SensorStreams, TactileFrame, TactileHistory,
};
use softvt_sensing::tactile::HISTORY_LENGTH;

#[derive(Clone, Debug)]
struct HistoryEntry {
    frame: WorldSnapshot,
    robot: RobotState,
    /// Camera images, once they were requested.
    cameras: Option<Vec<Arc<CameraImage>>>,
    /// True if a requested image was taken inside an object.
    camera_inside: bool,
    /// Tactile frames of both fingers, once they were requested.
    tactile: Option<Arc<[TactileFrame; 2]>>,
    /// True if the state is counted as one that was observed from inside an object.
    is_counted: bool,
}

/// States of the last control steps, oldest first.
#[derive(Clone, Debug, Default)]
pub(super) struct ObservationHistory {
    entries: VecDeque<HistoryEntry>,
    /// Number of states whose observation had an image from inside an object. A state that is
    /// observed again counts once.
    pub camera_inside: u32,
}

impl ObservationHistory {
    /// Appends the state after a control step; `past_steps` earlier ones may be requested.
    pub(super) fn push(&mut self, frame: WorldSnapshot, robot: RobotState, past_steps: usize) {
        while self.entries.len() >= HISTORY_LENGTH.max(past_steps + 1) {
            self.entries.pop_front();
        }
        self.entries.push_back(HistoryEntry {
            frame,
            robot,
            cameras: None,
            camera_inside: false,
            tactile: None,
            is_counted: false,
        });
    }

    /// Adds the requested streams to an observation that has none.
    pub(super) fn observe(
        &mut self,
        sensors: &mut Sensors,
        proprioceptive: Observation,
        streams: &SensorStreams,
    ) -> Result<Observation, SensingError> {
        let first = |past: usize| self.entries.len().saturating_sub(past + 1);
        let (first_state, first_image) = (first(streams.past_steps), first(streams.past_images));
        let mut steps = Vec::with_capacity(streams.past_steps + 1);
        for (index, entry) in self.entries.iter_mut().enumerate().skip(first_state) {
            let cameras = if index >= first_image { entry.images(sensors, streams)? } else { Vec::new() };
            steps.push(PastStep { robot: entry.robot, cameras });
        }
        let Some(PastStep { cameras, .. }) = steps.pop() else { return Ok(proprioceptive) };
        let Some(HistoryEntry { frame, camera_inside, is_counted, .. }) = self.entries.back_mut() else {
            return Ok(proprioceptive);
        };
        self.camera_inside += u32::from(*camera_inside && !*is_counted);
        *is_counted |= *camera_inside;
        let forces = streams.force.then(|| Sensors::pad_forces(frame));
        let force_history = if streams.force { self.forces() } else { Vec::new() };
        let tactile = if streams.tactile { Some(self.tactile(sensors)?) } else { None };
        Ok(Observation { cameras, past: steps, tactile, forces, force_history, ..proprioceptive })
    }

    /// Forces on the left and right pad in the last states, N.
    fn forces(&self) -> Vec<[f64; 6]> {
        let both = |entry: &HistoryEntry| {
            let [left, right] = Sensors::pad_forces(&entry.frame).map(|pad| pad.wrench.force);
            [left.x, left.y, left.z, right.x, right.y, right.z]
        };
        self.entries.iter().map(both).collect()
    }

    /// Tactile frames of the last states; each is computed once.
    fn tactile(&mut self, sensors: &mut Sensors) -> Result<TactileHistory, SensingError> {
        let mut frames = Vec::with_capacity(self.entries.len());
        for HistoryEntry { frame, tactile, .. } in &mut self.entries {
            let both = match tactile.take() {
                Some(both) => both,
                None => Arc::new(sensors.tactile_frames(frame)?),
            };
            frames.push(both.clone());
            *tactile = Some(both);
        }
        Ok(TactileHistory { frames })
    }
}

impl HistoryEntry {
    /// Images of the requested cameras. Those of a state are rendered once.
    fn images(
        &mut self,
        sensors: &mut Sensors,
        streams: &SensorStreams,
    ) -> Result<Vec<Arc<CameraImage>>, SensingError> {
        if let Some(images) = self.cameras.as_ref().filter(|images| images.len() == streams.cameras.len()) {
            return Ok(images.clone());
        }
        let mut images = Vec::with_capacity(streams.cameras.len());
        for name in &streams.cameras {
            let camera = sensors.camera(name)?.clone();
            let rendered = match streams.depth || streams.segmentation {
                true => sensors.render(&self.frame, &camera)?,
                false => sensors.render_rgb(&self.frame, &camera)?,
            };
            self.camera_inside |= rendered.inside.is_some();
            let depth = streams.depth.then(|| rendered.depth.clone());
            let segmentation = streams.segmentation.then(|| rendered.segmentation.clone());
            let image = rendered.into_rgb_image();
            images.push(Arc::new(CameraImage { name: camera.name, image, depth, segmentation }));
        }
        self.cameras = Some(images.clone());
        Ok(images)
    }
}
