//! Running plans: episodes, experts and experiments, each in virtual machines of their own.

pub(crate) mod episode;
pub(crate) mod experiment;
pub(crate) mod expert;
pub(crate) mod predicate;
