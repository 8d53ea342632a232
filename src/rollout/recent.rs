//! The last control steps, as far as a policy's senses reach back.

use std::{collections::VecDeque, sync::Arc};

use super::senses::{SenseError, Senses};
use crate::{
    physics::world::Frame,
    policy::{Observation, Streams, TouchFrame, TouchHistory},
    sensing::tactile::HISTORY,
};

/// States and, where somebody has looked, what was felt in them; oldest first.
#[derive(Debug)]
pub(super) struct Recent {
    senses: Senses,
    frames: VecDeque<(Frame, Option<Arc<[TouchFrame; 2]>>)>,
}

impl Recent {
    pub fn new(senses: Senses) -> Self {
        Self { senses, frames: VecDeque::with_capacity(HISTORY) }
    }

    /// Takes the state after a control step.
    pub fn push(&mut self, frame: Frame) {
        if self.frames.len() == HISTORY {
            self.frames.pop_front();
        }
        self.frames.push_back((frame, None));
    }

    /// Adds to an observation what is looked at.
    pub fn observe(&mut self, blind: Observation, streams: &Streams) -> Result<Observation, SenseError> {
        let Some((frame, _)) = self.frames.back() else { return Ok(blind) };
        let cameras = streams.cameras.iter().map(|name| self.senses.picture(frame, name));
        let cameras = cameras.collect::<Result<_, _>>()?;
        let forces = streams.force.then(|| Senses::forces(frame));
        let touch = if streams.touch { Some(self.touch()?) } else { None };
        Ok(Observation { cameras, touch, forces, ..blind })
    }

    /// What was felt in the last states; each is worked out once.
    fn touch(&mut self) -> Result<TouchHistory, SenseError> {
        let mut frames = Vec::with_capacity(HISTORY);
        for (frame, felt) in &mut self.frames {
            let both = match felt.take() {
                Some(both) => both,
                None => Arc::new(self.senses.touch_frame(frame)?),
            };
            frames.push(both.clone());
            *felt = Some(both);
        }
        Ok(TouchHistory { frames })
    }
}
