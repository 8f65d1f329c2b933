//! The experiments of the paper's Section 5, simulated with the shipped scenes.

use std::convert::Infallible;
use std::path::Path;

use cohaptic_harness::{Model, Observer, Simulation, TickRow};
use cohaptic_peer::Contact;
use cohaptic_scene::Scene;
use cohaptic_stability::{Admittance, Analysis, Method, PartKind, Radius, Verdict, analyse};
use cohaptic_units::Instant;

use crate::case::Strategy;
use crate::{PaperError, Watch};

/// Record of a peer. The three lists are indexed like [`Trace::times`].
#[derive(Clone, PartialEq, Debug, Default)]
pub(crate) struct PeerTrace {
    /// Position of the peer's copy \[m\].
    pub(crate) position: Vec<f64>,
    /// Velocity of the peer's copy \[m/s\].
    pub(crate) velocity: Vec<f64>,
    /// Coordination force on the peer's copy \[N\].
    pub(crate) force: Vec<f64>,
}

/// Record of a simulation.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Trace {
    /// Times of the record \[s\].
    pub(crate) times: Vec<f64>,
    pub(crate) peers: Vec<PeerTrace>,
}

/// A run of Section 5.1: two peers move the object, and a third peer does not touch the object.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct StabilityTest {
    pub(crate) strategy: Strategy,
    /// Coordination stiffness KT \[N/m\].
    pub(crate) stiffness: f64,
    /// `true` if the users are arms that follow a sine. Otherwise the users are forces.
    pub(crate) arms: bool,
    /// Delay one way \[ms\].
    pub(crate) delay_ms: u32,
    pub(crate) radius: Radius,
    pub(crate) trace: Trace,
}

/// A run of Section 5.2: one peer pushes with 1.5 N, and two peers do not touch the object.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Travel {
    pub(crate) strategy: Strategy,
    /// Delay one way \[ms\].
    pub(crate) delay_ms: u32,
    pub(crate) radius: Radius,
    /// Spectral radius of the motions excited by a symmetric push: the pushed copy and the mean of the others.
    pub(crate) excited: Radius,
    /// Spectral radius of the two untouched copies swinging against each other, not excited by the push.
    pub(crate) apart: Radius,
    /// Time at which the pushed copy has moved 20 mm \[s\]; `None` if never.
    pub(crate) time: Option<f64>,
    /// Viscosity felt by a slow hand, from the admittance \[N·s/m\].
    pub(crate) viscosity: f64,
    pub(crate) trace: Trace,
}

impl Travel {
    /// Returns whether the push itself makes the object diverge.
    pub(crate) fn diverges(&self) -> bool {
        self.excited.verdict() == Verdict::Unstable
    }
}

/// Distance of the object in Section 5.2 \[m\].
pub(crate) const DISTANCE: f64 = 0.02;
/// The two readings of the paper's delay of 48 ms, one way \[ms\]: half of a round trip, and the number itself.
pub(crate) const DELAYS_MS: [u32; 2] = [24, 48];

const STABILITY_SCENES: [(Strategy, f64, bool, &str); 8] = [
    (Strategy::Ap, 2100.0, true, include_str!("../scenarios/5-1-ap-2100.toml")),
    (Strategy::Pd, 2100.0, true, include_str!("../scenarios/5-1-pd-2100.toml")),
    (Strategy::Ap, 1000.0, true, include_str!("../scenarios/5-1-ap-1000.toml")),
    (Strategy::Pd, 1000.0, true, include_str!("../scenarios/5-1-pd-1000.toml")),
    (Strategy::Ap, 2100.0, false, include_str!("../scenarios/5-1-ap-2100-no-arm.toml")),
    (Strategy::Pd, 2100.0, false, include_str!("../scenarios/5-1-pd-2100-no-arm.toml")),
    (Strategy::Ap, 1000.0, false, include_str!("../scenarios/5-1-ap-1000-no-arm.toml")),
    (Strategy::Pd, 1000.0, false, include_str!("../scenarios/5-1-pd-1000-no-arm.toml")),
];

const TRAVEL_SCENES: [(Strategy, &str); 2] =
    [(Strategy::Ap, include_str!("../scenarios/5-2-ap.toml")), (Strategy::Pd, include_str!("../scenarios/5-2-pd.toml"))];

