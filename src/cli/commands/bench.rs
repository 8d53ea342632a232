//! `softvt bench`: the rates of this machine beside the published ones.

use std::path::PathBuf;

use clap::{Args, value_parser};

use crate::{
    error::CliError,
    output::{eprint_notice, print},
};
use softvt_common::{
    files::replace,
    text::{TextTable, decimal},
};
use softvt_runner::{
    growth::{self, GrowthCurve, GrowthPoint},
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
    /// Measure how the cost grows with nodes, bodies, threads and pixels instead, and plot it as an SVG file
    #[arg(long, value_name = "FILE", conflicts_with = "out")]
    growth: Option<PathBuf>,
}

/// Measures and prints the rates.
///
/// # Errors
/// The suite cannot be run, or the file cannot be written.
pub(super) fn run(args: &BenchArgs) -> Result<(), CliError> {
    let published = softvt_script::embedded("assets/rates.json")
        .ok_or_else(|| CliError::input("this build has no assets/rates.json, which names the suite"))?;
    let published: MachineRates = serde_json::from_slice(published)?;
    let on_stage = |stage: &str| eprint_notice(format!("measuring: {stage}"));
    if let Some(path) = &args.growth {
        let curves = growth::measure(&published.script, thread_count(args.threads), on_stage)?;
        replace(path, growth::plot(&curves))?;
        return print(&growth_table(&curves));
    }
    let rates = rates::measure(&published.script, thread_count(args.threads), on_stage)?;
    if let Some(path) = &args.out {
        replace(path, [serde_json::to_string_pretty(&rates)?.as_bytes(), b"\n"].concat())?;
    }
    print(&table(&rates, &published))
}

/// The rates, one column for each machine.
fn table(here: &MachineRates, published: &MachineRates) -> String {
    let row = |name: &str, value: &dyn Fn(&MachineRates) -> String| {
        vec![name.to_owned(), value(here), value(published)]
    };
    let mut rows = vec![
        ["", "here", "published"].map(str::to_owned).to_vec(),
        row("CPU s to the first observation", &|rates| format!("{:.2}", rates.first_observation_s)),
        row("the same with the cache", &|rates| decimal(rates.cached_first_observation_s, 2)),
    ];
    for (index, of_streams) in here.streams.iter().enumerate() {
        let value = |rates: &MachineRates| {
            rates.streams.get(index).map_or_else(String::new, |rate| {
                format!("{:.0} ({:.1} ×)", rate.observations_per_s, rate.times_real_time())
            })
        };
        rows.push(row(&format!("{}, one core", of_streams.streams), &value));
    }
    let machine = |rates: &MachineRates| {
        let threads =
            if rates.threads == 1 { "1 thread".to_owned() } else { format!("{} threads", rates.threads) };
        format!("{:.0} ({threads})", rates.observations_per_s)
    };
    rows.push(row("all streams, machine", &machine));
    let names = [("here", here), ("published", published)]
        .map(|(which, rates)| format!("{which}: softvt {}, {}\n", rates.softvt, rates.machine));
    format!(
        "Observations per second, and the multiple of real time, in {} task 0\n\n{}\n{}",
        here.script,
        TextTable::fitted(&rows, |column| column > 0),
        names.concat()
    )
}

/// The curves, one row per measurement.
fn growth_table(curves: &[GrowthCurve]) -> String {
    let of_curve = |curve: &GrowthCurve| {
        let power = curve.exponent().map_or_else(String::new, |power| format!(", power {power:.2}"));
        let mut rows = vec![vec![curve.size.to_owned(), format!("{}{power}", curve.cost)]];
        let point = |point: &GrowthPoint| vec![format!("{}", point.size), format!("{:.3}", point.cost)];
        rows.extend(curve.points.iter().map(point));
        TextTable::fitted(&rows, |_| true)
    };
    curves.iter().map(of_curve).collect::<Vec<_>>().join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use softvt_runner::rates::StreamRate;

    #[test]
    fn a_table_has_the_rates_of_both_machines_and_the_multiples_of_real_time() {
        let rates = |machine: &str, observations_per_s: f64| MachineRates {
            softvt: "0.1.0".to_owned(),
            script: "suites/some.lua".to_owned(),
            machine: machine.to_owned(),
            first_observation_s: 1.5,
            cached_first_observation_s: None,
            streams: vec![StreamRate { streams: "state".to_owned(), observations_per_s }],
            threads: 4,
            observations_per_s: 4.0 * observations_per_s,
        };
        let text = table(&rates("mine", 30.0), &rates("theirs", 60.0));
        for expected in
            ["suites/some.lua", "30 (1.5 ×)", "60 (3.0 ×)", "120 (4 threads)", "here: softvt 0.1.0, mine"]
        {
            assert!(text.contains(expected), "{expected} in\n{text}");
        }
    }
}
