//! The words: which are read, which are refused and where, and that printing and reading are inverse.

mod exact;
mod exact_line;
mod grammar;
mod refusals;
pub(in crate::netem) mod round_trip;
