//! TCP as Linux does it, as a state machine without sockets or clock.
//!
//! Use this crate if a test or a simulation of yours wants real TCP in virtual time: handshakes, retransmissions, congestion control, windows, resets and
//! their errors, to the nanosecond and the same on every run.
//!
//! A [`Connection`] is one end of a TCP connection. Time is an argument of its calls. The owner of a connection hands arrived segments to
//! [`Connection::handle_segment`], takes segments to send from [`Connection::poll_transmit`], and calls [`Connection::handle_timeout`] at the instant that
//! [`Connection::poll_timeout`] returns. The program that uses the connection calls [`Connection::read`], [`Connection::write`], [`Connection::shutdown`]
//! and [`Connection::close`]. [`Segment::to_packet`] writes a real IP packet, [`Segment::parse`] reads a real IP packet. [`TcpConfig`] holds every constant.
//!
//! The crate implements RFC 9293 (TCP), 5961 (resets with an inexact sequence number), 7323 (timestamps, large windows), 6298 (timeouts), 5681 and 6582
//! (Reno, NewReno), 2018, 2883 and 6675 (selective acknowledgements), 6937 (rate reduction), 8985 (RACK-TLP), 9438 (CUBIC, with `HyStart`), 3168 (ECN) and 8257
//! (DCTCP, with differences from Linux that [`CongestionControl::Dctcp`] names).
//! Where an RFC leaves a choice, the crate chooses as Linux does. The crate leaves out urgent data, ICMP, path MTU discovery, Fast Open, pacing and F-RTO.
//! Listeners belong to the owner of the connections, because the owner knows the ports: the owner makes a connection of a SYN with
//! [`Connection::accept`], and counts the connections that no program has accepted yet.
//!
//! ```
//! use cohaptic_tcp::{Connection, TcpConfig};
//! use cohaptic_units::Instant;
//!
//! let (client, server) = ("10.0.0.1:50000".parse()?, "10.0.0.2:80".parse()?);
//! let mut now = Instant::ZERO;
//! let mut a = Connection::connect(now, TcpConfig::default(), client, server, 1)?;
//! let syn = a.poll_transmit(now).expect("the SYN leaves at once");
//!
//! now = Instant::from_nanos(10_000_000);
//! let mut b = Connection::accept(now, TcpConfig::default(), &syn, 2)?;
//! a.handle_segment(now, &b.poll_transmit(now).expect("the answer"));
//! assert_eq!(a.write(b"hello")?, 5);
//! while let Some(segment) = a.poll_transmit(now) {
//!     b.handle_segment(now, &segment);
//! }
//! let mut text = [0; 8];
//! assert_eq!(b.read(&mut text)?, 5);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![cfg_attr(not(test), no_std)]
#![cfg_attr(test, allow(clippy::float_cmp, clippy::cast_precision_loss, reason = "tests compare exact values and count samples"))]

extern crate alloc;

mod assembler;
mod config;
mod congestion;
mod connection;
mod error;
mod flight;
mod info;
mod memory;
mod pace;
mod ranges;
mod rtt;
mod scoreboard;
mod segment;
mod send_buffer;
mod sequence;
mod tuning;

pub use config::{ConfigError, CongestionControl, EcnFallback, Keepalive, TcpConfig};
pub use connection::Connection;
pub use error::Error;
pub use flight::Flight;
pub use info::{CaState, Info, State};
pub use segment::{Ecn, Flags, Options, ParseError, Payload, SackBlocks, Segment};

/// Compiles and runs the code blocks of the README as doc tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
