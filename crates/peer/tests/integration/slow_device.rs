//! A peer whose device exchanges at fewer ticks than the peer computes, against numbers of an independent program.

use std::time::Duration;

use cohaptic_peer::{
    Clock, Contact, Coordination, CopyConfig, Device as _, DeviceConfig, Exchange, Gains, Hand, Held, Integrator, ObjectCopy, Peer, PeerConfig,
    Signal, SimulatedDevice, State, coordination::LawStrategy,
};

const TICK: Duration = Duration::from_millis(1);

/// Returns device and copy (xH, vH, xO, vO) after 100 ticks of 1 ms under a hand of 1.5 N: half of 0.45 kg drawn to another copy at rest at 0.
fn after_100_ticks(coupling: Gains, exchange: Exchange) -> [f64; 4] {
    after_100_ticks_of(peer(coupling, exchange))
}

fn peer(coupling: Gains, exchange: Exchange) -> Peer<1, SimulatedDevice<1>, LawStrategy<1>> {
    let clock = Clock::regular(TICK);
    let config = PeerConfig {
        session: 0,
        place: 0,
        axes: 1,
        contact: Contact::Grasp,
        coupling,
        tick: TICK,
        compute_delay: false,
        exchange,
        own_damping: 0.0,
        enclosure: None,
    };
    let hand = Hand::Force(Signal::Constant([1.5, 0.0, 0.0]));
    let device = SimulatedDevice::new(DeviceConfig { mass: 0.1, damping: 5.0 }, Some(&hand), State::REST, Integrator::Exact, &clock);
    let object = ObjectCopy::new(CopyConfig { mass: 0.225, damping: 0.0 }, State::REST, Integrator::Exact, &clock);
    let law = Coordination::AveragePosition.strategy(Gains { stiffness: 500.0, damping: 5.0 }, 2, TICK);
    Peer::new(config, device, object, law, Held::new([State::REST]))
}

fn after_100_ticks_of(mut peer: Peer<1, SimulatedDevice<1>, LawStrategy<1>>) -> [f64; 4] {
    for tick in 0..100 {
        let now = Clock::regular(TICK).instant(tick).expect("a tenth of a second can be counted");
        peer.compute(now);
        peer.advance(now, TICK);
    }
    let (device, object) = (peer.device().state(), peer.object().state());
    [device.position[0], device.velocity[0], object.position[0], object.velocity[0]]
}

fn agree(found: [f64; 4], expected: [f64; 4]) {
    for (found, expected) in found.into_iter().zip(expected) {
        assert!((found - expected).abs() <= 1e-12, "{found} is not {expected}");
    }
}

#[test]
fn an_exchange_at_each_tick_moves_as_the_reference_says() {
    let expected = [0.004_189_098_680_446_95, -0.012_628_365_389_951_2, 0.003_717_446_243_695, -0.012_160_247_577_023_5];
    agree(after_100_ticks(Gains { stiffness: 3500.0, damping: 5.0 }, Exchange::EACH_TICK), expected);
}

#[test]
fn late_readings_at_every_second_tick_move_as_the_reference_says() {
    let expected = [0.005_249_524_637_675_79, -0.011_154_064_835_519_7, 0.003_774_464_098_998_85, -0.005_454_790_302_800_96];
    agree(after_100_ticks(Gains { stiffness: 1000.0, damping: 2.0 }, Exchange { every: 2, late: true }), expected);
}

/// Zero ticks from one exchange to the next are no pace: such a device exchanges at each tick.
#[test]
fn a_device_without_a_pace_exchanges_at_each_tick() {
    let coupling = Gains { stiffness: 1000.0, damping: 2.0 };
    for late in [false, true] {
        let [zero, one] = [0, 1].map(|every| after_100_ticks(coupling, Exchange { every, late }));
        assert_eq!(zero.map(f64::to_bits), one.map(f64::to_bits), "late: {late}");
    }
}

/// A pace that is set takes the place of the pace with which the peer was made, in both directions.
#[test]
fn a_pace_that_is_set_is_the_pace_of_all_later_ticks() {
    let coupling = Gains { stiffness: 1000.0, damping: 2.0 };
    let slow = Exchange { every: 2, late: true };
    for (made, set) in [(Exchange::EACH_TICK, slow), (slow, Exchange::EACH_TICK)] {
        let mut peer = peer(coupling, made);
        peer.set_exchange(set);
        assert_eq!(after_100_ticks_of(peer).map(f64::to_bits), after_100_ticks(coupling, set).map(f64::to_bits), "{made:?}, then {set:?}");
    }
}
