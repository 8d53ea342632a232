//! The tables of results, in Markdown.

use serde_json::Value;
use softvt::runner::PolicyConfig;

use crate::collected::Results;

/// The file with all columns.
pub const PAGE: &str = "docs/results/README.md";

/// Names of the marked parts of the README: the table of its first screen, those of all results, and the rates.
const FIRST_SCREEN: &str = "verdicts";
const ALL: &str = "results";
const RATES: &str = "rates";
/// Script of the runs on the first screen.
const FIRST_SCRIPT: &str = "suites/hidden.lua";
/// Controllers on the first screen above and below the best constant number.
const ABOVE_BOUND: [&str; 4] = ["expert", "tactile-servo", "look-retry", "weigh"];
const BELOW_BOUND: [&str; 1] = ["expert-binary"];

/// The README with new tables and rates, if it has places for them.
///
/// # Errors
/// If it does not have the lines around a part once each.
pub fn written(
    readme: &str,
    results: &[Results],
    labels: &Value,
    physics: &str,
    rates: &Value,
) -> Result<String, String> {
    let readme = replaced(readme, FIRST_SCREEN, &first_screen(results, labels))?;
    let readme = replaced(&readme, ALL, &overview(results, labels, physics))?;
    replaced(&readme, RATES, &rates_sentence(rates))
}

/// Observations per second of one core and of the machine, of which an episode has 20 per simulated second.
fn rates_sentence(rates: &Value) -> String {
    let rate = |streams: &str| {
        let rows = rates["streams"].as_array().into_iter().flatten();
        let row = rows.into_iter().find(|row| row["streams"] == streams);
        row.and_then(|row| row["observations_per_s"].as_f64()).unwrap_or_default()
    };
    let (all, state) = (rate("all streams"), rate("state"));
    format!(
        "One core of an {} makes {all:.0} observations per second with every sensor ({:.1} times real time), and {state:.0} of the robot's \
         state alone ({:.1} times).\n{} threads make {:.0} with every sensor. `softvt bench` measures a machine \
         ([docs/performance.md](docs/performance.md)).\n",
        rates["machine"].as_str().unwrap_or_default(),
        all / 20.0,
        state / 20.0,
        rates["threads"],
        rates["observations_per_s"].as_f64().unwrap_or_default(),
    )
}

/// The README with a new part of a name.
///
/// # Errors
/// If it does not have the lines around the part once each.
fn replaced(readme: &str, name: &str, tables: &str) -> Result<String, String> {
    let (begin, end) = (format!("<!-- {name}:begin -->\n"), format!("<!-- {name}:end -->"));
    let parts = readme.split_once(&begin).and_then(|(before, rest)| Some((before, rest.split_once(&end)?.1)));
    match parts {
        Some((before, after)) if readme.matches(&begin).count() + readme.matches(&end).count() == 2 => {
            Ok(format!("{before}{begin}{tables}{end}{after}"))
        }
        _ => Err(format!("README.md: expected the lines {begin} and {end} once each, around the tables")),
    }
}

/// Both verdicts in the hidden suites: of controllers at both ends, and of the best constant number.
pub fn first_screen(results: &[Results], labels: &Value) -> String {
    let Some(one) = results.iter().find(|one| one.script == FIRST_SCRIPT) else { return String::new() };
    let mut text = verdict_header(&one.suites);
    let shown = |cells: Vec<Option<&Value>>, name: String| {
        row(std::iter::once(name).chain(cells.into_iter().flat_map(verdicts)))
    };
    let of =
        |name: &str| shown(one.suites.iter().map(|suite| found(suite, name)).collect(), label(labels, name));
    let best: Vec<Option<&Value>> = one.suites.iter().map(blind_bound).collect();
    let mut names: Vec<&str> = best.iter().flatten().filter_map(|cell| cell["name"].as_str()).collect();
    names.dedup();
    let names: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
    text += &ABOVE_BOUND.map(of).concat();
    text += &shown(best, format!("[best constant number](docs/touch.md): {}", names.join(", ")));
    text + &BELOW_BOUND.map(of).concat()
}

