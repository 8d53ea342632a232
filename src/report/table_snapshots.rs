//! Snapshots of every table of the same runs: `INSTA_UPDATE=always cargo test --release -p softvt-report` writes them.

use std::collections::BTreeMap;

use super::{
    comparison::compare,
    comparison_table,
    condition_table::{
        self, ConditionOutcome, ConditionRow, ConditionTable, compares_policies, controllers_table,
    },
    leaderboard,
    policy_ranking::PolicyRanking,
    run_summary::{RunSummary, summarize_runs, tests::stored},
    sample_record,
    styled_text::TerminalFormat,
    tables::{
        all_tables,
        formats::{latex, markdown},
    },
    terminal,
};
use insta::assert_snapshot;
use softvt_benchmark::ShiftValue;
use softvt_evaluation::{
    stage::TaskStage,
    verdict::{InvalidReason, Outcome, TargetVerdict, WrongObjectContact},
};
use softvt_runs::{
    record::{EpisodeRecord, UnreachableCommand},
    stored_run::StoredRun,
};

/// Two episodes of each of three tasks.
fn episodes(edit: impl Fn(usize, u32, &mut EpisodeRecord)) -> Vec<EpisodeRecord> {
    let tasks = [("lift the left bun", "bun"), ("lift the right bun", "bun"), ("lift the pie", "apple_pie")];
    let mut all = Vec::new();
    for (task, (prompt, asset)) in tasks.into_iter().enumerate() {
        for episode in 0..2 {
            let mut record = sample_record();
            let header = &mut record.header;
            (header.id.task, header.id.episode) = (task, episode);
            (header.prompt, header.asset) = (prompt.to_owned(), asset.to_owned());
            record.verdict.others_ok = Some(true);
            record.stats.metrics = BTreeMap::from([("tilt".to_owned(), Some(0.1 * f64::from(episode)))]);
            edit(task, episode, &mut record);
            all.push(record);
        }
    }
    all
}

fn over_limit(record: &mut EpisodeRecord, d_pct: f64, collapsed_pct: f64) {
    record.verdict.safety = false;
    let of = record.verdict.object_mut();
    (of.d_peak, of.deformation_ok) = (Some(d_pct), Some(false));
    (of.d_mean, of.d_final, of.d_p95) = (Some(0.5 * d_pct), Some(0.1), Some(0.9 * d_pct));
    (of.time_over_tau_s, of.collapsed_volume_pct) = (Some(2.5), Some(collapsed_pct));
}

fn missed(record: &mut EpisodeRecord, stage: TaskStage) {
    let v = &mut record.verdict;
    (v.goal, v.goal_time_s, v.safety, v.failed_stage) = (false, None, false, Some(stage));
    record.outcome = Outcome::Budget;
}

/// A run whose episodes are all safe, and gentle.
fn careful() -> StoredRun {
    let edit = |_: usize, _: u32, record: &mut EpisodeRecord| {
        (record.verdict.contact_success, record.verdict.contact_safety) = (true, true);
        (record.verdict.object_mut().grip_ratio, record.verdict.gentle) = (Some(1.5), true);
    };
    stored("runs/careful", "expert", episodes(edit))
}

/// A run with an episode of each category.
fn rough() -> StoredRun {
    let edit = |task: usize, episode: u32, record: &mut EpisodeRecord| match (task, episode) {
        (0, 0) => over_limit(record, 9.0, 67.0),
        (0, _) => {
            over_limit(record, 1.5, 1.0);
            record.verdict.first_wrong_contact =
                Some(WrongObjectContact { time_s: 1.0, object: "pie".to_owned() });
            record.verdict.others_ok = Some(false);
        }
        (1, 0) => {
            missed(record, TaskStage::Carry);
            record.verdict.no_drop = false;
        }
        (1, _) => {
            missed(record, TaskStage::Reach);
            record.stats.gave_up = Some("table is in the way".to_owned());
        }
        (_, 0) => {
            missed(record, TaskStage::Grasp);
            record.outcome = Outcome::Invalid { reason: InvalidReason::Inverted, step: 3, node: None };
            (record.verdict.others_ok, record.verdict.object_mut().deformation_ok) = (None, None);
        }
        _ => {
            record.verdict.object_mut().grip_ratio = Some(6.0);
            (record.stats.far_commands, record.stats.clamped_grips) = (100, 7);
            let first = UnreachableCommand {
                position_m: [467.0, 4.0, 260.0],
                distance_m: 534.5,
                angle_rad: 0.0,
                joint: None,
            };
            record.stats.first_far_command = Some(first);
        }
    };
    stored("runs/rough", "servo", episodes(edit))
}

/// A run of rigid objects that is not finished.
fn rigid() -> StoredRun {
    let edit = |_: usize, _: u32, record: &mut EpisodeRecord| {
        record.header.id.suite = "rigid".to_owned();
        record.verdict.targets = vec![TargetVerdict::default()];
    };
    let mut run = stored("runs/rigid", "expert", episodes(edit));
    run.manifest.episodes = 20;
    run
}

