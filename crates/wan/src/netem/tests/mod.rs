//! Tests of the words: words that are read, words that are refused and where the error points, and printing as the inverse of reading.

mod exact;
mod exact_line;
mod grammar;
mod refusals;
pub(in crate::netem) mod round_trip;
