//! `softvt doctor`: versions, the machine, and a comparison of the physics with the published bits.

use std::{path::Path, sync::Arc};

use crate::{
    error::{CliError, Exit},
    output::{Console, print},
};
use softvt_runner::{GoldenEpisode, thread_count};

/// Prints versions and runs the golden episode.
///
/// # Errors
/// The golden episode cannot be run, or ends in another state than the published one.
pub(super) fn run() -> Result<(), CliError> {
    print(&format!(
        "softvt     {}\nplatform   {} {}, {} threads\nfeatures   {}\nlua        5.4, embedded\n",
        env!("CARGO_PKG_VERSION"),
        std::env::consts::ARCH,
        std::env::consts::OS,
        thread_count(None),
        if cfg!(target_feature = "avx2") { "avx2" } else { "portable (slower; the same results)" },
    ))?;
    let Some(golden) = GoldenEpisode::published()? else {
        return print("golden     none in this build\n");
    };
    let hash = golden.simulate(Arc::new(Console::default()))?;
    let is_same = hash == golden.state_hash;
    let verdict = if is_same { "matches the published one" } else { "DIFFERS from the published one" };
    print(&format!("golden     {} task {}: {hash}, {verdict}\n", golden.script, golden.task))?;
    if is_same { Ok(()) } else { Err(mismatch(&golden)) }
}

fn mismatch(golden: &GoldenEpisode) -> CliError {
    let local = ["suites", "scripts", "assets"].into_iter().filter(|folder| Path::new(folder).is_dir());
    let local: Vec<&str> = local.collect();
    let cause = match local.is_empty() {
        true => "this machine or this build computes other results".to_owned(),
        false => format!(
            "files of the working folder ({}) take precedence over those of the release; run softvt doctor in an empty \
             folder to test the machine alone",
            local.join(", ")
        ),
    };
    CliError::new(
        Exit::Internal,
        format!(
            "the golden episode does not end in the published state {}: {cause}; results are not bitwise comparable with \
         published ones",
            golden.state_hash
        ),
    )
}
