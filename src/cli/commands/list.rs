//! `softvt list`: suites, tasks, assets, policies and profiles, in the working folder and in the binary, and settings.

use clap::{Args, ValueEnum};
use serde_json::Value;

use crate::{
    error::CliError,
    output::{print, print_json},
};
use softvt_common::table::{Column, Table};
use softvt_runner::script_catalog::{self, Listing};

/// List suites, tasks, assets, policies, profiles or settings
#[derive(Args, Debug)]
pub(crate) struct ListArgs {
    /// Kind of items to list
    #[arg(value_name = "suites|tasks|assets|policies|profiles|settings")]
    what: ListKind,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum ListKind {
    Suites,
    Tasks,
    Assets,
    Policies,
    Profiles,
    Settings,
}

/// Lists what the arguments ask for.
pub(super) fn run(args: &ListArgs) -> Result<(), CliError> {
    let Listing { rows, errors } = match args.what {
        ListKind::Suites => script_catalog::suites(),
        ListKind::Tasks => script_catalog::tasks(),
        ListKind::Assets => script_catalog::assets().into(),
        ListKind::Policies => script_catalog::policies().into(),
        ListKind::Profiles => script_catalog::profiles().into(),
        ListKind::Settings => script_catalog::settings().into(),
    };
    if args.json {
        print_json(&rows)?
    } else {
        print(table(&rows))?
    }
    if errors.is_empty() {
        return Ok(());
    }
    Err(CliError::input(errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("\nsoftvt: ")))
}

/// Formats rows as a table with the keys of all rows as headings. Numbers are right-aligned.
fn table(rows: &[Value]) -> String {
    let mut headings: Vec<&str> = Vec::new();
    for key in rows.iter().filter_map(Value::as_object).flat_map(|row| row.keys()) {
        if !headings.contains(&key.as_str()) {
            headings.push(key);
        }
    }
    let cell = |row: &Value, key: &str| match &row[key] {
        Value::Null => String::new(),
        Value::String(text) => text.clone(),
        Value::Array(items) => {
            items.iter().map(|item| item.as_str().unwrap_or_default()).collect::<Vec<_>>().join(", ")
        }
        other => other.to_string(),
    };
    let columns = headings.into_iter().map(|name| {
        let is_number = rows.iter().all(|row| row[name].is_number() || row[name].is_null());
        let of_row = move |row: &Value| cell(row, name);
        if is_number { Column::number(name, of_row) } else { Column::text(name, of_row) }
    });
    Table::new(rows, columns).text()
}
