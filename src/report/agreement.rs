//! Property of random runs: every table has the same Goal Success, Safety Success, counts and deformations.

use std::path::Path;

use proptest::{collection::vec, prelude::*, sample::select};
use serde_json::{Value, json};

use crate::{
    cells,
    condition_table::ConditionOutcome,
    leaderboard, page,
    policy_ranking::PolicyRanking,
    run_summary::{summarize_runs, tests::stored},
    sample_record,
    styled_text::TerminalFormat,
    tables, terminal,
};
use softvt_common::text::decimal;
use softvt_evaluation::{
    category::EpisodeCategory,
    drop::{DropEvent, DropReason},
    safety::{KAPPAS, KappaVerdict, NOMINAL_KAPPA},
    statistics::{Distribution, Rate},
    thresholds::{AssetThreshold, ThresholdFile},
    verdict::{Handling, InvalidReason, Outcome, TargetVerdict},
};
use softvt_runs::{
    paired_stats::{PairedComparison, pair_episodes},
    record::EpisodeRecord,
    requirement::Requirement,
    softvtbench_files,
};

/// D_ref of the asset of the object, %.
const D_REF: f64 = 2.0;
/// Slip that the criteria allow, mm.
const ALLOWED_MM: f64 = 2.0;

#[derive(Clone, Debug)]
struct Moved {
    is_soft: bool,
    d_peak: Option<f64>,
    has_limit: bool,
    is_incomplete: bool,
    is_dropped: bool,
    slip_mm: f64,
}

/// An episode as it went, from which the test derives its verdict without the code under test.
#[derive(Clone, Debug)]
struct Played {
    is_valid: bool,
    reaches_goal: bool,
    requires_no_slip: bool,
    moved: Vec<Moved>,
}

impl Moved {
    fn is_within(&self, kappa: f64) -> Option<bool> {
        let tau = Some(kappa * D_REF).filter(|_| self.has_limit);
        match self.d_peak.zip(tau) {
            _ if !self.is_soft => Some(true),
            Some((d, tau)) if d > tau => Some(false),
            Some(_) if !self.is_incomplete => Some(true),
            _ => None,
        }
    }

    /// The fields of a target's verdict that the episode decides.
    fn verdict(&self, object: Option<String>, is_valid: bool) -> TargetVerdict {
        let of_limit = |x: f64| Some(x).filter(|_| self.is_soft && self.has_limit);
        let handling = Handling {
            no_drop: !self.is_dropped,
            drop: self.is_dropped.then_some(DropEvent { reason: DropReason::FreeFall, time_s: 1.0 }),
            no_slip: self.slip_mm <= ALLOWED_MM,
            slip_mm: self.slip_mm,
        };
        TargetVerdict {
            soft: self.is_soft,
            handling: object.as_ref().map(|_| handling),
            object,
            d_peak: self.d_peak.filter(|_| self.is_soft),
            missing_deformation: u64::from(self.is_incomplete),
            kappa: of_limit(NOMINAL_KAPPA),
            tau: of_limit(NOMINAL_KAPPA * D_REF),
            d_ref: of_limit(D_REF),
            deformation_ok: self.is_within(NOMINAL_KAPPA).filter(|_| self.is_soft && is_valid),
            ..TargetVerdict::default()
        }
    }
}

impl Played {
    fn is_goal(&self) -> bool {
        self.is_valid && self.reaches_goal
    }

    fn no_drop(&self) -> bool {
        self.is_valid && !self.moved.iter().any(|moved| moved.is_dropped)
    }

    fn slip_mm(&self) -> f64 {
        self.moved.iter().map(|moved| moved.slip_mm).fold(0.0, f64::max)
    }

    fn is_within(&self, kappa: f64) -> bool {
        self.is_valid && self.moved.iter().all(|moved| moved.is_within(kappa) == Some(true))
    }

    fn is_safe(&self, kappa: f64) -> bool {
        let slips = self.requires_no_slip && self.slip_mm() > ALLOWED_MM;
        self.is_goal() && self.no_drop() && !slips && self.is_within(kappa)
    }

    fn soft(&self) -> impl Iterator<Item = &Moved> {
        self.moved.iter().filter(|moved| moved.is_soft)
    }

    fn is_soft(&self) -> bool {
        self.soft().next().is_some()
    }

    /// Largest peak D of a target, %, and largest peak D over τ.
    fn d_peak(&self) -> Option<f64> {
        self.soft().filter_map(|moved| moved.d_peak).reduce(f64::max).filter(|_| self.is_valid)
    }

