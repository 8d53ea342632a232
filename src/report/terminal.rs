//! The results of a run in the terminal: the verdict first, then one line per task that failed. With details also all
//! other tasks and the figures of `summary.json`.

use super::{
    styled_text::{Emphasis, StyledText, TerminalFormat},
    task_names::{TaskName, task_names},
    terminal_details::push_details,
};
use softvt_common::text::{counted, decimal, shortened, significant};
use softvt_evaluation::{
    category::EpisodeCategory,
    statistics::{Distribution, Rate},
};
use softvt_runs::paired_tests::{DetectableDifference, MIN_DISCORDANT};
use softvt_runs::summary::{
    AbortedEpisode, CommandCounts, GroupScores, InvalidEpisode, SuiteSummary, TaskScores, TauRange,
};

/// Columns of a row of a task other than its name and, at the end, its categories.
const NUMBERS_WIDTH: usize = 41;
/// Columns for the categories of a task.
const CATEGORIES_WIDTH: usize = 19;
/// Width from which rows also have NoDrop, D and τ.
const WIDE: usize = 110;
/// Columns of the bar of a rate.
const BAR_WIDTH: usize = 12;
/// Number of episodes below which intervals are called wide.
const FEW_EPISODES: usize = 30;
/// Largest number of invalid episodes listed.
const MAX_INVALID_LISTED: usize = 5;
/// Largest number of aborted episodes listed.
const MAX_ABORTED_LISTED: usize = 10;

/// The results of one suite.
pub fn table(summary: &SuiteSummary, format: TerminalFormat) -> String {
    let mut text = StyledText::new(format);
    let scores = &summary.scores;
    let episodes = counted(scores.episodes, "episode");
    let title = format!("{} · {} · {episodes}", summary.suite, summary.method_label());
    text.line(Emphasis::Bold, shortened(&title, format.width - 1));
    push_categories(&mut text, scores);
    text.end();
    push_rate(&mut text, "Goal", scores.goal_success_rate, EpisodeCategory::Safe).end();
    push_safety(&mut text, scores);
    text.end();
    push_tasks(&mut text, summary, format);
    push_metrics(&mut text, scores, format);
    if format.has_details {
        push_details(&mut text, summary);
    }
    push_notes(&mut text, summary, format);
    text.into_text()
}

/// The number of episodes of each category that occurs. Rigid objects have no limit to be within.
fn push_categories(text: &mut StyledText, scores: &GroupScores) {
    let counts = EpisodeCategory::ALL.map(|category| (category, scores.count(category)));
    for (at, (category, count)) in counts.into_iter().filter(|(_, count)| *count > 0).enumerate() {
        let gap = if at > 0 { "  " } else { "" };
        let name = match (category, scores.is_soft()) {
            (EpisodeCategory::Safe, false) => "placed without a drop",
            _ => category.name(),
        };
        let crushed = match (category, scores.crushed_over_limit) {
            (EpisodeCategory::OverLimit, crushed @ 1..) => format!(" ({crushed} crushed)"),
            _ => String::new(),
        };
        let part = format!("{} {count} {name}{crushed}", category.glyph());
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
        return text.push(Emphasis::None, format!("{name:<7} N/A"));
    };
    let bounds = rate.wilson95.map(|[low, high]| format!("[{low:>3.0}, {high:>3.0}]")).unwrap_or_default();
    let filled = (0.01 * value * BAR_WIDTH as f64).round() as usize;
    let [full, empty] = [("█", filled), ("░", BAR_WIDTH - filled.min(BAR_WIDTH))].map(|(c, n)| c.repeat(n));
    text.push(Emphasis::Bold, format!("{name:<7}{value:>4.0} %"))
        .push(Emphasis::None, format!("  {bounds}  "))
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
        let what = format!("Safety  N/A  not judged: {}", scores.not_judged);
        return text.line(Emphasis::None, what);
    }
    push_rate(text, "Safety", scores.safety_success_rate, EpisodeCategory::Safe);
    let over = scores.count(EpisodeCategory::OverLimit);
    let gap = scores.goal_safe_gap.filter(|gap| *gap > 0.0);
    if let (Some(gap), true) = (gap, over > 0) {
        let harm = match scores.crushed_over_limit {
            0 => "placed over the limit".to_owned(),
            crushed if crushed == over => "placed, but crushed".to_owned(),
            crushed => format!("placed over the limit, {crushed} of {over} crushed"),
        };
        let category = Emphasis::Category(EpisodeCategory::OverLimit);
        text.push(Emphasis::None, "  ").push(category, format!("gap {gap:.0} points: {harm}"));
    }
    text.end();
}

