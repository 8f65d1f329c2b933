//! A peer of a run with clock, device and counters.

use std::time::Duration;

use cohaptic_peer::coordination::Role;
use cohaptic_peer::rotation::Rotation;
use cohaptic_peer::{Clock, Device, Held, LastSent, ObjectCopy, Peer, RestingDevice, SimulatedDevice, State, Strategy};
use cohaptic_scene::Scene;
use cohaptic_units::Instant;

use super::row;
use crate::disturbance::Disturbance;
use crate::observer::{Ended, Observer};
use crate::plan::{DeviceChoice, Plan};
use crate::rows::{StepRow, TurnStepRow};

/// A peer with a clock and the counters of ticks and samples.
pub(super) struct Member<const A: usize, S, D> {
    pub(super) peer: Peer<A, DeviceModel<A, D>, S>,
    pub(super) clock: Clock,
    /// Number of computed ticks of the peer.
    pub(super) tick: u64,
    /// Tick of the next due sample.
    pub(super) next_send: u64,
    /// Ticks between two samples, at least 1.
    pub(super) send_every: u64,
    /// State sent last. Kept only if the scene has a send condition (dead bands).
    pub(super) last_sent: Option<LastSent<A>>,
    /// Samples arrived after a newer sample of the same sender.
    pub(super) stale_samples: u64,
    /// Damaged samples refused by the decoder.
    pub(super) refused_samples: u64,
    /// Held part of the coordination force computed at the latest tick \[N\]. Updated only if steps are watched.
    pub(super) commanded: [f64; A],
}

/// Model of a peer's device. D is the type of unsimulated devices.
#[derive(Debug)]
#[expect(clippy::large_enum_variant, reason = "most peers of most scenes are the large variant, and a box would cost a cache miss a tick")]
pub(crate) enum DeviceModel<const A: usize, D> {
    Unsimulated(D),
    Simulated(SimulatedDevice<A>),
}

impl<const A: usize, D: Device<A>> Device<A> for DeviceModel<A, D> {
    #[inline]
    fn state(&self) -> State<A> {
        match self {
            Self::Unsimulated(device) => device.state(),
            Self::Simulated(device) => device.state(),
        }
    }

    #[inline(always)]
    fn advance(&mut self, now: Instant, span: Duration, coupling_force: [f64; A]) {
        match self {
            Self::Unsimulated(device) => device.advance(now, span, coupling_force),
            Self::Simulated(device) => device.advance(now, span, coupling_force),
        }
    }
}

impl<const A: usize, S: Strategy<A>, D: Device<A>> Member<A, S, D> {
    /// Moves to the next tick and shows the step. `commanded` is the held part of the coordination force that was computed at the present tick \[N\]; `row` is
    /// the index of the peer and the number of axes.
    #[inline]
    pub(super) fn advance_watched(
        &mut self,
        now: Instant,
        span: Duration,
        commanded: [f64; A],
        row: (usize, usize),
        observer: &mut (impl Observer<Error = Ended> + ?Sized),
    ) -> Result<(), Ended> {
        match self.peer.role() {
            // The most frequent case passes a constant role and no turn, so the compiler specialises the inlined function.
            Role::Copy if self.peer.rotation().is_none() => self.advance_as(now, span, commanded, (row, Role::Copy), observer, None),
            role @ (Role::Copy | Role::Client { .. }) => self.advance_otherwise(now, span, commanded, (row, role), observer),
        }
    }

    /// Like [`Member::advance_watched`], for a client or for a turning peer. Not inlined, so the frequent case stays small.
    #[inline(never)]
    fn advance_otherwise(
        &mut self,
        now: Instant,
        span: Duration,
        commanded: [f64; A],
        row: ((usize, usize), Role),
        observer: &mut (impl Observer<Error = Ended> + ?Sized),
    ) -> Result<(), Ended> {
        let turn = self.peer.rotation().map(|rotation| TurnStepRow {
            span,
            before: rotation.copy().rate,
            after: [0.0; 3],
            travel: rotation.travel(span),
            held_torque: rotation.on_copy(),
            coordination_torque: rotation.applied().coordination,
            own_damping: rotation.own_damping(),
        });
        self.advance_as(now, span, commanded, row, observer, turn)
    }

