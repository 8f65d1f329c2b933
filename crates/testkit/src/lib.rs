//! Tests of networked programs over emulated bad links, in virtual time, with equal results in every run.
//!
//! Use this crate if you test a program that talks over TCP, UDP or QUIC, and want every failure again from its seed.
//!
//! A [`Testbed`] consists of hosts and the [links](wan) between them. A program that runs on a test bed has sockets with the methods of tokio's,
//! [timers](time), and hosts that crash, restart, and lose their connections. Nothing waits in real time: the clock jumps to the next event.
//!
//! ```
//! use cohaptic_testkit::{Instant, Testbed, time};
//!
//! let took = Testbed::new(["client", "server"]).links("delay 24ms").run(|bed| async move {
//!     let server = bed.host("server").bind("0.0.0.0:7").unwrap();
//!     let client = bed.host("client").bind("0.0.0.0:0").unwrap();
//!     client.send_to(b"hello", "server:7").await.unwrap();
//!     server.recv(&mut [0; 5]).await.unwrap();
//!     time::now()
//! });
//! assert_eq!(took, Instant::from_nanos(24_000_000));
//! ```
//!
//! Tests on random links and networks need the feature `strategies`, which brings proptest. Such tests shrink a network to the least impaired network on which
//! the test still fails. In `Cargo.toml`:
//!
//! ```toml
//! [dev-dependencies]
//! cohaptic-testkit = { git = "URL of this repository", features = ["strategies"] }
//! ```
//!
//! The chapter "Testing your own program over a bad network", `docs/testing.md` in the repository, is an introduction by examples.
//!
//! A failing property prints a whole `#[test]` that fails again, also after hosts and links were added to it. Its chance is repeated by the seed, or
//! replaced by [hits](hit) that name the lost packets.
//!
//! # Contents
//!
//! | what | where |
//! | --- | --- |
//! | hosts and links, and how a program is run: once, twice, recorded, on tokio | [`Testbed`] |
//! | while it runs: hosts, links, cuts, notes | [`Bed`], [`Host`], [`JoinHandle`] |
//! | datagrams, and the addresses and names of hosts | [`UdpSocket`], [`Addresses`], [`AddressPlan`], [`ToSocketAddrs`] |
#![cfg_attr(
    feature = "tcp",
    doc = "| streams, as Linux does TCP, and every constant of it | [`TcpListener`], [`TcpStream`], [`TcpSocket`], [`tcp::TcpConfig`], [`net`] |"
)]
#![cfg_attr(not(feature = "tcp"), doc = "| streams, as Linux does TCP | feature `tcp` |")]
//! | timers to the nanosecond | [`time`], [`Instant`] |
//! | what a link is: words of `tc-netem`, or a model of the emulator | [`ToLink`], [`wan`] |
#![cfg_attr(feature = "files", doc = "| links with a name, such as `starlink`, and hosts behind one | [`LibraryLink`], [`Testbed::access`] |")]
#![cfg_attr(not(feature = "files"), doc = "| links with a name, such as `starlink`, and hosts behind one | feature `files` |")]
//! | NATs and firewalls, hosts with several networks | [`Testbed::nat`], [`Testbed::firewall`], [`Testbed::interfaces`], [`Nat`] |
//! | single packets that are dropped, delayed, copied, damaged or held back | [`hit`], [`Testbed::on_packet`], [`Testbed::hit`](Testbed::hit()) |
//! | programs without sockets: state machines | [`node`] |
#![cfg_attr(feature = "strategies", doc = "| links and networks at random, which shrink to the least impaired | [`strategies`] |")]
#![cfg_attr(not(feature = "strategies"), doc = "| links and networks at random, which shrink to the least impaired | feature `strategies` |")]
//! | programs whose sockets are tokio's, unchanged, with their dependencies | feature `facade`, `docs/how-to-existing-program.md` in the repository |
#![cfg_attr(feature = "quinn", doc = "| unmodified QUIC endpoints | [`quinn`](mod@quinn) |")]
#![cfg_attr(not(feature = "quinn"), doc = "| unmodified QUIC endpoints | feature `quinn` |")]
#![cfg_attr(feature = "hyper", doc = "| unmodified programs of hyper and axum | [`hyper`](mod@hyper), feature `axum` |")]
#![cfg_attr(not(feature = "hyper"), doc = "| unmodified programs of hyper, axum and tonic | features `hyper`, `axum`, `tonic` |")]
//! | hosts and links from a file | [`Testbed::from_file`], [`LinkFile`] |
#![cfg_attr(feature = "scenes", doc = "| scene files as tests, and scenes at random | [`check_scene`], [`check_scenes`], [`strategies::scene`] |")]
#![cfg_attr(not(feature = "scenes"), doc = "| scene files as tests, and scenes at random | feature `scenes` |")]
//! | what happened: events, the fate of every packet, the first difference between two runs | [`Trace`], [`Record`], [`Difference`] |
//! | when a run that does not end is given up | [`Testbed::time_limit`], [`Testbed::step_limit`] |
//! | what a failed test leaves behind, and its replay | [`Testbed::artefacts`], [`Record::write`] |
//!
//! # Features
//!
//! | feature | on by default | brings |
//! | --- | --- | --- |
//! | `tcp` | yes | TCP, by `cohaptic-tcp`, and the words of hits that are about segments of TCP |
//! | `tokio` | yes | `Testbed::on_tokio`, for programs that use tokio's timers and tasks, and the traits and methods of sockets that are of tokio's types |
//! | `pcapng` | yes | captures among what a failed test leaves behind, by `cohaptic-capture` |
//! | `strategies` | | strategies of proptest for links, networks and hits, and `proptest` itself |
//! | `facade` | | programs that use tokio's own sockets, on a test bed unchanged, through the package that `cohaptic tokio` generates; brings `tcp` and `tokio` |
//! | `loopback` | | runtimes whose loopback is a link, for the package that `cohaptic tokio` generates; not for use by hand; brings `facade` |
//! | `tokio-net` | | the methods `ready`, `try_io` and `async_io` of sockets, whose types tokio has only with its own feature `net`; brings `tokio` |
//! | `files` | | links of the library by name, and relay files (TOML) as hosts and links; files of plain words need no feature |
//! | `scenes` | | scene files as hosts and links and as tests, and strategies for scenes of coordination; brings `files` and `strategies` |
//! | `hyper` | | connectors and executors for hyper and hyper-util; brings `tcp` and `tokio` |
//! | `axum` | | `TcpListener` as a listener of `axum::serve`; brings `tcp` and `tokio` |
//! | `tonic` | | `TcpStream` as a connection of a tonic server; brings `tcp` and `tokio` |
//! | `quinn` | | QUIC by quinn, and `quinn` itself |
//!
//! # Variables of the environment
//!
//! | variable | says |
//! | --- | --- |
//! | [`COHAPTIC_TEST_SEED`](SEED_VARIABLE) | the seed of every test bed of the process |
//! | [`COHAPTIC_TEST_STALL`](STALL_VARIABLE) | for how long anything may run without returning to the test bed, by the wall clock |
//! | [`COHAPTIC_TEST_ARTEFACTS`](ARTEFACTS_VARIABLE) | the folder below which every test that fails writes what happened |
//! | `COHAPTIC_TEST_LOOPBACK` | words of `tc-netem` for the loopback of tests that make no test bed, under `cohaptic test`: `docs/how-to-existing-program.md` |
//! | `COHAPTIC_TEST_LIMIT` | the time limit of these tests, in virtual time, such as `30h`; an hour otherwise |
#![cfg_attr(test, allow(clippy::unwrap_used, reason = "tests"))]

