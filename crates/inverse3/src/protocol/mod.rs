//! Messages between a program and Haply's Inverse Service: JSON in text frames of a WebSocket.
//!
//! The forms come from Haply's documentation 3.5 and of the crate `haply` 1.3.1. Programs tell versions before 3.5 from later versions by [`Version`], and
//! differ in the words of [`Format`].

mod event;
mod reply;
mod request;
mod version;

pub use event::Event;
pub(crate) use reply::FASTEST;
pub use reply::{Config, Device, Flaw, Kinematics, Reply, Status};
pub use request::Request;
pub use version::{Format, Version};

/// Preset of a device whose coordinates begin in the middle of the workspace (3.5).
pub const PRESET: &str = "arm_front_centered";
