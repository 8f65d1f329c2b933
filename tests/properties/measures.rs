//! Every measure against what the rows of the run say: all ticks and packets are kept, and the figure is computed from them at the end.

use std::collections::BTreeMap;

use cohaptic_harness::measures::{MeasuredRun, Measures};
use cohaptic_harness::{Model, NoObserver, Simulation};
use cohaptic_peer::State;
use cohaptic_peer::wire::SampleKind;
use cohaptic_scene::{Measure, MeasureName, MeasureSettings, MeasureSpec, MeasureTravel, Scene};
use cohaptic_tests::{Body, Log, Place, Tick, drafts, run};
use cohaptic_tests_common::{cases, properties};
use cohaptic_units::Instant;
use cohaptic_wan::Fate;
use proptest::prelude::*;
use proptest::sample::Index;

use super::count;

/// The scene with all measures.
fn measuring(mut scene: Scene, settings: MeasureSettings) -> Scene {
    scene.measure = Some(MeasureSpec { names: MeasureName::all(scene.peers.len(), scene.task.is_some()), settings });
    scene
}

fn values(scene: &Scene, model: Model) -> BTreeMap<MeasureName, Option<f64>> {
    Measures::run(scene, model).values.into_iter().map(|measured| (measured.name, measured.value)).collect()
}

/// The rows of a run by instant: of each, the ticks in it.
fn instants(log: &Log) -> impl Iterator<Item = &[Tick]> {
    log.ticks.chunk_by(|one, other| one.at == other.at)
}

/// The discrepancy after each instant \[m\], by its definition.
fn discrepancies(scene: &Scene, log: &Log) -> Vec<(Instant, f64)> {
    let mut latest: Vec<Place> = scene.peers.iter().map(|peer| peer.position).collect();
    let after = |ticks: &[Tick]| {
        for tick in ticks {
            latest[tick.peer] = tick.object.position;
        }
        let along = |axis: usize| {
            let pairs = latest.iter().flat_map(|one| latest.iter().map(move |other| one[axis] - other[axis]));
            pairs.fold(0.0, f64::max)
        };
        (ticks[0].at, (0..3).map(along).fold(0.0, f64::max))
    };
    instants(log).map(after).collect()
}

/// The ⌈p·n/100⌉-th smallest.
fn ranked(values: &[f64], percent: usize) -> Option<f64> {
    let mut values = values.to_vec();
    values.sort_by(f64::total_cmp);
    values.get((percent * values.len()).div_ceil(100).max(1) - 1).copied()
}

fn rms(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| (values.iter().map(|value| value * value).sum::<f64>() / count(values.len())).sqrt())
}

fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, f64::max)
}

/// The components of a force of all peers at all ticks, and their changes from a tick to the next one.
fn force(scene: &Scene, log: &Log, of: impl Fn(&Tick) -> Place) -> (Vec<f64>, Vec<f64>) {
    let axes = scene.axes.count();
    let all = log.ticks.iter().flat_map(|tick| of(tick).into_iter().take(axes)).collect();
    let mut changes = Vec::new();
    for peer in 0..scene.peers.len() {
        for pair in log.of(peer).windows(2) {
            changes.extend((0..axes).map(|axis| (of(pair[1])[axis] - of(pair[0])[axis]).abs()));
        }
    }
    (all, changes)
}

/// The energy that the coordination injects, and how far it may be from the measure.
struct Energy {
    /// After each instant \[J\].
    injected: Vec<f64>,
    peers: Vec<f64>,
    rounding: f64,
}

/// Forces as the controller computes them at a tick: F without what β adds, and all that is held.
#[derive(Clone, Copy, Default)]
struct Held {
    coordination: Place,
    all: Place,
}

