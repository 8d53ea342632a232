//! The results table of a run in the terminal.

use softvt_common::text::{TextColumn, TextTable, counted, decimal, shortened};
use softvt_evaluation::{
    safety::KAPPAS,
    statistics::{Distribution, Rate},
};
use softvt_records::paired_tests::{DetectableDifference, MIN_DISCORDANT};
use softvt_records::summary::{
    AbortedEpisode, CommandCounts, EpisodeDeformation, GroupScores, InvalidEpisode, SuiteSummary, TauRange,
};

/// Columns: index and prompt of the task, three rates, four figures of D, τ and the number of invalid episodes.
const COLUMNS: [TextColumn; 11] = {
    use TextColumn::{Left, Right};
    [
        Right(3),
        Left(27),
        Right(6),
        Right(6),
        Right(6),
        Right(7),
        Right(6),
        Right(6),
        Right(6),
        Right(9),
        Right(7),
    ]
};

/// Largest number of invalid episodes listed.
const MAX_INVALID_LISTED: usize = 5;
/// Largest number of aborted episodes listed.
const MAX_ABORTED_LISTED: usize = 10;

/// The results of one suite: one row per task, one for all, and the rates with their intervals.
pub fn table(summary: &SuiteSummary) -> String {
    let mut table = TextTable::new(COLUMNS);
    let scores = &summary.scores;
    let is_soft = scores.deformation_ok_rate.is_some();
    let episodes = counted(scores.episodes, "episode");
    table.line(format!("{} · policy {} · {episodes}", summary.suite, summary.method_label()));
    table.rule();
    table.row(["#", "task", "Goal", "NoDrop", "Safety", "D mean", "P5", "median", "P95", "τ", "invalid"]);
    table.rule();
    let named: Vec<TaskName> =
        summary.by_task.iter().map(|task| TaskName { prompt: &task.prompt, asset: &task.asset }).collect();
    for (task, name) in summary.by_task.iter().zip(task_names(&named)) {
        table.row(cells(&task.task.to_string(), &name, &task.scores, is_soft));
    }
    table.rule();
    table.row(cells("", "all", scores, is_soft));
    table.rule();
    push_rates(&mut table, summary);
    push_harm_and_stages(&mut table, scores);
    push_notes(&mut table, summary);
    table.line(resolution(scores));
    table.text
}

