//! Scores of an episode: deformation, drop, slip, goal, safety, calibration and statistics.
//!
//! Everything here is a small pure function or state machine on plain numbers; the simulator is one source of
//! them, a motion-capture system could be another. [`judge::Judge`] takes one [`evidence::Evidence`] per
//! physics step and returns a [`record::Verdict`] at the end. Verdicts go into [`record::EpisodeRecord`]s, and
//! those into a [`summary::SuiteSummary`].
//!
//! | question | module |
//! |---|---|
//! | How deformed is a soft body? | [`deformation`] |
//! | Does the target rest at its goal, released? | [`goal`] |
//! | Was the object dropped, or released on purpose? | [`drop`](mod@drop) |
//! | How far did it slide in the grasp? | [`slip`] |
//! | Goal, NoDrop and deformation limit together | [`safety`] |
//! | Where does the limit τ of an asset come from? | [`calibration`], [`thresholds`], [`envelope_plot`] |
//! | Every threshold of the judge | [`criteria`] |
//! | Rates, intervals, paired tests | [`statistics`], [`paired_stats`], [`summary`] |
//!
//! The metrics are those of SoftVTBench; `docs/decisions.md` lists the choices made where the paper is silent.

pub mod calibration;
pub mod criteria;
pub mod deformation;
pub mod drop;
pub mod envelope_plot;
pub mod episode_id;
pub mod evidence;
pub mod goal;
pub mod judge;
pub mod paired_stats;
pub mod record;
pub mod safety;
pub mod slip;
pub mod statistics;
pub mod summary;
pub mod thresholds;
