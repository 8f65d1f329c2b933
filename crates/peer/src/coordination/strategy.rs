//! What a peer asks of its coordination.

use alloc::boxed::Box;

use cohaptic_units::Instant;

use crate::{Gains, Held, State};

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

    /// Whether the strategy asks for [`Held::lead`]; asked once, when the peer is made.
    fn needs_ages(&self) -> bool {
        false
    }

    /// New gains, from the next tick on. A strategy without gains ignores them.
    fn set_gains(&mut self, gains: Gains);

    /// Everything the strategy remembers from tick to tick, as numbers; always as many. Empty for one that remembers nothing.
    ///
    /// The stability analysis puts a strategy into a state and looks where it goes. A strategy that remembers what it does not show here is refused there.
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

    fn needs_ages(&self) -> bool {
        (**self).needs_ages()
    }

    fn set_gains(&mut self, gains: Gains) {
        (**self).set_gains(gains);
    }

    fn memory(&self) -> &[f64] {
        (**self).memory()
    }

    fn set_memory(&mut self, memory: &[f64]) {
        (**self).set_memory(memory);
    }
}
