//! End of a run at the outcome of its task.

use cohaptic_scene::Scene;
use cohaptic_units::Instant;

use crate::TickRow;
use crate::task::Judge;

/// Judge of a task with `end = "stop"`. A judge of its own, because a run ends at the same instant whoever observes it.
pub(super) struct Stopping {
    judge: Judge,
}

impl Stopping {
    /// Returns `None` for a scene that runs to its end.
    pub(super) fn of(scene: &Scene) -> Option<Box<Self>> {
        scene.ends_with_task().then(|| Judge::of(scene)).flatten().map(|judge| Box::new(Self { judge }))
    }

    /// Returns the end of the run, after all ticks of an instant; `None` while the run goes on. `next`: instant of the next tick.
    pub(super) fn end(&mut self, next: Option<Instant>) -> Option<Instant> {
        self.judge.settle(&mut |_, _| ());
        // No tick can change the outcome after the deadline, so the deadline ends the run before a later tick.
        self.judge.ended().or_else(|| Some(self.judge.deadline()).filter(|deadline| next.is_none_or(|next| next > *deadline)))
    }

    /// Takes in the tick of a peer.
    pub(super) fn judge(&mut self, row: &TickRow<'_>) {
        self.judge.on_tick(row, &mut |_, _| ());
    }
}
