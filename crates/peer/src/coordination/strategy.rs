//! Interface between a peer and its coordination.

use alloc::boxed::Box;

use cohaptic_units::Instant;

use super::LawValues;
use crate::sample_kind::SampleKind;
use crate::{Contact, Gains, Held, State};

/// Input of a strategy at a tick.
#[derive(Debug)]
pub struct Context<'a, const A: usize> {
    /// Instant of the tick.
    pub now: Instant,
    /// Time on the peer's own clock.
    pub local_time: Instant,
    /// State of the peer's own copy of the object.
    pub own: &'a State<A>,
    /// Newest samples of other peers.
    pub held: &'a Held<A>,
    /// Motion of the copy over this tick as a function of the coordination force; [`Prediction::REST`] for a strategy that does not
    /// [ask](Strategy::needs_prediction).
    pub ahead: Prediction<A>,
}

/// Motion of a copy over a tick as a function of the coordination force F: d = free − compliance·F.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Prediction<const A: usize> {
    /// Motion without a coordination force, with walls and coupling \[m\].
    pub free: [f64; A],
    /// Motion per force that acts over the tick [m/N]; above zero.
    pub compliance: f64,
}

impl<const A: usize> Prediction<A> {
    /// A prediction without motion.
    pub const REST: Self = Self { free: [0.0; A], compliance: 0.0 };
}

/// Part of the shared object that a peer simulates.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Role {
    /// The peer has a copy of its own.
    #[default]
    Copy,
    /// The peer sends the state of its device, and has no copy of its own: the newest state heard from a server takes the place of the copy.
    Client {
        /// Index of the server in the order of peers without this peer.
        server: usize,
    },
}

/// Result of a strategy at a tick.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Command<const A: usize> {
    /// Coordination force FT \[N\], which equation (8) subtracts.
    pub force: [f64; A],
    /// Desired motion of the copy (xd, vd), for the record.
    pub target: State<A>,
}

