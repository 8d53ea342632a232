//! Judging: deformation, drop and slip, goal, safety, calibration and statistics. Small pure functions on plain numbers.
//!
//! One [`judge::Judge`] watches one episode: it is shown an [`evidence::Evidence`] after every physics step and gives a
//! [`judge::Verdict`] at the end. [`record::EpisodeRecord`]s gather into a [`summary::Summary`].

pub mod calibration;
pub mod deformation;
pub mod difference;
pub mod drop;
pub mod evidence;
pub mod goal;
pub mod judge;
pub mod paired;
pub mod record;
pub mod rules;
pub mod safety;
pub mod slip;
pub mod statistics;
pub mod summary;
pub mod thresholds;
