//! Fourier transforms of padded fields ([`fourier`]) and resizing of images ([`resize`]).
//!
//! The libraries behind them are generic: each crate that calls them compiles thousands of their functions, and so do
//! the unit tests of that crate. Here this happens once. Nothing in this crate is generic, and its tests are in a crate
//! of their own.
#![warn(missing_docs, unreachable_pub)]

pub mod fourier;
pub mod resize;
