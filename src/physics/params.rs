//! Every number of the mechanics in one place.

use serde::{Deserialize, Serialize};

use crate::text::format_number;

/// Parameters of the mechanics. The defaults are what the benchmark runs with.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Params {
    /// Time step, s. Control runs at 20 Hz whatever it is.
    pub dt: f64,
    /// Mass-proportional damping of soft bodies (air drag), 1/s. 0; the paper's engine uses 2.5.
    pub alpha: f64,
    /// Stiffness-proportional damping of soft bodies, s. 5 ms settles a grasped body in under 0.3 s.
    pub beta: f64,
    /// Dissipation time of contact springs, s. Small against `dt`, so that a sliding surface is not held off.
    pub tau: f64,
    /// Normal modulus per area of colliders without a soft layer, Pa/m: near rigid for E ≤ 1 MPa.
    pub rigid_modulus: f64,
    /// Tangential over normal contact stiffness (Mindlin 1949 gives 0.5…0.8 for bodies; creep does not depend on it).
    pub shear_ratio: f64,
    /// Samples closer than this, or than 1.5 steps of approach, get a row, m.
    pub margin: f64,
    /// Speed below which a body may fall asleep, m/s.
    pub sleep_speed: f64,
    /// How long a body must be that slow, s.
    pub sleep_after: f64,
    /// Whether bodies fall asleep at all.
    pub sleeping: bool,
    /// Time for which an element may be inverted before the run is invalid, s.
    pub inverted_after: f64,
    /// Speed beyond which the run is invalid, m/s: nothing that a gripper of 0.2 m/s, an arm or a fall onto a table moves is
    /// near it.
    pub most_speed: f64,
}

impl Default for Params {
    fn default() -> Self {
        Self {
            dt: 1.0 / 60.0,
            alpha: 0.0,
            beta: 5e-3,
            tau: 5e-3,
            rigid_modulus: 1e9,
            shear_ratio: 0.5,
            margin: 2e-4,
            sleep_speed: 1e-4,
            sleep_after: 0.5,
            sleeping: true,
            inverted_after: 0.1,
            most_speed: 100.0,
        }
    }
}

impl Params {
    /// Checks every number.
    ///
    /// # Errors
    /// The first number out of its range; a fragment for people.
    pub fn check(&self) -> Result<(), String> {
        let positive = [
            ("dt", self.dt),
            ("rigid_modulus", self.rigid_modulus),
            ("shear_ratio", self.shear_ratio),
            ("margin", self.margin),
            ("sleep_after", self.sleep_after),
            ("most_speed", self.most_speed),
        ];
        let not_negative = [
            ("alpha", self.alpha),
            ("beta", self.beta),
            ("tau", self.tau),
            ("sleep_speed", self.sleep_speed),
            ("inverted_after", self.inverted_after),
        ];
        for (name, value) in positive {
            if !(value > 0.0 && value.is_finite()) {
                return Err(format!(
                    "physics.{name}: expected a positive number, got {}",
                    format_number(value)
                ));
            }
        }
        for (name, value) in not_negative {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(format!("physics.{name}: expected 0 or more, got {}", format_number(value)));
            }
        }
        // Below, settling alone would take minutes.
        if !(1e-4..=0.05).contains(&self.dt) {
            return Err(format!(
                "physics.dt: expected seconds in 0.0001..0.05, got {}",
                format_number(self.dt)
            ));
        }
        Ok(())
    }
}
