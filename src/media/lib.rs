//! Drawing on images ([`canvas`]), plots as SVG ([`chart`], [`plot`], [`multiples`], [`log_plot`], [`histogram`]) of
//! the same elements ([`svg`]), axes ([`ticks`]), labels of curves ([`labels`]) and colours ([`palette`]), files of
//! images ([`jpeg`]) and of moving pictures ([`video`], [`animation`]).
#![warn(missing_docs, unreachable_pub)]

pub mod animation;
pub mod canvas;
pub mod chart;
pub mod histogram;
pub mod jpeg;
pub mod labels;
pub mod log_plot;
pub mod multiples;
pub mod palette;
pub mod plot;
pub mod svg;
pub mod ticks;
pub mod video;
