//! What a peer asks of its coordination.

use alloc::boxed::Box;

use cohaptic_units::Instant;

use super::LawValues;
use crate::wire::SampleKind;
use crate::{Contact, Gains, Held, State};

/// What a strategy sees at a tick.
#[derive(Debug)]
pub struct Context<'a, const A: usize> {
    /// The instant of the tick.
    pub now: Instant,
    /// What the peer's own clock shows.
    pub local_time: Instant,
    /// The peer's own copy of the object.
    pub own: &'a State<A>,
    /// The newest samples from the others.
    pub held: &'a Held<A>,
    /// How the coordination force moves the copy over this tick; at rest for a strategy that does not [ask](Strategy::needs_prediction).
    pub ahead: Prediction<A>,
}

/// The motion of a copy over a tick as a function of the coordination force F: d = free − compliance·F.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Prediction<const A: usize> {
    /// The motion without a coordination force, walls and coupling included \[m\].
    pub free: [f64; A],
    /// By how much a newton that acts over the tick moves the copy [m/N]; above zero.
    pub compliance: f64,
}

impl<const A: usize> Prediction<A> {
    /// Nothing moves.
    pub const REST: Self = Self { free: [0.0; A], compliance: 0.0 };
}

/// Which part of the shared object a peer has.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Role {
    /// A copy of its own.
    #[default]
    Copy,
    /// None: it sends the state of its device, and its copy is the newest state heard from a server.
    Client {
        /// The place of the server among the others, in order with this peer left out.
        server: usize,
    },
}

/// What a strategy answers.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Command<const A: usize> {
    /// The coordination force FT \[N\]; equation (8) subtracts it.
    pub force: [f64; A],
    /// Where the strategy wants the copy to be, (xd, vd), for the record.
    pub target: State<A>,
}

/// A coordination strategy of one peer.
///
/// It must be deterministic: the answer depends on the calls made so far and on nothing else.
///
/// A peer with a strategy of its own, a tenth of a second of which is run:
///
/// ```
/// use core::time::Duration;
///
/// use cohaptic_peer::{
///     Clock, Command, Contact, Context, CopyConfig, DeviceConfig, Gains, Held, Integrator, ObjectCopy, Peer, PeerConfig, SimulatedDevice, State,
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
    /// The command at a tick. Called exactly once a tick, after the samples that have arrived were taken in.
    fn command(&mut self, context: &Context<'_, A>) -> Command<A>;

    /// Up to which age \[s\] samples move on in [`Held::lead`], for a strategy that asks for it; asked once, when the peer is made.
    fn horizon(&self) -> Option<f64> {
        None
    }

    /// Whether the strategy asks for [`Context::ahead`]; asked once, when the peer is made.
    fn needs_prediction(&self) -> bool {
        false
    }

    /// Which part of the object the peer has; asked once, when the peer is made.
    fn role(&self) -> Role {
        Role::Copy
    }

    /// What samples carry beyond the state; asked once, when the peer is made. With [`SampleKind::State`], [`Strategy::extra`], [`Strategy::sent`] and
    /// [`Strategy::accept`] are not called.
    fn kind(&self) -> SampleKind {
        SampleKind::State
    }

    /// The extra numbers of the sample that is sent now, before the command of the tick, to another peer; of a kind that is not personal, to all of them,
    /// and `receiver` is 0. The others count in order, with this peer left out.
    fn extra(&mut self, _receiver: usize, _own: &State<A>, _held: &Held<A>) -> [f64; A] {
        [0.0; A]
    }

    /// The samples of this tick have been made for all receivers.
    fn sent(&mut self, _own: &State<A>) {}

    /// The extra numbers of a sample that is newer than all before it from another peer.
    fn accept(&mut self, _other: usize, _numbers: &[f64; A]) {}

    /// The coupling force FC that was heard of \[N\], for a peer that does not compute it.
    fn heard_coupling(&self) -> Option<[f64; A]> {
        None
    }

    /// How the device of another peer touches the object from the next tick on; for a strategy that computes the coupling of others.
    fn set_contact(&mut self, _other: usize, _contact: Contact) {}

    /// New gains, from the next tick on. A strategy without gains ignores them.
    fn set_gains(&mut self, gains: Gains);

    /// New values of the parameters that the strategy has of its own, from the next tick on: of those that [can change](super::LawParameter::can_change). β is part
    /// of the body, and the peer changes it.
    fn set_parameters(&mut self, _own: &LawValues) {}

    /// Everything the strategy remembers from tick to tick, as numbers; always as many. Empty for one that remembers nothing.
    ///
    /// The stability analysis puts a strategy into a state and looks where it goes. A strategy that remembers what it does not show here is refused there,
    /// but for two things. Counts of ticks need not be shown: the state is put back where they stand as at the beginning of any frame. A strategy of a
    /// [kind](Strategy::kind) that shows nothing is handed again what it accepted last.
    fn memory(&self) -> &[f64] {
        &[]
    }

    /// Puts [`Strategy::memory`] back, or replaces it by as many other numbers.
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
