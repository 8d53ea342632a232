//! The results table of a run in the terminal, at most 100 columns wide.

use super::text_table::{push_line, push_rule, shortened};
use crate::{
    evaluation::{
        safety::KAPPAS,
        statistics::{Distribution, Rate},
        summary::{AbortedEpisode, Scores, SuiteSummary},
    },
    text::counted,
};

/// Width of a task's name, columns.
const NAME_WIDTH: usize = 30;
/// Width of the table, columns.
const WIDTH: usize = 99;

/// Largest number of aborted episodes listed.
const MAX_ABORTED_LISTED: usize = 10;

/// The results of one suite: one row per task, one for all, and the rates with their intervals.
pub fn table(summary: &SuiteSummary) -> String {
    let mut out = String::new();
    let scores = &summary.scores;
    let soft = scores.deformation_ok_rate.is_some();
    push_line(
        &mut out,
        &format!(
            "{} · policy {} · {}",
            summary.suite,
            summary.method_label(),
            counted(scores.episodes, "episode")
        ),
    );
    push_rule(&mut out, WIDTH);
    push_line(
        &mut out,
        &format!(
            "{:>3} {:<NAME_WIDTH$} {:>6} {:>6} {:>6} {:>7} {:>6} {:>6} {:>6} {:>6} {:>7}",
            "#", "task", "Goal", "NoDrop", "Safety", "D mean", "P5", "median", "P95", "τ", "invalid"
        ),
    );
    push_rule(&mut out, WIDTH);
    let prompts: Vec<&str> = summary.by_task.iter().map(|t| t.prompt.as_str()).collect();
    for (task, name) in summary.by_task.iter().zip(distinct_parts(&prompts)) {
        let tau = summary.by_asset.get(&task.asset).and_then(|asset| asset.tau);
        push_line(&mut out, &row(&task.task.to_string(), name, &task.scores, tau, soft));
    }
    push_rule(&mut out, WIDTH);
    push_line(&mut out, &row("", "all", scores, None, soft));
    push_rule(&mut out, WIDTH);
    footer(&mut out, summary);
    out
}

fn row(number: &str, name: &str, scores: &Scores, tau: Option<f64>, soft: bool) -> String {
    let d: Distribution = scores.deformation;
    let deformation = |value: Option<f64>| match value {
        Some(value) => format!("{value:.2}"),
        None if soft => "–".into(),
        None => "N/A".into(),
    };
    format!(
        "{number:>3} {:<NAME_WIDTH$} {:>6} {:>6} {:>6} {:>7} {:>6} {:>6} {:>6} {:>6} {:>7}",
        shortened(name, NAME_WIDTH),
        percent(&scores.goal_success_rate),
        percent(&scores.no_drop_rate),
        percent(&scores.safety_success_rate),
        deformation(d.mean),
        deformation(d.p5),
        deformation(d.median),
        deformation(d.p95),
        tau.map_or_else(String::new, |tau| format!("{tau:.2}")),
        scores.invalid,
    )
}

fn footer(out: &mut String, summary: &SuiteSummary) {
    let scores = &summary.scores;
    let deformation_ok = scores.deformation_ok_rate;
    for (name, rate) in [
        ("Goal Success", Some(scores.goal_success_rate)),
        ("NoDrop", Some(scores.no_drop_rate)),
        ("Deformation within τ", deformation_ok),
        ("Safety Success", Some(scores.safety_success_rate)),
    ] {
        push_line(
            out,
            &format!("{name:<22}{}", rate.map_or_else(|| "   N/A".into(), |rate| interval(&rate))),
        );
    }
    let gap = scores.goal_safe_gap.map_or_else(|| "–".into(), |gap| format!("{gap:.1}"));
    push_line(out, &format!("{:<22}{gap:>6} pp", "Goal–safety gap"));
    if !summary.kappa.is_empty() {
        let at = KAPPAS.iter().filter_map(|kappa| summary.kappa.iter().find(|row| row.kappa == *kappa));
        let text: Vec<String> =
            at.map(|row| format!("κ={}: {} %", row.kappa, percent(&row.safety_success_rate))).collect();
        push_line(out, &format!("{:<22}{}", "Safety Success at", text.join(" · ")));
        let (all, goal) = (scores.deformation.n, scores.deformation_goal);
        let of_goal = goal.mean.map_or_else(|| "–".into(), |mean| format!("{mean:.2} %"));
        push_line(
            out,
            &format!(
                "D is the peak in % of the bounding-box diagonal; n {all}; mean {of_goal} over the {} at the goal",
                goal.n
            ),
        );
    }
    if summary.privileged {
        push_line(out, "privileged policy: it had access to ground-truth state");
    }
    if summary.force_observed {
        push_line(
            out,
            "force_observed policy: it observed ground-truth forces at the pads, which no real sensor measures",
        );
    }
    if scores.safety_unknown > 0 {
        push_line(
            out,
            &format!(
                "safety could not be judged in {} (no threshold, or D not measured); counted as unsafe",
                counted(scores.safety_unknown, "episode")
            ),
        );
    }
    if scores.invalid > 0 {
        push_line(
            out,
            &format!("{} counted as failed in every rate", counted(scores.invalid, "invalid episode")),
        );
    }
    gave_up(out, summary);
}

