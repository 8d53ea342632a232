//! Functions for all layers: atomic [`files`], numpy files ([`npy`]), jobs on threads ([`parallel`]), numbers and [`text`]
//! in messages.
#![warn(missing_docs, unreachable_pub)]

pub mod files;
pub mod npy;
pub mod parallel;
pub mod text;
