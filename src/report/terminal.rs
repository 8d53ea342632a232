//! The results of a run in the terminal: the verdict first, then one line per task that failed. With details also all
//! other tasks and the figures of `summary.json`.

use super::{
    cells::{percentile, tau_range},
    styled_text::{Emphasis, StyledText, TerminalFormat},
    task_names::{TaskName, task_names},
    terminal_details::push_details,
};
use softvt_common::{
    table::{Column, Table},
    text::{counted, decimal, shortened, significant},
};
use softvt_evaluation::{
    category::EpisodeCategory,
    statistics::{Distribution, Rate},
};
use softvt_runs::paired_tests::{DetectableDifference, MIN_DISCORDANT};
use softvt_runs::summary::{CommandCounts, FailedEpisode, GroupScores, SuiteSummary, TaskScores};

/// Columns of a row of a task other than its name and, at the end, its categories.
const NUMBERS_WIDTH: usize = 41;
/// Columns for the categories of a task.
const CATEGORIES_WIDTH: usize = 19;
/// Width from which rows also have NoDrop, D and τ, and the width of these columns.
const WIDE: usize = 110;
const WIDE_WIDTH: usize = 30;
/// Columns of the bar of a rate.
const BAR_WIDTH: usize = 12;
/// Number of episodes below which intervals are called wide.
pub(crate) const FEW_EPISODES: usize = 30;
/// Largest number of invalid episodes listed.
const MAX_INVALID_LISTED: usize = 5;
/// Largest number of aborted episodes listed.
const MAX_ABORTED_LISTED: usize = 10;

pub fn table(summary: &SuiteSummary, format: TerminalFormat) -> String {
    let mut text = StyledText::new(format);
    let scores = &summary.scores;
    let episodes = counted(scores.episodes, "episode");
    text.title(format_args!("{} · {} · {episodes}", summary.suite, summary.method_label()));
    push_categories(&mut text, scores);
    text.end();
    push_rate(&mut text, "Goal", scores.goal_success_rate, EpisodeCategory::Safe).end();
    push_safety(&mut text, scores);
    text.end();
    push_tasks(&mut text, summary);
    push_metrics(&mut text, scores);
    if format.has_details {
        push_details(&mut text, summary);
    }
    push_notes(&mut text, summary);
    text.into_text()
}

/// The number of episodes of each category that occurs. Rigid objects have no limit to be within.
fn push_categories(text: &mut StyledText, scores: &GroupScores) {
    let counts = EpisodeCategory::ALL.map(|category| (category, scores.count(category)));
    let mut length = 0;
    for (category, count) in counts.into_iter().filter(|(_, count)| *count > 0) {
        let name = match (category, scores.is_soft()) {
            (EpisodeCategory::Safe, false) => "placed without a drop",
            _ => category.name(),
        };
        let crushed = match (category, scores.crushed_over_limit) {
            (EpisodeCategory::OverLimit, crushed @ 1..) => format!(" ({crushed} crushed)"),
            _ => String::new(),
        };
        let part = format!("{} {count} {name}{crushed}", category.glyph());
        if length > 0 && length + 2 + part.chars().count() > text.width() {
            text.end();
            length = 0;
        }
        let gap = if length > 0 { "  " } else { "" };
        length += gap.len() + part.chars().count();
        text.push(Emphasis::None, gap).push(Emphasis::Category(category), part);
    }
    text.end();
}

