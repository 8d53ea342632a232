//! The measures of episodes, each declared once: what it is of a record, how a summary aggregates it, how two runs are
//! compared by it, and how tables show it.
//!
//! `measures!` makes [`GroupScores`], [`EpisodeDeformation`] and [`PairedComparison`] of the list, and [`MEASURES`]. Of
//! these, comparisons, the tables of the grip, volumes, harm and the course of D, and that of `docs/results.md` are
//! made. Tables that select and arrange a few measures read their fields. A row is
//!
//! ```text
//! Kind(value of a record) in key-of-summaries vs key-of-comparisons, group, "heading", decimals, "unit", "meaning";
//! ```
//!
//! where `in`, `within` (the mean over episodes of a measure of their course) and `vs` may be absent.

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;

use crate::{
    paired_stats::{EpisodePair, PairedDifference, PairedStages},
    record::EpisodeRecord,
    summary::TauRange,
};
use softvt_evaluation::{
    category::EpisodeCategory,
    stage::TaskStage,
    statistics::{Distribution, Rate, stratified_bootstrap},
};

/// Subject of a measure: measures of one group share a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeasureGroup {
    /// Goal, drops and limits. Of all episodes together, these have intervals by the bootstrap within tasks.
    Success,
    Deformation,
    /// Forces, contact and slip of the grip.
    Grip,
    /// Volume beyond the strain limits of the material.
    Volume,
    /// Other objects than the targets.
    Harm,
    /// Scores of other benchmarks, in `summary.json` alone.
    OtherRule,
}

#[derive(Debug)]
pub struct Measure {
    /// Key in summaries; `None` if they do not have it.
    pub summary: Option<&'static str>,
    /// Key in `within_episodes` of summaries.
    pub within: Option<&'static str>,
    /// Key in comparisons; `None` if runs are not compared by it.
    pub paired: Option<&'static str>,
    pub group: MeasureGroup,
    pub heading: &'static str,
    /// Unit; empty for none.
    pub unit: &'static str,
    pub digits: usize,
    pub about: &'static str,
    /// Its value in a summary.
    pub score: fn(&GroupScores) -> Option<Score>,
    pub difference: fn(&PairedComparison) -> Option<PairedDifference>,
}

impl Measure {
    /// Name in tables with the unit: "gentle, %".
    pub fn label(&self) -> String {
        let comma = if self.unit.is_empty() { "" } else { ", " };
        format!("{}{comma}{}", self.heading, self.unit)
    }

    pub fn of(group: MeasureGroup) -> impl Iterator<Item = &'static Self> {
        MEASURES.iter().filter(move |measure| measure.group == group)
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Score {
    /// Share of the episodes; not judged for what was judged in none.
    Rate(Rate),
    Distribution(Distribution),
    Mean(Option<f64>),
}

impl From<Rate> for Score {
    fn from(rate: Rate) -> Self {
        Self::Rate(rate)
    }
}

impl From<Option<Rate>> for Score {
    fn from(rate: Option<Rate>) -> Self {
        Self::Rate(rate.unwrap_or_default())
    }
}

impl From<Distribution> for Score {
    fn from(distribution: Distribution) -> Self {
        Self::Distribution(distribution)
    }
}

/// Episodes of a group, by task if intervals by the bootstrap are wanted.
pub(crate) struct Episodes<'a> {
    pub(crate) records: &'a [&'a EpisodeRecord],
    pub(crate) tasks: Option<&'a BTreeMap<usize, Vec<&'a EpisodeRecord>>>,
}