fn energy(scene: &Scene, log: &Log) -> Energy {
    let axes = scene.axes.count();
    let place = |components: &[f64]| -> Place { std::array::from_fn(|axis| components.get(axis).copied().unwrap_or(0.0)) };
    // The state at the end of the step that begins at each row.
    let mut next: Vec<Body> =
        log.summary.peers.iter().map(|peer| Body { position: place(&peer.position), velocity: place(&peer.velocity) }).collect();
    let mut after: Vec<Body> = log.ticks.iter().rev().map(|tick| std::mem::replace(&mut next[tick.peer], tick.object)).collect();
    after.reverse();
    let mut late = vec![Held::default(); scene.peers.len()];
    let mut energy = Energy { injected: Vec::new(), peers: vec![0.0; scene.peers.len()], rounding: 0.0 };
    let (mut sum, mut rows) = (0.0, after.iter());
    for ticks in instants(log) {
        for tick in ticks {
            let (peer, before, after) = (tick.peer, tick.object, rows.next().unwrap());
            let own = scene.own_damping(peer);
            let state = State { position: before.position, velocity: before.velocity };
            let walls = scene.object.enclosure.map_or([0.0; 3], |enclosure| enclosure.force(&state));
            let spring: Place = std::array::from_fn(|axis| tick.coordination_force[axis] - own * before.velocity[axis]);
            let computed = Held { coordination: spring, all: std::array::from_fn(|axis| tick.coupling_force[axis] - spring[axis] + walls[axis]) };
            let applied = if scene.peers[peer].compute_delay { std::mem::replace(&mut late[peer], computed) } else { computed };
            let copy = scene.copy_config(peer);
            let mut work = 0.0;
            for axis in 0..axes {
                let moved = after.position[axis] - before.position[axis];
                let kinetic = 0.5 * copy.mass * (after.velocity[axis].powi(2) - before.velocity[axis].powi(2));
                let damped = if own > 0.0 { own / copy.damping * (applied.all[axis] * moved - kinetic) } else { 0.0 };
                work -= applied.coordination[axis] * moved + damped;
                let squares = copy.mass * (after.velocity[axis].powi(2) + before.velocity[axis].powi(2));
                let forces =
                    applied.coordination[axis].abs() + applied.all[axis].abs() + tick.coupling_force[axis].abs() + own * before.velocity[axis].abs();
                // A sum of so many terms, each of some roundings.
                energy.rounding += 1e-13 * (forces * moved.abs() + squares);
            }
            sum += work;
            energy.peers[peer] += work;
        }
        energy.injected.push(sum);
    }
    energy
}

/// The ages of held samples at all ticks of their holders, from what became of every packet \[ns\].
fn ages(scene: &Scene, log: &Log) -> Vec<u64> {
    let mut ages = Vec::new();
    for from in 0..scene.peers.len() {
        for to in (0..scene.peers.len()).filter(|to| *to != from) {
            let arrived = |at: Instant| {
                let of_pair = log.packets.iter().filter(|packet| (packet.path.from.index(), packet.path.to.index()) == (from, to));
                let there = of_pair.filter(|packet| matches!(packet.fate, Fate::Delivered(arrival) if arrival <= at));
                there.max_by_key(|packet| packet.sequence).map(|packet| at.as_nanos() - packet.offered.as_nanos())
            };
            ages.extend(log.of(to).into_iter().filter_map(|tick| arrived(tick.at)));
        }
    }
    ages
}

/// Packets and bytes that peers hand to the network at most, from the ticks at which they may send; just as many without dead bands.
fn sent(scene: &Scene, log: &Log) -> (u64, u64) {
    let others = scene.peers.len() as u64 - 1;
    let sends = |peer: usize| {
        let every = scene.coordination.update.as_nanos() / scene.peers[peer].clock.tick.as_nanos();
        let ticks = log.of(peer).len() as u128;
        ticks.saturating_sub(u128::from(scene.peers[peer].phase)).div_ceil(every)
    };
    let receivers = |peer: usize| if scene.server().is_some_and(|server| server != peer) { 1 } else { others };
    let packets = (0..scene.peers.len()).map(|peer| u64::try_from(sends(peer)).unwrap() * receivers(peer)).sum();
    // docs/wire-format.md: 48 bytes, and 16 for each axis in version 1 or 24 in version 2.
    let of_axis = if scene.sample_kind() == SampleKind::State { 16 } else { 24 };
    (packets, packets * (48 + of_axis * scene.axes.count() as u64))
}