    fn d_over_tau(&self) -> Option<f64> {
        let known = self.soft().filter(|moved| moved.has_limit).filter_map(|moved| moved.d_peak);
        known.map(|d| d / (NOMINAL_KAPPA * D_REF)).reduce(f64::max).filter(|_| self.is_valid)
    }

    fn is_judged(&self) -> bool {
        self.soft().all(|moved| match self.is_valid {
            true => moved.is_within(NOMINAL_KAPPA).is_some(),
            false => moved.has_limit,
        })
    }

    fn record(&self, episode: usize) -> EpisodeRecord {
        let mut record = sample_record();
        record.header.id.episode = episode as u32;
        let name = |at: usize| (at > 0).then(|| format!("object {at}"));
        let verdict = |(at, moved): (usize, &Moved)| moved.verdict(name(at), self.is_valid);
        let mut targets: Vec<TargetVerdict> = self.moved.iter().enumerate().map(verdict).collect();
        let object = &mut targets[0];
        (object.d_peak_v1, object.d_peak_max) = (object.d_peak, object.d_peak);
        record.header.soft = object.soft;
        record.outcome = match (self.is_valid, self.reaches_goal) {
            (true, true) => Outcome::Completed,
            (true, false) => Outcome::Budget,
            (false, _) => Outcome::Invalid { reason: InvalidReason::Inverted, step: 1, node: None },
        };
        let at = |kappa: f64| KappaVerdict {
            kappa,
            tau_pct: kappa * D_REF,
            deformation_ok: self.moved[0].is_within(kappa).filter(|_| object.soft && self.is_valid),
            safety: self.is_safe(kappa),
        };
        let v = &mut record.verdict;
        v.kappas = object.d_ref.map_or_else(Vec::new, |_| KAPPAS.map(at).to_vec());
        (v.goal, v.goal_time_s) = (self.is_goal(), self.is_goal().then_some(8.4));
        v.no_drop = self.no_drop();
        v.drop = (!v.no_drop).then_some(DropEvent { reason: DropReason::FreeFall, time_s: 1.0 });
        (v.slip_mm, v.no_slip) = (self.slip_mm(), self.slip_mm() <= ALLOWED_MM);
        v.slip_ok = Some(v.no_slip).filter(|_| self.requires_no_slip && self.is_valid);
        v.safety = self.is_safe(NOMINAL_KAPPA);
        let known = |moved: &Moved| moved.is_within(NOMINAL_KAPPA);
        let is_harm_known = self.moved.iter().any(|moved| known(moved) == Some(false));
        v.safety_known =
            self.is_valid && (is_harm_known || self.moved.iter().all(|moved| known(moved).is_some()));
        v.targets = targets;
        record
    }
}

fn moved() -> impl Strategy<Value = Moved> {
    let d_peak = prop_oneof![4 => 0.0..1.2, 1 => select(vec![0.6, 1.0, 1.4]), 1 => 0.0..3.0].prop_map(Some);
    let d_peak = prop_oneof![9 => d_peak, 1 => Just(None)];
    let rarely = || prop::bool::weighted(0.1);
    let slip_mm = prop_oneof![0.0..1.0, 0.0..4.0];
    (prop::bool::weighted(0.7), d_peak, prop::bool::weighted(0.9), rarely(), rarely(), slip_mm).prop_map(
        |(is_soft, d_peak, has_limit, is_incomplete, is_dropped, slip_mm)| {
            let is_incomplete = is_soft && (is_incomplete || d_peak.is_none());
            Moved { is_soft, d_peak, has_limit, is_incomplete, is_dropped, slip_mm }
        },
    )
}

/// The episodes of a suite, which may require NoSlip.
fn episodes() -> impl Strategy<Value = Vec<Played>> {
    let episode = (prop::bool::weighted(0.9), prop::bool::weighted(0.8), vec(moved(), 1..=3));
    (any::<bool>(), vec(episode, 1..16)).prop_map(|(requires_no_slip, episodes)| {
        let played = episodes.into_iter().map(|(is_valid, reaches_goal, moved)| Played {
            is_valid,
            reaches_goal,
            requires_no_slip,
            moved,
        });
        played.collect()
    })
}