impl<'a> Episodes<'a> {
    fn valid(&self) -> impl Iterator<Item = &'a EpisodeRecord> {
        self.records.iter().copied().filter(|r| r.outcome.is_valid())
    }

    fn soft(&self) -> impl Iterator<Item = &'a EpisodeRecord> {
        self.records.iter().copied().filter(|r| r.has_soft_target())
    }

    /// True if a soft target was judged: without one, what needs its limit has no rate.
    fn is_any_judged(&self) -> bool {
        self.records.iter().any(|r| r.has_judged_soft_target())
    }

    fn metrics(&self) -> BTreeMap<String, Distribution> {
        let names: BTreeSet<&String> = self.valid().flat_map(|r| r.stats.metrics.keys()).collect();
        let of = |name: &String| {
            let values = self.valid().filter_map(|r| r.metric(name));
            (name.clone(), Distribution::from_values(values.collect()))
        };
        names.into_iter().map(of).collect()
    }

    /// Share of all episodes that are valid and pass a test, with an interval by the bootstrap for
    /// a measure of success.
    fn rate(&self, test: fn(&EpisodeRecord) -> bool, group: MeasureGroup) -> Rate {
        let succeeds = |r: &&EpisodeRecord| r.outcome.is_valid() && test(r);
        let rate = Rate::from_test(self.records, succeeds);
        let strata = self
            .tasks
            .filter(|_| group == MeasureGroup::Success)
            .map(|tasks| tasks.values().map(|task| task.iter().map(succeeds).collect()).collect::<Vec<_>>());
        strata.map_or(rate, |strata| rate.with_bootstrap(&strata))
    }
}

struct Pairs<'a> {
    pairs: &'a [EpisodePair<'a>],
}

impl Pairs<'_> {
    /// True if each run judged a soft target, as [`Episodes::is_any_judged`] of a summary.
    fn is_any_judged(&self) -> bool {
        [0, 1].iter().all(|&run| self.records().any(|pair| pair[run].has_judged_soft_target()))
    }

    fn metrics(&self) -> BTreeMap<String, PairedDifference> {
        let names: BTreeSet<&String> =
            self.pairs.iter().flat_map(|pair| pair.first.stats.metrics.keys()).collect();
        let of = |name: &String| {
            let value = |r: &EpisodeRecord| r.metric(name).filter(|_| r.outcome.is_valid());
            let both = |[first, second]: [&EpisodeRecord; 2]| Some([value(first)?, value(second)?]);
            (name.clone(), PairedDifference::from_values(self.records().filter_map(both)))
        };
        names.into_iter().map(of).collect()
    }

    fn records(&self) -> impl Iterator<Item = [&EpisodeRecord; 2]> {
        self.pairs.iter().map(|pair| [pair.first, pair.second])
    }
}

