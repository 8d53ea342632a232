//! Episodes for somebody else to drive over a network: reset, step, render, get and set the state. `docs/serve.md` is the
//! protocol.

mod catalog;
mod connection;
mod fields;
mod live_episode;
mod request;
mod response;
mod server;
mod session;
mod space;
mod state;

pub use catalog::{EpisodeId, ServedSuite, ServerConfig, split_named};
pub use response::hello;
pub use server::{Server, serve};
