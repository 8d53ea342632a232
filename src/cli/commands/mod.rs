//! One file per command. Commands do not use each other; what they share is in [`super::run`].

pub(super) mod check;
pub(super) mod compare;
pub(super) mod dataset;
pub(super) mod doctor;
pub(super) mod init;
pub(super) mod list;
pub(super) mod merge;
pub(super) mod record;
pub(super) mod replay;
pub(super) mod report;
pub(super) mod run;
pub(super) mod serve;
pub(super) mod view;