/// A way to aggregate a value of records.
trait Aggregate {
    type Score;
    fn score(&self, episodes: &Episodes<'_>, group: MeasureGroup) -> Self::Score;
    fn difference(&self, pairs: &Pairs<'_>) -> PairedDifference;
}

/// A success. An invalid episode has none.
struct Success(fn(&EpisodeRecord) -> bool);

impl Aggregate for Success {
    type Score = Rate;

    fn score(&self, episodes: &Episodes<'_>, group: MeasureGroup) -> Rate {
        episodes.rate(self.0, group)
    }

    fn difference(&self, pairs: &Pairs<'_>) -> PairedDifference {
        PairedDifference::from_successes(
            pairs.records().map(|pair| pair.map(|r| r.outcome.is_valid() && (self.0)(r))),
        )
    }
}

/// As [`SoftSuccess`], and not judged without soft targets. Beside judged ones, rigid targets need no limit.
struct SafeSuccess(fn(&EpisodeRecord) -> bool);

impl Aggregate for SafeSuccess {
    type Score = Rate;

    fn score(&self, episodes: &Episodes<'_>, group: MeasureGroup) -> Rate {
        SoftSuccess(self.0).score(episodes, group).unwrap_or_default()
    }

    fn difference(&self, pairs: &Pairs<'_>) -> PairedDifference {
        SoftSuccess(self.0).difference(pairs)
    }
}

/// A success that only soft targets have; null without them, not judged where none was.
struct SoftSuccess(fn(&EpisodeRecord) -> bool);

impl Aggregate for SoftSuccess {
    type Score = Option<Rate>;

    fn score(&self, episodes: &Episodes<'_>, group: MeasureGroup) -> Option<Rate> {
        episodes.soft().next()?;
        Some(if episodes.is_any_judged() { episodes.rate(self.0, group) } else { Rate::not_judged() })
    }

    fn difference(&self, pairs: &Pairs<'_>) -> PairedDifference {
        if pairs.is_any_judged() { Success(self.0).difference(pairs) } else { PairedDifference::default() }
    }
}

/// A fact that is unknown of some episodes, which are left out; null if it is never known.
struct KnownFact(fn(&EpisodeRecord) -> Option<bool>);

impl Aggregate for KnownFact {
    type Score = Option<Rate>;

    fn score(&self, episodes: &Episodes<'_>, _: MeasureGroup) -> Option<Rate> {
        let known: Vec<bool> = episodes.valid().filter_map(self.0).collect();
        (!known.is_empty()).then(|| Rate::from_test(&known, |holds| *holds))
    }

    fn difference(&self, pairs: &Pairs<'_>) -> PairedDifference {
        let both = |[first, second]: [&EpisodeRecord; 2]| Some([(self.0)(first)?, (self.0)(second)?]);
        PairedDifference::from_successes(pairs.records().filter_map(both))
    }
}

/// A fault, whose rate should be low. Invalid episodes count if they have it.
struct Fault(fn(&EpisodeRecord) -> bool);

impl Aggregate for Fault {
    type Score = Rate;

    fn score(&self, episodes: &Episodes<'_>, _: MeasureGroup) -> Rate {
        Rate::from_test(episodes.records, |r| (self.0)(r))
    }

    fn difference(&self, pairs: &Pairs<'_>) -> PairedDifference {
        PairedDifference::from_failures(pairs.records().map(|pair| pair.map(self.0)))
    }
}

/// A number that should be low, of the valid episodes that have it.
struct Amount(fn(&EpisodeRecord) -> Option<f64>);

impl Aggregate for Amount {
    type Score = Distribution;

    fn score(&self, episodes: &Episodes<'_>, _: MeasureGroup) -> Distribution {
        Distribution::from_values(episodes.valid().filter_map(self.0).collect())
    }

    fn difference(&self, pairs: &Pairs<'_>) -> PairedDifference {
        let of_valid = |r: &EpisodeRecord| (self.0)(r).filter(|_| r.outcome.is_valid());
        let both = |[first, second]: [&EpisodeRecord; 2]| Some([of_valid(first)?, of_valid(second)?]);
        PairedDifference::from_values(pairs.records().filter_map(both))
    }
}

/// As [`Amount`], where invalid episodes with a soft target rank as worst.
struct RankedAmount(fn(&EpisodeRecord) -> Option<f64>);

impl Aggregate for RankedAmount {
    type Score = Distribution;

    fn score(&self, episodes: &Episodes<'_>, _: MeasureGroup) -> Distribution {
        let invalid = episodes.soft().filter(|r| !r.outcome.is_valid()).count();
        let values = |records: &[&EpisodeRecord]| -> Vec<f64> {
            records.iter().filter(|r| r.outcome.is_valid()).filter_map(|r| (self.0)(r)).collect()
        };
        let strata = episodes.tasks.map(|tasks| tasks.values().map(|task| values(task)).collect::<Vec<_>>());
        let bootstrap95 = strata.and_then(|strata| stratified_bootstrap(&strata));
        Distribution { bootstrap95, ..Distribution::with_invalid(values(episodes.records), invalid) }
    }

    fn difference(&self, pairs: &Pairs<'_>) -> PairedDifference {
        Amount(self.0).difference(pairs)
    }
}

/// Declares the measures, see the [module](self).
macro_rules! measures {
    ($(
        $kind:ident($value:expr) $(in $summary:ident)? $(within $within:ident)? $(vs $paired:ident)?,
        $group:ident, $heading:literal, $digits:literal, $unit:literal, $about:literal;
    )*) => {
        /// All measures, in the order of summaries.
        pub static MEASURES: &[Measure] = &[$(
            Measure {
                summary: measures!(@name $($summary)?),
                within: measures!(@name $($within)?),
                paired: measures!(@name $($paired)?),
                group: MeasureGroup::$group,
                heading: $heading,
                unit: $unit,
                digits: $digits,
                about: $about,
                score: measures!(@score [$($summary)?] [$($within)?]),
                difference: measures!(@difference $($paired)?),
            },
        )*];

        /// Success rates and deformation of a group of episodes.
        #[derive(Clone, Debug, PartialEq, Serialize)]
        pub struct GroupScores {
            /// Number of episodes, valid or not.
            pub episodes: usize,
            /// Number of episodes that were invalid or could not be run.
            pub invalid: usize,
            /// Number of valid episodes whose safety could not be judged, for lack of a threshold or of evidence.
            pub safety_unknown: usize,
            /// Number of episodes with a soft target whose deformation was not judged, for lack of a
            /// limit or of evidence.
            pub not_judged: usize,
            $($(#[doc = $about] pub $summary: measures!(@type $kind),)?)*
            /// Goal Success minus Safety Success, percentage points.
            pub goal_safe_gap: Option<f64>,
            /// Number of valid episodes in which harm to other soft bodies is unknown.
            pub others_unknown: usize,
            /// Number of episodes without Goal Success by the stage at which they ended.
            pub failed_stages: BTreeMap<TaskStage, usize>,
            pub categories: BTreeMap<EpisodeCategory, usize>,
            /// Number of episodes of the category "over the limit" in which the object was crushed.
            pub crushed_over_limit: usize,
            /// Smallest and largest τ that was applied to a target, %; null without any.
            pub tau_range: Option<TauRange>,
            pub within_episodes: EpisodeDeformation,
            /// Metrics of the suite over the valid episodes that have them, by name.
            #[serde(skip_serializing_if = "BTreeMap::is_empty")]
            pub metrics: BTreeMap<String, Distribution>,
        }

        /// The course of D within episodes, each the mean over the valid ones that have it; null without any.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
        pub struct EpisodeDeformation {
            $($(#[doc = $about] pub $within: Option<f64>,)?)*
        }

        /// Differences of the second run from the first. An invalid episode succeeds at nothing and has no deformation.
        ///
        /// A quantity is compared over the pairs in which both episodes have it.
        #[derive(Clone, Debug, PartialEq, Serialize)]
        pub struct PairedComparison {
            /// Number of episodes that both runs have.
            pub pairs: usize,
            /// Number of those that are invalid in at least one run.
            pub invalid_pairs: usize,
            $($(#[doc = $about] pub $paired: PairedDifference,)?)*
            /// Stages at which episodes without Goal Success ended; invalid ones included.
            pub failed_stages: PairedStages,
            /// Metrics of the suite that both runs have, by name.
            #[serde(skip_serializing_if = "BTreeMap::is_empty")]
            pub metrics: BTreeMap<String, PairedDifference>,
        }

        impl GroupScores {
            pub(crate) fn new(episodes: &Episodes<'_>) -> Self {
                let mut scores = Self {
                    $($($summary: $kind($value).score(episodes, MeasureGroup::$group),)?)*
                    within_episodes: EpisodeDeformation {
                        $($($within: $kind($value).score(episodes, MeasureGroup::$group).mean,)?)*
                    },
                    episodes: episodes.records.len(),
                    invalid: episodes.records.len() - episodes.valid().count(),
                    safety_unknown: episodes.valid().filter(|r| !r.verdict.safety_known).count(),
                    not_judged: episodes.soft().filter(|r| !r.is_deformation_judged()).count(),
                    goal_safe_gap: None,
                    others_unknown: episodes.valid().filter(|r| r.verdict.others_ok.is_none()).count(),
                    failed_stages: counts(episodes.records.iter().filter_map(|r| r.verdict.failed_stage)),
                    categories: counts(episodes.records.iter().map(|r| r.category())),
                    crushed_over_limit: episodes.records.iter().filter(|r| r.is_crushed_over_limit()).count(),
                    tau_range: TauRange::new(episodes.soft()),
                    metrics: episodes.metrics(),
                };
                let [goal, safety] = [scores.goal_success_rate, scores.safety_success_rate].map(|of| of.rate);
                scores.goal_safe_gap = goal.zip(safety).map(|(goal, safety)| goal - safety);
                scores
            }
        }

        impl PairedComparison {
            pub fn from_pairs(pairs: &[EpisodePair<'_>]) -> Self {
                let pairs = Pairs { pairs };
                Self {
                    pairs: pairs.pairs.len(),
                    invalid_pairs: pairs.records().filter(|pair| pair.iter().any(|r| !r.outcome.is_valid())).count(),
                    $($($paired: $kind($value).difference(&pairs),)?)*
                    failed_stages: PairedStages::new(pairs.records().map(|pair| pair.map(|r| r.verdict.failed_stage))),
                    metrics: pairs.metrics(),
                }
            }
        }
    };
    (@type Success) => { Rate };
    (@type SafeSuccess) => { Rate };
    (@type SoftSuccess) => { Option<Rate> };
    (@type KnownFact) => { Option<Rate> };
    (@type Fault) => { Rate };
    (@type Amount) => { Distribution };
    (@type RankedAmount) => { Distribution };
    (@score [] []) => { |_| None };
    (@score [$summary:ident] []) => { |scores| Some(Score::from(scores.$summary)) };
    (@score [] [$within:ident]) => { |scores| Some(Score::Mean(scores.within_episodes.$within)) };
    (@difference) => { |_| None };
    (@difference $paired:ident) => { |paired| Some(paired.$paired) };
    (@name) => { None };
    (@name $name:ident) => { Some(stringify!($name)) };
}

measures! {
    Success(|r| r.verdict.goal) in tsr,
        Success, "TSR", 1, "%", "Task success rate: the same as `goal_success_rate`.";
    SoftSuccess(EpisodeRecord::is_deformation_safe) in dsr vs dsr,
        Success, "DSR", 1, "%", "Goal Success with `d_peak` ≤ τ of each soft target, dropped or not.";
    Success(|r| r.verdict.goal) in goal_success_rate vs goal,
        Success, "Goal", 1, "%", "Goal Success.";
    Success(|r| r.verdict.no_drop) in no_drop_rate vs no_drop,
        Success, "NoDrop", 1, "%", "No target was dropped.";
    SoftSuccess(|r| r.is_within_limits() == Some(true)) in deformation_ok_rate,
        Success, "D within τ", 1, "%", "`d_peak` ≤ τ of each soft target.";
    SafeSuccess(|r| r.verdict.safety) in safety_success_rate vs safety,
        Success, "Safety", 1, "%", "Safety Success.";
    Success(|r| r.verdict.no_slip) in no_slip_rate,
        Grip, "NoSlip", 1, "%", "No target slid along a pad by more than the limit.";
    Success(|r| r.verdict.contact_success) in contact_success_rate vs contact_success,
        Grip, "contact success", 1, "%", "Contact success: Goal Success with contact of both pads throughout the carry.";
    SafeSuccess(|r| r.verdict.contact_safety) in contact_safety_rate vs contact_safety,
        Grip, "contact safety", 1, "%", "Contact success with Safety Success and NoSlip.";
    Success(|r| r.verdict.gentle) in gentle_rate vs gentle,
        Grip, "gentle", 1, "%", "Goal Success with a grip ratio of at most 2 (`criteria.gentle_ratio`).";
    Amount(|r| r.verdict.object().grip_ratio) in grip_ratio vs grip_ratio,
        Grip, "grip ratio", 1, "", "Largest force on a pad over the least that holds the object on its path, where it was carried.";
    Success(|r| r.verdict.goal_v1) in goal_v1_rate,
        OtherRule, "Goal v1", 1, "%", "Goal Success by the looser predicate of SoftVTBench's released code.";
    Fault(|r| r.outcome.is_valid() && r.verdict.wrong_instance) in wrong_instance_rate,
        Harm, "wrong object first", 1, "%", "Another object than a target was lifted first.";
    KnownFact(|r| r.verdict.others_ok) in others_ok_rate vs others_ok,
        Harm, "others within τ", 1, "%", "No other soft body exceeded its own τ, of the valid episodes in which that is known.";
    Fault(|r| r.verdict.first_wrong_contact.is_some()) in wrong_contact_rate vs wrong_contact,
        Harm, "touched others", 1, "%", "The robot touched a movable object other than the target; fewer are better.";
    Amount(EpisodeRecord::d_over_tau) in d_over_tau vs d_over_tau,
        Deformation, "D/limit", 2, "", "`d_peak` over τ, of the target for which it is largest.";
    RankedAmount(EpisodeRecord::d_peak) in deformation vs d_peak,
        Deformation, "D peak", 2, "%", "Largest `d_peak` of a target; invalid episodes rank as worst.";
    Amount(|r| r.d_peak().filter(|_| r.verdict.goal)) in deformation_goal,
        Deformation, "D peak at goal", 2, "%", "The same over the episodes with Goal Success.";
    Amount(|r| r.verdict.object().d_mean) within d_mean vs d_mean,
        Deformation, "D mean", 2, "%", "Mean D of the object over all physics steps.";
    Amount(|r| r.verdict.object().d_final) within d_final vs d_final,
        Deformation, "D final", 2, "%", "D of the object at the end.";
    Amount(|r| r.verdict.object().d_p95) within d_p95 vs d_p95,
        Deformation, "D P95", 2, "%", "95th percentile of the D of the object over all physics steps.";
    Amount(EpisodeRecord::time_over_tau_s) within time_over_tau_s vs time_over_tau_s,
        Deformation, "time over τ", 2, "s", "Longest time for which a target was over its τ.";
    Amount(EpisodeRecord::collapsed_volume_pct) in collapsed_volume vs collapsed_volume_pct,
        Volume, "collapsed", 1, "%", "Largest share of the volume of a target beyond its collapse strain at one time.";
    Amount(EpisodeRecord::damaged_volume_pct) in damaged_volume vs damaged_volume_pct,
        Volume, "damaged", 1, "%", "Largest share of the volume of a target that was ever beyond its damage strain.";
}

fn counts<K: Ord>(keys: impl Iterator<Item = K>) -> BTreeMap<K, usize> {
    let mut counts = BTreeMap::new();
    keys.for_each(|key| *counts.entry(key).or_insert(0) += 1);
    counts
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The table of the measures in `docs/results.md`.
    fn page() -> String {
        let key =
            |name: Option<&str>, path: &str| name.map_or_else(String::new, |name| format!("`{path}{name}`"));
        let row = |measure: &Measure| {
            let Measure { summary, within, paired, unit, about, .. } = measure;
            let summary = key(*summary, "") + &key(*within, "within_episodes.");
            format!("| {summary} | {} | {unit} | {about} |\n", key(*paired, ""))
        };
        let rows: String = MEASURES.iter().map(row).collect();
        format!("| summary.json | compare | unit | meaning |\n|---|---|---|---|\n{rows}")
    }

    #[test]
    fn the_page_of_results_has_every_measure() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/results.md");
        let text = std::fs::read_to_string(path).expect("the page");
        let (before, rest) = text.split_once("<!-- measures:begin -->\n").expect("its begin");
        let (_, after) = rest.split_once("<!-- measures:end -->").expect("its end");
        let written = format!("{before}<!-- measures:begin -->\n{}<!-- measures:end -->{after}", page());
        if std::env::var_os("SOFTVT_WRITE_DOCS").is_some() {
            std::fs::write(path, &written).expect("written");
        }
        assert!(
            std::fs::read_to_string(path).expect("the page") == written,
            "docs/results.md differs; run .ci/regenerate measures"
        );
    }

    #[test]
    fn keys_are_those_of_the_files_and_names_fit_into_tables() {
        let scores = serde_json::to_value(GroupScores::from_records(&[])).unwrap();
        let paired = serde_json::to_value(PairedComparison::from_pairs(&[])).unwrap();
        for measure in MEASURES {
            assert!(measure.summary.is_none_or(|key| scores.get(key).is_some()), "{measure:?}");
            assert!(
                measure.within.is_none_or(|key| scores["within_episodes"].get(key).is_some()),
                "{measure:?}"
            );
            assert!(measure.paired.is_none_or(|key| paired.get(key).is_some()), "{measure:?}");
            assert!(measure.paired.is_none() || measure.label().chars().count() <= 18, "{measure:?}");
        }
    }
}
