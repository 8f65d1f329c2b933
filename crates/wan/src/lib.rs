//! A wide-area network emulated as pure state machines.
//!
//! Use this crate if a program of yours wants delays, losses, queues or reordering, in virtual time or by a clock of its own.
//!
//! A [`Link`] takes packets in at an instant and gives them back later, twice, damaged, or not at all: it is a chain of impairments (outage, loss,
//! duplication, corruption, a token bucket, a bottleneck with a finite queue, slots, reordering, propagation delay with jitter, an order policy), each in a
//! file of its own. A [`LinkModel`] is one such chain, several in turn, a recording, or Linux's netem to the bit. A [`Network`] is directed links and shared
//! access lines between N nodes over one event queue. Every packet has a [`Fate`], and every fate a counter, so at every instant
//!
//! ```text
//! offered + duplicated = delivered + dropped (by cause) + in flight
//! ```
//!
//! Time is an argument: nothing here reads a clock, opens a socket, or draws a random number that has no address (see [`random`]). Equal seeds and equal calls
//! give equal answers on every platform. This crate does not know what travels in the packets.
//!
//! Read [`LinkConfig`] first, then [`Link`]. [`netem`] reads the words of `tc-netem`.
//!
//! ```
//! use bytes::Bytes as Payload;
//! use cohaptic_units::{Bytes, Instant, parse};
//! use cohaptic_wan::{Delay, Link, LinkConfig, LinkName};
//!
//! let config = LinkConfig { delay: Delay::constant(parse::duration("24ms")?), ..LinkConfig::default() };
//! let mut link = Link::new(1, &LinkName::between("left", "right"), config);
//!
//! link.handle_packet(Instant::ZERO, Bytes::new(64), Payload::from_static(b"a sample"))?;
//! let arrival = link.poll_timeout().expect("one packet is on the way");
//! assert_eq!(arrival, Instant::from_nanos(24_000_000));
//!
//! link.handle_timeout(arrival)?;
//! let delivered = link.poll_event().expect("it has arrived");
//! assert_eq!(delivered.payload, "a sample");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![cfg_attr(not(test), no_std)]
#![cfg_attr(
    test,
    allow(
        clippy::float_cmp,
        clippy::cast_precision_loss,
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        clippy::single_range_in_vec_init,
        reason = "tests compare exact values, count samples, and list spans"
    )
)]

extern crate alloc;

pub mod delay_table;
mod event_queue;
mod fates;
mod laws;
mod line;
mod link;
pub mod netem;
mod network;
mod packet;
pub mod parameters;
pub mod random;
mod ring;
mod stages;

pub use event_queue::{Event, EventQueue};
pub use fates::damage::Damage;
pub use fates::fate::{DropCause, Fate};
pub use fates::log::{FateLog, FateLogError, FateLogReader, FateRow};
pub use fates::record::{PacketEvent, PacketRecord, PathPart};
pub use fates::stats::{CrossCounts, LinkStats};
pub use laws::chance::{Chance, ChanceError};
pub use laws::delay as law;
pub use laws::delay::distribution::Distribution;
pub use laws::normal::standard_normal;
pub use laws::sojourn::Sojourn;
pub use line::filter::Offered;
pub use line::model::{KernelNetem, LINK_KIND_PARAMETERS, LinkModel};
pub use line::name::LinkName;
pub use line::pipeline::TimeWentBack;
pub use link::Link;
pub use network::direct_links::{Arrivals, DirectLinks};
pub use network::id::{LinkId, NodeId, Path};
pub use network::stepped_links::SteppedLinks;
pub use network::{AccessLine, MOST_NODES, Network, NetworkConfig, NetworkError, TakeArrival};
pub use packet::{PacketInfo, flow_number};
pub use ring::Ring;
pub use stages::config::{LINK_PARAMETERS, Layout, LinkConfig};
pub use stages::corruption::{Checksum, Corruption, Flips};
pub use stages::delay::{Correlation, Delay, DelayError, Jitter};
pub use stages::impairment::{ExtraDelay, ParameterValue, Refusal, Values};
pub use stages::list::Impairments;
pub use stages::loss::{Bursts, Counts, FourState, FourStateError, GilbertElliott, GilbertElliottInTime, Loss, NoTime, Pattern, PatternError};
pub use stages::modulation::{MODULATOR, Modulated, Modulator, ModulatorError, ModulatorState};
pub use stages::order::Order;
pub use stages::outage::{IdleOutages, Outage, Outages, OutagesError, RandomOutages};
pub use stages::path_trace::{Between, PathTrace, PathTraceError};
pub use stages::queue::{
    Bottleneck, Cells, CoDel, CrossRecording, CrossRecordingError, CrossTraffic, CrossTrafficError, DeliveryTrace, DeliveryTraceError, Discipline,
    DualPi2, FqCoDel, Framing, Load, MAHIMAHI_BYTES, OnOff, Peak, Pie, Poisson, QueueLimit, Red, RedError, Service, TokenBucket,
};
pub use stages::reorder::{Displacement, Reorder};
pub use stages::slots::{SlotGap, Slots, SlotsError};

/// Runs the code of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
