//! Settling: the objects of a scene come to rest before an episode begins.

use super::{cancel, object::ObjectInstance, simulation::Simulation};
use crate::{
    geometry::Aabb,
    physics::{BodyId, world::StepFailure},
    scene::Scene,
};

/// Speed below which an object counts as settled, m/s.
const SETTLED_SPEED: f64 = 1e-3;
/// Time for which all objects must be settled, s.
const SETTLED_TIME: f64 = 0.5;
/// Time limit of settling, s.
const SETTLE_TIMEOUT: f64 = 3.0;
/// Drop below all fixed objects from which on an object counts as fallen out of the world, m.
const MIN_FALL: f64 = 0.5;

/// The scene did not come to rest.
#[derive(Debug, thiserror::Error)]
pub enum SettleError {
    /// An object still moves.
    #[error(
        "object {object} still moves at {speed_mm:.1} mm/s after {SETTLE_TIMEOUT} s of settling; put it nearer to what \
         it rests on, or make it lie stably"
    )]
    Moving {
        /// The fastest object.
        object: String,
        /// Its speed, mm/s.
        speed_mm: f64,
        /// `file:line` where the object was placed; empty if no script placed it.
        placed_at: String,
    },
    /// An object fell below all fixed objects.
    #[error(
        "object {object} fell out of the world: there was nothing below it, and after {SETTLE_TIMEOUT} s of settling it is \
         {fallen:.1} m lower; place it above a support"
    )]
    Fell {
        /// The object.
        object: String,
        /// Distance that it has fallen, m.
        fallen: f64,
        /// `file:line` where the object was placed; empty if no script placed it.
        placed_at: String,
    },
    /// The run was cancelled.
    #[error("interrupted")]
    Interrupted,
    /// A physics step failed.
    #[error("settling failed: {failure}")]
    Failed {
        /// The failure.
        failure: StepFailure,
        /// `file:line` where the failing object was placed; empty if unknown.
        placed_at: String,
    },
}

impl SettleError {
    /// `file:line` where a script placed the object in question.
    pub fn place(&self) -> Option<&str> {
        match self {
            Self::Moving { placed_at, .. }
            | Self::Fell { placed_at, .. }
            | Self::Failed { placed_at, .. } => Some(placed_at.as_str()).filter(|place| !place.is_empty()),
            Self::Interrupted => None,
        }
    }
}

impl Simulation {
    /// Steps until all objects have been at rest for 0.5 s, while the arm holds its pose.
    ///
    /// # Errors
    /// An object still moves after 3 s or has fallen out of the world, a physics step fails, or the run is cancelled.
    pub fn settle(&mut self) -> Result<(), SettleError> {
        let dt = self.world.params.dt;
        let mut settled_time = 0.0;
        let mut elapsed = 0.0;
        while settled_time < SETTLED_TIME {
            if cancel::requested() {
                return Err(SettleError::Interrupted);
            }
            self.step().map_err(|failure| SettleError::Failed {
                placed_at: failure.body().map_or(String::new(), |body| placed_at(&self.scene, body)),
                failure,
            })?;
            elapsed += dt;
            let fastest = self.fastest();
            let moving = fastest.filter(|(_, speed)| *speed >= SETTLED_SPEED);
            settled_time = if moving.is_none() { settled_time + dt } else { 0.0 };
            if let Some((object, speed)) = moving.filter(|_| elapsed > SETTLE_TIMEOUT) {
                return Err(self.unsettled(object, speed));
            }
        }
        Ok(())
    }

    /// The error about an object that moves at `speed` (m/s) after the time limit.
    fn unsettled(&self, object: &ObjectInstance, speed: f64) -> SettleError {
        let (name, placed_at) = (object.name.clone(), placed_at(&self.scene, &object.name));
        let height = self.centre(object).z;
        let fixed =
            self.objects.iter().filter(|other| other.body == BodyId::World && !other.colliders.is_empty());
        let floor = fixed
            .map(|other| Aabb::transformed(&other.bounds, &other.start_w).min.z)
            .fold(f64::INFINITY, f64::min);
        let fallen = object.start_w.translation.z - height;
        match fallen > MIN_FALL && height < floor {
            true => SettleError::Fell { object: name, fallen, placed_at },
            false => SettleError::Moving { object: name, speed_mm: 1e3 * speed, placed_at },
        }
    }

    /// The fastest object and its speed, m/s; the first one if several are equally fast.
    fn fastest(&self) -> Option<(&ObjectInstance, f64)> {
        let speeds = self.objects.iter().map(|object| (object, self.speed(object)));
        speeds.reduce(|best, next| if next.1 > best.1 { next } else { best })
    }
}

/// `file:line` where the object of a name, or the object of the part of that name, was placed.
fn placed_at(scene: &Scene, name: &str) -> String {
    let whole = name.split('.').next().unwrap_or(name);
    let object = scene.objects.iter().find(|object| object.name == whole);
    object.map_or(String::new(), |object| object.placed_at.clone())
}
