//! Results of the re-simulation of demonstrations, as `softvt replay` and `softvt dataset check` print them.

use crate::{
    error::{CliError, Exit},
    output::print,
};
use softvt_common::text::counted;
use softvt_runner::replay::{DemoRef, DemoReplay};

/// Prints for each demonstration whether its re-simulation is byte-identical, and how many reach the goal.
///
/// # Errors
/// A result differs (exit code 1).
pub(crate) fn report_replays(demos: &[DemoRef], replays: &[DemoReplay]) -> Result<(), CliError> {
    for (DemoRef { file, demo }, replay) in demos.iter().zip(replays) {
        let result = match &replay.difference {
            None => format!("byte-identical, final state {}", replay.state_hash),
            Some(difference) => format!("differs: {difference}"),
        };
        print(&format!("{} demo_{demo}: {result}\n", file.display()))?;
    }
    let all = demos.len();
    let identical = replays.iter().filter(|replay| replay.difference.is_none()).count();
    let reached = replays.iter().filter(|replay| replay.goal_reached).count();
    if all > 1 {
        print(&format!(
            "replayed by their actions alone: {identical} of {all} byte-identical, {reached} of {all} reach the goal\n"
        ))?;
    }
    if identical == all {
        return Ok(());
    }
    Err(CliError::new(
        Exit::Internal,
        format!(
            "replaying {} gave another result; softvt doctor checks whether this machine computes the published results",
            counted(all - identical, "demonstration")
        ),
    ))
}
