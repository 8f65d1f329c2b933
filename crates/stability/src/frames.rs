//! The frame of a scene, event by event, for crates that need more of a frame than its matrix: `cohaptic-proofs`.
//!
//! A scene is split into pieces that move apart ([`pieces`]), each of these into combinations of open and closed contacts ([`pairs`]), and each combination
//! into classes of equal peers ([`Structure`]). A class is one [`Node`]; what the nodes do and hear in a frame is a [`Timetable`], and both together are a
//! [`Lifted`] system.

pub use crate::analysis::notes;
pub use crate::combinations::{Combination, pairs};
pub use crate::full::{FullMap, Trust, full_along};
pub use crate::graph::enclosed::{EnclosedSpectrum, eigenvectors};
pub use crate::graph::{node_on, on_this_topology, weights_of};
pub use crate::lifted::node::{External, Rows, Scale, Scratch};
pub use crate::lifted::{Autonomous, Body, FrameMap, Instrument, Lifted, Node, Operator, Sampling, Seen};
pub use crate::linear_form::{LawRow, LinearLaw};
pub use crate::network::{LinkTiming, NominalNetwork};
pub use crate::parts::{alone, lifted_part};
pub use crate::pieces::{Piece, pieces, refuse_operators, refuse_slow_devices, refuse_topology};
pub use crate::structure::{Contacts, Structure, check_laws, classes, clocks, has_equal_clocks, links};
pub use crate::timetable::{Event, Instants, NodeClock, Timetable, UseOfHeld};