/// Appends a rate with its interval and a bar.
fn push_rate<'a>(
    text: &'a mut StyledText,
    name: &str,
    rate: Rate,
    category: EpisodeCategory,
) -> &'a mut StyledText {
    let Some(value) = rate.rate else {
        return text.push(Emphasis::None, format_args!("{name:<7} N/A"));
    };
    let bounds = rate.wilson95.map(|[low, high]| format!("[{low:>3.0}, {high:>3.0}]")).unwrap_or_default();
    let filled = (0.01 * value * BAR_WIDTH as f64).round() as usize;
    let [full, empty] = [("█", filled), ("░", BAR_WIDTH - filled.min(BAR_WIDTH))].map(|(c, n)| c.repeat(n));
    text.push(Emphasis::Bold, format_args!("{name:<7}{value:>4.0} %"))
        .push(Emphasis::None, format_args!("  {bounds}  "))
        .push(Emphasis::Category(category), full)
        .push(Emphasis::Faint, empty)
}

/// Safety Success, and what separates it from Goal Success.
fn push_safety(text: &mut StyledText, scores: &GroupScores) {
    if scores.episodes == 0 {
        return text.line(Emphasis::None, "Safety  N/A  no episodes");
    }
    if !scores.is_soft() {
        return text.line(Emphasis::None, "Safety  N/A  rigid objects have no limit of their deformation");
    }
    if scores.safety_success_rate.rate.is_none() {
        let count = scores.not_judged;
        return text.line(Emphasis::None, format_args!("Safety  N/A  not judged: {count}"));
    }
    push_rate(text, "Safety", scores.safety_success_rate, EpisodeCategory::Safe);
    let over = scores.count(EpisodeCategory::OverLimit);
    let gap = scores.goal_safe_gap.filter(|gap| *gap > 0.0);
    if let (Some(gap), true) = (gap, over > 0) {
        let harm = match scores.crushed_over_limit {
            0 => "placed over the limit".to_owned(),
            crushed if crushed == over => "placed, but crushed".to_owned(),
            crushed => format!("placed, {crushed} of {over} crushed"),
        };
        let category = Emphasis::Category(EpisodeCategory::OverLimit);
        text.push(Emphasis::None, "  ").push(category, format_args!("gap {gap:.0} points: {harm}"));
    }
    text.end();
}

struct TaskRow<'a> {
    number: String,
    name: &'a str,
    scores: &'a GroupScores,
}

/// One line per task that has a failed episode, or per task with details, and one for all.
fn push_tasks(text: &mut StyledText, summary: &SuiteSummary) {
    let tasks = &summary.by_task;
    if tasks.is_empty() {
        return;
    }
    let named: Vec<TaskName> =
        tasks.iter().map(|task| TaskName { prompt: &task.prompt, asset: &task.asset }).collect();
    let names = task_names(&named);
    let has_failed = |task: &TaskScores| task.scores.count(EpisodeCategory::Safe) < task.scores.episodes;
    let is_shown = |task: &TaskScores| text.format.has_details || has_failed(task);
    let shown = tasks.iter().zip(&names).filter(|(task, _)| is_shown(task));
    let row = |(task, name)| {
        let TaskScores { task, scores, .. }: &TaskScores = task;
        let name: &String = name;
        TaskRow { number: task.to_string(), name, scores }
    };
    let mut rows: Vec<TaskRow> = shown.map(row).collect();
    rows.push(TaskRow { number: String::new(), name: "all", scores: &summary.scores });
    let lines = Table::new(&rows, task_columns(text.format)).lines();
    text.line(Emphasis::Faint, &lines[0]);
    for (row, line) in rows.iter().zip(&lines[1..rows.len()]) {
        text.push(Emphasis::None, line).push(Emphasis::None, "  ");
        push_failures(text, row.scores);
    }
    text.line(Emphasis::Bold, &lines[rows.len()]);
    let hidden = tasks.len() + 1 - rows.len();
    if hidden > 0 {
        let others = if hidden < tasks.len() { "other " } else { "" };
        let what = if summary.scores.is_soft() { "without a failure" } else { "placed without a drop" };
        let hidden = counted(hidden, &(others.to_owned() + "task"));
        text.line(Emphasis::Faint, format_args!("    {hidden} {what}; --details shows all"));
    }
}

