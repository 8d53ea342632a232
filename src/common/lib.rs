//! What all layers share: the identity of an episode ([`episode_id`]), the flag that ends long loops ([`cancel`]), a
//! [`disk_cache`], SHA-256 ([`digest`]), atomic [`files`], files of finished work ([`journal`]), declarations of
//! [`settings`](mod@settings), numpy files ([`npy`]), jobs on threads ([`parallel`]), ranges of numbers ([`range`]),
//! [`table`]s, and numbers and [`text`] in messages.
#![warn(unreachable_pub)]

pub mod cancel;
pub mod digest;
pub mod disk_cache;
pub mod episode_id;
pub mod files;
pub mod journal;
pub mod npy;
pub mod parallel;
pub mod range;
pub mod settings;
pub mod table;
pub mod text;
