//! Settings of a run.

use maud::{Markup, html};
use serde_json::Value;

use crate::report::run_summary::RunSummary;

/// The main fields of `run.json`, followed by the whole file.
pub(super) fn settings(summary: &RunSummary) -> Markup {
    let manifest = &summary.run.manifest;
    let fields = [
        ("Folder", summary.run.dir.display().to_string()),
        ("Script", command_line(&manifest["script"], &manifest["arguments"])),
        ("Policy", summary.summary.method_label()),
        ("softvt", value_text(&manifest["softvt"])),
        ("Seed, split", format!("{}, {}", value_text(&manifest["seed"]), value_text(&manifest["split"]))),
        ("Episodes", format!("{} of {}", summary.run.records.len(), summary.run.requested_episodes())),
        ("Shifts", pairs(&manifest["shifts"])),
        ("Settings changed", pairs(&manifest["set"])),
        ("Options", entries(&manifest["options"], "")),
        ("Thresholds τ", entries(&manifest["thresholds"], " %")),
    ];
    html! {
        details {
            summary { (summary.name()) }
            dl { @for (name, value) in fields { dt { (name) } dd { @if value.is_empty() { "none" } @else { (value) } } } }
            details.inner { summary { "run.json" } pre { (format!("{manifest:#}")) } }
        }
    }
}

fn value_text(value: &Value) -> String {
    match value {
        Value::Null => "none".to_owned(),
        Value::String(text) => text.clone(),
        Value::Number(number) => number
            .as_f64()
            .filter(|x| x.fract() != 0.0)
            .map_or_else(|| number.to_string(), |x| format!("{:.3}", x).trim_end_matches('0').to_owned()),
        other => other.to_string(),
    }
}

fn command_line(script: &Value, arguments: &Value) -> String {
    let all = [script].into_iter().chain(arguments.as_array().into_iter().flatten());
    all.map(value_text).collect::<Vec<_>>().join(" ")
}

fn pairs(list: &Value) -> String {
    let all = list.as_array().into_iter().flatten();
    all.map(|pair| format!("{}={}", value_text(&pair[0]), value_text(&pair[1])))
        .collect::<Vec<_>>()
        .join(", ")
}

fn entries(object: &Value, unit: &str) -> String {
    let all = object.as_object().into_iter().flatten();
    let shown = |(name, value): (&String, &Value)| match value {
        Value::Null => format!("{name} none"),
        value => format!("{name} {}{unit}", value_text(value)),
    };
    all.map(shown).collect::<Vec<_>>().join(", ")
}
