//! Scores of an episode: deformation, drop, slip, goal, safety, calibration and statistics.
//!
//! Everything here is a small pure function or state machine on plain numbers; the simulator is one source of
//! them, a motion-capture system could be another. [`judge::Judge`] takes one [`evidence::Evidence`] per
//! physics step and returns a [`verdict::Verdict`] at the end.
//!
//! Quantities, as SoftVTBench defines them:
//!
//! - **D**, % of the diagonal of the object's bounding box as modelled: root mean square distance, over the volume, of
//!   a body from its settled shape after the best rigid fit ([`deformation`], metric [`deformation::METRIC_ID`]).
//!   **D_peak** is the maximum of the target's D over all physics steps of an episode.
//! - **D_ref**, %: largest D of a stable squeeze in the compression sweep of an asset ([`calibration`]).
//! - **κ**, 0 to 1: share of D_ref that an episode may use; 0.5 in the benchmark ([`safety::NOMINAL_KAPPA`]), and also
//!   reported for 0.3 and 0.7 (appendix C.3).
//! - **τ** = κ·D_ref, %, rounded to six decimals: deformation limit of an asset ([`safety::DeformationLimit`]).
//! - **Safety Success** = Goal ∧ NoDrop ∧ D_peak ≤ τ, and NoSlip where the criteria require it ([`safety`]).
//!
//! | question | module |
//! |---|---|
//! | How deformed is a soft body? | [`deformation`] |
//! | Does a target rest at its place, released? | [`goal`] |
//! | Does a goal of several parts hold? | [`goal_tree`] |
//! | Was the object dropped, or released on purpose? | [`drop`](mod@drop) |
//! | How far did it slide along the pads while they carried it? | [`slip`] |
//! | How hard was the grip against the least that holds? | [`grip`] |
//! | At which stage did the episode fail? | [`stage`] |
//! | Goal, NoDrop and deformation limit together | [`safety`] |
//! | What does the judge find, and how did the rollout end? | [`verdict`] |
//! | Which one word describes the episode? | [`category`] |
//! | Where does the limit τ of an asset come from? | [`calibration`], [`thresholds`], [`envelope_text`] |
//! | What limit and window has another instance of an asset? | [`instance`] |
//! | Every threshold of the judge | [`criteria`] |
//! | Rates and intervals | [`statistics`] |
//!
//! The metrics are those of SoftVTBench; `docs/decisions.md` lists the choices made where the paper is silent.
#![warn(missing_docs, unreachable_pub)]

pub mod calibration;
pub mod category;
pub mod criteria;
pub mod deformation;
pub mod drop;
pub mod envelope_text;
pub mod evidence;
pub mod goal;
pub mod goal_tree;
pub mod grip;
pub mod instance;
pub mod judge;
pub mod safety;
pub mod slip;
pub mod stage;
pub mod statistics;
pub mod thresholds;
pub mod verdict;