fn task_columns<'a>(format: TerminalFormat) -> Vec<Column<'a, TaskRow<'a>>> {
    let is_wide = format.width >= WIDE;
    let wide = if is_wide { WIDE_WIDTH } else { 0 };
    let room = format.width.saturating_sub(1 + NUMBERS_WIDTH + CATEGORIES_WIDTH + wide);
    let number = |heading, width, cell: fn(&GroupScores) -> String| {
        Column::number(heading, move |row: &TaskRow| cell(row.scores)).width(width)
    };
    let mut columns = vec![
        Column::number("#", |row: &TaskRow| row.number.clone()).width(3),
        Column::text("object", |row: &TaskRow| row.name.to_owned()).width(room.clamp(12, 40)),
        number("goal", 7, |s| format!("{}/{}", s.goal_success_rate.count, s.episodes)),
        number("safe", 7, |s| match s.safety_success_rate.rate {
            Some(_) => format!("{}/{}", s.count(EpisodeCategory::Safe), s.episodes),
            None => "N/A".to_owned(),
        }),
        number("D/limit", 8, |s| decimal(s.d_over_tau.median, 2)),
        number("collapsed", 9, |s| match s.collapsed_volume.mean {
            Some(percent) => format!("{percent:.0} %"),
            None => "–".to_owned(),
        }),
    ];
    if is_wide {
        columns.extend([
            number("NoDrop, %", 9, |s| decimal(s.no_drop_rate.rate, 1)),
            number("D, %", 9, |s| percentile(&s.deformation, s.deformation.median)),
            number("τ, %", 9, |s| tau_range(s.tau_range)),
        ]);
    }
    columns
}

/// The categories of the failed episodes of a task, with their numbers if there are several episodes.
fn push_failures(text: &mut StyledText, scores: &GroupScores) {
    let failed = EpisodeCategory::ALL.into_iter().skip(1).filter(|category| scores.count(*category) > 0);
    let failed: Vec<EpisodeCategory> = failed.collect();
    for (at, category) in failed.iter().enumerate() {
        let gap = if at > 0 { " " } else { "" };
        let crushed = if *category == EpisodeCategory::OverLimit { scores.crushed_over_limit } else { 0 };
        let what = match (scores.episodes, &failed[..]) {
            (1, _) if crushed > 0 => "crushed".to_owned(),
            _ if crushed == scores.count(*category) => format!("{crushed} crushed"),
            _ if crushed > 0 => format!("{}, {crushed} crushed", scores.count(*category)),
            (1, _) => category.name().to_owned(),
            (_, [single]) => format!("{} {}", scores.count(*single), single.name()),
            _ => scores.count(*category).to_string(),
        };
        let part = format_args!("{} {what}", category.glyph());
        text.push(Emphasis::None, gap).push(Emphasis::Category(*category), part);
    }
    text.end();
}

fn push_metrics(text: &mut StyledText, scores: &GroupScores) {
    if scores.metrics.is_empty() {
        return;
    }
    let number = |heading, of: fn(&Distribution) -> Option<f64>| {
        let cell = move |metric: &(&String, &Distribution)| match of(metric.1) {
            Some(value) => significant(value, 4),
            None => "–".to_owned(),
        };
        Column::number(heading, cell).width(9)
    };
    let width = text.width().saturating_sub(45).clamp(12, 40);
    let columns = [
        Column::text("metric", |metric: &(&String, &Distribution)| metric.0.clone()).width(width),
        number("mean", |of| of.mean),
        number("P5", |of| of.p5),
        number("median", |of| of.median),
        number("P95", |of| of.p95),
        Column::number("n", |metric: &(&String, &Distribution)| metric.1.n.to_string()).width(4),
    ];
    let metrics: Vec<(&String, &Distribution)> = scores.metrics.iter().collect();
    for (at, line) in Table::new(&metrics, columns).lines().iter().enumerate() {
        text.line(if at == 0 { Emphasis::Faint } else { Emphasis::None }, line);
    }
}