/// Episodes whose limit is not known, and which require that nothing slips.
fn not_judged() -> StoredRun {
    let edit = |_: usize, _: u32, record: &mut EpisodeRecord| {
        let v = &mut record.verdict;
        (v.safety, v.safety_known, v.slip_ok) = (false, false, Some(true));
        let of = v.object_mut();
        (of.tau, of.d_ref, of.kappa, of.deformation_ok) = (None, None, None, None);
    };
    stored("runs/unknown", "pi", episodes(edit))
}

fn summaries() -> Vec<RunSummary> {
    let mut heavy = StoredRun { dir: "runs/heavy".into(), ..rough() };
    heavy.manifest.shifts.push(ShiftValue { name: "mass".to_owned(), value: 2.5 });
    heavy.records[0] = careful().records[0].clone();
    summarize_runs(vec![careful(), rough(), heavy, rigid(), not_judged()])
}

#[test]
fn the_terminal_shows_the_verdict_first_and_only_failed_tasks() {
    let formats = [
        TerminalFormat::PLAIN,
        TerminalFormat::PLAIN.with_details(),
        TerminalFormat { width: 120, is_coloured: true, has_details: false },
    ];
    let runs = [careful(), rough(), rigid(), not_judged(), stored("runs/empty", "noop", Vec::new())];
    let mut text = String::new();
    for run in summarize_runs(runs.to_vec()) {
        for format in formats {
            let table = terminal::table(&run.summary, format);
            let is_narrow = table.lines().all(|line| line.chars().count() < format.width);
            assert!(format.is_coloured || is_narrow, "{table}");
            text += &format!("{table}\n");
        }
    }
    assert_snapshot!("terminal", text.replace('\u{1b}', "␛"));
}

#[test]
fn two_runs_are_compared_by_measure_and_by_task_and_more_by_letters() {
    let [a, b, c] = [careful(), rough(), not_judged()].map(|run| vec![run]);
    let mut text = String::new();
    for (format, second) in
        [(TerminalFormat::PLAIN, &b), (TerminalFormat::PLAIN.with_details(), &b), (TerminalFormat::PLAIN, &c)]
    {
        let table = comparison_table::table(&compare(&a, second).expect("common episodes"), format);
        assert!(table.lines().all(|line| line.chars().count() < 80), "{table}");
        text += &format!("{table}\n");
    }
    text += &PolicyRanking::new(&[a, b, c]).expect("common episodes").table();
    assert_snapshot!("comparison", text);
}

fn condition(name: &str, outcome: Option<ConditionOutcome>) -> ConditionRow {
    ConditionRow {
        rigid_twin: false,
        condition: name.to_owned(),
        shift: Vec::new(),
        set: Vec::new(),
        policy: None,
        replay: false,
        blind: false,
        not_applicable: outcome.is_none().then(|| "nothing in it deforms".to_owned()),
        outcome,
    }
}

#[test]
fn conditions_have_a_row_each_and_policies_as_conditions_a_column_per_suite() {
    let (reference, changed) = (careful().records, rough().records);
    let outcome =
        |records: &[EpisodeRecord], reference| Some(ConditionOutcome::new("x".into(), records, reference));
    let suite = |name: &str, rows: Vec<ConditionRow>| {
        let (suite, policy) = (name.to_owned(), "expert".to_owned());
        ConditionTable { suite, policy, deformable: true, rows }
    };
    let buns = suite(
        "buns",
        vec![
            condition("reference", outcome(&reference, None)),
            condition("heavy", outcome(&changed, Some(&reference))),
            condition("a condition with a name that is very long", None),
        ],
    );
    assert!(!compares_policies(std::slice::from_ref(&buns)));
    let mut text = [TerminalFormat::PLAIN, TerminalFormat::PLAIN.with_details()]
        .map(|format| condition_table::table(&buns, format))
        .join("\n");
    let policies = |name: &str| {
        let policy = |name: &str, blind, outcome| ConditionRow {
            policy: Some(name.to_owned()),
            blind,
            ..condition(name, outcome)
        };
        let rows = vec![
            condition("reference", outcome(&reference, None)),
            policy("servo", false, outcome(&reference, None)),
            policy("loose", true, outcome(&changed, None)),
            policy("middle", true, outcome(&reference[..2], None)),
        ];
        suite(name, rows)
    };
    let suites = ["buns", "rolls", "cubes", "a suite with a long name", "loaves"].map(policies);
    assert!(compares_policies(&suites));
    text += &format!("\n{}", controllers_table(&suites, TerminalFormat::PLAIN));
    assert!(text.lines().all(|line| line.chars().count() < 80), "{text}");
    assert_snapshot!("conditions", text);
}

#[test]
fn reports_have_every_table_with_marks_of_privileged_policies() {
    let runs = summaries();
    let tables = all_tables(&runs);
    for table in &tables {
        assert!(table.rows.iter().all(|row| row.len() == table.columns.len()), "{table:?}");
    }
    assert_snapshot!("markdown", tables.iter().map(markdown).collect::<Vec<_>>().join("\n"));
    assert_snapshot!("latex", tables[..3].iter().map(latex).collect::<Vec<_>>().join("\n"));
    let rows = leaderboard::rows(&runs).replace(env!("CARGO_PKG_VERSION"), "VERSION");
    assert_snapshot!("leaderboard", rows.replace(",\"", ",\n  \""));
}
