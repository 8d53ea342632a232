//! Episodes on a local web page: a scene to look around in, both tactile pictures, and what the judge measures, while
//! an episode is simulated and afterwards.
//!
//! A [`Watch`] has one thread that simulates the episode that was asked for last and appends a message for every
//! control step to a feed; a server answers the requests of browsers in a thread each, and sends the feed to each open
//! page over a websocket. A script that is saved again starts its episode again.
#![warn(unreachable_pub)]

mod feed;
mod geometry;
mod menu;
mod message;
mod page;
mod server;
mod stage;
mod state;
mod teleop;

pub use server::Watch;
pub use stage::{Program, Selection};
