//! A server through which clients control episodes: reset, step, render, get and set the state. The protocol
//! is described in `docs/serve.md`.

mod catalog;
mod connection;
mod episode_state;
mod live_episode;
mod request;
mod response;
mod server;
mod session;
mod spaces;

pub use catalog::{RequestError, ServedSuite, ServerConfig};
pub use response::hello;
pub use server::{Server, serve};
