//! Running what a script asks for: episodes, experts and experiments.

pub(crate) mod controller;
pub(crate) mod episode;
pub(crate) mod experiment;
pub(crate) mod expert;
pub(crate) mod reachability;
pub(crate) mod timing;
