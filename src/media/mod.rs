//! Drawing on images ([`canvas`]), plots as SVG ([`chart`], [`plot`], [`multiples`], [`log_plot`], [`histogram`]) of
//! the same elements ([`svg`]), axes ([`ticks`]) and colours ([`palette`]), and files of moving pictures ([`video`],
//! [`animation`]).
#![warn(missing_docs, unreachable_pub)]

pub mod animation;
pub mod canvas;
pub mod chart;
pub mod histogram;
pub mod log_plot;
pub mod multiples;
pub mod palette;
pub mod plot;
pub mod svg;
pub mod ticks;
pub mod video;