mod access;
mod address;
mod again;
mod artefacts;
#[cfg(feature = "axum")]
pub mod axum;
mod bed;
mod buffers;
mod context;
mod core;
mod current;
mod errno;
#[cfg(feature = "facade")]
mod facade;
mod failure;
mod fault;
mod file;
mod groups;
pub mod hit;
mod host;
#[cfg(feature = "hyper")]
pub mod hyper;
#[cfg(feature = "files")]
mod library;
mod link;
#[cfg(feature = "loopback")]
#[doc(hidden)]
pub mod loopback;
mod middlebox;
mod names;
mod nat;
#[cfg(feature = "tcp")]
pub mod net;
pub mod node;
#[cfg(any(feature = "facade", feature = "quinn"))]
mod origin;
#[cfg(feature = "quinn")]
pub mod quinn;
mod record;
mod resolve;
mod runtime;
#[cfg(feature = "scenes")]
mod scenes;
mod seed;
mod settings;
mod setup;
mod socket;
#[cfg(feature = "strategies")]
pub mod strategies;
mod task;
#[cfg(feature = "tcp")]
pub mod tcp;
pub mod time;
#[cfg(feature = "tonic")]
mod tonic;
mod trace;
mod watch;
mod wire;
mod words;

pub use access::AccessStats;
pub use address::{AddressPlan, Addresses};
pub use artefacts::{ARTEFACTS_VARIABLE, WriteError};
pub use bed::{Bed, Nat, NatMapping, NatProtocol, Testbed};
#[cfg(feature = "scenes")]
pub use cohaptic_harness as harness;
pub use cohaptic_units as units;
pub use cohaptic_units::Instant;
pub use cohaptic_wan as wan;
pub use fault::WordsError;
pub use file::{LinkFile, LinkFileError};
pub use host::Host;
#[cfg(feature = "files")]
pub use library::LibraryLink;
pub use link::ToLink;
#[cfg(feature = "strategies")]
pub use proptest;
pub use record::Record;
pub use resolve::ToSocketAddrs;
#[cfg(feature = "scenes")]
pub use scenes::{check_scene, check_scenes};
pub use seed::SEED_VARIABLE;
pub use socket::UdpSocket;
pub use task::{JoinHandle, TaskStopped};
#[cfg(feature = "tcp")]
pub use tcp::{listener::TcpListener, socket::TcpSocket, stream::TcpStream};
pub use trace::{Difference, Happening, Lost, PacketName, Trace, TraceEvent};
pub use watch::STALL_VARIABLE;

/// Runs the code of the README as a doc test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