/// One line per task that has a failed episode, or per task with details, and one for all.
fn push_tasks(text: &mut StyledText, summary: &SuiteSummary, format: TerminalFormat) {
    let tasks = &summary.by_task;
    let named: Vec<TaskName> =
        tasks.iter().map(|task| TaskName { prompt: &task.prompt, asset: &task.asset }).collect();
    let names = task_names(&named);
    let has_failed = |task: &TaskScores| task.scores.count(EpisodeCategory::Safe) < task.scores.episodes;
    let is_shown = |task: &TaskScores| format.has_details || has_failed(task);
    let is_wide = format.width >= WIDE;
    let wide = if is_wide { WIDE_WIDTH } else { 0 };
    let room = format.width.saturating_sub(1 + NUMBERS_WIDTH + CATEGORIES_WIDTH + wide);
    let name_width = room.clamp(12, 40);
    let row = |number: &str, name: &str, scores: &GroupScores| {
        let (n, goal) = (scores.episodes, scores.goal_success_rate.count);
        let is_judged = scores.is_soft() && scores.safety_success_rate.rate.is_some();
        let safe =
            if is_judged { format!("{}/{n}", scores.count(EpisodeCategory::Safe)) } else { "N/A".to_owned() };
        let collapsed =
            scores.collapsed_volume.mean.map_or_else(|| "–".to_owned(), |pct| format!("{pct:.0} %"));
        let mut line = format!(
            "{number:>3} {:<name_width$} {:>7} {safe:>7} {:>8} {collapsed:>9}",
            shortened(name, name_width),
            format!("{goal}/{n}"),
            decimal(scores.d_over_tau.median, 2)
        );
        if is_wide {
            line += &wide_cells(scores).map(|cell| format!(" {cell:>9}")).concat();
        }
        line
    };
    if tasks.is_empty() {
        return;
    }
    let mut heading = format!(
        "{:>3} {:<name_width$} {:>7} {:>7} {:>8} {:>9}",
        "#", "object", "goal", "safe", "D/limit", "collapsed"
    );
    if is_wide {
        heading += &WIDE_HEADINGS.map(|cell| format!(" {cell:>9}")).concat();
    }
    text.line(Emphasis::Faint, heading);
    for (task, name) in tasks.iter().zip(&names).filter(|(task, _)| is_shown(task)) {
        text.push(Emphasis::None, row(&task.task.to_string(), name, &task.scores)).push(Emphasis::None, "  ");
        push_failures(text, &task.scores);
    }
    let hidden = tasks.iter().filter(|task| !is_shown(task)).count();
    text.line(Emphasis::Bold, row("", "all", &summary.scores));
    if hidden > 0 {
        let others = if hidden < tasks.len() { "other " } else { "" };
        let what = if summary.scores.is_soft() { "without a failure" } else { "placed without a drop" };
        let them = format!("    {} {what}; --details shows all", counted(hidden, &format!("{others}task")));
        text.line(Emphasis::Faint, them);
    }
}

/// Headings and columns that wide terminals have in addition.
const WIDE_HEADINGS: [&str; 3] = ["NoDrop, %", "D, %", "τ, %"];
const WIDE_WIDTH: usize = 30;

