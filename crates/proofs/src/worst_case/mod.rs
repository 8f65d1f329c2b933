//! The worst case over patterns that are bounded but otherwise unknown: "at most m losses in a row", "a delay anywhere in this range".
//!
//! A frame multiplies the state by one of a few matrices, depending on the losses and delays in the frame. A [`Pattern`](pattern::Pattern) says which sequences
//! of frames the network can produce. A pattern with the matrices is an [`Automaton`], and the fastest growth over all its sequences is the *joint spectral
//! radius* of the automaton. Below 1, every allowed pattern lets disturbances die out. Above 1, some allowed pattern makes disturbances grow;
//! [`WorstCase::cycle`](gripenberg::WorstCase::cycle) is such a pattern.
//!
//! ```text
//!            certified from below                     certified from above
//!   a pattern that repeats: its spectral radius   <=  ρ  <=  norms of products (gripenberg), a quadratic certificate (verified)
//! ```
//!
//! Worst case and mean square are different questions with different answers. Let a state x be halved when a packet arrives and multiplied by 1.5 when a packet
//! is lost, with probability 0.2. Then E\[x²\] is multiplied by 0.8·0.25 + 0.2·2.25 = 0.65 in every frame, so that x is stable in the mean square. Three losses
//! and one arrival, repeated for ever, multiply x by 0.5·1.5³ = 1.69 in four frames, so that x is unstable in the worst case. Both are true, because that
//! pattern has probability zero to last for ever. A jammer, or a schedule that beats with the sampling, can produce the pattern all the same.
//!
//! Certificates are computed in floating point. Every bound covers the rounding errors of its own computation and does not depend on the search before it. The
//! computation uses only sums, products, quotients, square roots and the functions of `libm`, so that the answer is the same on every machine.

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
