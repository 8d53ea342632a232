//! Drawing on images ([`canvas`]), and video files ([`video`]).
#![warn(unreachable_pub)]

pub mod canvas;
pub mod video;