fn push_notes(text: &mut StyledText, summary: &SuiteSummary) {
    let scores = &summary.scores;
    let mut note_if = |applies: bool, what: &str| {
        if applies {
            text.note(what);
        }
    };
    let slip = "Safety Success also requires no slip in the hand (criteria.require_no_slip)";
    note_if(summary.no_slip_required, slip);
    note_if(summary.privileged, "privileged: it reads the true state, which no robot has");
    note_if(summary.replayed, "replayed: the actions are those of a recorded run");
    let forces = "force_observed: it reads the true forces at the pads, which no real sensor measures";
    note_if(summary.force_observed, forces);
    summary.attempt_notes().iter().for_each(|line| text.note(line));
    push_command_notes(text, &summary.commands);
    for (name, _) in scores.metrics.iter().filter(|(_, values)| values.n == 0) {
        text.note(format_args!("metric {name} has no value in any valid episode: its function returned nil"));
    }
    if scores.safety_unknown > 0 {
        text.note(format_args!(
            "safety could not be judged in {} (no threshold, or D not measured); counted as not safe",
            counted(scores.safety_unknown, "episode")
        ));
    }
    if scores.invalid > 0 {
        let invalid = counted(scores.invalid, "invalid episode");
        text.note(format_args!("{invalid} counted as failed in every rate"));
    }
    push_failed(text, &summary.invalid_episodes, "invalid: ", MAX_INVALID_LISTED);
    if !summary.gave_up.is_empty() {
        let episodes = counted(summary.gave_up.len(), "episode");
        text.note(format_args!("{} gave up in {episodes}:", summary.policy));
    }
    push_failed(text, &summary.gave_up, "", MAX_ABORTED_LISTED);
    push_resolution(text, scores);
}

/// A line for each of the first episodes of a list, and the number of the others.
fn push_failed(text: &mut StyledText, episodes: &[FailedEpisode], failure: &str, most: usize) {
    for FailedEpisode { task, episode, reason } in episodes.iter().take(most) {
        text.note(shortened(&format!("  task {task} episode {episode}: {failure}{reason}"), text.width()));
    }
    if episodes.len() > most {
        text.note(format_args!("  … and {} more, in summary.json", episodes.len() - most));
    }
}

/// Smallest difference that this number of episodes can detect.
fn push_resolution(text: &mut StyledText, scores: &GroupScores) {
    let n = scores.episodes;
    let wide = if n < FEW_EPISODES { format!("n = {n}: intervals are wide; ") } else { String::new() };
    match DetectableDifference::new(scores.main_rate().count, n) {
        Some(DetectableDifference { smallest, .. }) => {
            let (episodes, points) = (counted(n, "episode"), significant(smallest, 2));
            text.note(format_args!(
                "{wide}{episodes} distinguish policies that differ by at least {points} points"
            ));
        }
        None => {
            text.note(format_args!("{wide}distinguishing policies takes at least {MIN_DISCORDANT} episodes"))
        }
    }
}

/// Notes about commands that were not executed as given.
fn push_command_notes(text: &mut StyledText, commands: &CommandCounts) {
    let note = |text: &mut StyledText, count: u64, what: &str, episodes: usize, end: &str| {
        if count > 0 {
            let episodes = counted(episodes, "episode");
            text.note(format_args!("{count} of {} {what} in {episodes}{end}", commands.steps));
        }
    };
    note(text, commands.far, "commands were out of reach", commands.far_episodes, "");
    if let Some(first) = commands.first_far {
        text.note(format_args!("  first: {first}"));
    }
    let (grips, steps) = ("grip values were out of range", "displacements were beyond −1..1, and clamped,");
    note(text, commands.clamped_grips, grips, commands.clamped_episodes, "; the hand clamped them");
    note(text, commands.clamped_steps, steps, commands.clamped_step_episodes, "");
}
