//! Coming to rest before an episode begins.

use super::{
    cancel,
    simulation::{ObjectInstance, Simulation},
};
use crate::{
    geometry::Aabb,
    physics::{BodyId, world::StepFailure},
    scene::Scene,
};

/// Speed below which a node counts as settled, m/s.
const SETTLED_SPEED: f64 = 1e-3;
/// How long all must be that slow, s.
const SETTLED_FOR: f64 = 0.5;
/// How long settling may take, s.
const SETTLE_WITHIN: f64 = 3.0;
/// What has sunk by more than this to below everything that is fixed has fallen out of the world, m.
const FALLEN: f64 = 0.5;

/// The scene did not come to rest.
#[derive(Debug, thiserror::Error)]
pub enum SettleError {
    /// Something still moves.
    #[error(
        "object {object} still moves at {speed_mm:.1} mm/s after {SETTLE_WITHIN} s of settling; put it nearer to what \
         it rests on, or make it lie stably"
    )]
    Moving {
        /// The fastest object.
        object: String,
        /// Its speed, mm/s.
        speed_mm: f64,
        /// Where it was placed, `file:line`; empty if no script did.
        placed_at: String,
    },
    /// Something is below all that could hold it.
    #[error(
        "object {object} fell out of the world: there was nothing below it, and after {SETTLE_WITHIN} s of settling it is \
         {fallen:.1} m lower; put it above what it is to rest on"
    )]
    Fell {
        /// The object.
        object: String,
        /// How far it has fallen, m.
        fallen: f64,
        /// As above.
        placed_at: String,
    },
    /// The run is to end.
    #[error("interrupted")]
    Interrupted,
    /// The physics failed.
    #[error("settling failed: {failure}")]
    Failed {
        /// How.
        failure: StepFailure,
        /// Where the object that it failed for was placed; empty if it is not known.
        placed_at: String,
    },
}

impl SettleError {
    /// `file:line` of the object that it is about, if a script placed it.
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
    /// Lets everything come to rest, the arm holding its pose.
    ///
    /// # Errors
    /// Something does not come to rest in time or falls for ever, or the physics fails.
    pub fn settle(&mut self) -> Result<(), SettleError> {
        let dt = self.world.params.dt;
        let mut quiet = 0.0;
        let mut waited = 0.0;
        while quiet < SETTLED_FOR {
            if cancel::requested() {
                return Err(SettleError::Interrupted);
            }
            self.step().map_err(|failure| SettleError::Failed {
                placed_at: failure.body().map_or(String::new(), |body| placed_at(&self.scene, body)),
                failure,
            })?;
            waited += dt;
            let fastest = self.fastest();
            let moving = fastest.filter(|(_, speed)| *speed >= SETTLED_SPEED);
            quiet = if moving.is_none() { quiet + dt } else { 0.0 };
            if let Some((object, speed)) = moving.filter(|_| waited > SETTLE_WITHIN) {
                return Err(self.unsettled(object, speed));
            }
        }
        Ok(())
    }

    /// What there is to say of an object that moves at `speed` (m/s) when all should be at rest.
    fn unsettled(&self, object: &ObjectInstance, speed: f64) -> SettleError {
        let (name, placed_at) = (object.name.clone(), placed_at(&self.scene, &object.name));
        let height = self.centre(object).z;
        let fixed =
            self.objects.iter().filter(|other| other.body == BodyId::World && !other.colliders.is_empty());
        let floor = fixed
            .map(|other| Aabb::transformed(&other.bounds, &other.start_w).min.z)
            .fold(f64::INFINITY, f64::min);
        let fallen = object.start_w.translation.z - height;
        match fallen > FALLEN && height < floor {
            true => SettleError::Fell { object: name, fallen, placed_at },
            false => SettleError::Moving { object: name, speed_mm: 1e3 * speed, placed_at },
        }
    }

    /// The fastest object and the speed of its fastest point, m/s; the first of them where several are.
    fn fastest(&self) -> Option<(&ObjectInstance, f64)> {
        let speeds = self.objects.iter().map(|object| (object, self.speed(object)));
        speeds.reduce(|best, next| if next.1 > best.1 { next } else { best })
    }
}

/// Where the object that `name` is, or is a part of, was placed.
fn placed_at(scene: &Scene, name: &str) -> String {
    let whole = name.split('.').next().unwrap_or(name);
    let object = scene.objects.iter().find(|object| object.name == whole);
    object.map_or(String::new(), |object| object.placed_at.clone())
}
