//! The worst case over patterns that are bounded but otherwise unknown: "at most m losses in a row", "a delay anywhere in this range".
//!
//! A frame multiplies the state by one of a few matrices, depending on what the network did in it. A [`Pattern`](pattern::Pattern) says which sequences the network can
//! produce; with the matrices it is an [`Automaton`], and the fastest growth over all its sequences is its *joint spectral radius*: below 1, every
//! allowed pattern lets disturbances die out; above 1, some allowed pattern, which [`WorstCase::cycle`](gripenberg::WorstCase::cycle) shows, makes them grow.
//!
//! ```text
//!            certified from below                     certified from above
//!   a pattern that repeats: its spectral radius   <=  ρ  <=  norms of products (gripenberg), a quadratic certificate (verified)
//! ```
//!
//! Worst case and mean square are different questions with different answers. A state x that is halved when a packet comes and multiplied by 1.5 when it
//! is lost, with probability 0.2, has E\[x²\] multiplied by 0.8·0.25 + 0.2·2.25 = 0.65 in every frame: mean-square stable. Three losses and one arrival,
//! over and over, multiply it by 0.5·1.5³ = 1.69 in four frames: as a pattern that may repeat for ever it is unstable. That pattern has probability
//! zero for ever, which is why both can be true; a jammer, or a schedule that beats with the sampling, does not know about probabilities.
//!
//! Certificates are computed in floating point: every bound carries the rounding errors of its own computation, with no trust in the search that
//! led to it. Only sums, products, quotients and roots of this crate's own are used, so that the answer is the same on every machine.

mod automaton;
mod barrier;
mod component;
mod gripenberg;
mod growth;
mod join;
mod lyapunov;
mod norm;
mod of_scene;
mod pattern;
mod root;
#[cfg(test)]
mod tests;
mod verified;

pub use automaton::AutomatonError;
pub use gripenberg::Effort;
pub use of_scene::{Links, Patterns, SceneWorstCase, SceneWorstCaseError, WorstPart, WorstVerdict, worst_case, worst_case_watched};
pub use pattern::PatternError;
