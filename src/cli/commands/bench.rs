//! `softvt bench`: the rates of this machine beside the published ones.

use std::path::PathBuf;

use clap::{Args, value_parser};

use crate::{
    error::CliError,
    output::{eprint_notice, print, text_columns},
};
use softvt_common::files::replace;
use softvt_runner::{
    rates::{self, MachineRates},
    thread_count,
};

/// Measure how many observations this machine makes per second
#[derive(Args, Debug)]
pub(crate) struct BenchArgs {
    /// Number of episodes at a time in the last measurement [default: number of processors]
    #[arg(long, value_name = "N", value_parser = value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Also write the rates to a JSON file
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Measures and prints the rates.
///
/// # Errors
/// The suite cannot be run, or the file not written.
pub(super) fn run(args: &BenchArgs) -> Result<(), CliError> {
    let published: Option<MachineRates> =
        softvt_script::embedded("assets/rates.json").map(serde_json::from_slice).transpose()?;
    let rates =
        rates::measure(thread_count(args.threads), |stage| eprint_notice(format!("measuring: {stage}")))?;
    if let Some(path) = &args.out {
        replace(path, [serde_json::to_string_pretty(&rates)?.as_bytes(), b"\n"].concat())?;
    }
    print(&table(&rates, published.as_ref()))
}

/// The rates, one column for each machine.
fn table(here: &MachineRates, published: Option<&MachineRates>) -> String {
    let machines: Vec<&MachineRates> = std::iter::once(here).chain(published).collect();
    let row = |name: &str, value: &dyn Fn(&MachineRates) -> String| {
        std::iter::once(name.to_owned()).chain(machines.iter().map(|rates| value(rates))).collect::<Vec<_>>()
    };
    let mut rows = vec![
        std::iter::once("")
            .chain(["here", "published"])
            .take(machines.len() + 1)
            .map(str::to_owned)
            .collect(),
        row("CPU s to the first observation", &|rates| format!("{:.2}", rates.first_observation_s)),
    ];
    for (index, of_streams) in here.streams.iter().enumerate() {
        let value = |rates: &MachineRates| {
            rates.streams.get(index).map_or_else(String::new, |rate| {
                format!("{:.0} ({:.1} ×)", rate.observations_per_s, rate.times_real_time())
            })
        };
        rows.push(row(&format!("{}, one core", of_streams.streams), &value));
    }
    let machine =
        |rates: &MachineRates| format!("{:.0} ({} threads)", rates.observations_per_s, rates.threads);
    rows.push(row("all streams, machine", &machine));
    let names = machines
        .iter()
        .zip(["here", "published"])
        .map(|(rates, which)| format!("{which}: softvt {}, {}\n", rates.softvt, rates.machine));
    format!(
        "Observations per second, and the multiple of real time, in {} task 0\n\n{}\n{}",
        rates::RATED_SUITE,
        text_columns(&rows, |column| column > 0),
        names.collect::<String>()
    )
}
