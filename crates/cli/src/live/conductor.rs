//! Between a session and onlookers: nothing here waits.

use std::sync::mpsc::Receiver;

use cohaptic_live::{Conductor, LinkChange, Status};
use cohaptic_units::Instant;

use super::status::snapshot;
use super::timeline::Elapsed;
use crate::interrupt;
use crate::realtime::{Edit, Look};

/// Publishes the session and hands in what live control changes.
pub(super) struct SessionConductor {
    look: Option<Look>,
    wanted: Receiver<Edit>,
    /// The links in the order of the description.
    pairs: Vec<(usize, usize)>,
    elapsed: Elapsed,
    /// Of the scene.
    axes: usize,
}

impl SessionConductor {
    pub(super) const fn new(look: Option<Look>, wanted: Receiver<Edit>, pairs: Vec<(usize, usize)>, elapsed: Elapsed, axes: usize) -> Self {
        Self { look, wanted, pairs, elapsed, axes }
    }
}

impl Conductor for SessionConductor {
    fn keep_going(&mut self) -> bool {
        !interrupt::requested()
    }

    fn next_change(&mut self) -> Option<LinkChange> {
        let Edit { link, keys, model } = self.wanted.try_recv().ok()?;
        let (from, to) = *self.pairs.get(link)?;
        Some(LinkChange { from, to, keys, model })
    }

    fn show(&mut self, status: Status) {
        self.elapsed.set(Instant::ZERO.saturating_add(status.elapsed));
        if let Some(look) = &self.look {
            look.publish(snapshot(&status, self.axes));
        }
    }

    fn wants_status(&self) -> bool {
        self.look.is_some()
    }
}
