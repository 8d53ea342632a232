//! Labels of the grip codes two-width and force, from what a demonstration commanded and measured.

/// Label of an open gripper in the code force, N: any value below 0 opens.
pub(crate) const OPEN_FORCE: f64 = -1.0;

/// Closures of the code two-width: 0 while open, and while closed the median of the closures that are commanded then. A
/// hand that is commanded to the measured width would exert no force.
pub(crate) fn two_widths(closures: &[f64], is_closed: &[bool]) -> Vec<f64> {
    let closed = closures.iter().zip(is_closed).filter(|(_, is_closed)| **is_closed);
    let held = lower_median(closed.map(|(closure, _)| *closure).collect());
    is_closed.iter().map(|is_closed| if *is_closed { held } else { 0.0 }).collect()
}

/// Forces of the code force, N: [`OPEN_FORCE`] while open, and while closed the force after the step. Until that first
/// reaches the median of all closed steps, the label is that median, since it is what the hand closes to.
pub(crate) fn forces(force_after_n: &[f64], is_closed: &[bool]) -> Vec<f64> {
    let closed = force_after_n.iter().zip(is_closed).filter(|(_, is_closed)| **is_closed);
    let held = lower_median(closed.map(|(force, _)| *force).filter(|force| *force > 0.0).collect());
    let mut is_held = false;
    let label = |(force, is_closed): (&f64, &bool)| {
        is_held = *is_closed && (is_held || *force >= held);
        match (is_closed, is_held) {
            (false, _) => OPEN_FORCE,
            (true, true) => *force,
            (true, false) => held,
        }
    };
    force_after_n.iter().zip(is_closed).map(label).collect()
}

/// The median, the lower one of an even number of values; 0 without values.
fn lower_median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len().saturating_sub(1) / 2).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_are_the_median_closure_and_the_force_from_when_it_is_reached() {
        let is_closed = [false, true, true, true, true, true, false, true, true];
        let closures = [0.2, 0.3, 0.4, 0.5, 0.5, 0.5, 0.1, 0.5, 0.5];
        assert_eq!(two_widths(&closures, &is_closed), [0.0, 0.5, 0.5, 0.5, 0.5, 0.5, 0.0, 0.5, 0.5]);
        let force = [0.0, 0.0, 1.0, 4.0, 4.5, 3.5, 0.0, 0.0, 4.0];
        // The median of 1, 3.5, 4, 4 and 4.5.
        assert_eq!(forces(&force, &is_closed), [-1.0, 4.0, 4.0, 4.0, 4.5, 3.5, -1.0, 4.0, 4.0]);
        assert_eq!(two_widths(&[0.3], &[false]), [0.0]);
        assert_eq!(forces(&[0.0, 0.0], &[true, false]), [0.0, -1.0]);
    }
}
