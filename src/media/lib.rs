//! Charts ([`chart`]) with their axes ([`axis`], [`d_axis`]) as elements of a drawing ([`drawing`]), which SVG images
//! ([`svg`]) and pixels ([`canvas`]) show in the colours of all results ([`palette`]); files of images ([`jpeg`]) and
//! of moving pictures ([`video`], [`animation`]).
#![warn(unreachable_pub)]

pub mod animation;
pub mod axis;
pub mod canvas;
pub mod chart;
pub mod d_axis;
pub mod drawing;
pub mod jpeg;
pub mod palette;
pub mod svg;
pub mod video;