/// The controller of a suite with the highest Safety among those that keep one number constant.
fn blind_bound(suite: &Value) -> Option<&Value> {
    let is_bound = |cell: &&Value| {
        let name = cell["name"].as_str().unwrap_or_default();
        PolicyConfig::named(name).is_ok_and(|policy| policy.is_blind_bound())
    };
    let safety = |cell: &Value| cell["safety_success_rate"]["rate"].as_f64().unwrap_or(-1.0);
    let cells = suite["controllers"].as_array()?.iter().filter(is_bound);
    cells.max_by(|a, b| safety(a).total_cmp(&safety(b)))
}

/// Two columns for the verdicts of each suite.
fn verdict_header(suites: &[Value]) -> String {
    let names = suites.iter().filter_map(|suite| suite["name"].as_str());
    let columns: Vec<String> =
        names.flat_map(|name| [format!("{}: Goal %", title(name)), "Safety %".to_owned()]).collect();
    format!("|  | {} |\n|---|{}\n", columns.join(" | "), "---:|".repeat(columns.len()))
}

/// One table per script: controllers × suites. Suites that an earlier table shows are left out. Results of another
/// final state than `physics` are announced as those of an earlier version.
pub fn overview(results: &[Results], labels: &Value, physics: &str) -> String {
    let table = |(index, one): (usize, &Results)| {
        let is_known = |suite: &Value| {
            results[..index]
                .iter()
                .any(|before| before.suites.iter().any(|known| known["name"] == suite["name"]))
        };
        let suites: Vec<Value> = one.suites.iter().filter(|suite| !is_known(suite)).cloned().collect();
        let mut text = format!("{}\n\n", caption(one)) + &verdict_header(&suites);
        for controller in controllers(one) {
            let cells = suites.iter().flat_map(|suite| verdicts(found(suite, &controller)));
            text += &row(std::iter::once(label(labels, &controller)).chain(cells));
        }
        text
    };
    let cells = results.iter().flat_map(|one| &one.suites).flat_map(|suite| suite["controllers"].as_array());
    let earlier = match cells.flatten().any(|cell| cell["physics"] != physics) {
        true => {
            "Rows that were not run again with this version come from an earlier one, in which single episodes can differ; \
                 [docs/results](docs/results/README.md) marks them.\n\n"
        }
        false => "",
    };
    earlier.to_owned() + &results.iter().enumerate().map(table).collect::<Vec<_>>().join("\n")
}

/// One table per script and suite, with all columns.
pub fn page(results: &[Results], labels: &Value, physics: &str) -> String {
    let mut text = "# Results\n\nGenerated by `.ci/regenerate results`, from the summaries of runs beside this page. Rates are in % with 95 % \
                    Wilson intervals; an invalid episode counts as a failure. D/τ is the peak deformation over the limit, the grip ratio the \
                    peak force on a pad over the least that holds the object, and the time the moment of Goal Success. Each is the \
                    median over the episodes in which it is defined.\n"
        .to_owned();
    text += &format!(
        "\nThe last column is the state in which the episode of `softvt doctor` ended in the version that made the run, now `{physics}`. \
         Rows of another state are of an earlier version: single episodes can differ, and if the definition or the limits of D \
         have changed since ([changelog](../../CHANGELOG.md)), rates too.\n"
    );
    for one in results {
        text += &format!("\n## `{}`\n", command(one));
        for suite in &one.suites {
            text += &format!("\n### {}\n\n", title(suite["name"].as_str().unwrap_or_default()));
            let columns = [
                "controller",
                "episodes",
                "invalid",
                "Goal",
                "NoDrop",
                "Safety",
                "D/τ",
                "grip ratio",
                "time s",
                "physics",
            ];
            text += &header(columns.map(str::to_owned));
            for cell in suite["controllers"].as_array().into_iter().flatten() {
                let rate = |key: &str| with_interval(&cell[key]);
                let median = |key: &str| number(&cell[key], 2);
                text += &row([
                    label(labels, cell["name"].as_str().unwrap_or_default()),
                    cell["episodes"].to_string(),
                    cell["invalid"].to_string(),
                    rate("goal_success_rate"),
                    rate("no_drop_rate"),
                    safety(cell),
                    median("d_over_tau_median"),
                    median("grip_ratio_median"),
                    number(&cell["goal_time_s_median"], 1),
                    format!("`{}`", cell["physics"].as_str().unwrap_or("unknown")),
                ]);
            }
        }
    }
    text
}

