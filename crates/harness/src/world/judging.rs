//! Judge of the task in a running scene: the targets of operators, and the end of a run at the outcome.

use cohaptic_scene::Scene;
use cohaptic_units::Instant;

use crate::TickRow;
use crate::task::Judge;

/// Judge of a world. Observers have judges of their own, because a run moves and ends in the same way whoever observes it.
#[derive(Debug)]
pub(super) struct Judging {
    judge: Judge,
    /// True if the outcome or the targets depend on the ticks. Otherwise the world need not show any tick.
    takes_ticks: bool,
    /// True if the outcome ends the run.
    stops: bool,
}

impl Judging {
    /// Returns the judge of a run to the end of the scene; `None` for a scene without a task. `serves_operators`: operators ask for the targets.
    pub(super) fn of(scene: &Scene, serves_operators: bool) -> Option<Box<Self>> {
        let judge = Judge::of_targets(scene)?;
        let takes_ticks = serves_operators && judge.target_follows_copies();
        Some(Box::new(Self { judge, takes_ticks, stops: false }))
    }

    /// Lets the outcome end the run.
    pub(super) const fn stop(&mut self) {
        (self.takes_ticks, self.stops) = (true, true);
    }

    /// Returns whether [`on_tick`](Self::on_tick) must be called for the ticks of all peers.
    pub(super) const fn takes_ticks(&self) -> bool {
        self.takes_ticks
    }

    /// Returns the judge, who has judged all earlier instants.
    pub(super) const fn judge(&self) -> &Judge {
        &self.judge
    }

    /// Takes in the tick of a peer.
    pub(super) fn on_tick(&mut self, row: &TickRow<'_>) {
        self.judge.on_tick(row, &mut |_, _| ());
    }

    /// Judges an instant after all its ticks. Returns the end of the run; `None` while the run goes on. `next`: instant of the next tick.
    pub(super) fn end(&mut self, next: Option<Instant>) -> Option<Instant> {
        self.judge.settle(&mut |_, _| ());
        if !self.stops {
            return None;
        }
        // No tick can change the outcome after the deadline, so the deadline ends the run before a later tick.
        self.judge.ended().or_else(|| Some(self.judge.deadline()).filter(|deadline| next.is_none_or(|next| next > *deadline)))
    }
}
