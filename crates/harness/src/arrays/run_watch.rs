//! Observers of runs in arrays.

use cohaptic_peer::coordination::BuiltIn;
use cohaptic_peer::rotation::{Attitude, Triple};
use cohaptic_scene::Scene;
use cohaptic_units::Instant;

use super::blocks::lane_of;
use super::bodies::{Bodies, SeenPlace};
use super::lanes::{Lanes, WIDTH};
use super::ticks::{Source, Ticks};
use crate::observer::{InstantRow, StateRow, TickRow, TurnRow};

/// An observer of a run in arrays: the loop over ticks is compiled for each kind, so that an unwatched run pays nothing.
pub(super) trait RunWatch<B, const A: usize, const P: usize> {
    /// Asked as [`crate::Observer::keep_going`] is.
    fn keep_going(&mut self, now: Instant) -> bool;

    /// At that tick everything that arrives has arrived, and nobody has moved.
    #[inline(always)]
    fn before_motion(&mut self, _now: Instant, _bodies: &B, _law: &BuiltIn<Lanes>) {}

    /// The damping of the law from now on is that of this scene.
    fn change_damping(&mut self, _scene: &Scene) {}

    /// At that tick copies were that far apart \[m\]; gives whether the run goes on.
    #[inline(always)]
    fn after_motion(&mut self, _now: Instant, _discrepancy: f64) -> bool {
        true
    }
}

/// An observer that is only asked whether to go on.
pub(super) struct Unwatched<'k>(pub(super) &'k mut dyn FnMut(Instant) -> bool);

impl<B, const A: usize, const P: usize> RunWatch<B, A, P> for Unwatched<'_> {
    fn keep_going(&mut self, now: Instant) -> bool {
        (self.0)(now)
    }
}

/// An observer of ticks and instants, of any type.
pub(crate) trait Onlooker {
    /// See [`crate::Observer::on_ticks`].
    fn on_ticks(&mut self, ticks: &Ticks<'_>);

    /// See [`crate::Observer::on_instant`]. Gives whether the run goes on: nothing has failed.
    fn on_instant(&mut self, row: &InstantRow) -> bool;

    /// See [`crate::Observer::keep_going`].
    fn keep_going(&mut self, now: Instant) -> bool;
}

/// An observer of all peers of one run.
pub(super) struct WatchedTicks<'a> {
    onlooker: &'a mut dyn Onlooker,
    /// By how much the law damps each peer [N·s/m], and its turn about each axis [N·m·s/rad].
    damping: Vec<(f64, Triple)>,
    /// Number of axes of the scene, which rows have. The run may simulate more.
    shown: usize,
}

impl<'a> WatchedTicks<'a> {
    pub(super) fn new(scene: &Scene, onlooker: &'a mut dyn Onlooker) -> Self {
        Self { onlooker, damping: damping(scene), shown: scene.axes.count() }
    }
}

/// By how much the law damps each peer, and its turn.
fn damping(scene: &Scene) -> Vec<(f64, Triple)> {
    (0..scene.peers.len()).map(|peer| (scene.own_damping(peer), scene.own_rotational_damping(peer))).collect()
}

impl<B: Bodies<A, P>, const A: usize, const P: usize> RunWatch<B, A, P> for WatchedTicks<'_> {
    fn change_damping(&mut self, scene: &Scene) {
        self.damping = damping(scene);
    }

    fn keep_going(&mut self, now: Instant) -> bool {
        self.onlooker.keep_going(now)
    }

    #[inline(always)]
    fn before_motion(&mut self, now: Instant, bodies: &B, law: &BuiltIn<Lanes>) {
        let source = Peers { at: now, bodies, law, damping: &self.damping, shown: self.shown };
        self.onlooker.on_ticks(&Ticks::new(now, self.damping.len(), bodies.blocks().of_all(), &source));
    }

    #[inline(always)]
    fn after_motion(&mut self, now: Instant, discrepancy: f64) -> bool {
        self.onlooker.on_instant(&InstantRow { at: now, discrepancy })
    }
}

/// A peer at one of its ticks.
struct Place<'a> {
    at: Instant,
    peer: usize,
    /// By how much the law damps it, and its turn.
    damping: &'a (f64, Triple),
    /// Number of axes that rows have.
    shown: usize,
    /// How its copy and its device are turned, if they are.
    attitude: Option<Attitude>,
    device: Option<Attitude>,
}

impl Place<'_> {
    /// Hands on its row, from the states and forces of its eight peers.
    fn hand_on<const A: usize>(&self, SeenPlace { axes, turn }: &SeenPlace<A>, on: &mut dyn FnMut(&TickRow<'_>) -> bool) -> bool {
        let (lane, (own, turns)) = (self.peer % WIDTH, self.damping);
        let object = StateOfLane::of(axes.each_ref().map(|seen| &seen.object), lane);
        let recorded = |axis: usize| {
            let held = axes[axis].coordination.0[lane];
            if *own > 0.0 { held + own * object.velocity[axis] } else { held }
        };
        let turned = turn.as_ref().and_then(|(coupling, aligning)| Some((self.attitude?, coupling, aligning)));
        let turned = turned.map(|(attitude, coupling, aligning)| {
            let coordination: Triple = std::array::from_fn(|axis| aligning[axis].0[lane] + turns[axis] * attitude.rate[axis]);
            (attitude, coupling.map(|torque| torque.0[lane]), coordination)
        });
        on(&TickRow {
            at: self.at,
            peer: self.peer,
            device: StateOfLane::of(axes.each_ref().map(|seen| &seen.device), lane).row(self.shown),
            object: object.row(self.shown),
            target: StateOfLane::of(axes.each_ref().map(|seen| &seen.target), lane).row(self.shown),
            coupling_force: &axes.each_ref().map(|seen| seen.coupling.0[lane])[..self.shown],
            coordination_force: &std::array::from_fn::<f64, A, _>(recorded)[..self.shown],
            turn: turned.as_ref().map(|(object, coupling_torque, coordination_torque)| TurnRow {
                object,
                device: self.device.as_ref(),
                coupling_torque,
                coordination_torque,
            }),
        })
    }
}

/// All peers before they move.
struct Peers<'a, B, const A: usize, const P: usize> {
    at: Instant,
    bodies: &'a B,
    law: &'a BuiltIn<Lanes>,
    damping: &'a [(f64, Triple)],
    /// Number of axes that rows have.
    shown: usize,
}

/// Position and velocity of a lane along each axis.
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

impl<B: Bodies<A, P>, const A: usize, const P: usize> Source for Peers<'_, B, A, P> {
    fn attitude(&self, peer: usize) -> Option<Attitude> {
        self.bodies.attitude(peer, 0)
    }

    #[inline(never)]
    fn each(&self, on: &mut dyn FnMut(&TickRow<'_>) -> bool) {
        for (place, damping) in self.damping.chunks(WIDTH).enumerate() {
            let seen = self.bodies.seen(place, self.law);
            for (peer, damping) in (place * WIDTH..).zip(damping) {
                let (attitude, device) = (self.bodies.attitude(peer, 0), self.bodies.device_attitude(peer, 0));
                if !(Place { at: self.at, peer, damping, shown: self.shown, attitude, device }).hand_on(&seen, on) {
                    return;
                }
            }
        }
    }
}
