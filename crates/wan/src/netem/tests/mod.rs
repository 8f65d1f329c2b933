//! The words: what is read, what is refused and where, and that printing and reading are inverse.

mod grammar;
mod refusals;
mod round_trip;
