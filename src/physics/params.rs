//! Parameters of the mechanics.

use serde::{Deserialize, Serialize};

use softvt_common::text::{NOT_NEGATIVE, POSITIVE, RangeError, check_range};

/// Parameters of the mechanics. The defaults are those of the benchmark.
///
/// [`PhysicsParams::validate`] rejects values outside of the valid ranges; a [`World`](super::World) assumes valid ones.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PhysicsParams {
    /// Time step, s. Control runs at 20 Hz independently of it, so it must divide 0.05 s in the benchmark.
    pub dt: f64,
    /// Mass-proportional Rayleigh damping of soft bodies (α, as air drag), 1/s. The paper's engine uses 2.5.
    #[serde(alias = "alpha")]
    pub rayleigh_mass: f64,
    /// Stiffness-proportional Rayleigh damping of soft bodies (β), s. Implicit Euler adds its step: motion is damped by β + `dt`, by
    /// default 21.7 ms, so that a smaller step damps less. Equilibria do not depend on it.
    #[serde(alias = "beta")]
    pub rayleigh_stiffness: f64,
    /// Dissipation time scale τ_d of contact springs, s (Castro et al. 2022). A surface that recedes faster
    /// than the springs relax is released; the value is small compared with `dt`, so that friction does not
    /// lift a sliding surface.
    #[serde(alias = "tau")]
    pub dissipation_time: f64,
    /// Normal contact stiffness per area of nearly rigid colliders, Pa/m: near rigid for Young's moduli up to 1 MPa.
    pub rigid_modulus: f64,
    /// Tangential over normal contact stiffness. Mindlin (1949) gives 0.5 to 0.8 for solids; creep does
    /// not depend on it.
    pub shear_ratio: f64,
    /// Gap below which a sample becomes a contact point, m; fast samples do so within 1.5 steps of approach.
    pub margin: f64,
    /// Speed below which a body may fall asleep, m/s.
    pub sleep_speed: f64,
    /// Time for which a body must be that slow before it sleeps, s.
    #[serde(alias = "sleep_after")]
    pub sleep_delay: f64,
    /// True if bodies may fall asleep at all.
    pub sleeping: bool,
    /// Longest time for which an element may be inverted before the run is invalid, s.
    #[serde(alias = "inverted_after")]
    pub max_inverted_time: f64,
    /// Largest speed of a valid state, m/s: far above that of a gripper (0.2 m/s), an arm, or a fall onto a table.
    #[serde(alias = "most_speed")]
    pub max_speed: f64,
}

impl Default for PhysicsParams {
    fn default() -> Self {
        Self {
            dt: 1.0 / 60.0,
            rayleigh_mass: 0.0,
            rayleigh_stiffness: 5e-3,
            dissipation_time: 5e-3,
            rigid_modulus: 1e9,
            shear_ratio: 0.5,
            margin: 2e-4,
            sleep_speed: 1e-4,
            sleep_delay: 0.5,
            sleeping: true,
            max_inverted_time: 0.1,
            max_speed: 100.0,
        }
    }
}

impl PhysicsParams {
    /// Checks the range of every parameter.
    ///
    /// # Errors
    /// The first parameter out of range.
    pub fn validate(&self) -> Result<(), RangeError> {
        let positive = [
            ("dt", self.dt),
            ("rigid_modulus", self.rigid_modulus),
            ("shear_ratio", self.shear_ratio),
            ("margin", self.margin),
            ("sleep_delay", self.sleep_delay),
            ("max_speed", self.max_speed),
        ];
        let not_negative = [
            ("rayleigh_mass", self.rayleigh_mass),
            ("rayleigh_stiffness", self.rayleigh_stiffness),
            ("dissipation_time", self.dissipation_time),
            ("sleep_speed", self.sleep_speed),
            ("max_inverted_time", self.max_inverted_time),
        ];
        for (name, value) in positive {
            check_range(&format!("physics.{name}"), value, POSITIVE, "a positive number")?;
        }
        for (name, value) in not_negative {
            check_range(&format!("physics.{name}"), value, NOT_NEGATIVE, "0 or more")?;
        }
        // With a smaller step, settling alone would take minutes.
        check_range("physics.dt", self.dt, 1e-4..=0.05, "seconds in 0.0001..0.05")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_earlier_versions_are_read() {
        let old = r#"{"alpha": 1.0, "beta": 2.0, "tau": 3.0, "sleep_after": 4.0, "inverted_after": 5.0, "most_speed": 6.0}"#;
        let params: PhysicsParams = serde_json::from_str(old).expect("aliases");
        let read = [
            params.rayleigh_mass,
            params.rayleigh_stiffness,
            params.dissipation_time,
            params.sleep_delay,
            params.max_inverted_time,
            params.max_speed,
        ];
        assert_eq!(read, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    }
}