fn cells(number: &str, name: &str, scores: &GroupScores, is_soft: bool) -> [String; 11] {
    let Distribution { mean, p5, median, p95, .. } = scores.deformation;
    let not_applicable = || "N/A".to_owned();
    let percentile = |value| if is_soft { percentile(&scores.deformation, value) } else { not_applicable() };
    [
        number.to_owned(),
        name.to_owned(),
        decimal(scores.goal_success_rate.rate, 1),
        decimal(scores.no_drop_rate.rate, 1),
        scores.safety_success_rate.rate.map_or_else(not_applicable, |rate| format!("{rate:.1}")),
        if is_soft { decimal(mean, 2) } else { not_applicable() },
        percentile(p5),
        percentile(median),
        percentile(p95),
        tau_range(scores.tau_range),
        scores.invalid.to_string(),
    ]
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

fn push_rates(table: &mut TextTable, summary: &SuiteSummary) {
    let scores = &summary.scores;
    for (name, rate) in [
        ("Goal Success (TSR)", Some(scores.goal_success_rate)),
        ("NoDrop", Some(scores.no_drop_rate)),
        ("Deformation within τ", scores.deformation_ok_rate),
        ("Safety Success", Some(scores.safety_success_rate)),
        ("DSR", scores.dsr),
    ] {
        let text = match rate.filter(|rate| rate.rate.is_some()) {
            Some(rate) => interval(rate),
            None if scores.not_judged > 0 => format!("   N/A  not judged: {}", scores.not_judged),
            None => "   N/A".to_owned(),
        };
        push_named(table, name, &text);
    }
    push_named(table, "Goal–safety gap", &format!("{:>6} pp", decimal(scores.goal_safe_gap, 1)));
    push_grip(table, scores);
    if summary.kappa.is_empty() {
        return;
    }
    let at = KAPPAS.iter().filter_map(|kappa| summary.kappa.iter().find(|row| row.kappa == *kappa));
    let rates = at.map(|row| format!("κ={}: {} %", row.kappa, decimal(row.safety_success_rate.rate, 1)));
    push_named(table, "Safety Success at", &rates.collect::<Vec<_>>().join(" · "));
    let (all, goal) = (scores.deformation, scores.deformation_goal);
    let of_goal = goal.mean.map_or_else(|| "–".to_owned(), |mean| format!("{mean:.2} %"));
    table.line(format!(
        "D is the peak in % of the bounding-box diagonal; n {}; mean {of_goal} over the {} at the goal",
        all.n, goal.n
    ));
    if all.has_invalid() {
        table.line(format!("percentiles rank the {} as worst (∞)", counted(all.invalid, "invalid episode")));
    }
    let EpisodeDeformation { d_mean, d_final, d_p95, time_over_tau_s } = scores.within_episodes;
    if d_mean.is_some() {
        table.line(format!(
            "within an episode, on average: D mean {} %, final {} %, P95 {} %; over τ for {} s",
            decimal(d_mean, 2),
            decimal(d_final, 2),
            decimal(d_p95, 2),
            decimal(time_over_tau_s, 2)
        ));
    }
}

/// Contact success and the grip ratio.
fn push_grip(table: &mut TextTable, scores: &GroupScores) {
    let (contact, safe) =
        (interval(scores.contact_success_rate), decimal(scores.contact_safety_rate.rate, 1));
    push_named(table, "Contact success", &format!("{contact}  safe and without slip: {safe} %"));
    let Distribution { p5, median, p95, .. } = scores.grip_ratio;
    let [p5, median, p95] = [p5, median, p95].map(|ratio| decimal(ratio, 1));
    let gentle = interval(scores.gentle_rate);
    push_named(table, "Gentle", &format!("{gentle}  grip ratio: P5 {p5}, median {median}, P95 {p95}"));
}

/// Harm to other objects, and the stages at which episodes failed.
fn push_harm_and_stages(table: &mut TextTable, scores: &GroupScores) {
    if let Some(rate) = scores.others_ok_rate {
        let unknown = match scores.others_unknown {
            0 => String::new(),
            unknown => format!("  unknown: {unknown}"),
        };
        push_named(table, "Others within their τ", &format!("{}{unknown}", interval(rate)));
    }
    push_named(table, "Touched other objects", &interval(scores.wrong_contact_rate));
    if !scores.failed_stages.is_empty() {
        let stages = scores.failed_stages.iter().map(|(stage, count)| format!("{} {count}", stage.name()));
        push_named(table, "Failed while", &stages.collect::<Vec<_>>().join(" · "));
    }
}

/// What the number of episodes can separate.
fn resolution(scores: &GroupScores) -> String {
    let rate = scores.safety_success_rate.rate.or(scores.goal_success_rate.rate).unwrap_or(0.0);
    let n = scores.episodes;
    let episodes = counted(n, "episode");
    match DetectableDifference::new((0.01 * rate * n as f64).round() as usize, n) {
        Some(DetectableDifference { smallest, found }) => format!(
            "{episodes} separate two policies from a difference of {smallest:.0} points on, in 4 of 5 cases from {found:.0} on"
        ),
        None => format!("{episodes} cannot separate two policies: {MIN_DISCORDANT} are needed at least"),
    }
}

fn push_notes(table: &mut TextTable, summary: &SuiteSummary) {
    let scores = &summary.scores;
    if summary.no_slip_required {
        table.line("Safety Success also requires no slip in the hand (criteria.require_no_slip)");
    }
    if summary.privileged {
        table.line("privileged policy: it had access to ground-truth state");
    }
    if summary.force_observed {
        table.line(
            "force_observed policy: it observed ground-truth forces at the pads, which no real sensor measures",
        );
    }
    push_commands(table, &summary.commands);
    if scores.safety_unknown > 0 {
        table.line(format!(
            "safety could not be judged in {} (no threshold, or D not measured); counted as unsafe",
            counted(scores.safety_unknown, "episode")
        ));
    }
    if scores.invalid > 0 {
        table.line(format!("{} counted as failed in every rate", counted(scores.invalid, "invalid episode")));
    }
    let invalid = &summary.invalid_episodes;
    for InvalidEpisode { task, episode, reason } in invalid.iter().take(MAX_INVALID_LISTED) {
        table.line(shortened(
            &format!("  task {task} episode {episode}: invalid: {reason}"),
            TextTable::WIDTH,
        ));
    }
    if invalid.len() > MAX_INVALID_LISTED {
        table.line(format!("  … and {} more, in summary.json", invalid.len() - MAX_INVALID_LISTED));
    }
    let aborted = &summary.gave_up;
    if aborted.is_empty() {
        return;
    }
    table.line(format!("{} gave up in {}:", summary.policy, counted(aborted.len(), "episode")));
    for AbortedEpisode { task, episode, reason } in aborted.iter().take(MAX_ABORTED_LISTED) {
        table.line(shortened(&format!("  task {task} episode {episode}: {reason}"), TextTable::WIDTH));
    }
    if aborted.len() > MAX_ABORTED_LISTED {
        table.line(format!("  … and {} more, in summary.json", aborted.len() - MAX_ABORTED_LISTED));
    }
}

/// Commands that were not executed as given.
fn push_commands(table: &mut TextTable, commands: &CommandCounts) {
    let of = |count: u64, what: &str, episodes: usize| {
        format!("{count} of {} {what} in {}", commands.steps, counted(episodes, "episode"))
    };
    if commands.far > 0 {
        table.line(of(commands.far, "commands were out of reach", commands.far_episodes));
        if let Some(first) = commands.first_far {
            table.line(format!("  first: {first}"));
        }
    }
    if commands.clamped_grips > 0 {
        let grips = of(commands.clamped_grips, "grip values were out of range", commands.clamped_episodes);
        table.line(format!("{grips}; the hand clamped them"));
    }
}

/// Appends a line of a figure below the table.
fn push_named(table: &mut TextTable, name: &str, text: &str) {
    table.line(format!("{name:<22}{text}"));
}

fn interval(rate: Rate) -> String {
    let bounds = rate.wilson95.map(|[low, high]| format!("  [{low:.1}, {high:.1}]")).unwrap_or_default();
    let by_task = rate
        .bootstrap95
        .map(|[low, high]| format!("  bootstrap by task [{low:.1}, {high:.1}]"))
        .unwrap_or_default();
    format!("{:>6} %{bounds}{by_task}", decimal(rate.rate, 1))
}

/// Fields from which a task gets its name in a table.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TaskName<'a> {
    /// Instruction given to the policy.
    pub prompt: &'a str,
    /// Asset of the object.
    pub asset: &'a str,
}

