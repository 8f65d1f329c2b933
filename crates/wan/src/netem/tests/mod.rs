//! The words: what is read, what is refused and where, and that printing and reading are inverse.

mod exact;
mod exact_line;
mod grammar;
mod refusals;
pub(in crate::netem) mod round_trip;
