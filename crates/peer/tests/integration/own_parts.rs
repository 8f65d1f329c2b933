//! A device and a strategy of another crate, in a [`Peer`].

use std::time::Duration;

use cohaptic_peer::wire::{MAX_LEN, Sample};
use cohaptic_peer::{
    Clock, Command, Contact, Context, CopyConfig, Device, Exchange, Gains, Held, Integrator, ObjectCopy, Peer, PeerConfig, State, Strategy,
};
use cohaptic_units::Instant;

/// A device whose position follows a script, and which records the forces on it.
#[derive(Debug, Default)]
struct Scripted {
    tick: u32,
    felt: Vec<(Instant, Duration, f64)>,
}

impl Device<1> for Scripted {
    fn state(&self) -> State<1> {
        State { position: [f64::from(self.tick)], velocity: [0.0] }
    }

    fn advance(&mut self, now: Instant, span: Duration, coupling_force: [f64; 1]) {
        self.felt.push((now, span, coupling_force[0]));
        self.tick += 1;
    }
}

/// A strategy that follows the first other peer only, with a gain that can be changed, and records the instants of its commands.
#[derive(Debug)]
struct FollowTheFirst {
    stiffness: f64,
    asked: Vec<Instant>,
}

impl Strategy<1> for FollowTheFirst {
    fn command(&mut self, context: &Context<'_, 1>) -> Command<1> {
        self.asked.push(context.now);
        let target = *context.held.state(0).expect("there is another peer");
        Command { force: [self.stiffness * (context.own.position[0] - target.position[0])], target }
    }

    fn set_gains(&mut self, gains: Gains) {
        self.stiffness = gains.stiffness;
    }
}

fn peer<D: Device<1>, S: Strategy<1>>(device: D, strategy: S, compute_delay: bool) -> Peer<1, D, S> {
    exchanging(device, strategy, compute_delay, Exchange::EACH_TICK)
}

fn exchanging<D: Device<1>, S: Strategy<1>>(device: D, strategy: S, compute_delay: bool, exchange: Exchange) -> Peer<1, D, S> {
    let coupling = Gains { stiffness: 2.0, damping: 0.0 };
    let config = PeerConfig {
        session: 0,
        place: 0,
        axes: 1,
        contact: Contact::Grasp,
        coupling,
        tick: Duration::from_millis(1),
        compute_delay,
        exchange,
        own_damping: 0.0,
        enclosure: None,
    };
    let clock = Clock::regular(Duration::from_millis(1));
    // A mass that moves too little to matter.
    let object = ObjectCopy::new(CopyConfig { mass: 1e300, damping: 0.0 }, State::REST, Integrator::Exact, &clock);
    Peer::new(config, device, object, strategy, Held::new([State::REST, State::REST]))
}

fn at(tick: u64) -> Instant {
    Instant::from_nanos(1_000_000 * tick)
}

#[test]
fn a_device_feels_the_coupling_force_of_its_tick_or_of_the_one_before() {
    for (compute_delay, expected) in [(false, [0.0, 2.0, 4.0, 6.0]), (true, [0.0, 0.0, 2.0, 4.0])] {
        let mut peer = peer(Scripted::default(), FollowTheFirst { stiffness: 0.0, asked: Vec::new() }, compute_delay);
        for tick in 0..4 {
            let forces = peer.compute(at(tick));
            // FC = KC·(xH − xO) with KC = 2 N/m, xH = tick and xO = 0, whatever is applied.
            assert_eq!(forces.coupling, [2.0 * f64::from(u32::try_from(tick).unwrap())]);
            peer.advance(at(tick), Duration::from_millis(1));
        }
        let felt: Vec<f64> = peer.device().felt.iter().map(|(_, _, force)| *force).collect();
        assert_eq!(felt, expected, "compute-delay {compute_delay}");
        assert_eq!(peer.device().felt[3].0, at(3));
        assert_eq!(peer.device().felt[3].1, Duration::from_millis(1));
    }
}

/// The device is at 0, 1, 2, … m at its ticks and the copy rests at 0, so FC is KC = 2 N/m times the reading.
#[test]
fn a_slow_device_is_read_at_its_exchanges_and_keeps_their_force() {
    for (every, late, expected) in [
        (1, true, [0.0, 0.0, 2.0, 4.0, 6.0, 8.0, 10.0]),
        (2, false, [0.0, 0.0, 4.0, 4.0, 8.0, 8.0, 12.0]),
        (2, true, [0.0, 0.0, 0.0, 0.0, 4.0, 4.0, 8.0]),
        (3, false, [0.0, 0.0, 0.0, 6.0, 6.0, 6.0, 12.0]),
    ] {
        let mut peer = exchanging(Scripted::default(), FollowTheFirst { stiffness: 0.0, asked: Vec::new() }, false, Exchange { every, late });
        let coupling = (0..7).map(|tick| {
            let [force] = peer.compute(at(tick)).coupling;
            peer.advance(at(tick), Duration::from_millis(1));
            force
        });
        let coupling = coupling.collect::<Vec<f64>>();
        let felt: Vec<f64> = peer.device().felt.iter().map(|(_, _, force)| *force).collect();
        assert_eq!((coupling.as_slice(), felt.as_slice()), (&expected[..], &expected[..]), "every {every}, late {late}");
    }
}

#[test]
fn a_strategy_is_asked_once_a_tick_and_sees_the_samples_one_by_one() {
    let mut peer = peer(Scripted::default(), FollowTheFirst { stiffness: 3.0, asked: Vec::new() }, false);
    let mut datagram = [0; MAX_LEN];
    for (sender, position) in [(1, 5.0), (2, 7.0)] {
        let state = State { position: [position], velocity: [0.0] };
        let len = Sample { session: 0, sender, sequence: 0, sent: Instant::ZERO, state }.encode(1, &mut datagram);
        peer.handle_datagram(&datagram[..len]).unwrap();
    }
    assert_eq!(peer.compute(at(0)).coordination, [-15.0]);
    peer.strategy_mut().set_gains(Gains { stiffness: 10.0, damping: 0.0 });
    peer.advance(at(0), Duration::from_millis(1));
    assert_eq!(peer.compute(at(1)).coordination, [-50.0]);
    assert_eq!(peer.strategy_mut().asked, [at(0), at(1)]);
}

/// Both traits can be used as trait objects, so a driver may choose device and strategy at run time.
#[test]
fn devices_and_strategies_may_be_boxed() {
    let device: Box<dyn Device<1>> = Box::new(Scripted::default());
    let strategy: Box<dyn Strategy<1>> = Box::new(FollowTheFirst { stiffness: 3.0, asked: Vec::new() });
    let mut peer = peer(device, strategy, false);
    peer.advance(at(0), Duration::from_millis(1));
    assert_eq!(peer.compute(at(1)).coupling, [2.0]);
}
