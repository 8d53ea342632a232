//! Verdicts at other time steps and on another mesh, as `softvt scripts/verdict_checks.lua` found them.

use serde::Deserialize;

/// A controller in a suite under a condition, and the verdicts that differ from those without it.
#[derive(Debug, Deserialize)]
pub struct VerdictRow {
    pub suite: String,
    pub controller: String,
    /// Name in `scripts/verdict_checks.lua`; `reference` for the default step and mesh.
    pub condition: String,
    pub episodes: u32,
    /// Goal Success, %.
    pub goal: f64,
    /// Safety Success, %.
    pub safety: f64,
    pub goal_turned: u32,
    pub safety_turned: u32,
}

impl VerdictRow {
    /// Share of the episodes with another Safety verdict.
    pub fn turned(&self) -> f64 {
        f64::from(self.safety_turned) / f64::from(self.episodes)
    }

    /// Largest share that is acceptable.
    pub fn bound(&self) -> f64 {
        if self.condition.starts_with("mesh") { 0.05 } else { 0.02 }
    }
}

/// The rows that `.ci/verdicts` wrote.
pub fn verdicts() -> Vec<VerdictRow> {
    serde_json::from_str(include_str!("verdicts.json")).expect("rows of verdicts")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn verdicts_hardly_turn_with_the_step_and_the_mesh() {
        let rows = verdicts();
        assert!(!rows.is_empty());
        for row in &rows {
            let of_row = |first: &&VerdictRow| {
                [&first.suite, &first.controller] == [&row.suite, &row.controller]
                    && first.condition == "reference"
            };
            let first = rows.iter().find(of_row).expect("a row");
            let share = |turned: u32| 100.0 * f64::from(turned) / f64::from(row.episodes);
            let [goal, safety] = [row.goal - first.goal, row.safety - first.safety].map(f64::abs);
            let consistent =
                goal <= share(row.goal_turned) + 1e-9 && safety <= share(row.safety_turned) + 1e-9;
            assert!(consistent, "{row:?}, at first {first:?}");
            // A published miss: this controller runs out of the 25 s of this suite in other episodes at another step.
            let is_missed = row.suite == "spatial_hidden" && row.controller == "tactile-servo";
            assert!(row.turned() <= row.bound() || is_missed, "{row:?}, at first {first:?}");
        }
    }
}
