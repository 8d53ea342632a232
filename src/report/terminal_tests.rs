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
fn the_table_says_it_all_in_less_than_100_columns() {
    let text = table(&SuiteSummary::of("suite", "expert", &records()));
    assert!(text.lines().all(|line| line.chars().count() < 100), "{text}");
    let row = |start: &str| text.lines().find(|line| line.starts_with(start)).unwrap_or_default();
    let words = |line: &str| line.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
    assert_eq!(
        words(row("  0 left")),
        ["0", "left", "100.0", "100.0", "50.0", "0.92", "0.39", "0.92", "1.44", "1.00", "0"]
    );
    assert_eq!(words(row("  1 right")), ["1", "right", "0.0", "0.0", "0.0", "–", "–", "–", "–", "1.00", "1"]);
    assert_eq!(row("Safety Success  "), "Safety Success          33.3 %  [6.1, 79.2]");
    assert_eq!(row("Goal–safety gap"), "Goal–safety gap         33.3 points");
    assert_eq!(row("Safety Success at"), "Safety Success at     κ 0.3 33.3 % · κ 0.5 33.3 % · κ 0.7 33.3 %");
    assert!(text.contains("1 invalid episodes count as failures"));
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
fn an_empty_run_has_a_table_too() {
    let text = table(&SuiteSummary::of("suite", "expert", &[]));
    assert!(text.contains("0 episodes"), "{text}");
}

#[test]
fn prompts_are_cut_to_what_distinguishes_them() {
    assert_eq!(distinct_parts(&["put a on it", "put b c on it"]), ["a", "b c"]);
    assert_eq!(distinct_parts(&["same", "same"]), ["same", "same"]);
    assert_eq!(distinct_parts(&["put it", "put it down"]), ["it", "it down"]);
    assert_eq!(distinct_parts(&["étoile à gauche", "étoile à droite"]), ["gauche", "droite"]);
    assert!(distinct_parts(&[]).is_empty());
}
