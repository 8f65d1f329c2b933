//! The description of a lifted system: nodes, weights and timetable, and the resulting sizes.

use super::Sampling;
use super::node::{Node, Rows};
use super::operator::Sight;
use crate::Matrix;
use crate::timetable::{Event, Timetable};

/// A system of nodes coupled through samples.
#[derive(Clone, Copy, Debug)]
pub struct Lifted<'a> {
    /// The nodes; the first node's copy is the reference of an untied system. Not empty.
    pub nodes: &'a [Node],
    /// Weight of each node's samples (column) in each node's target (row).
    pub weights: &'a Matrix,
    /// Samples, deliveries and ticks of the nodes in one frame.
    pub timetable: &'a Timetable,
    /// The numbers of a sample used by the laws of the nodes.
    pub sampling: Sampling,
    /// Common time \[s\]. Velocities times the common time are lengths.
    pub time: f64,
    /// `true` if something ties the motion to ground. Otherwise everything can be moved together without a force, and positions are taken relative to the first
    /// node's copy.
    pub tied: bool,
}

/// Sizes of the matrix of a frame and of its delayed loop.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Sizes {
    /// Number of rows of the matrix: see [`FrameMap::size`](super::FrameMap::size).
    pub(crate) states: usize,
    /// Number of rows for numbers of samples and for seen places of earlier frames: see [`FrameMap::history`](super::FrameMap::history).
    pub(crate) history: usize,
    /// Number of rows of the delayed loop: see [`FrameMap::signals`](super::FrameMap::signals).
    pub(crate) signals: usize,
}

impl Lifted<'_> {
    /// Returns the sizes of the system's matrix without computing the matrix.
    pub(crate) fn sizes(&self) -> Sizes {
        let channels = self.sampling.channels();
        let silent = self.sampling.is_silent(self.time);
        let reference = usize::from(!self.tied);
        let own = self.nodes.iter().map(Node::states).sum::<usize>() - reference;
        let (mut seen_before, mut seen) = (0, 0);
        for sight in self.sights() {
            seen_before += sight.operator.lag;
            seen += sight.ticks;
        }
        let history = if silent { 0 } else { self.timetable.depth.iter().sum::<usize>() * channels } + seen_before;
        let sent = self.timetable.sent.iter().sum::<usize>() * channels + seen;
        Sizes { states: own + history, history, signals: own + sent + reference }
    }

    /// Returns the places of the rows of each node.
    pub fn rows(&self) -> Vec<Rows> {
        let mut count = 0;
        let rows = self.nodes.iter().map(|node| {
            let rows = node.rows(count);
            count += node.states();
            rows
        });
        rows.collect()
    }

    /// Tells whether an operator moves the hand of a node.
    pub(crate) fn has_operators(&self) -> bool {
        self.nodes.iter().any(|node| node.operator.is_some())
    }

    /// Returns the sights of the operators, ordered by node, without rows.
    pub(super) fn sights(&self) -> Vec<Sight> {
        if !self.has_operators() {
            return Vec::new();
        }
        let ticks = self.ticks();
        let operators = self.nodes.iter().enumerate().filter_map(|(node, of)| Some((node, of.operator?)));
        operators.map(|(node, operator)| Sight::new(node, operator, ticks[node])).collect()
    }

    /// Returns the number of ticks of each node in a frame.
    pub fn ticks(&self) -> Vec<usize> {
        let mut ticks = vec![0; self.nodes.len()];
        for event in &self.timetable.events {
            if let Event::Tick { node, .. } = event {
                ticks[*node] += 1;
            }
        }
        ticks
    }
}
