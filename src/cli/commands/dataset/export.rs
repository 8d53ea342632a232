//! `softvt dataset export`: a recording as a LeRobot dataset.

use crate::{
    cli::{
        args::{ExportArgs, ExportFormat, GripperArg},
        error::CliError,
        output::{Progress, print},
        run::{config::thread_count, demo_replay::check_complete},
    },
    dataset::{
        DatasetError,
        lerobot::{self, ExportConfig, GripperCoding, LeRobotVersion},
    },
    rollout::cancel,
    text::counted,
};

/// Exports a recording.
///
/// # Errors
/// As [`lerobot::export`]. No output remains then.
pub(super) fn run(args: &ExportArgs) -> Result<(), CliError> {
    if args.out.to_string_lossy().trim().is_empty() {
        return Err(CliError::input("--out: expected a new folder, got \"\""));
    }
    check_complete(&args.path)?;
    let config = ExportConfig {
        data: args.path.clone(),
        out: args.out.clone(),
        version: match args.format {
            ExportFormat::LerobotV21 => LeRobotVersion::V21,
            ExportFormat::LerobotV30 => LeRobotVersion::V30,
        },
        gripper: match args.gripper {
            GripperArg::Binary => GripperCoding::Binary,
            GripperArg::Continuous => GripperCoding::Continuous,
        },
        tasks: args.tasks.clone(),
        threads: thread_count(args.threads),
    };
    let mut progress: Option<Progress> = None;
    let exported = lerobot::export(&config, cancel::requested, |total, episode| {
        progress.get_or_insert_with(|| Progress::new(total, "export")).tick(episode);
    });
    if let Some(progress) = &progress {
        progress.finish();
    }
    let exported = exported.map_err(|error| match error {
        DatasetError::Interrupted => CliError::interrupted("interrupted; nothing was written"),
        other => CliError::input(other),
    })?;
    print(&format!(
        "{}, {}, {}: {}\n",
        counted(exported.episodes, "episode"),
        counted(exported.frames, "frame"),
        counted(exported.tasks, "prompt"),
        config.out.display()
    ));
    Ok(())
}