fn wide_cells(scores: &GroupScores) -> [String; 3] {
    [
        decimal(scores.no_drop_rate.rate, 1),
        percentile(&scores.deformation, scores.deformation.median),
        tau_range(scores.tau_range),
    ]
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
        let part = format!("{} {what}", category.glyph());
        text.push(Emphasis::None, gap).push(Emphasis::Category(*category), part);
    }
    text.end();
}

/// A percentile of D, with two decimals; "∞" if it falls on an invalid episode.
pub(crate) fn percentile(of: &Distribution, value: Option<f64>) -> String {
    if value.is_none() && of.has_invalid() { "∞".to_owned() } else { decimal(value, 2) }
}

/// The τ that was applied, or the range of several; empty without any.
pub(crate) fn tau_range(range: Option<TauRange>) -> String {
    let Some(TauRange { min, max }) = range else { return String::new() };
    let [min, max] = [min, max].map(|tau| format!("{tau:.2}"));
    if min == max { min } else { format!("{min}–{max}") }
}

/// One line per metric of the suite.
fn push_metrics(text: &mut StyledText, scores: &GroupScores, format: TerminalFormat) {
    if scores.metrics.is_empty() {
        return;
    }
    let width = format.width.saturating_sub(1 + 45).clamp(12, 40);
    let row = |name: &str, cells: [String; 4], n: &str| {
        let cells = cells.map(|cell| format!(" {cell:>9}")).concat();
        format!("{:<width$}{cells} {n:>4}", shortened(name, width))
    };
    text.line(Emphasis::Faint, row("metric", ["mean", "P5", "median", "P95"].map(str::to_owned), "n"));
    for (name, Distribution { mean, p5, median, p95, n, .. }) in &scores.metrics {
        let number = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), |value| significant(value, 4));
        text.line(Emphasis::None, row(name, [*mean, *p5, *median, *p95].map(number), &n.to_string()));
    }
}

fn push_notes(text: &mut StyledText, summary: &SuiteSummary, format: TerminalFormat) {
    let (scores, width) = (&summary.scores, format.width - 1);
    let mut note = |what: &str| text.wrapped(what, width);
    if summary.no_slip_required {
        note("Safety Success also requires no slip in the hand (criteria.require_no_slip)");
    }
    if summary.privileged {
        note("privileged: it reads the true state, which no robot has");
    }
    if summary.replayed {
        note("replayed: the actions are those of a recorded run");
    }
    if summary.force_observed {
        note("force_observed: it reads the true forces at the pads, which no real sensor measures");
    }
    summary.attempt_notes().iter().for_each(|line| note(line));
    command_notes(&summary.commands).iter().for_each(|line| note(line));
    for (name, _) in scores.metrics.iter().filter(|(_, values)| values.n == 0) {
        note(&format!("metric {name} has no value in any valid episode: its function returned nil"));
    }
    if scores.safety_unknown > 0 {
        note(&format!(
            "safety could not be judged in {} (no threshold, or D not measured); counted as not safe",
            counted(scores.safety_unknown, "episode")
        ));
    }
    if scores.invalid > 0 {
        note(&format!("{} counted as failed in every rate", counted(scores.invalid, "invalid episode")));
    }
    let invalid = &summary.invalid_episodes;
    for InvalidEpisode { task, episode, reason } in invalid.iter().take(MAX_INVALID_LISTED) {
        note(&shortened(&format!("  task {task} episode {episode}: invalid: {reason}"), width));
    }
    if invalid.len() > MAX_INVALID_LISTED {
        note(&format!("  … and {} more, in summary.json", invalid.len() - MAX_INVALID_LISTED));
    }
    let aborted = &summary.gave_up;
    if !aborted.is_empty() {
        note(&format!("{} gave up in {}:", summary.policy, counted(aborted.len(), "episode")));
    }
    for AbortedEpisode { task, episode, reason } in aborted.iter().take(MAX_ABORTED_LISTED) {
        note(&shortened(&format!("  task {task} episode {episode}: {reason}"), width));
    }
    if aborted.len() > MAX_ABORTED_LISTED {
        note(&format!("  … and {} more, in summary.json", aborted.len() - MAX_ABORTED_LISTED));
    }
    note(&resolution(scores));
}

