//! `softvt record`: demonstrations of the tasks of a suite, those kept that are safe and reach the goal.

use serde_json::json;

use crate::{
    cli::{
        error::CliError,
        run::selection::select_tasks,
        run::{
            grip_recorder::note_grips,
            recording::{self, AttemptPlan, RecordingConfig, SuiteRecording, suites_of},
        },
    },
    script,
};

/// What to record.
#[derive(Clone, Debug)]
pub(crate) struct Record {
    /// What is kept, and where.
    pub output: RecordingConfig,
    /// Demonstrations a task.
    pub demos: u32,
    /// Most attempts a task.
    pub attempts: u32,
}

/// Records what the command line asks for.
///
/// # Errors
/// The script is no suite, the folder holds something else, an attempt or a file fails, too few attempts are good.
pub(crate) fn run(record: &Record) -> Result<(), CliError> {
    let Record { output, demos, attempts } = record;
    let run = &output.run;
    let loaded = script::load(&run.file, &run.script_words).map_err(CliError::input)?;
    let suites = suites_of("record", run, &loaded.plan)?;
    let names: Vec<String> = suites.iter().map(|suite| run.name_of(suite)).collect();
    let asked = json!({
        "softvt": env!("CARGO_PKG_VERSION"),
        "demos": demos,
        "pictures": output.pictures,
        "privileged": output.privileged,
        "suites": names,
    });
    recording::record_all(output, &asked, || {
        let session = |suite| {
            let wanted = AttemptPlan::First { demos: *demos, attempts: *attempts };
            SuiteRecording::new(
                output,
                (&loaded, suite),
                (select_tasks(run, suite)?, wanted),
                |batch, grips| {
                    note_grips(run, batch, grips);
                    Ok(())
                },
            )
        };
        suites.iter().map(|suite| session(*suite)).collect()
    })
}
