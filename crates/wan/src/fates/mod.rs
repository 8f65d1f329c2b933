//! Fates of packets: their names, records, counters, and logs.

pub(crate) mod fate;
pub(crate) mod log;
pub(crate) mod record;
pub(crate) mod stats;