/// What the number of episodes can separate.
fn resolution(scores: &GroupScores) -> String {
    let rate = if scores.is_soft() { scores.safety_success_rate } else { scores.goal_success_rate };
    let n = scores.episodes;
    let wide = if n < FEW_EPISODES { format!("n = {n}: intervals are wide; ") } else { String::new() };
    match DetectableDifference::new(rate.count, n) {
        Some(DetectableDifference { smallest, .. }) => {
            let (episodes, points) = (counted(n, "episode"), significant(smallest, 2));
            format!("{wide}{episodes} distinguish policies that differ by at least {points} points")
        }
        None => format!("{wide}distinguishing policies takes at least {MIN_DISCORDANT} episodes"),
    }
}

/// Commands that were not executed as given.
fn command_notes(commands: &CommandCounts) -> Vec<String> {
    let of = |count: u64, what: &str, episodes: usize| {
        format!("{count} of {} {what} in {}", commands.steps, counted(episodes, "episode"))
    };
    let mut notes = Vec::new();
    if commands.far > 0 {
        notes.push(of(commands.far, "commands were out of reach", commands.far_episodes));
        notes.extend(commands.first_far.map(|first| format!("  first: {first}")));
    }
    if commands.clamped_grips > 0 {
        let grips = of(commands.clamped_grips, "grip values were out of range", commands.clamped_episodes);
        notes.push(format!("{grips}; the hand clamped them"));
    }
    if commands.clamped_steps > 0 {
        let what = "displacements were beyond −1..1, and clamped,";
        notes.push(of(commands.clamped_steps, what, commands.clamped_step_episodes));
    }
    notes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample_record;
    use softvt_evaluation::verdict::{Outcome, TargetVerdict};
    use softvt_runs::record::{EpisodeRecord, UnreachableCommand};

    fn episode(task: usize, prompt: &str, edit: impl Fn(&mut EpisodeRecord)) -> EpisodeRecord {
        let mut record = sample_record();
        record.header.id.task = task;
        record.header.prompt = prompt.into();
        edit(&mut record);
        record
    }

    fn records() -> Vec<EpisodeRecord> {
        let (left, right) =
            ("pick up the left bun and place it there", "pick up the right bun and place it there");
        vec![
            episode(0, left, |_| ()),
            episode(0, left, |r| {
                r.verdict.object_mut().d_peak = Some(1.5);
                (r.verdict.object_mut().deformation_ok, r.verdict.safety) = (Some(false), false);
            }),
            episode(1, right, |r| r.outcome = Outcome::Error { message: "x".into() }),
        ]
    }

    fn plain(summary: &SuiteSummary) -> String {
        table(summary, TerminalFormat::PLAIN.with_details())
    }

    /// Words of the first line that starts with `start`, without spaces before it.
    fn words(text: &str, start: &str) -> Vec<String> {
        let line = text.lines().find(|line| line.trim_start().starts_with(start)).unwrap_or_default();
        line.split_whitespace().map(str::to_owned).collect()
    }

    #[test]
    fn the_verdict_comes_first_and_only_failed_tasks_have_lines() {
        let summary = SuiteSummary::from_records("suite", "expert", &records());
        let text = table(&summary, TerminalFormat::PLAIN);
        assert!(text.lines().all(|line| line.chars().count() < 80), "{text}");
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(
            lines[..2],
            ["suite · expert (privileged) · 3 episodes", "● 1 safe  ✗ 1 over the limit  ▨ 1 invalid"]
        );
        assert_eq!(words(&text, "Safety")[..6], ["Safety", "33", "%", "[", "6,", "79]"]);
        assert!(text.contains("gap 33 points: placed over the limit\n"), "1.25 % collapsed: {text}");
        assert_eq!(
            words(&text, "0 bun")[3..],
            ["2/2", "1/2", "0.92", "1", "%", "✗", "1", "over", "the", "limit"]
        );
        assert_eq!(words(&text, "1 bun")[3..], ["0/1", "0/1", "–", "–", "▨", "invalid"]);
        assert!(text.contains("n = 3: intervals are wide; "), "{text}");
        assert!(!text.contains("DSR") && !text.contains('\u{1b}'), "{text}");
        let safe = SuiteSummary::from_records("suite", "expert", &records()[..1]);
        let text = table(&safe, TerminalFormat::PLAIN);
        assert!(!text.contains("0 bun") && text.contains("1 task without a failure; --details"), "{text}");
        let colours = table(&summary, TerminalFormat { is_coloured: true, ..TerminalFormat::PLAIN });
        assert!(colours.contains("\u{1b}[38;5;166m✗ 1 over the limit\u{1b}[0m"), "{colours}");
    }

    #[test]
    fn an_object_is_called_crushed_from_5_percent_of_collapsed_volume_on() {
        let crushed = episode(0, "put it there", |r| {
            (r.verdict.object_mut().deformation_ok, r.verdict.safety) = (Some(false), false);
            r.verdict.object_mut().collapsed_volume_pct = Some(67.0);
        });
        let text = plain(&SuiteSummary::from_records("suite", "expert", &[crushed]));
        assert!(text.contains("gap 100 points: placed, but crushed\n"), "{text}");
    }

    #[test]
    fn details_have_every_task_and_the_figures_of_the_summary() {
        let text = plain(&SuiteSummary::from_records("suite", "expert", &records()));
        assert!(text.lines().all(|line| line.chars().count() < 80), "{text}");
        let row = |start: &str| text.lines().find(|line| line.starts_with(start)).unwrap_or_default();
        assert_eq!(row("Safety Success  "), "Safety Success          33.3 %  [6.1, 79.2]");
        assert_eq!(row("Goal–safety gap"), "Goal–safety gap         33.3 pp");
        assert_eq!(
            row("Safety Success at"),
            "Safety Success at     κ=0.3: 33.3 % · κ=0.5: 33.3 % · κ=0.7: 33.3 %"
        );
        assert_eq!(row("Peak D"), "Peak D, % of diagonal mean 0.92, P5 0.45, median 1.50, P95 ∞; n 2");
        assert!(text.contains("1 invalid episode counted as failed"));
        assert!(text.contains("  task 1 episode 0: invalid: x\n"), "the reason is given: {text}");
        assert!(text.contains("percentiles rank the 1 invalid episode as worst"), "{text}");
        assert_eq!(row("DSR"), "DSR                     33.3 %  [6.1, 79.2]");
        let wide = table(
            &SuiteSummary::from_records("suite", "expert", &records()),
            TerminalFormat { width: 120, ..TerminalFormat::PLAIN },
        );
        assert_eq!(words(&wide, "0 bun")[8..11], ["100.0", "0.92", "1.00"], "{wide}");
    }

    #[test]
    fn the_grip_is_summarised_and_a_required_criterion_is_named() {
        let records = [(1.5, true), (6.0, false)].map(|(ratio, gentle)| {
            episode(0, "put it there", |r| {
                (r.verdict.object_mut().grip_ratio, r.verdict.gentle) = (Some(ratio), gentle);
                (r.verdict.contact_success, r.verdict.contact_safety) = (true, gentle);
                r.verdict.slip_ok = Some(true);
            })
        });
        let text = plain(&SuiteSummary::from_records("suite", "expert", &records));
        assert!(text.lines().all(|line| line.chars().count() < 80), "{text}");
        let row = |start: &str| text.lines().find(|line| line.starts_with(start)).unwrap_or_default();
        assert_eq!(
            row("Contact success"),
            "Contact success        100.0 %  [34.2, 100.0]  safe, no slip: 50.0 %"
        );
        assert_eq!(row("Gentle"), "Gentle                  50.0 %  [9.5, 90.5]");
        assert_eq!(row("Grip ratio"), "Grip ratio            P5 1.7, median 3.8, P95 5.8");
        assert!(text.contains("also requires no slip in the hand"), "{text}");
        let text = plain(&SuiteSummary::from_records("suite", "expert", &self::records()));
        assert!(!text.contains("also requires no slip"), "{text}");
    }

    #[test]
    fn what_was_never_judged_has_no_rate_and_no_tau() {
        let unknown = episode(0, "put it there", |r| {
            (
                r.verdict.object_mut().tau,
                r.verdict.object_mut().d_ref,
                r.verdict.object_mut().deformation_ok,
            ) = (None, None, None);
            (r.verdict.safety, r.verdict.safety_known) = (false, false);
        });
        let text = plain(&SuiteSummary::from_records("suite", "expert", &[unknown]));
        let row = |start: &str| text.lines().find(|line| line.starts_with(start)).unwrap_or_default();
        assert_eq!(row("Deformation within τ"), "Deformation within τ     N/A  not judged: 1");
        assert_eq!(row("Safety Success  "), "Safety Success           N/A  not judged: 1");
        assert!(text.contains("κ=0.3: – %") && !text.contains("1.00"), "{text}");
    }

    #[test]
    fn the_column_of_tau_shows_what_was_applied() {
        let tau = |tau: Option<f64>| episode(0, "put it there", |r| r.verdict.object_mut().tau = tau);
        let shown = |records: &[EpisodeRecord]| {
            tau_range(SuiteSummary::from_records("suite", "expert", records).scores.tau_range)
        };
        assert_eq!(shown(&[tau(None), tau(Some(2.5))]), "2.50");
        assert_eq!(shown(&[tau(Some(1.018)), tau(Some(3.09))]), "1.02–3.09");
        assert_eq!(shown(&[tau(None)]), "");
    }

    #[test]
    fn a_rigid_suite_shows_not_applicable() {
        let rigid = episode(0, "lift it", |r| r.verdict.targets = vec![TargetVerdict::default()]);
        let text = plain(&SuiteSummary::from_records("suite", "expert", &[rigid]));
        assert!(text.contains("Safety  N/A  rigid objects") && !text.contains('κ'), "{text}");
        assert!(text.contains("● 1 placed without a drop") && !text.contains("safe:"), "{text}");
        assert_eq!(words(&text, "0 bun")[2..4], ["1/1", "N/A"]);
    }

    #[test]
    fn commands_that_were_not_executed_as_given_are_shown() {
        let far = episode(0, "lift it", |r| {
            (r.stats.far_commands, r.stats.clamped_grips) = (100, 7);
            let position_m = [467.0, 4.0, 260.0];
            r.stats.first_far_command =
                Some(UnreachableCommand { position_m, distance_m: 534.5, angle_rad: 0.0, joint: None });
        });
        let text = plain(&SuiteSummary::from_records("suite", "pi", &[far, episode(0, "lift it", |_| ())]));
        let lines = "100 of 336 commands were out of reach in 1 episode\n  first: (467, 4, 260) m, 534.5 m and 0 rad from the tool\n";
        assert!(text.contains(lines), "{text}");
        assert!(
            text.contains("7 of 336 grip values were out of range in 1 episode; the hand clamped"),
            "{text}"
        );
    }

    #[test]
    fn an_empty_run_has_a_table() {
        let text = plain(&SuiteSummary::from_records("suite", "expert", &[]));
        assert!(text.contains("0 episodes"), "{text}");
    }
}