/// Equal, or off by at most `error`; a value that is no number is no value.
fn same(found: Option<f64>, expected: Option<f64>, error: f64) -> bool {
    match (found, expected.filter(|value| value.is_finite())) {
        (Some(found), Some(expected)) => (found - expected).abs() <= error,
        (found, expected) => found == expected,
    }
}

fn settings() -> BoxedStrategy<(Index, Index, f64, f64)> {
    (any::<Index>(), any::<Index>(), (-4.0..-1.0_f64).prop_map(|power| 10_f64.powf(power)), (-5.0..-1.0_f64).prop_map(|power| 10_f64.powf(power)))
        .boxed()
}

fn of((peer, axis, distance, band): &(Index, Index, f64, f64), scene: &Scene) -> MeasureSettings {
    let travel = MeasureTravel { peer: peer.index(scene.peers.len()), axis: axis.index(scene.axes.count()), distance: *distance };
    MeasureSettings { travel, band: *band, probe: None }
}

properties! {
    #![proptest_config(cases(150))]

    #[test]
    fn each_measure_is_what_the_rows_say(draft in drafts::anything(), settings in settings()) {
        let scene = draft.scene();
        let settings = of(&settings, &scene);
        let log = run(&scene, Model::Least);
        let found = values(&measuring(scene.clone(), settings.clone()), Model::Least);
        let of_run = |measure: Measure| found[&MeasureName { measure, peer: None }];
        let near = |measure: Measure, expected: Option<f64>, error: f64| {
            prop_assert!(same(of_run(measure), expected, error), "{}: {:?} for {:?} within {}", measure.name(), of_run(measure), expected, error);
            Ok(())
        };

        let apart = discrepancies(&scene, &log);
        let distances: Vec<f64> = apart.iter().map(|(_, distance)| *distance).collect();
        near(Measure::DiscrepancyRms, rms(&distances), 0.0)?;
        for (measure, percent) in [(Measure::DiscrepancyP50, 50), (Measure::DiscrepancyP95, 95), (Measure::DiscrepancyP99, 99)] {
            // Of 2^24 m and more nothing is told, and below 2^-40 m all is zero.
            let exact = ranked(&distances, percent).filter(|exact| *exact < 16_777_216.0);
            near(measure, exact, exact.map_or(0.0, |exact| exact / 256.0 + 2_f64.powi(-40)))?;
        }
        let outside = apart.iter().rposition(|(_, distance)| *distance > settings.band);
        let settled = outside.map_or(Some(0.0), |last| apart.get(last + 1).map(|(at, _)| at.as_secs_f64()));
        near(Measure::Settling, settled, 0.0)?;

        let MeasureTravel { peer, axis, distance } = settings.travel;
        // A client of a server begins where the server's copy does.
        let ticks = log.of(peer);
        let start = ticks.first().map_or(0.0, |tick| tick.object.position[axis]);
        let reached = ticks.into_iter().find(|tick| (tick.object.position[axis] - start).abs() >= distance);
        near(Measure::Travel, reached.map(|tick| tick.at.as_secs_f64()), 0.0)?;

        let of_forces = [
            (force(&scene, &log, |tick| tick.coordination_force), [Measure::ForcePeak, Measure::ForceRms, Measure::ForceJump]),
            (force(&scene, &log, |tick| tick.coupling_force), [Measure::FeltPeak, Measure::FeltRms, Measure::FeltJump]),
        ];
        for ((all, changes), [peak, root, jump]) in of_forces {
            near(peak, Some(largest(all.iter().map(|force| force.abs()))).filter(|_| !all.is_empty()), 0.0)?;
            near(root, rms(&all), 0.0)?;
            near(jump, Some(largest(changes.into_iter())).filter(|_| !all.is_empty()), 0.0)?;
        }

        let (packets, bytes) = sent(&scene, &log);
        let seconds = log.summary.duration.as_secs_f64();
        if scene.coordination.send_when.is_none() {
            near(Measure::PacketRate, Some(packets as f64 / seconds), 0.0)?;
            near(Measure::BitRate, Some(8.0 * bytes as f64 / seconds), 0.0)?;
        } else {
            prop_assert!(of_run(Measure::PacketRate).is_some_and(|rate| rate <= packets as f64 / seconds));
        }

        let ages = ages(&scene, &log);
        let mean = (!ages.is_empty()).then(|| ages.iter().sum::<u64>() as f64 / count(ages.len()) * 1e-9);
        near(Measure::AgeMean, mean, 1e-15 * mean.unwrap_or(0.0))?;
        let ages: Vec<f64> = ages.into_iter().map(|nanos| nanos as f64 * 1e-9).collect();
        let oldest = ranked(&ages, 99);
        near(Measure::AgeP99, oldest, oldest.unwrap_or(0.0) / 256.0)?;
        near(Measure::Viscosity, None, 0.0)?;
        near(Measure::EffectiveMass, None, 0.0)?;
    }

    /// W by the motion from row to row. Without damping of its own the law's force stands in the rows as it is, so the sums have the same bits.
    #[test]
    fn energy_is_the_work_of_held_forces_over_the_steps_taken(draft in drafts::anything()) {
        let scene = draft.scene();
        // Of clients W is that of their devices, whose last step is not in the rows.
        prop_assume!(scene.server().is_none());
        let log = run(&scene, Model::Least);
        let found = values(&measuring(scene.clone(), MeasureSettings::default()), Model::Least);
        let Energy { injected, peers, rounding } = energy(&scene, &log);
        let own = (0..peers.len()).any(|peer| scene.own_damping(peer) > 0.0);
        let error = if own { rounding } else { 0.0 };
        let at_end = injected.last().copied().unwrap_or(0.0);
        let energy = found[&MeasureName { measure: Measure::Energy, peer: None }];
        prop_assert!(same(energy, Some(at_end), error), "{energy:?} for {at_end} within {error}");
        let peak = found[&MeasureName { measure: Measure::EnergyPeak, peer: None }];
        prop_assert!(same(peak, Some(largest(injected.iter().copied())), error), "{peak:?}");
        for (peer, expected) in peers.into_iter().enumerate() {
            let ticked = !log.of(peer).is_empty();
            let energy = found[&MeasureName { measure: Measure::PeerEnergy, peer: Some(peer) }];
            prop_assert!(same(energy, ticked.then_some(expected), error), "{energy:?} for {expected} within {error}");
        }
    }

    #[test]
    fn the_general_model_gives_the_same_bits(draft in drafts::anything(), settings in settings()) {
        let scene = draft.scene();
        let settings = of(&settings, &scene);
        let scene = measuring(scene, settings);
        let bits = |model: Model| -> Vec<_> { values(&scene, model).into_iter().map(|(name, value)| (name, value.map(f64::to_bits))).collect() };
        prop_assert_eq!(bits(Model::Least), bits(Model::General));
    }

    /// And one measure alone is what it is among all.
    #[test]
    fn measures_change_nothing_that_happens(draft in drafts::anything(), which in any::<Index>()) {
        let scene = draft.scene();
        let Ok(unseen) = Simulation::new(&scene, Model::Least).run(&mut NoObserver);
        let mut measured = measuring(scene, MeasureSettings::default());
        let MeasuredRun { summary, values: all, .. } = Measures::run(&measured, Model::Least);
        prop_assert_eq!(format!("{summary:?}"), format!("{unseen:?}"));
        let one = all[which.index(all.len())];
        measured.measure.as_mut().unwrap().names = vec![one.name];
        let alone = Measures::run(&measured, Model::Least).values;
        prop_assert_eq!(alone.len(), 1);
        prop_assert_eq!((alone[0].name, alone[0].value.map(f64::to_bits)), (one.name, one.value.map(f64::to_bits)));
    }
}
