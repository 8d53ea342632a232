//! What a run was made with.

use maud::{Markup, html};
use serde_json::Value;

use crate::report::run_summary::RunSummary;

/// The fields of `run.json` that one asks for first, and all of it below.
pub(super) fn settings(judged: &RunSummary) -> Markup {
    let info = &judged.run.info;
    let fields = [
        ("Folder", judged.run.dir.display().to_string()),
        ("Script", words(&info["script"], &info["arguments"])),
        ("Policy", judged.summary.method_label()),
        ("softvt", plain(&info["softvt"])),
        ("Seed, split", format!("{}, {}", plain(&info["seed"]), plain(&info["split"]))),
        ("Episodes", format!("{} of {}", judged.run.records.len(), judged.run.wanted())),
        ("Shifts", pairs(&info["shifts"])),
        ("Settings changed", pairs(&info["set"])),
        ("Options", map(&info["options"], "")),
        ("Thresholds τ", map(&info["thresholds"], " %")),
    ];
    html! {
        details {
            summary { (judged.name()) }
            dl { @for (name, value) in fields { dt { (name) } dd { @if value.is_empty() { "none" } @else { (value) } } } }
            details.inner { summary { "run.json" } pre { (format!("{info:#}")) } }
        }
    }
}

fn plain(value: &Value) -> String {
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

fn words(script: &Value, arguments: &Value) -> String {
    let all = [script].into_iter().chain(arguments.as_array().into_iter().flatten());
    all.map(plain).collect::<Vec<_>>().join(" ")
}

fn pairs(list: &Value) -> String {
    let all = list.as_array().into_iter().flatten();
    all.map(|pair| format!("{}={}", plain(&pair[0]), plain(&pair[1]))).collect::<Vec<_>>().join(", ")
}

fn map(object: &Value, unit: &str) -> String {
    let all = object.as_object().into_iter().flatten();
    let shown = |(name, value): (&String, &Value)| match value {
        Value::Null => format!("{name} none"),
        value => format!("{name} {}{unit}", plain(value)),
    };
    all.map(shown).collect::<Vec<_>>().join(", ")
}
