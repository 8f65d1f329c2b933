//! The lifted system: nodes that are coupled through samples.

use super::Sampling;
use super::node::{Node, Rows};
use crate::Matrix;
use crate::timetable::{Event, Timetable};

/// Nodes that are coupled through samples.
#[derive(Clone, Copy, Debug)]
pub struct Lifted<'a> {
    /// The nodes.
    pub nodes: &'a [Node],
    /// The weight of each node's samples (column) in each node's target (row).
    pub weights: &'a Matrix,
    /// What happens in a frame of them.
    pub timetable: &'a Timetable,
    /// Which numbers of a sample the laws of the nodes use.
    pub sampling: Sampling,
    /// What velocities are multiplied by \[s\].
    pub time: f64,
    /// Whether something ties the motion to ground. If not, the whole may be moved without a force, and positions are taken relative to the first
    /// node's copy.
    pub tied: bool,
}

/// How large the matrix of a frame is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Sizes {
    /// Its rows: see [`FrameMap::size`](super::FrameMap::size).
    pub(crate) states: usize,
    /// How many of these are numbers of samples of earlier frames: see [`FrameMap::history`](super::FrameMap::history).
    pub(crate) history: usize,
    /// The rows of its delayed loop: see [`FrameMap::signals`](super::FrameMap::signals).
    pub(crate) signals: usize,
}

impl Lifted<'_> {
    /// How large its matrix is, told without making one.
    pub(crate) fn sizes(&self) -> Sizes {
        let channels = self.sampling.channels();
        let silent = self.sampling.is_silent(self.time);
        let reference = usize::from(!self.tied);
        let own = self.nodes.iter().map(Node::states).sum::<usize>() - reference;
        let history = if silent { 0 } else { self.timetable.depth.iter().sum::<usize>() * channels };
        let sent = self.timetable.sent.iter().sum::<usize>() * channels;
        Sizes { states: own + history, history, signals: own + sent + reference }
    }

    /// The rows of each node.
    pub fn rows(&self) -> Vec<Rows> {
        let mut count = 0;
        let rows = self.nodes.iter().map(|node| {
            let rows = node.rows(count);
            count += node.states();
            rows
        });
        rows.collect()
    }

    /// How often each node ticks in a frame.
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
