//! A server through which clients control episodes: reset, step, render, get and set the state. The protocol
//! is described in `docs/serve.md`.
#![warn(unreachable_pub)]

/// Ends a function with an invalid request.
macro_rules! bail {
    ($($message:tt)*) => {
        return Err($crate::config::RequestError::Invalid(format!($($message)*)))
    };
}

mod attempts;
mod config;
mod connection;
mod render_budget;
mod request;
mod response;
mod server;
mod session;
mod spaces;
mod state;

pub use config::{EpisodeRecorder, RequestError, ServerConfig};
pub use response::hello;
pub use server::serve;
pub use softvt_policy::{access::AccessRules, http::listen};
