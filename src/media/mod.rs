//! Drawing on images ([`canvas`]), plots ([`plot`], [`log_plot`]) and video files ([`video`]).
#![warn(missing_docs, unreachable_pub)]

pub mod canvas;
pub mod log_plot;
pub mod plot;
pub mod video;
