//! Observers of runs in arrays, as seen by the loop over ticks.

use cohaptic_peer::coordination::BuiltIn;
use cohaptic_scene::Scene;
use cohaptic_units::Instant;

use super::blocks::{Seen, lane_of};
use super::bodies::Bodies;
use super::lanes::{Lanes, WIDTH};
use super::ticks::{Source, Ticks};
use crate::rows::{InstantRow, StateRow, TickRow};

/// Observer of a run in arrays. The loop over ticks is compiled for each implementation, so an unwatched run makes no rows.
pub(super) trait RunWatch<const A: usize> {
    /// Called as [`crate::Observer::keep_going`] is.
    fn keep_going(&mut self, now: Instant) -> bool;

    /// Called at each tick after samples were delivered and before any body moves.
    #[inline(always)]
    fn before_motion(&mut self, _now: Instant, _bodies: &Bodies<A>, _law: &BuiltIn<Lanes>) {}

    /// Called when the law's own damping becomes the damping of `scene`.
    fn change_damping(&mut self, _scene: &Scene) {}

    /// Called after each tick with the distance between copies before the move \[m\]. Returns whether the run goes on.
    fn after_motion(&mut self, _now: Instant, _discrepancy: f64) -> bool {
        true
    }
}

/// Observer that is asked only whether the run goes on.
pub(super) struct Unwatched<'k>(pub(super) &'k mut dyn FnMut(Instant) -> bool);

impl<const A: usize> RunWatch<A> for Unwatched<'_> {
    fn keep_going(&mut self, now: Instant) -> bool {
        (self.0)(now)
    }
}

/// Observer of ticks and instants behind a trait object, so the loops are not compiled for every type of observer.
pub(crate) trait Onlooker {
    /// See [`crate::Observer::on_ticks`].
    fn on_ticks(&mut self, ticks: &Ticks<'_>);

    /// See [`crate::Observer::on_instant`]. Returns whether the run goes on, that is, whether no call has failed.
    fn on_instant(&mut self, row: &InstantRow) -> bool;

    /// See [`crate::Observer::keep_going`].
    fn keep_going(&mut self, now: Instant) -> bool;
}

/// Passes ticks and instants of one run to an onlooker.
pub(super) struct WatchedTicks<'a> {
    onlooker: &'a mut dyn Onlooker,
    /// Own damping of the law \[N·s/m\], indexed by peer.
    damping: Vec<f64>,
    /// Number of axes in rows: the axes of the scene. The run may simulate more axes.
    shown: usize,
}

impl<'a> WatchedTicks<'a> {
    pub(super) fn new(scene: &Scene, onlooker: &'a mut dyn Onlooker) -> Self {
        Self { onlooker, damping: damping(scene), shown: scene.axes.count() }
    }
}

/// Returns the own damping of the law \[N·s/m\], indexed by peer.
fn damping(scene: &Scene) -> Vec<f64> {
    (0..scene.peers.len()).map(|peer| scene.own_damping(peer)).collect()
}

impl<const A: usize> RunWatch<A> for WatchedTicks<'_> {
    fn change_damping(&mut self, scene: &Scene) {
        self.damping = damping(scene);
    }

    fn keep_going(&mut self, now: Instant) -> bool {
        self.onlooker.keep_going(now)
    }

    #[inline(always)]
    fn before_motion(&mut self, now: Instant, bodies: &Bodies<A>, law: &BuiltIn<Lanes>) {
        let source = Peers { at: now, bodies, law, damping: &self.damping, shown: self.shown };
        self.onlooker.on_ticks(&Ticks::new(now, self.damping.len(), bodies.blocks().of_all(), &source));
    }

    #[inline(always)]
    fn after_motion(&mut self, now: Instant, discrepancy: f64) -> bool {
        self.onlooker.on_instant(&InstantRow { at: now, discrepancy })
    }
}

/// A peer at a tick.
struct Place {
    at: Instant,
    peer: usize,
    /// Own damping of the law for this peer \[N·s/m\].
    damping: f64,
    /// Number of axes in rows.
    shown: usize,
}

impl Place {
    /// Calls `on` with the row of this peer. `axes` holds states and forces of the peer's block along each axis. Returns the result of `on`.
    fn hand_on<const A: usize>(&self, axes: &[Seen; A], on: &mut dyn FnMut(&TickRow<'_>) -> bool) -> bool {
        let lane = self.peer % WIDTH;
        let object = StateOfLane::of(axes.each_ref().map(|seen| &seen.object), lane);
        // The law's own damping is part of the copy's step map, not of the force computed by the law, so the damping is added for the row.
        let recorded = |axis: usize| {
            let held = axes[axis].coordination.0[lane];
            if self.damping > 0.0 { held + self.damping * object.velocity[axis] } else { held }
        };
        on(&TickRow {
            at: self.at,
            peer: self.peer,
            device: StateOfLane::of(axes.each_ref().map(|seen| &seen.device), lane).row(self.shown),
            object: object.row(self.shown),
            target: StateOfLane::of(axes.each_ref().map(|seen| &seen.target), lane).row(self.shown),
            coupling_force: &axes.each_ref().map(|seen| seen.coupling.0[lane])[..self.shown],
            coordination_force: &std::array::from_fn::<f64, A, _>(recorded)[..self.shown],
            turn: None,
        })
    }
}

/// All peers at a tick, before the move.
struct Peers<'a, const A: usize> {
    at: Instant,
    bodies: &'a Bodies<A>,
    law: &'a BuiltIn<Lanes>,
    damping: &'a [f64],
    /// Number of axes in rows.
    shown: usize,
}

/// Position \[m\] and velocity \[m/s\] of a lane along each axis.
struct StateOfLane<const A: usize> {
    position: [f64; A],
    velocity: [f64; A],
}

impl<const A: usize> StateOfLane<A> {
    #[inline(always)]
    fn of(motions: [&super::blocks::Motions; A], lane: usize) -> Self {
        let motions = motions.map(|motions| lane_of(motions, lane));
        Self { position: motions.map(|motion| motion.position), velocity: motions.map(|motion| motion.velocity) }
    }

    #[inline(always)]
    fn row(&self, shown: usize) -> StateRow<'_> {
        StateRow { position: &self.position[..shown], velocity: &self.velocity[..shown] }
    }
}

impl<const A: usize> Source for Peers<'_, A> {
    #[inline(never)]
    fn each(&self, on: &mut dyn FnMut(&TickRow<'_>) -> bool) {
        for (place, damping) in self.damping.chunks(WIDTH).enumerate() {
            // States and forces are computed for eight peers at once, and only if the observer asks for rows.
            let seen = self.bodies.seen(place, self.law);
            for (peer, damping) in (place * WIDTH..).zip(damping) {
                if !(Place { at: self.at, peer, damping: *damping, shown: self.shown }).hand_on(&seen, on) {
                    return;
                }
            }
        }
    }
}