/// The command, the number of episodes, the number of invalid ones, and who sees ground truth.
fn caption(one: &Results) -> String {
    let cells: Vec<&Value> =
        one.suites.iter().flat_map(|suite| suite["controllers"].as_array().into_iter().flatten()).collect();
    let count = |key: &str| -> Vec<u64> { cells.iter().filter_map(|cell| cell[key].as_u64()).collect() };
    let episodes = count("episodes");
    let (least, most) =
        (episodes.iter().min().copied().unwrap_or(0), episodes.iter().max().copied().unwrap_or(0));
    let episodes = if least == most { least.to_string() } else { format!("{least} to {most}") };
    let invalid = match count("invalid").iter().sum::<u64>() {
        0 => "No episode was invalid".to_owned(),
        1 => "One episode was invalid".to_owned(),
        n => format!("{n} episodes were invalid"),
    };
    let privileged = if cells.iter().all(|cell| cell["privileged"] == true) {
        ". All controllers plan from ground-truth state (*privileged*)"
    } else {
        ""
    };
    let each = if one.has_conditions { "" } else { " for each controller" };
    format!(
        "`{}`{each}: {episodes} episodes per row and suite; the brackets are the 95 % interval of Safety. {invalid}{privileged}.",
        command(one)
    )
}

/// The command of the runs. The number of episodes is left out if it differs.
fn command(one: &Results) -> String {
    let cells = || one.suites.iter().flat_map(|suite| suite["controllers"].as_array().into_iter().flatten());
    let per_task =
        |cell: &Value| Some(cell["episodes"].as_u64()? / cell["tasks"].as_u64().filter(|tasks| *tasks > 0)?);
    let first = cells().next().and_then(per_task);
    let episodes = first
        .filter(|_| cells().all(|cell| per_task(cell) == first))
        .map_or_else(String::new, |n| format!(" --episodes {n}"));
    format!("softvt {}{episodes}{}", one.script, if one.has_conditions { "" } else { " --policy NAME" })
}

/// The controllers of all suites, in the order of the runs.
fn controllers(one: &Results) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for cell in one.suites.iter().flat_map(|suite| suite["controllers"].as_array().into_iter().flatten()) {
        let name = cell["name"].as_str().unwrap_or_default();
        if !names.iter().any(|known| known == name) {
            names.push(name.to_owned());
        }
    }
    names
}

fn found<'a>(suite: &'a Value, controller: &str) -> Option<&'a Value> {
    suite["controllers"].as_array()?.iter().find(|cell| cell["name"] == controller)
}

/// The name of a controller with the words about it.
fn label(labels: &Value, name: &str) -> String {
    labels[name].as_str().map_or_else(|| format!("`{name}`"), |words| format!("`{name}`: {words}"))
}

/// `object_varied` as `Object-Varied`.
fn title(name: &str) -> String {
    let capital = |word: &str| word[..1].to_uppercase() + &word[1..];
    name.split('_').filter(|word| !word.is_empty()).map(capital).collect::<Vec<_>>().join("-")
}

/// Goal, and Safety with its interval.
fn verdicts(cell: Option<&Value>) -> [String; 2] {
    cell.map_or_else(
        || ["–".to_owned(), "–".to_owned()],
        |cell| [number(&cell["goal_success_rate"]["rate"], 1), safety(cell)],
    )
}

/// Safety with its interval. Where no object has a limit, Safety does not apply.
fn safety(cell: &Value) -> String {
    if cell["d_over_tau_median"].is_null() {
        "N/A".to_owned()
    } else {
        with_interval(&cell["safety_success_rate"])
    }
}

fn with_interval(rate: &Value) -> String {
    match rate["wilson95"].as_array().map(Vec::as_slice) {
        Some([low, high]) => {
            format!("{}\u{a0}[{},\u{a0}{}]", number(&rate["rate"], 1), number(low, 1), number(high, 1))
        }
        _ => number(&rate["rate"], 1),
    }
}

fn number(value: &Value, digits: usize) -> String {
    value.as_f64().map_or_else(|| "–".to_owned(), |value| format!("{value:.digits$}"))
}

fn header(names: impl IntoIterator<Item = String>) -> String {
    let names: Vec<String> = names.into_iter().collect();
    format!("| {} |\n|{}\n", names.join(" | "), "---|".repeat(names.len()))
}

fn row(cells: impl IntoIterator<Item = String>) -> String {
    format!("| {} |\n", cells.into_iter().collect::<Vec<_>>().join(" | "))
}
