//! The last control steps, as far as a policy's senses reach back.

use std::{collections::VecDeque, sync::Arc};

use super::senses::{SenseError, Senses};
use crate::{
    physics::world::Frame,
    policy::{CameraPicture, Observation, Streams, TouchFrame, TouchHistory},
    sensing::tactile::HISTORY,
};

/// States and, where somebody has looked, what was felt in them; oldest first.
#[derive(Clone, Debug, Default)]
pub(super) struct Recent {
    frames: VecDeque<(Frame, Option<Arc<[TouchFrame; 2]>>)>,
    /// Observations with a picture taken from inside of something.
    pub inside: u32,
}

impl Recent {
    /// Takes the state after a control step.
    pub(super) fn push(&mut self, frame: Frame) {
        if self.frames.len() == HISTORY {
            self.frames.pop_front();
        }
        self.frames.push_back((frame, None));
    }

    /// Adds to an observation what is looked at.
    pub(super) fn observe(
        &mut self,
        senses: &mut Senses,
        blind: Observation,
        streams: &Streams,
    ) -> Result<Observation, SenseError> {
        let Some((frame, _)) = self.frames.back() else { return Ok(blind) };
        let mut cameras = Vec::with_capacity(streams.cameras.len());
        let mut inside = false;
        for name in &streams.cameras {
            let camera = senses.camera(name)?.clone();
            let picture = senses.see(frame, &camera)?;
            inside |= picture.inside.is_some();
            cameras.push(CameraPicture { name: camera.name, picture: picture.into_image() });
        }
        self.inside += u32::from(inside);
        let forces = streams.force.then(|| Senses::forces(frame));
        let force_history = if streams.force { self.forces() } else { Vec::new() };
        let touch = if streams.touch { Some(self.touch(senses)?) } else { None };
        Ok(Observation { cameras, touch, forces, force_history, ..blind })
    }

    /// Resultants in the last states.
    fn forces(&self) -> Vec<[f64; 6]> {
        let both = |(frame, _): &(Frame, _)| {
            let [left, right] = Senses::forces(frame).map(|pad| pad.load.force);
            [left.x, left.y, left.z, right.x, right.y, right.z]
        };
        self.frames.iter().map(both).collect()
    }

    /// What was felt in the last states; each is worked out once.
    fn touch(&mut self, senses: &mut Senses) -> Result<TouchHistory, SenseError> {
        let mut frames = Vec::with_capacity(HISTORY);
        for (frame, felt) in &mut self.frames {
            let both = match felt.take() {
                Some(both) => both,
                None => Arc::new(senses.touch_frame(frame)?),
            };
            frames.push(both.clone());
            *felt = Some(both);
        }
        Ok(TouchHistory { frames })
    }
}
