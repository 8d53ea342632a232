//! One file per command. Commands do not use each other; what they share is in [`super::run`].

pub(crate) mod check;
pub(crate) mod compare;
pub(crate) mod dataset;
pub(crate) mod doctor;
pub(crate) mod init;
pub(crate) mod list;
pub(crate) mod merge;
pub(crate) mod record;
pub(crate) mod replay;
pub(crate) mod report;
pub(crate) mod run;
pub(crate) mod serve;
pub(crate) mod view;
