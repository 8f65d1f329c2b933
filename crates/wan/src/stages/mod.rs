//! Stages of a link. Each file holds one impairment: its parameters with their checks, and the stage with the impairment's state.
//!
//! [`config`] lists the stages in their order on a packet's way.

pub(crate) mod config;
pub(crate) mod corruption;
pub(crate) mod delay;
#[allow(dead_code, reason = "the list may need only a part of it")]
pub(crate) mod impairment;
#[allow(dead_code, unused_imports, reason = "the list may be empty")]
pub(crate) mod list;
pub(crate) mod loss;
pub(crate) mod modulation;
pub(crate) mod order;
pub(crate) mod outage;
pub(crate) mod path_trace;
pub(crate) mod queue;
pub(crate) mod reorder;
pub(crate) mod slots;
pub(crate) mod spike;