/// Reasons of aborted episodes, one per line.
fn gave_up(out: &mut String, summary: &SuiteSummary) {
    let all = &summary.gave_up;
    if all.is_empty() {
        return;
    }
    push_line(out, &format!("{} gave up in {}:", summary.policy, counted(all.len(), "episode")));
    for AbortedEpisode { task, episode, reason } in all.iter().take(MAX_ABORTED_LISTED) {
        push_line(out, &shortened(&format!("  task {task} episode {episode}: {reason}"), WIDTH));
    }
    if all.len() > MAX_ABORTED_LISTED {
        push_line(out, &format!("  … and {} more, in summary.json", all.len() - MAX_ABORTED_LISTED));
    }
}

fn percent(rate: &Rate) -> String {
    rate.rate.map_or_else(|| "–".into(), |rate| format!("{rate:.1}"))
}

fn interval(rate: &Rate) -> String {
    let bounds = rate.wilson95.map(|[low, high]| format!("  [{low:.1}, {high:.1}]")).unwrap_or_default();
    format!("{:>6} %{bounds}", percent(rate))
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
    use crate::evaluation::record::{EpisodeRecord, Outcome, tests::sample};

    fn episode(task: usize, prompt: &str, edit: impl Fn(&mut EpisodeRecord)) -> EpisodeRecord {
        let mut record = sample();
        record.identity.task = task;
        record.identity.prompt = prompt.into();
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
        let text = table(&SuiteSummary::of("suite", "expert", &records()));
        assert!(text.lines().all(|line| line.chars().count() < 100), "{text}");
        let row = |start: &str| text.lines().find(|line| line.starts_with(start)).unwrap_or_default();
        let words = |line: &str| line.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
        assert_eq!(
            words(row("  0 left")),
            ["0", "left", "100.0", "100.0", "50.0", "0.92", "0.39", "0.92", "1.44", "1.00", "0"]
        );
        assert_eq!(
            words(row("  1 right")),
            ["1", "right", "0.0", "0.0", "0.0", "–", "–", "–", "–", "1.00", "1"]
        );
        assert_eq!(row("Safety Success  "), "Safety Success          33.3 %  [6.1, 79.2]");
        assert_eq!(row("Goal–safety gap"), "Goal–safety gap         33.3 pp");
        assert_eq!(
            row("Safety Success at"),
            "Safety Success at     κ=0.3: 33.3 % · κ=0.5: 33.3 % · κ=0.7: 33.3 %"
        );
        assert!(text.contains("1 invalid episode counted as failed"));
    }

    #[test]
    fn a_rigid_suite_shows_not_applicable() {
        let rigid = episode(0, "lift it", |r| {
            r.identity.soft = false;
            (r.verdict.d_peak, r.verdict.deformation_ok, r.verdict.tau) = (None, None, None);
        });
        let text = table(&SuiteSummary::of("suite", "expert", &[rigid]));
        assert!(text.contains("N/A") && !text.contains('κ'), "{text}");
        assert!(text.contains("lift it"));
    }

    #[test]
    fn an_empty_run_has_a_table() {
        let text = table(&SuiteSummary::of("suite", "expert", &[]));
        assert!(text.contains("0 episodes"), "{text}");
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