/// Short names of tasks: the parts in which their prompts differ, with the asset where those of several tasks coincide.
pub(crate) fn task_names(tasks: &[TaskName]) -> Vec<String> {
    let prompts: Vec<&str> = tasks.iter().map(|task| task.prompt).collect();
    let parts = distinct_parts(&prompts);
    let name = |(part, task): (&&str, &TaskName)| match parts.iter().filter(|other| *other == part).count() {
        1 => (*part).to_owned(),
        _ => format!("{part} ({})", task.asset),
    };
    parts.iter().zip(tasks).map(name).collect()
}

/// The prompts without the whole words with which all of them begin or end.
fn distinct_parts<'a>(prompts: &[&'a str]) -> Vec<&'a str> {
    let words: Vec<Vec<&str>> = prompts.iter().map(|p| p.split(' ').collect()).collect();
    let Some(shortest) = words.iter().map(Vec::len).min() else { return Vec::new() };
    if words.iter().all(|w| *w == words[0]) {
        return prompts.to_vec();
    }
    let same = |at: &dyn Fn(&[&'a str]) -> &'a str| words.iter().all(|w| at(w) == at(&words[0]));
    let head = (0..shortest - 1).take_while(|i| same(&|w| w[*i])).count();
    let tail = (1..shortest - head).take_while(|i| same(&|w| w[w.len() - *i])).count();
    let length = |words: &[&str]| words.iter().map(|word| word.len() + 1).sum::<usize>();
    let cut = |prompt: &'a str, w: &[&str]| {
        &prompt[length(&w[..head])..prompt.len() - length(&w[w.len() - tail..])]
    };
    prompts.iter().zip(&words).map(|(prompt, w)| cut(prompt, w)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample_record;
    use softvt_evaluation::verdict::Outcome;
    use softvt_records::record::{EpisodeRecord, UnreachableCommand};

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
                r.verdict.d_peak = Some(1.5);
                (r.verdict.deformation_ok, r.verdict.safety) = (Some(false), false);
            }),
            episode(1, right, |r| r.outcome = Outcome::Error { message: "x".into() }),
        ]
    }

    #[test]
    fn the_table_has_fewer_than_100_columns_and_the_expected_numbers() {
        let text = table(&SuiteSummary::from_records("suite", "expert", &records()));
        assert!(text.lines().all(|line| line.chars().count() < 100), "{text}");
        let row = |start: &str| text.lines().find(|line| line.starts_with(start)).unwrap_or_default();
        let words = |line: &str| line.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
        assert_eq!(
            words(row("  0 left")),
            ["0", "left", "100.0", "100.0", "50.0", "0.92", "0.39", "0.92", "1.44", "1.00", "0"]
        );
        assert_eq!(
            words(row("  1 right")),
            ["1", "right", "0.0", "0.0", "0.0", "–", "∞", "∞", "∞", "1.00", "1"]
        );
        assert_eq!(row("Safety Success  "), "Safety Success          33.3 %  [6.1, 79.2]");
        assert_eq!(row("Goal–safety gap"), "Goal–safety gap         33.3 pp");
        assert_eq!(
            row("Safety Success at"),
            "Safety Success at     κ=0.3: 33.3 % · κ=0.5: 33.3 % · κ=0.7: 33.3 %"
        );
        assert!(text.contains("1 invalid episode counted as failed"));
        assert!(text.contains("  task 1 episode 0: invalid: x\n"), "the reason is given: {text}");
        assert!(text.contains("percentiles rank the 1 invalid episode as worst"), "{text}");
        assert_eq!(row("DSR"), "DSR                     33.3 %  [6.1, 79.2]");
    }

    #[test]
    fn the_grip_is_summarised_and_a_required_criterion_is_named() {
        let records = [(1.5, true), (6.0, false)].map(|(ratio, gentle)| {
            episode(0, "put it there", |r| {
                (r.verdict.grip_ratio, r.verdict.gentle) = (Some(ratio), gentle);
                (r.verdict.contact_success, r.verdict.contact_safety) = (true, gentle);
                r.verdict.slip_ok = Some(true);
            })
        });
        let text = table(&SuiteSummary::from_records("suite", "expert", &records));
        assert!(text.lines().all(|line| line.chars().count() < 100), "{text}");
        let row = |start: &str| text.lines().find(|line| line.starts_with(start)).unwrap_or_default();
        assert_eq!(
            row("Contact success"),
            "Contact success        100.0 %  [34.2, 100.0]  safe and without slip: 50.0 %"
        );
        assert_eq!(
            row("Gentle"),
            "Gentle                  50.0 %  [9.5, 90.5]  grip ratio: P5 1.7, median 3.8, P95 5.8"
        );
        assert!(text.contains("also requires no slip in the hand"), "{text}");
        let plain = table(&SuiteSummary::from_records("suite", "expert", &self::records()));
        assert!(!plain.contains("also requires no slip"), "{plain}");
    }

    #[test]
    fn what_was_never_judged_has_no_rate_and_no_tau() {
        let unknown = episode(0, "put it there", |r| {
            (r.verdict.tau, r.verdict.d_ref, r.verdict.deformation_ok) = (None, None, None);
            (r.verdict.safety, r.verdict.safety_known) = (false, false);
        });
        let text = table(&SuiteSummary::from_records("suite", "expert", &[unknown]));
        let row = |start: &str| text.lines().find(|line| line.starts_with(start)).unwrap_or_default();
        assert_eq!(row("Deformation within τ"), "Deformation within τ     N/A  not judged: 1");
        assert_eq!(row("Safety Success  "), "Safety Success           N/A  not judged: 1");
        assert!(text.contains("κ=0.3: – %") && !text.contains("1.00"), "{text}");
    }

    #[test]
    fn the_column_of_tau_shows_what_was_applied() {
        let tau = |tau: Option<f64>| episode(0, "put it there", |r| r.verdict.tau = tau);
        let shown = |records: &[EpisodeRecord]| {
            tau_range(SuiteSummary::from_records("suite", "expert", records).scores.tau_range)
        };
        assert_eq!(shown(&[tau(None), tau(Some(2.5))]), "2.50");
        assert_eq!(shown(&[tau(Some(1.018)), tau(Some(3.09))]), "1.02–3.09");
        assert_eq!(shown(&[tau(None)]), "");
    }

    #[test]
    fn a_rigid_suite_shows_not_applicable() {
        let rigid = episode(0, "lift it", |r| {
            r.header.soft = false;
            (r.verdict.d_peak, r.verdict.deformation_ok, r.verdict.tau) = (None, None, None);
        });
        let text = table(&SuiteSummary::from_records("suite", "expert", &[rigid]));
        assert!(text.contains("N/A") && !text.contains('κ'), "{text}");
        assert!(text.contains("lift it"));
    }

    #[test]
    fn commands_that_were_not_executed_as_given_are_shown() {
        let far = episode(0, "lift it", |r| {
            (r.stats.far_commands, r.stats.clamped_grips) = (100, 7);
            let position_m = [467.0, 4.0, 260.0];
            r.stats.first_far_command =
                Some(UnreachableCommand { position_m, distance_m: 534.5, angle_rad: 0.0 });
        });
        let text = table(&SuiteSummary::from_records("suite", "pi", &[far, episode(0, "lift it", |_| ())]));
        let lines = "100 of 336 commands were out of reach in 1 episode\n  first: (467, 4, 260) m, 534.5 m and 0 rad from the tool\n";
        assert!(text.contains(lines), "{text}");
        assert!(
            text.contains("7 of 336 grip values were out of range in 1 episode; the hand clamped"),
            "{text}"
        );
    }

    #[test]
    fn an_empty_run_has_a_table() {
        let text = table(&SuiteSummary::from_records("suite", "expert", &[]));
        assert!(text.contains("0 episodes"), "{text}");
    }

    #[test]
    fn equal_prompts_are_told_apart_by_their_assets() {
        let task = |prompt, asset| TaskName { prompt, asset };
        let tasks =
            [task("lift a roll", "bun"), task("lift a pastry", "croissant"), task("lift a pastry", "eclair")];
        assert_eq!(task_names(&tasks), ["roll", "pastry (croissant)", "pastry (eclair)"]);
    }

    #[test]
    fn prompts_are_reduced_to_their_distinct_parts() {
        assert_eq!(distinct_parts(&["put a on it", "put b c on it"]), ["a", "b c"]);
        assert_eq!(distinct_parts(&["same", "same"]), ["same", "same"]);
        assert_eq!(distinct_parts(&["put it", "put it down"]), ["it", "it down"]);
        assert_eq!(distinct_parts(&["étoile à gauche", "étoile à droite"]), ["gauche", "droite"]);
        assert!(distinct_parts(&[]).is_empty());
    }
}