/// Returns the scene file of Section 5.2 for a strategy.
pub(crate) fn travel_text(strategy: Strategy) -> &'static str {
    TRAVEL_SCENES.iter().find(|(of, _)| *of == strategy).map_or("", |(_, text)| text)
}

/// Returns the scene file of Section 5.1 for a strategy, a stiffness \[N/m\], and users with or without arms.
pub(crate) fn stability_text(strategy: Strategy, stiffness: f64, arms: bool) -> &'static str {
    // Stiffnesses are whole numbers of N/m.
    let wanted = |scene: &&(Strategy, f64, bool, &str)| scene.0 == strategy && (scene.1 - stiffness).abs() < 0.5 && scene.2 == arms;
    STABILITY_SCENES.iter().find(wanted).map_or("", |(.., text)| text)
}

/// Simulates Section 5.1: both strategies and stiffnesses, with and without arms, for both delays. The users move at 1 Hz, about as fast as in Figure 7.
pub(crate) fn stability_tests(watch: &dyn Watch) -> Result<Vec<StabilityTest>, PaperError> {
    let mut tests = Vec::new();
    for delay_ms in DELAYS_MS {
        for (strategy, stiffness, arms, text) in STABILITY_SCENES {
            // An arm follows the sine. Without arms the force of the hand is the sine.
            let hand = if arms { "hand.follows" } else { "hand" };
            // The shipped scenes move more slowly; the paper's Figure 7 shows about 1 Hz.
            let faster = ["left", "right"].map(|peer| format!("peers.{peer}.{hand}.sine.frequency=1.0"));
            let overrides: Vec<String> = faster.into_iter().chain([format!("link.delay={delay_ms}ms")]).collect();
            let scene = Scene::parse(text, Path::new("5-1.toml"), &overrides)?;
            // An infinite distance is never reached: only the record is wanted.
            let (trace, _) = simulate(&scene, f64::INFINITY, watch)?;
            tests.push(StabilityTest { strategy, stiffness, arms, delay_ms, radius: away_from_walls(&scene)?.radius, trace });
        }
    }
    watch.one_more();
    Ok(tests)
}

/// Simulates Section 5.2: both strategies for both delays.
pub(crate) fn travels(watch: &dyn Watch) -> Result<Vec<Travel>, PaperError> {
    let mut travels = Vec::new();
    for delay_ms in DELAYS_MS {
        for (strategy, text) in TRAVEL_SCENES {
            let scene = Scene::parse(text, Path::new("5-2.toml"), &[format!("link.delay={delay_ms}ms")])?;
            let (trace, time) = simulate(&scene, DISTANCE, watch)?;
            let viscosity = Admittance::of(&scene, 0)?.fit_low_frequency().viscosity.value;
            let analysis = away_from_walls(&scene)?;
            let part = |wanted: fn(PartKind) -> bool| {
                // The largest radius over the wanted parts of all modes.
                let of = analysis.modes.iter().flat_map(|mode| &mode.parts).filter(|part| wanted(part.kind)).map(|part| part.radius);
                of.fold(Radius { value: 0.0, error: 0.0 }, Radius::or)
            };
            let excited = part(|kind| kind == PartKind::Together);
            let apart = part(|kind| matches!(kind, PartKind::Apart { .. }));
            travels.push(Travel { strategy, delay_ms, radius: analysis.radius, excited, apart, time, viscosity, trace });
        }
    }
    watch.one_more();
    Ok(travels)
}

/// Analyses a scene as long as the object touches no wall and one-sided contacts stay closed. Walls and one-sided contacts are not linear.
fn away_from_walls(scene: &Scene) -> Result<Analysis, PaperError> {
    let mut scene = scene.clone();
    scene.object.enclosure = None;
    for peer in &mut scene.peers {
        // A one-sided contact that stays closed acts like a grasp.
        if peer.contact != Contact::None {
            peer.contact = Contact::Grasp;
        }
    }
    Ok(analyse(&scene, Method::Reduced)?)
}

/// Number of ticks per recorded tick: with ticks of 1 ms, a record every 4 ms.
const KEPT: u64 = 4;

