//! What Linux 6.6 does with a netem (`net/sched/sch_netem.c`), draw for draw.
//!
//! A [`Qdisc`] is the queueing discipline on a device of infinite speed, without a child and at the root: offer it packets with
//! [`Qdisc::enqueue`], take what leaves with [`Qdisc::dequeue`]. With the same `seed` it makes the same decisions as the kernel, except for what the
//! kernel does not draw from its seeded generator (below). Written anew from formulas and facts; no code of the kernel is in it.
//!
//! # What happens to a packet
//!
//! 1. A draw decides whether it is duplicated, the next whether it is lost (or marked, with `ecn`). **One that is duplicated and lost passes once.**
//! 2. The copy goes through all of this again before the packet goes on, with draws of its own and without being duplicated.
//! 3. A draw decides whether one of its bits is flipped.
//! 4. If `limit` packets are held already, **those under way included**, it is dropped.
//! 5. If its turn to be reordered has come and the draw says so, it leaves at once: before all others, past rate and slots.
//! 6. Else its time to leave is now + delay; with a rate, max(now + delay, the latest time to leave of those held) + transmission time: **the
//!    serialiser stands behind the delay**, where it undoes jitter.
//! 7. It leaves at its time, in the order of the times, equal times in the order of arrival; with slots, when one is open.
//!
//! # Random numbers
//!
//! [`Prng`] is the kernel's, seeded by `seed` of the words or of [`Qdisc::new`]. The kernel takes three things from its unseeded generator: where the
//! flipped bit is, the gap between slots that have no distribution, and the first value of every correlated sequence. Here these come from
//! a SplitMix64 (Steele, Lea & Flood 2014), seeded by the seed of [`Qdisc::new`] alone.
//!
//! # What `tc` does on the way
//!
//! The numbers are those that `tc` of iproute2 6.6 hands over: probabilities of 32 bits, a delay and jitter of whole microseconds and then
//! of whole ticks of 64 ns, both rounded down, jitter of at most 2.147483647 s. It forgets the correlation of `duplicate` unless delay, random
//! loss, corrupt or reorder has one too.
//!
//! # Parts left out
//!
//! Segmentation offload (a packet is a packet), a child or parent qdisc, a device that is slow or stops, timers that are late.

mod airtime;
mod built_in;
mod correlated;
mod loss;
mod parameters;
mod prng;
mod qdisc;
mod slot;
mod table;
mod time_fifo;

pub use prng::Prng;
pub use qdisc::{Dequeued, DropReason, FlippedBit, Output, Qdisc, QdiscError};
pub use table::Table;

#[cfg(test)]
mod tests;
