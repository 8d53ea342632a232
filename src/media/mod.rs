//! Drawing on images ([`canvas`]), and video files ([`video`]).
#![warn(missing_docs, unreachable_pub)]

pub mod canvas;
pub mod video;
