//! `softvt bench`: the rates of this machine next to the published ones.

use std::path::PathBuf;

use clap::{Args, value_parser};

use crate::{
    error::CliError,
    output::{OutputFormat, check_output_file, print},
};
use softvt_common::files::replace;
use softvt_runner::{
    bench_growth,
    bench_rates::{self, MachineRates},
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
pub(super) fn run(args: &BenchArgs) -> Result<(), CliError> {
    for (flag, path, format) in
        [("--growth", &args.growth, OutputFormat::SVG), ("--out", &args.out, OutputFormat::JSON)]
    {
        path.as_ref().map_or(Ok(()), |path| check_output_file(flag, path, format))?;
    }
    let published = softvt_script::embedded("assets/rates.json")
        .ok_or_else(|| CliError::input("this build has no assets/rates.json, which names the suite"))?;
    let published: MachineRates = serde_json::from_slice(published)?;
    let on_stage = |stage: &str| notice!("measuring: {stage}");
    let threads = thread_count(args.threads);
    let (table, file) = match &args.growth {
        Some(_) => {
            let curves = bench_growth::measure(&published.script, threads, on_stage)?;
            (bench_growth::table(&curves), bench_growth::plot(&curves))
        }
        None => {
            let rates = bench_rates::measure(&published.script, threads, on_stage)?;
            (rates.table_beside(&published), serde_json::to_string_pretty(&rates)? + "\n")
        }
    };
    let path = args.growth.as_ref().or(args.out.as_ref());
    let written = path.map_or(Ok(()), |path| replace(path, file));
    // The table is printed whatever happens to the file: measuring takes long.
    print(&table)?;
    Ok(written?)
}