/// Simulates a scene with ticks of 1 ms. Returns the record, and the time at which the first peer's copy has moved `distance` \[m\].
fn simulate(scene: &Scene, distance: f64, watch: &dyn Watch) -> Result<(Trace, Option<f64>), PaperError> {
    let mut recorder = Recorder {
        trace: Trace { times: Vec::new(), peers: vec![PeerTrace::default(); scene.peers.len()] },
        distance,
        start: scene.object.position[0],
        last: (0.0, 0.0),
        reached: None,
        watch,
    };
    let Ok(_) = Simulation::new(scene, Model::Least).run(&mut recorder);
    // The record of a stopped run is incomplete, and must not pass for a result.
    if watch.stops() { Err(PaperError::Stopped) } else { Ok((recorder.trace, recorder.reached)) }
}

/// Observer of a simulation: records every fourth tick, and finds the time of the given distance.
struct Recorder<'a> {
    trace: Trace,
    distance: f64,
    start: f64,
    /// Time \[s\] and distance \[m\] of the first peer's copy at the tick before.
    last: (f64, f64),
    reached: Option<f64>,
    watch: &'a dyn Watch,
}

impl Observer for Recorder<'_> {
    type Error = Infallible;

    fn wants_ticks(&self) -> bool {
        true
    }

    fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), Infallible> {
        let t = row.at.as_secs_f64();
        if row.peer == 0 {
            let gone = (row.object.position[0] - self.start).abs();
            if self.reached.is_none() && gone >= self.distance {
                // Linear interpolation between two ticks. `gone` exceeds `gone_before`, because the tick before was below the distance.
                let (before, gone_before) = self.last;
                self.reached = Some(before + (t - before) * (self.distance - gone_before) / (gone - gone_before));
            }
            self.last = (t, gone);
        }
        // Chosen by time and not by counting ticks, so that all peers are recorded at the same instants.
        if row.at.as_nanos().is_multiple_of(KEPT * 1_000_000) {
            if row.peer == 0 {
                self.trace.times.push(t);
            }
            let peer = &mut self.trace.peers[row.peer];
            peer.position.push(row.object.position[0]);
            peer.velocity.push(row.object.velocity[0]);
            peer.force.push(row.coordination_force[0]);
        }
        Ok(())
    }

    fn keep_going(&mut self, _now: Instant) -> bool {
        !self.watch.stops()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Unwatched;

    /// Radii from crates/stability/tests/reference/radii.json.
    #[test]
    fn section_5_1_has_the_radii_of_the_reference() {
        let tests = stability_tests(&Unwatched).unwrap();
        let radius = |strategy, stiffness: f64, arms| {
            let wanted = |test: &&StabilityTest| {
                test.strategy == strategy && (test.stiffness - stiffness).abs() < 1.0 && test.arms == arms && test.delay_ms == 24
            };
            tests.iter().find(wanted).unwrap().radius.value
        };
        for (found, expected) in [
            (radius(Strategy::Ap, 2100.0, true), 0.992_453_875_8),
            (radius(Strategy::Pd, 2100.0, true), 1.053_350_901_5),
            (radius(Strategy::Ap, 1000.0, true), 0.986_240_717_1),
            (radius(Strategy::Pd, 1000.0, true), 0.992_165_688_9),
            (radius(Strategy::Ap, 2100.0, false), 1.014_391_773_5),
            (radius(Strategy::Pd, 2100.0, false), 1.011_715_382_3),
            (radius(Strategy::Ap, 1000.0, false), 1.002_672_697_2),
            (radius(Strategy::Pd, 1000.0, false), 0.978_014_835_7),
        ] {
            assert!((found - expected).abs() < 2e-10, "{found} is not {expected}");
        }
    }

    /// The law of momentum in scenarios/README.md gives 1.138 s and 2.255 s, right to 2 %.
    #[test]
    fn section_5_2_takes_as_long_as_the_viscosity_law_says() {
        let travels = travels(&Unwatched).unwrap();
        let time = |strategy| travels.iter().find(|travel| travel.strategy == strategy && travel.delay_ms == 24).unwrap().time.unwrap();
        assert!((time(Strategy::Ap) / 1.138 - 1.0).abs() < 0.02 && (time(Strategy::Pd) / 2.255 - 1.0).abs() < 0.02);
    }
}