    /// Moves to the next tick and shows the step. The field `after` of `turn` is filled in here, after the move.
    #[inline(always)]
    fn advance_as(
        &mut self,
        now: Instant,
        span: Duration,
        commanded: [f64; A],
        ((place, axes), role): ((usize, usize), Role),
        observer: &mut (impl Observer<Error = Ended> + ?Sized),
        turn: Option<TurnStepRow>,
    ) -> Result<(), Ended> {
        let late = std::mem::replace(&mut self.commanded, commanded);
        // With a compute delay, the force of the previous tick acts during this step.
        let coordination = if self.peer.compute_delay() { late } else { commanded };
        let before = self.moved_by_coordination(role);
        // The forces that act during this step, copied before `advance` changes the peer.
        let acting = *self.peer.applied();
        self.peer.advance(now, span);
        let turn = turn.map(|turn| TurnStepRow { after: self.peer.attitude().rate, ..turn });
        let after = self.moved_by_coordination(role);
        // A client feels the other peers by its coupling force only.
        let coordination = if role == Role::Copy { coordination } else { acting.coupling };
        observer.on_step(&StepRow {
            at: now,
            peer: place,
            before: row(&before, axes),
            after: row(&after, axes),
            held_force: &acting.on_object[..axes],
            coordination_force: &coordination[..axes],
            own_damping: self.peer.own_damping(),
            turn,
        })
    }

    /// Returns the state of the body on which the other peers act: the copy, or the device of a client.
    #[inline(always)]
    fn moved_by_coordination(&self, role: Role) -> State<A> {
        if role == Role::Copy { *self.peer.object().state() } else { self.peer.device().state() }
    }
}

impl<const A: usize, S: Strategy<A>, D: Device<A> + From<RestingDevice<A>>> Member<A, S, D> {
    pub(super) fn new(scene: &Scene, plan: &Plan, initial: &[State<A>], disturbance: Option<Disturbance>, place: usize, strategy: S) -> Self {
        let spec = &scene.peers[place];
        let (clock, integrator) = (spec.clock, scene.integrator);
        let displaced = |body| {
            // Body 0 is the device and body 1 the copy: each has a separate disturbance.
            let state = if body == 0 { scene.initial_device(place) } else { initial[place] };
            disturbance.map_or(state, |disturbance| disturbance.displace(state, scene.axes.count(), place, body))
        };
        let device = match plan.devices[place] {
            DeviceChoice::Resting | DeviceChoice::Unobserved => DeviceModel::Unsimulated(RestingDevice { position: displaced(0).position }.into()),
            DeviceChoice::Simulated => {
                DeviceModel::Simulated(SimulatedDevice::new(spec.device, spec.hand.as_ref(), displaced(0), integrator, &clock))
            }
        };
        let object = ObjectCopy::new(scene.copy_config(place), displaced(1), integrator, &clock);
        let held = match &scene.topology {
            None => Held::new(initial.iter().enumerate().filter(|(other, _)| *other != place).map(|(_, state)| *state)),
            Some(topology) => {
                let near = topology.neighbours(place).iter().map(|other| (*other, initial[*other as usize]));
                Held::of_some(near, topology.relative_weights(place))
            }
        };
        // The scene was checked: `update` is a multiple of the tick.
        let send_every = scene.coordination.update.as_nanos() / clock.tick.as_nanos();
        let mut peer = Peer::new(scene.peer_config(place), device, object, strategy, held);
        if let Some(mut rotation) = scene.rotation_of(place) {
            if let (Some(disturbance), Some(length)) = (disturbance, scene.gyration()) {
                disturbance.turn(&mut rotation, length, place);
            }
            peer = peer.with_rotation(rotation);
        }
        Self {
            peer,
            clock,
            tick: 0,
            next_send: spec.phase,
            send_every: u64::try_from(send_every).unwrap_or(u64::MAX),
            last_sent: None,
            stale_samples: 0,
            refused_samples: 0,
            commanded: [0.0; A],
        }
    }

    #[inline]
    pub(super) fn is_finite(&self) -> bool {
        let mut sum = State::REST;
        self.add_states(&mut sum);
        // The sum of finite states may overflow.
        let are_finite = || self.peer.object().state().is_finite() && self.peer.device().state().is_finite();
        (sum.is_finite() || are_finite()) && self.turns_finitely()
    }

    /// Returns whether the attitudes of the peer are finite; `true` without a rotation.
    pub(super) fn turns_finitely(&self) -> bool {
        self.peer.rotation().is_none_or(Rotation::is_finite)
    }

    /// Adds the states of copy and device to `sum`.
    #[inline]
    pub(super) fn add_states(&self, sum: &mut State<A>) {
        // One match arm for each kind, not a reference chosen by the match: each arm then reads a known address.
        match self.peer.device() {
            DeviceModel::Unsimulated(device) => sum.accumulate(&device.state()),
            DeviceModel::Simulated(device) => sum.accumulate(&device.state()),
        }
        sum.accumulate(self.peer.object().state());
    }
}
