//! `softvt dataset check`: validation of a dataset, with re-simulation of some of its demonstrations.

use crate::{
    cli::{
        args::DatasetCheckArgs,
        error::CliError,
        output::print,
        run::demo_replay::{DemoRef, check_complete, demos_of, replay_demos},
    },
    dataset::check,
    text::counted,
};

/// Validates a dataset folder or one HDF5 file.
///
/// # Errors
/// Any problem of the dataset, or (exit code 1) a demonstration that is not reproduced.
pub(super) fn run(args: &DatasetCheckArgs) -> Result<(), CliError> {
    let path = &args.path;
    check_complete(path)?;
    let findings = if path.is_dir() { check::folder(path) } else { check::file(path) };
    let findings = findings.map_err(CliError::input)?;
    if !findings.problems.is_empty() {
        return Err(CliError::input(format!(
            "{}\n{}: {}",
            findings.problems.join("\n"),
            path.display(),
            counted(findings.problems.len(), "problem")
        )));
    }
    print(&format!(
        "{}, {}, {}: OK\n",
        counted(findings.demos, "demonstration"),
        counted(findings.steps, "step"),
        counted(findings.videos, "video")
    ));
    replay_demos(&sample(&demos_of(path)?, args.replays))
}

/// Selects `count` demonstrations, evenly spaced from the first.
fn sample(demos: &[DemoRef], count: usize) -> Vec<DemoRef> {
    let count = count.min(demos.len());
    (0..count).map(|i| demos[i * demos.len() / count].clone()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sample_is_evenly_spaced() {
        let demos: Vec<DemoRef> = (0..10).map(|demo| DemoRef { file: "x".into(), demo }).collect();
        let sampled = |count| sample(&demos, count).into_iter().map(|demo| demo.demo).collect::<Vec<_>>();
        assert_eq!(sampled(1), [0]);
        assert_eq!(sampled(2), [0, 5]);
        assert_eq!(sampled(20).len(), 10);
        assert_eq!(sampled(0), [0; 0]);
    }
}
