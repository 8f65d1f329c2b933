//! The behaviour of Linux 6.6 with a netem (`net/sched/sch_netem.c`), draw for draw.
//!
//! A link of this model ([`KernelNetem`](crate::KernelNetem)) is the queueing discipline on a device of infinite speed, without a child and at the root. With
//! the same `seed` the decisions are the decisions of the kernel, except for values from the kernel's unseeded generator (below). The code was written anew
//! from formulas and facts, and contains no code of the kernel.
//!
//! # The way of a packet
//!
//! 1. A draw decides whether the packet is duplicated, and the next draw whether it is lost (or marked, with `ecn`). **A packet that is both duplicated and
//!    lost passes once.**
//! 2. The copy goes through all of these steps before the packet goes on, with draws of its own and without being duplicated.
//! 3. A draw decides whether one bit of the packet is flipped.
//! 4. If `limit` packets are held already, **packets in propagation included**, the packet is dropped.
//! 5. If the packet is a candidate for reordering and the draw says so, the packet leaves at once: before all other packets, past rate and slots.
//! 6. Otherwise the packet's time to leave is now + delay. With a rate, the time is max(now + delay, the latest time to leave of the packets held) +
//!    transmission time: **the serialiser comes after the delay**, and undoes jitter.
//! 7. The packet leaves at its time, in the order of times, and of arrival for equal times. With slots, the packet leaves when a slot is open.
//!
//! # Random numbers
//!
//! [`Prng`] is the kernel's generator, seeded by `seed` of the words or else by the seed of the link. The kernel takes three values from its unseeded
//! generator: the place of a flipped bit, the gap between slots without a distribution, and the first value of every correlated sequence. Here these values
//! come from a SplitMix64 (Steele, Lea & Flood 2014), seeded by the seed of the link alone.
//!
//! # Rounding by `tc`
//!
//! The numbers are the ones that `tc` of iproute2 6.6 hands over: probabilities of 32 bits, delay and jitter in whole microseconds and then in whole ticks of
//! 64 ns, both rounded down, and jitter of at most 2.147483647 s. `tc` forgets the correlation of `duplicate` unless delay, random loss, corrupt or reorder
//! has a correlation too.
//!
//! # Parts left out
//!
//! Segmentation offload (each packet is a single packet), a child or parent qdisc, a slow or stopping device, and late timers.

mod airtime;
mod correlated;
mod loss;
mod parameters;
mod prng;
mod qdisc;
mod slot;
mod table;
mod time_fifo;

pub use parameters::QdiscError;
pub use prng::Prng;
pub use table::Table;

pub(crate) use qdisc::{DropReason, Output, Qdisc};

#[cfg(test)]
mod tests;
