//! One line without the packets on the way through it: from a [`model`] to the least [`pipeline`] that does what the model says.

pub(crate) mod direct;
pub(crate) mod engine;
pub(crate) mod filter;
pub(crate) mod model;
pub(crate) mod name;
pub(crate) mod pipeline;
pub(crate) mod replay;
pub(crate) mod staged;
