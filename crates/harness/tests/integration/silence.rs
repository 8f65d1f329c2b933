//! Effect of a peer's silence on the coordination forces of the others.

use std::convert::Infallible;

use cohaptic_harness::live::LiveScene;
use cohaptic_harness::{Observer, TickRow};
use cohaptic_scene::Scene;
use cohaptic_tests_common::properties;
use cohaptic_units::Instant;
use proptest::collection::vec;
use proptest::prelude::*;

use crate::remote::{millis, sample};
use crate::scenes::{Written, read};

const STIFFNESS: f64 = 1000.0;
const DAMPING: f64 = 5.0;

/// Returns a scene of a simulated peer, whose hand is an arm, and a peer in another process. `delay` has the keys of the links.
fn two(delay: &str) -> Written {
    read(format!(
        "scene = {{ duration = \"4s\", seed = 5 }}\nobject = {{ mass = 0.3, damping = 1.0 }}\n\
         coordination = {{ strategy = \"average-position\", stiffness = {STIFFNESS}, damping = {DAMPING}, update = \"8ms\" }}\n\
         [[peers]]\nname = \"here\"\ndevice = {{ mass = 0.1, damping = 5.0 }}\ncoupling = {{ stiffness = 800.0, damping = 5.0 }}\n\
         hand = {{ arm = {{ mass = 0.4, damping = 5.0, stiffness = 300.0 }} }}\n[[peers]]\nname = \"there\"\nkind = \"udp\"\n[link]\n{delay}\n"
    ))
}

/// Instant, position \[m\] and velocity [m/s] of the copy, and coordination force \[N\] of the simulated peer, for each tick.
#[derive(Default)]
struct Ticks(Vec<(Instant, f64, f64, f64)>);

impl Observer for Ticks {
    type Error = Infallible;

    fn wants_ticks(&self) -> bool {
        true
    }

    fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), Infallible> {
        self.0.push((row.at, row.object.position[0], row.object.velocity[0], row.coordination_force[0]));
        Ok(())
    }
}

/// Returns the ticks of a session up to `until` \[ms\]. `sent` are the samples of the other peer: instant \[ms\], sequence number and position \[m\].
fn ticks(scene: &Scene, sent: &[(u64, u64, f64)], until: u64) -> Vec<(Instant, f64, f64, f64)> {
    let mut live = LiveScene::new(scene, |_| None);
    let mut ticks = Ticks::default();
    for (at, sequence, x) in sent {
        let Ok(_taken_or_not) = live.handle_sample(millis(*at), 1, &sample(scene, 1, *sequence, *x, 0.0), &mut ticks);
    }
    let Ok(()) = live.handle_timeout(millis(until), &mut ticks);
    ticks.0
}

/// The copy of the simulated peer begins away from the copy of the absent peer, and moves.
#[test]
fn a_peer_that_never_joins_exerts_no_force_at_all() {
    let Written { text, .. } = two("delay = \"1ms\"");
    let apart = read(text.replace("name = \"here\"", "name = \"here\"\nposition = 0.02\nvelocity = 0.1"));
    let ticks = ticks(&apart.scene, &[], 1000);
    assert_eq!(ticks.len(), 1001);
    assert!(ticks.iter().all(|(_, _, _, force)| *force == 0.0));
    assert!(ticks.iter().any(|(_, x, _, _)| (x - 0.02).abs() > 0.005), "it does move");
}

/// The rule of the manual, number by number: w of a sender at rest is FT/(KT·(xO − s) + BT·vO).
#[test]
fn the_pull_falls_and_rises_linearly_from_when_it_was_heard_and_when_it_arrives() {
    let Written { scene, .. } = two("delay = \"30ms\"");
    let heard: Vec<(u64, u64, f64)> = (0..50).map(|k| (100 + 8 * k, k, 0.04)).collect();
    let again = (1200..1800).step_by(8).zip(0..).map(|(at, k)| (at, k, 0.04));
    let sent: Vec<_> = heard.into_iter().chain(again).collect();
    for (at, x, v, force) in ticks(&scene, &sent, 1800) {
        let t = at.as_secs_f64();
        // First arrival at 130 ms; last heard at 492 ms, so falling from 592 ms; first arrival after the silence at 1230 ms.
        let expected = match t {
            t if t < 0.592 => ((t - 0.130) / 0.25).clamp(0.0, 1.0),
            t if t < 1.230 => (1.0 - (t - 0.592) / 0.25).max(0.0),
            t => ((t - 1.230) / 0.25).min(1.0),
        };
        let whole = STIFFNESS * (x - 0.04) + DAMPING * v;
        assert!((force - expected * whole).abs() < 1e-9, "at {at}: {force} N, w = {expected}");
    }
}

/// Returns by how much the largest change of force in a tick exceeds its bound \[N\]: the manual's bound for silence plus the change due to the motion.
fn largest_excess(ticks: &[(Instant, f64, f64, f64)], places: &[f64]) -> f64 {
    let share = 1.0 / 250.0;
    let excess = ticks.windows(2).map(|pair| {
        let ((_, x0, v0, f0), (_, x, v, f)) = (pair[0], pair[1]);
        let far = places.iter().map(|place| (place - x0).abs().max((place - x).abs())).fold(0.0, f64::max);
        let apart = places.iter().flat_map(|a| places.iter().map(move |b| (a - b).abs())).fold(0.0, f64::max);
        let fading = share * (STIFFNESS * (far + apart) + DAMPING * v0.abs().max(v.abs()));
        (f - f0).abs() - fading - STIFFNESS * (x - x0).abs() - DAMPING * (v - v0).abs()
    });
    excess.fold(f64::MIN, f64::max)
}

/// A present sender that moves by 9 cm between two samples makes the force jump beyond the bound, so that the bound can fail.
#[test]
fn the_bound_would_see_a_jump() {
    let Written { scene, .. } = two("delay = \"2ms\"");
    let sent: Vec<(u64, u64, f64)> = (0..100).map(|k| (8 * k, k, if k < 60 { 0.0 } else { 0.09 })).collect();
    let excess = largest_excess(&ticks(&scene, &sent, 700), &[0.0, 0.09]);
    assert!(excess > 50.0, "{excess} N");
}

properties! {
    #![proptest_config(crate::cases(60))]

    /// The other peer comes and goes at random times and places, over several networks. It stays at one place during each visit.
    #[test]
    fn no_coming_back_makes_the_force_jump(
        visits in vec((101..600_u64, 1..400_u64, -0.05..0.05), 1..6),
        link in prop::sample::select(vec!["", "delay = \"24ms\"", "delay = \"20ms\"\njitter = \"10ms\"\nloss = \"20%\"", "delay = \"150ms\""]),
    ) {
        let Written { scene, .. } = two(link);
        let (mut at, mut sent, mut places) = (0, Vec::new(), vec![0.0]);
        for (silence, stay, place) in visits {
            at += silence;
            sent.extend((at..=at + stay).step_by(8).zip(0..).map(|(at, k)| (at, k, place)));
            at += stay;
            places.push(place);
        }
        let excess = largest_excess(&ticks(&scene, &sent, at + 600), &places);
        prop_assert!(excess < 1e-9, "{excess} N more in a tick than can be");
    }
}
