//! The states of the last control steps, as far back as observations reach.

use std::{collections::VecDeque, sync::Arc};

use super::{sensor_assets::SensingError, sensors::SensorSuite};
use softvt_physics::world::WorldSnapshot;
use softvt_policy::{CameraImage, Observation, SensorStreams, TactileFrame, TactileHistory};
use softvt_sensing::tactile::HISTORY_LENGTH;

#[derive(Clone, Debug)]
struct HistoryEntry {
    frame: WorldSnapshot,
    /// Tactile frames of both fingers, once they were requested.
    tactile: Option<Arc<[TactileFrame; 2]>>,
}

/// States of the last control steps, oldest first.
#[derive(Clone, Debug, Default)]
pub(super) struct ObservationHistory {
    entries: VecDeque<HistoryEntry>,
    /// Number of observations with an image from inside an object.
    pub camera_inside: u32,
}

impl ObservationHistory {
    /// Appends the state after a control step.
    pub(super) fn push(&mut self, frame: WorldSnapshot) {
        if self.entries.len() == HISTORY_LENGTH {
            self.entries.pop_front();
        }
        self.entries.push_back(HistoryEntry { frame, tactile: None });
    }

    /// Adds the requested streams to an observation that has none.
    pub(super) fn observe(
        &mut self,
        sensors: &mut SensorSuite,
        proprioceptive: Observation,
        streams: &SensorStreams,
    ) -> Result<Observation, SensingError> {
        let Some(HistoryEntry { frame, .. }) = self.entries.back() else { return Ok(proprioceptive) };
        let mut cameras = Vec::with_capacity(streams.cameras.len());
        let mut inside = false;
        for name in &streams.cameras {
            let camera = sensors.camera(name)?.clone();
            let rendered = sensors.render(frame, &camera)?;
            inside |= rendered.inside.is_some();
            cameras.push(CameraImage { name: camera.name, image: rendered.into_rgb_image() });
        }
        self.camera_inside += u32::from(inside);
        let forces = streams.force.then(|| SensorSuite::pad_forces(frame));
        let force_history = if streams.force { self.forces() } else { Vec::new() };
        let tactile = if streams.tactile { Some(self.tactile(sensors)?) } else { None };
        Ok(Observation { cameras, tactile, forces, force_history, ..proprioceptive })
    }

    /// Forces on the left and right pad in the last states, N.
    fn forces(&self) -> Vec<[f64; 6]> {
        let both = |entry: &HistoryEntry| {
            let [left, right] = SensorSuite::pad_forces(&entry.frame).map(|pad| pad.wrench.force);
            [left.x, left.y, left.z, right.x, right.y, right.z]
        };
        self.entries.iter().map(both).collect()
    }

    /// Tactile frames of the last states; each is computed once.
    fn tactile(&mut self, sensors: &mut SensorSuite) -> Result<TactileHistory, SensingError> {
        let mut frames = Vec::with_capacity(HISTORY_LENGTH);
        for HistoryEntry { frame, tactile } in &mut self.entries {
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
