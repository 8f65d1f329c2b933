//! The ends of packets: their names, their records, their counters, and logs of them.

pub(crate) mod fate;
pub(crate) mod log;
pub(crate) mod record;
pub(crate) mod stats;
