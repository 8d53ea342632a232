//! The squeeze against the independent static solver: same mesh, law, samples.

use crate::{
    rows::{Row, rows},
    support::{Outcome, run},
};

/// A squeeze and its reference row.
pub struct Compared {
    pub row: Row,
    pub ours: Outcome,
}

impl Compared {
    /// Runs the squeeze of a row. If friction cannot hold, the row's hold columns are those of sticking pads,
    /// so the pads stick.
    pub fn new(row: Row) -> Self {
        let mut options = row.squeeze();
        if !row.flag("holds") {
            options.friction = 1e3;
        }
        Self { ours: run(&options), row }
    }

    /// Relative errors of force and D in the grip and of force and D in the hold.
    pub fn errors(&self) -> [f64; 4] {
        let against = |value: f64, key: &str| value / self.row.number(key) - 1.0;
        [
            against(self.ours.force_grip_n, "force_grip_n"),
            against(self.ours.d_grip_pct, "d_grip_pct"),
            against(self.ours.force_hold_n, "force_hold_n"),
            against(self.ours.d_hold_pct, "d_hold_pct"),
        ]
    }

    /// Error of the hold force over the force whose friction just carries the weight.
    pub fn capacity_error(&self) -> f64 {
        let scale = self.row.number("weight_n") / (2.0 * self.row.number("friction"));
        (self.ours.force_hold_n - self.row.number("force_hold_n")) / scale
    }
}

/// The rows of `group` that `keep` chooses, with our squeezes next to them.
pub fn compare(group: &str, keep: impl Fn(&Row) -> bool) -> Vec<Compared> {
    rows(group).into_iter().filter(|row| keep(row)).map(Compared::new).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_within(compared: &[Compared], bound: f64) {
        assert!(!compared.is_empty());
        for c in compared {
            let [.., force, d] = c.errors();
            assert!(c.ours.failure.is_none(), "{:?}: {:?}", c.row, c.ours.failure);
            assert!(force.abs() < bound && d.abs() < bound, "force {force:.4}, D {d:.4} at {:?}", c.row);
        }
    }

    #[test]
    fn cube_at_gaps_48_to_30_has_the_reference_force_and_deformation() {
        assert_within(&compare("cube", |row| row.number("gap_mm") <= 48.0), 0.02);
    }

    #[test]
    fn cube_at_light_gaps_has_the_reference_force_on_the_scale_of_its_capacity() {
        for c in compare("cube", |row| (49.0..=49.8).contains(&row.number("gap_mm"))) {
            assert!(c.capacity_error().abs() < 0.03, "{:.4} at {:?}", c.capacity_error(), c.row);
        }
    }

    #[test]
    fn finer_cube_has_the_reference_force_and_deformation() {
        assert_within(&compare("cube_12", |row| row.number("gap_mm") == 42.0), 0.02);
    }

    #[test]
    fn round_bodies_have_the_reference_force_and_deformation() {
        let firm = |row: &Row| row.number("resolution") == 6.0 && row.number("capacity_over_weight") > 7.0;
        assert_within(&compare("round", firm), 0.02);
    }

    #[test]
    fn other_materials_pads_and_sizes_have_the_reference_force_and_deformation() {
        assert_within(&compare("variants", |row| row.number("capacity_over_weight") > 3.0), 0.02);
    }

    #[test]
    fn pads_of_other_sizes_and_places_have_the_reference_force_and_deformation() {
        let whole = |row: &Row| row.number("pad_mm").fract() == 0.0;
        assert_within(&compare("pads", whole), 0.02);
    }
}
