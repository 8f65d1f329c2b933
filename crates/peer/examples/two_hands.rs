//! Two people hold one cube, each with a haptic device, 2000 km apart. One of them pulls for a second and lets go.
//!
//! Each peer has a copy of the cube; a spring and a damper pull each copy towards the newest sample of the other one. The example shows the loop of a
//! program of your own around [`Peer`]: send, receive, compute, advance. The way of the samples is the loop's business, here a queue with a delay.
//!
//! ```text
//! cargo run -p cohaptic-peer --example two_hands
//! ```
#![allow(clippy::print_stdout, reason = "an example prints")]

use std::collections::VecDeque;
use std::error::Error;
use std::fmt::Write as _;
use std::time::Duration;

use cohaptic_peer::coordination::LawStrategy;
use cohaptic_peer::wire::MAX_LEN;
use cohaptic_peer::{
    Clock, Contact, Coordination, CopyConfig, DeviceConfig, Exchange, Gains, Hand, Held, Integrator, ObjectCopy, Peer, PeerConfig, Signal,
    SimulatedDevice, State,
};

const TICK: Duration = Duration::from_millis(1);
/// A sample goes out at each eighth tick, 125 times a second.
const UPDATE: u64 = 8;

type OnePeer = Peer<1, SimulatedDevice<1>, LawStrategy<1>>;

fn peer(place: u32, clock: &Clock) -> OnePeer {
    let device = SimulatedDevice::new(DeviceConfig { mass: 0.1, damping: 5.0 }, None, State::REST, Integrator::Exact, clock);
    // Each copy has half of the cube's 450 g.
    let object = ObjectCopy::new(CopyConfig { mass: 0.225, damping: 0.0 }, State::REST, Integrator::Exact, clock);
    let strategy = Coordination::AveragePosition.strategy(Gains { stiffness: 500.0, damping: 5.0 }, 2, TICK);
    let config = PeerConfig {
        session: 1,
        place,
        axes: 1,
        contact: Contact::Grasp,
        coupling: Gains { stiffness: 3500.0, damping: 5.0 },
        tick: TICK,
        compute_delay: false,
        exchange: Exchange::EACH_TICK,
        own_damping: 0.0,
        enclosure: None,
    };
    Peer::new(config, device, object, strategy, Held::new([State::REST]))
}

/// The state after one tick: where both copies are \[m\], and the force that the second user feels \[N\].
struct Row {
    copies: [f64; 2],
    felt: f64,
}

/// Runs three seconds over a way that takes this number of ticks. Returns a row for each tick.
fn pull(delay: u64) -> Result<Vec<Row>, Box<dyn Error>> {
    let clock = Clock::regular(TICK);
    let mut peers = [peer(0, &clock), peer(1, &clock)];
    // Samples on their way to each peer: the tick of the arrival, and the bytes.
    let mut ways = [VecDeque::new(), VecDeque::new()];
    let mut rows = Vec::new();
    for tick in 0..3000 {
        let now = clock.instant(tick).ok_or("the clock has ended")?;
        match tick {
            0 => peers[0].device_mut().set_hand(Some(&Hand::Force(Signal::Constant([1.5, 0.0, 0.0])))),
            1000 => peers[0].device_mut().set_hand(None),
            _ => {}
        }
        for place in 0..2 {
            if tick % UPDATE == 0 {
                let mut sample = [0; MAX_LEN];
                let length = peers[place].sample(clock.local_time(tick), &mut sample);
                ways[1 - place].push_back((tick + delay, sample[..length].to_vec()));
            }
        }
        let mut felt = 0.0;
        for (peer, way) in peers.iter_mut().zip(&mut ways) {
            while let Some((_, sample)) = way.front().filter(|(arrival, _)| *arrival <= tick) {
                peer.handle_datagram(sample)?;
                way.pop_front();
            }
            felt = peer.compute(now).coupling[0];
            peer.advance(now, TICK);
        }
        rows.push(Row { copies: peers.each_ref().map(|peer| peer.object().state().position[0]), felt: -felt });
    }
    Ok(rows)
}

/// Returns the table of the README.
fn table() -> Result<String, Box<dyn Error>> {
    let mut text = format!("{:>9} {:>10} {:>11} {:>12} {:>14}\n", "delay", "time", "first copy", "second copy", "second user");
    for delay in [0, 24, 100] {
        for (row, tick) in pull(delay)?.iter().zip(1..).filter(|(_, tick)| [100, 250, 500, 1000, 2000, 3000].contains(tick)) {
            let Row { copies: [first, second], felt } = row;
            writeln!(text, "{delay:>6} ms {tick:>7} ms {:>8.2} mm {:>9.2} mm {felt:>12.3} N", first * 1e3, second * 1e3)?;
        }
    }
    Ok(text)
}

fn main() -> Result<(), Box<dyn Error>> {
    print!("{}", table()?);
    Ok(())
}

#[test]
fn the_readme_shows_the_table() -> Result<(), Box<dyn Error>> {
    assert!(include_str!("../README.md").contains(&table()?), "{}", table()?);
    Ok(())
}
