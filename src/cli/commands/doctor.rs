//! `softvt doctor`: versions, the machine, and a comparison of the physics with the published bits; or a comparison of
//! a policy with demonstrations.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use clap::Args;

use crate::{
    args::PolicyArgs,
    error::{CliError, Exit},
    output::{Console, print, print_json},
};
use softvt_runner::{
    GoldenEpisode, Observer, PolicyConfig, policy_check::check_policy, stored_folder::enter_for_dataset,
    thread_count,
};

/// Check the installation with a golden episode, or a policy against demonstrations
#[derive(Args, Clone, Debug)]
pub(crate) struct DoctorArgs {
    #[command(flatten)]
    policy: PolicyArgs,
    /// Recorded demonstrations: their observations are sent to the policy, and its answers compared with their actions
    #[arg(long, value_name = "DIR", requires = "policy")]
    dataset: Option<PathBuf>,
    /// Number of demonstrations, spread over the dataset
    #[arg(long, value_name = "N", default_value_t = 3, requires = "dataset")]
    demos: usize,
    /// Print the comparison as JSON
    #[arg(long, requires = "dataset")]
    json: bool,
}

/// Checks the installation, or a policy.
///
/// # Errors
/// The golden episode cannot be run, or ends in another state than the published one. The policy cannot be run, or
/// (exit code 3) its answers do not agree with the demonstrations.
pub(super) fn run(args: &DoctorArgs) -> Result<(), CliError> {
    match (&args.dataset, args.policy.is_given()) {
        (Some(dataset), _) => compare_answers(args, dataset),
        (None, true) => Err(CliError::input(
            "--policy needs --dataset DIR: a folder of softvt record, with whose demonstrations its answers are compared",
        )),
        (None, false) => run_golden_episode(),
    }
}

fn compare_answers(args: &DoctorArgs, dataset: &Path) -> Result<(), CliError> {
    let observer: Arc<dyn Observer> = Arc::new(Console::default());
    let policy = PolicyConfig::load(&args.policy.options())?;
    let check = check_policy(&policy, &enter_for_dataset(dataset, &*observer)?, args.demos, &observer)?;
    if args.json {
        print_json(&check)?
    } else {
        print(check.text())?
    }
    match check.agrees() {
        true => Ok(()),
        false => {
            Err(CliError::new(Exit::Policy, "the answers of the policy do not agree with the demonstrations"))
        }
    }
}

fn run_golden_episode() -> Result<(), CliError> {
    out!(
        "softvt     {}\nplatform   {} {}, {} threads\nfeatures   {}\nlua        5.4, embedded\n",
        env!("CARGO_PKG_VERSION"),
        std::env::consts::ARCH,
        std::env::consts::OS,
        thread_count(None),
        if cfg!(target_feature = "avx2") { "avx2" } else { "portable (slower; the same results)" },
    )?;
    let Some(golden) = GoldenEpisode::published()? else {
        return print("golden     none in this build\n");
    };
    let hash = golden.simulate(Arc::new(Console::default()))?;
    let is_same = hash == golden.state_hash;
    let verdict = if is_same { "matches the published one" } else { "DIFFERS from the published one" };
    out!("golden     {} task {}: {hash}, {verdict}\n", golden.script, golden.task)?;
    if is_same {
        return Ok(());
    }
    let local: Vec<&str> =
        ["suites", "scripts", "assets"].into_iter().filter(|folder| Path::new(folder).is_dir()).collect();
    let cause = match local.is_empty() {
        true => "this machine or this build computes other results".to_owned(),
        false => format!(
            "files of the working folder ({}) take precedence over those of the release; run softvt doctor in an empty \
             folder to test the machine alone",
            local.join(", ")
        ),
    };
    let published = &golden.state_hash;
    let message = format_args!(
        "the golden episode does not end in the published state {published}: {cause}; results are not bitwise \
         comparable with published ones"
    );
    Err(CliError::new(Exit::Internal, message))
}