/// Rate that SoftVTBench's files give for `records`, of which each moves one object.
fn softvtbench_rates(records: &[EpisodeRecord]) -> [Value; 3] {
    let mut thresholds = ThresholdFile::new(NOMINAL_KAPPA, Vec::new(), "softvt".into());
    let (tau, kappa) = (NOMINAL_KAPPA * D_REF, NOMINAL_KAPPA);
    thresholds
        .thresholds
        .insert("bun".into(), AssetThreshold { tau, d_ref: D_REF, kappa, n_stable_trials: 1 });
    let folder = tempfile::tempdir().unwrap();
    softvtbench_files::write_scores(folder.path(), records, &thresholds).unwrap();
    let text = std::fs::read(folder.path().join(softvtbench_files::FOLDER).join("summary.json")).unwrap();
    let summary: Value = serde_json::from_slice(&text).unwrap();
    ["n_episodes", "goal_success_rate", "safe_success_rate"].map(|key| summary[key].clone())
}

proptest! {
    #[test]
    fn every_table_has_the_same_goal_and_safety_of_the_same_records(episodes in episodes()) {
        let n = episodes.len();
        let count = |test: &dyn Fn(&Played) -> bool| episodes.iter().filter(|episode| test(episode)).count();
        let percent = |count: usize| 100.0 * count as f64 / n as f64;
        let goal = count(&Played::is_goal);
        let safe = count(&|episode| episode.is_safe(NOMINAL_KAPPA));
        let is_soft = episodes.iter().any(Played::is_soft);
        let is_judged = episodes.iter().any(|episode| episode.is_soft() && episode.is_judged());
        let safety = Some(percent(safe)).filter(|_| is_judged);

        let records: Vec<EpisodeRecord> =
            episodes.iter().enumerate().map(|(index, episode)| episode.record(index)).collect();
        let runs = summarize_runs(vec![stored("a", "pi", records.clone())]);
        let (run, scores) = (&runs[0], &runs[0].summary.scores);
        prop_assert_eq!(scores.goal_success_rate.rate, Some(percent(goal)));
        prop_assert_eq!(scores.safety_success_rate.rate, safety);
        prop_assert_eq!((scores.episodes, scores.count(EpisodeCategory::Safe)), (n, safe));
        prop_assert_eq!(scores.invalid, count(&|episode| !episode.is_valid));
        prop_assert_eq!(scores.categories.values().sum::<usize>(), n);

        // The intervals are of the quantities of their rates.
        let rates = [scores.goal_success_rate, scores.no_drop_rate, scores.safety_success_rate];
        for rate in rates.into_iter().chain(scores.deformation_ok_rate).chain(scores.dsr) {
            if let (Some(rate), Some([low, high])) = (rate.rate, rate.bootstrap95) {
                prop_assert!(low - 1e-9 <= rate && rate <= high + 1e-9, "{} in [{}, {}]", rate, low, high);
            }
        }

        // Peaks of D: all of them, those over τ, and the table of the report.
        let peaks = |of: fn(&Played) -> Option<f64>| episodes.iter().filter_map(of).collect::<Vec<f64>>();
        let invalid = count(&|episode| !episode.is_valid && episode.is_soft());
        let expected = Distribution::with_invalid(peaks(Played::d_peak), invalid);
        prop_assert_eq!(Distribution { bootstrap95: None, ..scores.deformation }, expected);
        prop_assert_eq!(scores.d_over_tau, Distribution::from_values(peaks(Played::d_over_tau)));
        let table = tables::deformation_table(&runs);
        prop_assert_eq!(table.is_some(), is_soft);
        if let Some(table) = table {
            let cells = [decimal(expected.mean, 2), expected.n.to_string(), expected.invalid.to_string()];
            prop_assert_eq!([&table.rows[0][2], &table.rows[0][6], &table.rows[0][7]], cells.each_ref());
        }

        // Strictness: the summary, and the figure of the report.
        let corners = page::kappa_curve::curve_corners(run);
        prop_assert_eq!((run.summary.kappa.is_empty(), corners.is_empty()), (!is_soft, !is_judged));
        for row in run.summary.kappa.iter().filter(|_| is_judged) {
            let expected = Some(percent(count(&|episode| episode.is_safe(row.kappa))));
            prop_assert_eq!(row.safety_success_rate.rate, expected, "κ {}", row.kappa);
            let within = Some(percent(count(&|episode| episode.is_within(row.kappa))));
            prop_assert_eq!(row.deformation_ok_rate.rate, within, "κ {}", row.kappa);
            let drawn = corners.iter().rfind(|corner| corner.kappa <= row.kappa + 1e-12).map(|c| c.percent);
            prop_assert_eq!(drawn, expected, "drawn at κ {}", row.kappa);
        }

        // The terminal, with counts, and the tables of the report, with percentages.
        let text = terminal::table(&run.summary, TerminalFormat::PLAIN);
        let all = text.lines().find(|line| line.trim_start().starts_with("all ")).unwrap();
        let cells: Vec<&str> = all.split_whitespace().take(3).collect();
        let shown = safety.map_or_else(|| "N/A".to_owned(), |_| format!("{safe}/{n}"));
        prop_assert_eq!(cells, ["all", &format!("{goal}/{n}"), &shown]);
        let row = &tables::main_table(&runs).rows[0];
        let cell = |count: Option<usize>| count.map_or_else(|| "N/A".to_owned(), |c| cells::rate(&Rate::new(c, n)));
        prop_assert_eq!([&row[3], &row[5]], [&cell(Some(goal)), &cell(safety.map(|_| safe))]);

        // The page: Goal and Safety, and the number of episodes of each category.
        let html = page::page(&runs, &page::Thumbnails::new(), Path::new("page"));
        let row = html.split("<td class=\"number\" data-head=\"Goal, %\">").nth(1).expect("a row of the run");
        prop_assert!(row.starts_with(&decimal(Some(percent(goal)), 0)), "{}", row);
        let shown = safety.map_or_else(|| "N/A".to_owned(), |safety| format!("<b>{safety:.0}"));
        let cell = row.split("data-head=\"Safety, %\">").nth(1).expect("Safety of the run");
        prop_assert!(cell.starts_with(&shown), "{}", cell);
        let counted = cell.split("class=\"counts\">").nth(1).expect("counts of the run");
        let counted = counted.split("</td>").next().unwrap_or_default();
        for (category, count) in &scores.categories {
            let shown = format!("{} {count}", category.glyph());
            prop_assert!(counted.contains(&shown), "{} in {}", shown, counted);
        }

        // The table of conditions, the comparison with itself, a ranking, and the row of a leaderboard.
        let condition = ConditionOutcome::new("a".into(), &records, None);
        prop_assert_eq!((condition.episodes, condition.invalid), (n, scores.invalid));
        prop_assert_eq!(condition.goal_success_rate.rate, Some(percent(goal)));
        prop_assert_eq!((condition.safety_success_rate.rate, condition.d_over_tau), (safety, scores.d_over_tau));
        let paired = PairedComparison::from_pairs(&pair_episodes(&records, &records));
        let rounded = |rate: Option<f64>| rate.map(|rate| (1e9 * rate).round());
        prop_assert_eq!((paired.pairs, rounded(paired.goal.first)), (n, rounded(Some(percent(goal)))));
        prop_assert_eq!(rounded(paired.safety.first), rounded(safety));
        let of_run = || vec![stored("a", "pi", records.clone())];
        let ranking = PolicyRanking::new(&[of_run(), of_run(), of_run()]).expect("common episodes");
        let letters = |is_known: bool| if is_known { "a" } else { "" };
        for ranked in &ranking.runs {
            let found = (ranked.goal.rate, ranked.safety.rate, ranked.d_over_tau);
            prop_assert_eq!(found, (Some(percent(goal)), safety, scores.d_over_tau.median));
            let expected = [letters(safety.is_some()), letters(scores.d_over_tau.n > 0)];
            prop_assert_eq!([&ranked.safety_letters, &ranked.d_over_tau_letters], expected);
        }
        let row: Value = serde_json::from_str(leaderboard::rows(&runs).trim_end()).unwrap();
        let expected = [json!(n), json!(percent(goal)), json!(safety), json!(expected.median)];
        let found = [&row["episodes"], &row["goal"]["rate"], &row["safety"]["rate"], &row["d_peak_median"]];
        prop_assert_eq!(found, expected.each_ref());
        let required = "safety>=0".parse::<Requirement>().expect("a requirement").unmet(&run.summary);
        prop_assert_eq!(required.is_none(), safety.is_some() || !is_soft);

        // SoftVTBench knows one object, no drop, no slip and no missing step.
        let alone = |episode: &&Played| episode.moved.len() == 1 && !episode.moved[0].is_incomplete;
        let alone: Vec<Played> = episodes.iter().filter(alone).cloned().collect();
        let records: Vec<_> = alone.iter().enumerate().map(|(index, of)| of.record(index)).collect();
        let rate = |test: &dyn Fn(&&Played) -> bool| json!(Rate::from_test(&alone, |of| test(&of)).rate);
        let safe = |of: &&Played| of.is_goal() && of.is_within(NOMINAL_KAPPA);
        let expected = [json!(alone.len()), rate(&|of| of.is_goal()), rate(&safe)];
        prop_assert_eq!(softvtbench_rates(&records), expected);
    }
}
