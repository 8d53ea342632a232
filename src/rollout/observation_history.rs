//! The last control steps, as far as a policy's sensors reach back.

use std::{collections::VecDeque, sync::Arc};

use super::sensors::{SensingError, SensorSuite};
use crate::{
    physics::world::Frame,
    policy::{CameraImage, Observation, SensorStreams, TactileFrame, TactileHistory},
    sensing::tactile::HISTORY_LENGTH,
};

/// States and, where somebody has looked, what was felt in them; oldest first.
#[derive(Clone, Debug, Default)]
pub(super) struct Recent {
    frames: VecDeque<(Frame, Option<Arc<[TactileFrame; 2]>>)>,
    /// Observations with a picture taken from inside of something.
    pub inside: u32,
}

impl Recent {
    /// Takes the state after a control step.
    pub(super) fn push(&mut self, frame: Frame) {
        if self.frames.len() == HISTORY_LENGTH {
            self.frames.pop_front();
        }
        self.frames.push_back((frame, None));
    }

    /// Adds to an observation what is looked at.
    pub(super) fn observe(
        &mut self,
        sensors: &mut SensorSuite,
        blind: Observation,
        streams: &SensorStreams,
    ) -> Result<Observation, SensingError> {
        let Some((frame, _)) = self.frames.back() else { return Ok(blind) };
        let mut cameras = Vec::with_capacity(streams.cameras.len());
        let mut inside = false;
        for name in &streams.cameras {
            let camera = sensors.camera(name)?.clone();
            let picture = sensors.render(frame, &camera)?;
            inside |= picture.inside.is_some();
            cameras.push(CameraImage { name: camera.name, image: picture.into_rgb_image() });
        }
        self.inside += u32::from(inside);
        let forces = streams.force.then(|| SensorSuite::pad_forces(frame));
        let force_history = if streams.force { self.forces() } else { Vec::new() };
        let touch = if streams.touch { Some(self.touch(sensors)?) } else { None };
        Ok(Observation { cameras, touch, forces, force_history, ..blind })
    }

    /// Resultants in the last states.
    fn forces(&self) -> Vec<[f64; 6]> {
        let both = |(frame, _): &(Frame, _)| {
            let [left, right] = SensorSuite::pad_forces(frame).map(|pad| pad.wrench.force);
            [left.x, left.y, left.z, right.x, right.y, right.z]
        };
        self.frames.iter().map(both).collect()
    }

    /// What was felt in the last states; each is worked out once.
    fn touch(&mut self, sensors: &mut SensorSuite) -> Result<TactileHistory, SensingError> {
        let mut frames = Vec::with_capacity(HISTORY_LENGTH);
        for (frame, felt) in &mut self.frames {
            let both = match felt.take() {
                Some(both) => both,
                None => Arc::new(sensors.tactile_frames(frame)?),
            };
            frames.push(both.clone());
            *felt = Some(both);
        }
        Ok(TactileHistory { frames })
    }
}
