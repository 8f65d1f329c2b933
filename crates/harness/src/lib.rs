//! Runs scenes: compiles a scene to the least that its run needs, owns the clock and the order of events, and records the run.
//!
//! Use this crate if you run scenes from Rust: to record them, to watch every tick, or to drive a session.
//!
//! [`Simulation`] is the scene in virtual time: N [`cohaptic_peer::Peer`]s that send samples through a [`cohaptic_wan::Network`]. A sample has the size of its
//! datagram but travels as numbers; bytes are made only for a damaged packet or a socket. A scene without need for events, and with an observer of no more than
//! ticks, runs in arrays, which hold numbers only: no peers, no datagrams, no packets. An [`Observer`] sees every tick and every packet; [`record`] has
//! observers that write CSV files and plots during the run. [`task`] judges what
//! the users of a scene are asked to do. [`check`] compares a run with the scene's expectations. [`mod@explain`] lists the parts that the
//! program models for a scene. [`live`] runs scenes with remote peers.
//!
//! This crate reads no clock: the same scene and seed give the same bytes on every machine.
//!
//! ```
//! use cohaptic_harness::{Model, NoObserver, Simulation};
//! use cohaptic_scene::Scene;
//!
//! let text = r#"
//!     scene = { duration = "1s", count = 2 }
//!     object = { mass = 0.45 }
//!     coordination = { strategy = "average-position", stiffness = 1000.0, damping = 5.0, update = "8ms" }
//!     peer = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
//!     link = { delay = "24ms" }
//! "#;
//! let scene = Scene::parse(text, "two.toml".as_ref(), &[])?;
//! let mut simulation = Simulation::new(&scene, Model::Least);
//! let summary = simulation.run(&mut NoObserver)?;
//! assert_eq!(summary.ticks, 1000);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod arrays;
pub mod check;
mod disturbance;
pub mod explain;
mod in_flight;
pub mod live;
pub mod measures;
mod number_text;
mod observer;
mod plan;
mod questions;
pub mod record;
mod rows;
mod schedule;
mod side_by_side;
mod simulation;
mod size;
mod spread;
mod summary;
pub mod task;
mod world;

pub use arrays::Ticks;
pub use cohaptic_scene::{FromScene, Strategies};
pub use observer::{NoObserver, Observer};
pub use plan::Model;
pub use rows::{HoldRow, InstantRow, PacketRow, SendRow, StateRow, StepRow, TickRow, TurnRow, TurnStepRow};
pub use side_by_side::{run_side_by_side, same_shape};
pub use simulation::Simulation;
pub use size::{TooLarge, too_large};
pub use summary::{AccessSummary, DIVERGED_DISTANCE, EachLink, Ending, LinkQuantiles, LinkSummaries, LinkSummary, PeerSummary, Summary};
