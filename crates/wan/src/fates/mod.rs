//! Fates of packets: their names, records, damage, counters, and logs.

pub(crate) mod damage;
pub(crate) mod fate;
pub(crate) mod log;
pub(crate) mod record;
pub(crate) mod stats;
