//! Fuzz targets of everything that reads bytes of others: datagrams, packets, files, requests.
//!
//! Each module has one function, `run`, which hands bytes to a reader and checks what the reader promises. A broken promise is a panic. `targets` makes a program
//! of each module for libFuzzer, and `run` beside this folder's manifest runs them. Structured targets take the bytes as a sequence of actions: see [`Input`].
#![allow(clippy::unwrap_used, clippy::panic, clippy::expect_used, reason = "a target fails by a panic")]

pub mod admission;
pub mod captures;
pub mod http;
mod input;
mod internet;
pub mod inverse3;
pub mod measurements;
pub mod netem;
pub mod offload;
pub mod relay;
pub mod router;
pub mod scene;
#[cfg(test)]
mod seeds;
pub mod tcp;
pub mod tcp_segment;
pub mod websocket;
pub mod wire;

pub use input::Input;

/// A target: its name, which is that of its module and of its folder of seeds, and its function.
pub type Target = (&'static str, fn(&[u8]));

/// All targets.
pub const TARGETS: [Target; 14] = [
    ("admission", admission::run),
    ("captures", captures::run),
    ("http", http::run),
    ("inverse3", inverse3::run),
    ("measurements", measurements::run),
    ("netem", netem::run),
    ("offload", offload::run),
    ("relay", relay::run),
    ("router", router::run),
    ("scene", scene::run),
    ("tcp", tcp::run),
    ("tcp_segment", tcp_segment::run),
    ("websocket", websocket::run),
    ("wire", wire::run),
];
