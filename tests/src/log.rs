//! Every row of a run, and where two runs first differ.

use std::convert::Infallible;

use cohaptic_harness::{Model, Observer, PacketRow, Simulation, StateRow, Strategies, Summary, TickRow};
use cohaptic_scene::Scene;
use cohaptic_units::Instant;

use crate::Place;

/// Position and velocity; components beyond the scene's axes are zero.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Body {
    /// \[m\]
    pub position: Place,
    /// \[m/s\]
    pub velocity: Place,
}

/// One peer at one tick.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Tick {
    /// The instant.
    pub at: Instant,
    /// The peer's place.
    pub peer: usize,
    /// Its device.
    pub device: Body,
    /// Its copy.
    pub object: Body,
    /// Where its strategy wants the copy to be.
    pub target: Body,
    /// FC \[N\].
    pub coupling_force: Place,
    /// FT \[N\].
    pub coordination_force: Place,
}

/// All that happened in a run.
#[derive(Clone, PartialEq, Debug)]
pub struct Log {
    /// The rows of ticks, as they came.
    pub ticks: Vec<Tick>,
    /// The rows of packets, as they came.
    pub packets: Vec<PacketRow>,
    /// What came out.
    pub summary: Summary,
}

impl Log {
    /// The ticks of one peer.
    #[must_use]
    pub fn of(&self, peer: usize) -> Vec<&Tick> {
        self.ticks.iter().filter(|tick| tick.peer == peer).collect()
    }

    /// The last instant at which anybody ticked.
    #[must_use]
    pub fn end(&self) -> Instant {
        self.ticks.last().map_or(Instant::ZERO, |tick| tick.at)
    }
}

/// Runs a scene and keeps everything.
#[must_use]
pub fn run(scene: &Scene, model: Model) -> Log {
    keep(&Simulation::new(scene, model))
}

/// Runs a simulation and keeps everything.
#[must_use]
pub fn keep<S: Strategies>(simulation: &Simulation<'_, S>) -> Log {
    let mut keeper = Keeper { ticks: Vec::new(), packets: Vec::new() };
    let Ok(summary) = simulation.run(&mut keeper);
    Log { ticks: keeper.ticks, packets: keeper.packets, summary }
}

struct Keeper {
    ticks: Vec<Tick>,
    packets: Vec<PacketRow>,
}

impl Observer for Keeper {
    type Error = Infallible;

    fn wants_ticks(&self) -> bool {
        true
    }

    fn wants_packets(&self) -> bool {
        true
    }

    fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), Infallible> {
        let body = |state: StateRow<'_>| Body { position: place(state.position), velocity: place(state.velocity) };
        self.ticks.push(Tick {
            at: row.at,
            peer: row.peer,
            device: body(row.device),
            object: body(row.object),
            target: body(row.target),
            coupling_force: place(row.coupling_force),
            coordination_force: place(row.coordination_force),
        });
        Ok(())
    }

    fn on_packet(&mut self, row: &PacketRow) -> Result<(), Infallible> {
        self.packets.push(*row);
        Ok(())
    }
}

fn place(components: &[f64]) -> Place {
    std::array::from_fn(|axis| components.get(axis).copied().unwrap_or(0.0))
}

/// The first row in which two runs differ in any bit, with its time; `None` if there is none.
#[must_use]
pub fn first_difference(one: &Log, other: &Log) -> Option<String> {
    let ticks = one.ticks.iter().zip(&other.ticks).find(|(a, b)| bits(a) != bits(b) || (a.at, a.peer) != (b.at, b.peer));
    if let Some((a, b)) = ticks {
        return Some(format!("at {}: {a:?}\n  and {b:?}", a.at));
    }
    if let Some((a, b)) = one.packets.iter().zip(&other.packets).find(|(a, b)| a != b) {
        return Some(format!("at {}: {a:?}\n  and {b:?}", a.at));
    }
    let counts = |log: &Log| (log.ticks.len(), log.packets.len());
    if counts(one) != counts(other) {
        return Some(format!("ticks and packets: {:?} and {:?}", counts(one), counts(other)));
    }
    (one.summary != other.summary).then(|| format!("{:?}\n  and {:?}", one.summary, other.summary))
}

/// All numbers of a row. Unlike `==` this tells −0 from 0.
fn bits(tick: &Tick) -> Vec<u64> {
    let bodies = [&tick.device, &tick.object, &tick.target].into_iter().flat_map(|body| [&body.position, &body.velocity]);
    bodies.chain([&tick.coupling_force, &tick.coordination_force]).flatten().map(|value| value.to_bits()).collect()
}