/// A coordination strategy of one peer.
///
/// A strategy must be deterministic: its result depends on the earlier calls alone.
///
/// Example: a peer with a strategy of its own, run for a tenth of a second.
///
/// ```
/// use core::time::Duration;
///
/// use cohaptic_peer::{
///     Clock, Command, Contact, Context, CopyConfig, DeviceConfig, Exchange, Gains, Held, Integrator, ObjectCopy, Peer, PeerConfig, SimulatedDevice, State,
///     Strategy, wire::MAX_LEN,
/// };
/// use cohaptic_units::Instant;
///
/// /// Pulls towards the mean position of the others and brakes the own velocity.
/// struct DampingInjection(Gains);
///
/// impl<const A: usize> Strategy<A> for DampingInjection {
///     fn command(&mut self, context: &Context<'_, A>) -> Command<A> {
///         let (own, mean) = (context.own, *context.held.mean());
///         let force = core::array::from_fn(|axis| {
///             self.0.stiffness * (own.position[axis] - mean.position[axis]) + self.0.damping * own.velocity[axis]
///         });
///         Command { force, target: mean }
///     }
///
///     fn set_gains(&mut self, gains: Gains) {
///         self.0 = gains;
///     }
/// }
///
/// let tick = Duration::from_millis(1);
/// let clock = Clock::regular(tick);
/// let device = SimulatedDevice::<1>::new(DeviceConfig { mass: 0.1, damping: 5.0 }, None, State::REST, Integrator::Exact, &clock);
/// let object = ObjectCopy::new(CopyConfig { mass: 0.15, damping: 0.0 }, State::REST, Integrator::Exact, &clock);
/// let config = PeerConfig {
///     session: 7,
///     place: 0,
///     axes: 1,
///     contact: Contact::Grasp,
///     coupling: Gains { stiffness: 3500.0, damping: 5.0 },
///     tick,
///     compute_delay: false,
///     exchange: Exchange::EACH_TICK,
///     own_damping: 0.0,
///     enclosure: None,
/// };
/// // One other peer, whose copy begins 1 cm away.
/// let other = State { position: [0.01], velocity: [0.0] };
/// let strategy = DampingInjection(Gains { stiffness: 1000.0, damping: 5.0 });
/// let mut peer = Peer::new(config, device, object, strategy, Held::new([other]));
///
/// let mut datagram = [0; MAX_LEN];
/// for k in 0..100 {
///     let now = clock.instant(k).expect("a tenth of a second can be counted");
///     if k % 8 == 0 {
///         let len = peer.sample(clock.local_time(k), &mut datagram);
///         let _to_send: &[u8] = &datagram[..len];
///     }
///     // peer.handle_datagram(…) for each datagram that has arrived by now
///     let _forces = peer.compute(now);
///     peer.advance(now, tick);
/// }
/// println!("{} m at {}", peer.object().state().position[0], Instant::from_nanos(100_000_000));
/// ```
pub trait Strategy<const A: usize> {
    /// Returns the command at a tick. Called exactly once per tick, after the arrived samples are taken in.
    fn command(&mut self, context: &Context<'_, A>) -> Command<A>;

    /// Returns the greatest age of extrapolation in [`Held::lead`] \[s\]; `None` for a strategy that does not use the lead. Asked once, in
    /// [`Peer::new`](crate::Peer::new).
    fn horizon(&self) -> Option<f64> {
        None
    }

    /// Returns whether the strategy uses [`Context::ahead`]. Asked once, in [`Peer::new`](crate::Peer::new).
    fn needs_prediction(&self) -> bool {
        false
    }

    /// Returns the part of the object that the peer simulates. Asked once, in [`Peer::new`](crate::Peer::new).
    fn role(&self) -> Role {
        Role::Copy
    }

    /// Returns the kind of data in samples beyond position and velocity. Asked once, in [`Peer::new`](crate::Peer::new). For [`SampleKind::State`], the
    /// methods [`Strategy::extra`], [`Strategy::sent`] and [`Strategy::accept`] are not called.
    fn kind(&self) -> SampleKind {
        SampleKind::State
    }

    /// Returns the extra numbers of the present sample, before the command of the tick. `receiver` is the index of the receiver in the order of peers without
    /// this peer, or 0 for a kind that is equal for all receivers. `own` is the state in the sample: that of the copy, or of the device of a client.
    fn extra(&mut self, _receiver: usize, _own: &State<A>, _held: &Held<A>) -> [f64; A] {
        [0.0; A]
    }

    /// Tells the strategy that the samples of this tick are complete for all receivers. `own` is the state in these samples.
    fn sent(&mut self, _own: &State<A>) {}

    /// Takes in the extra numbers of a sample that is newer than all earlier samples of this sender. Not called for [`SampleKind::Increment`] at a peer with a
    /// copy: the peer itself adds these numbers to the held position. `_other` is the index of the sender in the order of
    /// peers without this peer.
    fn accept(&mut self, _other: usize, _numbers: &[f64; A]) {}

    /// Returns the coupling force FC heard from another peer \[N\]; `None` if this peer computes FC.
    fn heard_coupling(&self) -> Option<[f64; A]> {
        None
    }

    /// Sets the contact of another peer's device from the next tick on, for a strategy that computes couplings of other peers.
    fn set_contact(&mut self, _other: usize, _contact: Contact) {}

    /// Sets the gains from the next tick on. A strategy without gains ignores the call.
    fn set_gains(&mut self, gains: Gains);

    /// Sets the strategy's own parameters from the next tick on, as far as they [can change](super::LawParameter::can_change). β is part of the body, and the
    /// peer changes it.
    fn set_parameters(&mut self, _own: &LawValues) {}

    /// Returns the whole state of the strategy between ticks as numbers, always equally many. Empty for a strategy without a state.
    ///
    /// The stability analysis sets the state of a strategy and observes its evolution. The analysis refuses a strategy with a hidden state, with two
    /// exceptions. Counts of ticks may be hidden: the analysis sets the state where the counts stand as at the beginning of any frame. A strategy of a
    /// [kind](Strategy::kind) beyond the state that returns no memory is given its last accepted numbers again.
    fn memory(&self) -> &[f64] {
        &[]
    }

    /// Sets the state of the strategy: [`Strategy::memory`] of an earlier tick, or equally many other numbers.
    fn set_memory(&mut self, _memory: &[f64]) {}
}

impl<const A: usize, S: Strategy<A> + ?Sized> Strategy<A> for Box<S> {
    fn command(&mut self, context: &Context<'_, A>) -> Command<A> {
        (**self).command(context)
    }

    fn horizon(&self) -> Option<f64> {
        (**self).horizon()
    }

    fn needs_prediction(&self) -> bool {
        (**self).needs_prediction()
    }

    fn role(&self) -> Role {
        (**self).role()
    }

    fn kind(&self) -> SampleKind {
        (**self).kind()
    }

    fn extra(&mut self, receiver: usize, own: &State<A>, held: &Held<A>) -> [f64; A] {
        (**self).extra(receiver, own, held)
    }

    fn sent(&mut self, own: &State<A>) {
        (**self).sent(own);
    }

    fn accept(&mut self, other: usize, numbers: &[f64; A]) {
        (**self).accept(other, numbers);
    }

    fn heard_coupling(&self) -> Option<[f64; A]> {
        (**self).heard_coupling()
    }

    fn set_contact(&mut self, other: usize, contact: Contact) {
        (**self).set_contact(other, contact);
    }

    fn set_gains(&mut self, gains: Gains) {
        (**self).set_gains(gains);
    }

    fn set_parameters(&mut self, own: &LawValues) {
        (**self).set_parameters(own);
    }

    fn memory(&self) -> &[f64] {
        (**self).memory()
    }

    fn set_memory(&mut self, memory: &[f64]) {
        (**self).set_memory(memory);
    }
}
