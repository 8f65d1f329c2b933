//! Peers that join late, leave, or start anew end where the others are.
//!
//! **Claim.** In a live session, however often a process elsewhere joined, fell silent and was started anew somewhere else: once it stays, what the others feel of it is whole after
//! `after` + `fade` + the delay (`docs/model.md`, silence), and from then on the session is the linear scene of which all peers are part. If that has a spectral radius ρ < 1, all copies come
//! together as fast as [`crate::claims::settling`] says; and if a hand's arm holds the object to a place, they end at that place. *Region*: ρ < 1, links
//! that only delay once it stays; before, they do anything.
//!
//! *Outside*: a process that goes on with another state every `after` (it never stays), and what `heals-and-diverges.toml` shows of unstable scenes.

use std::convert::Infallible;

use cohaptic_harness::live::LiveScene;
use cohaptic_harness::{Model, Observer, TickRow};
use cohaptic_peer::coordination::LawStrategy;
use cohaptic_peer::wire::MAX_LEN;
use cohaptic_peer::{ArmConfig, Contact, Gains, Held, ObjectCopy, Peer, RestingDevice, State};
use cohaptic_scene::Scene;
use cohaptic_tests::{Draft, DraftHand, DraftLink, links, run};
use cohaptic_tests_common::properties;
use cohaptic_units::Instant;
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::select;

use crate::claims::cases;
use crate::claims::healing::PLAIN;
use crate::claims::paper::BOTH;
use crate::claims::settling::{Motion, Settling, motions, spread};

const MILLISECOND: core::time::Duration = core::time::Duration::from_millis(1);

/// The program of a peer that lives elsewhere: a copy of the object and a strategy, and no memory beyond its life.
type Process = Peer<1, RestingDevice<1>, LawStrategy<1>>;

fn start(scene: &Scene, place: usize, x: f64) -> Process {
    let spec = &scene.peers[place];
    let object = ObjectCopy::new(scene.copy_config(place), State { position: [x], velocity: [0.0] }, scene.integrator, &spec.clock);
    let others = (0..scene.peers.len()).filter(|other| *other != place).map(|other| scene.initial_state(other));
    let strategy = scene.coordination.strategy.strategy(scene.coordination.gains, scene.peers.len(), scene.peers[0].clock.tick);
    Peer::new(scene.peer_config(place), RestingDevice { position: [0.0] }, object, strategy, Held::new(others))
}

/// When the process is started \[ms\], where its copy begins \[m\], and when it ends.
#[derive(Clone, Copy, Debug)]
struct Life {
    from: u64,
    to: u64,
    place: f64,
}

/// The motions of the peers that live here.
struct Here(Vec<Vec<Motion>>);

impl Observer for Here {
    type Error = Infallible;

    fn wants_ticks(&self) -> bool {
        true
    }

    fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), Infallible> {
        let motion = Motion { device: (row.device.position[0], row.device.velocity[0]), object: (row.object.position[0], row.object.velocity[0]) };
        self.0[row.peer].push(motion);
        Ok(())
    }
}

/// Runs a session whose last peer lives elsewhere, through these lives, tick by tick.
fn session(scene: &Scene, lives: &[Life], ticks: u64) -> Vec<Vec<Motion>> {
    let place = scene.peers.len() - 1;
    let every = u64::try_from((scene.coordination.update.as_nanos() / MILLISECOND.as_nanos()) as usize).unwrap();
    let mut live = LiveScene::new(scene, |_| None);
    let mut here = Here(vec![Vec::new(); place + 1]);
    let mut process: Option<Process> = None;
    for tick in 0..ticks {
        let now = Instant::from_nanos(tick * 1_000_000);
        if let Some(life) = lives.iter().find(|life| life.from == tick) {
            process = Some(start(scene, place, life.place));
        }
        if lives.iter().any(|life| life.to == tick) {
            process = None;
        }
        // The order of an instant: it sends, what has arrived is handed over, it computes and moves.
        if let Some(process) = process.as_mut().filter(|_| tick % every == scene.peers[place].phase) {
            let mut datagram = [0; MAX_LEN];
            let len = process.sample(now, &mut datagram);
            // Started anew before its silence was noticed, it is refused until then: its numbers begin again.
            let Ok(_taken_or_not) = live.handle_sample(now, place, &datagram[..len], &mut here);
        }
        let Ok(()) = live.handle_timeout(now, &mut here);
        while let Some(transmit) = live.poll_transmit() {
            if let Some(process) = &mut process {
                let _newest_or_late = process.handle_datagram(&transmit.datagram).unwrap();
            }
        }
        let state = process.as_ref().map_or(State::REST, |process| *process.object().state());
        here.0[place].push(Motion { device: (0.0, 0.0), object: (state.position[0], state.velocity[0]) });
        if let Some(process) = &mut process {
            process.compute(now);
            process.advance(now, MILLISECOND);
        }
    }
    here.0
}

/// The scene as a file with its last peer elsewhere.
fn elsewhere(draft: &Draft) -> Scene {
    let last = &draft.peers.last().unwrap().name;
    let text = draft.to_toml().replace(&format!("name = \"{last}\"\ntick"), &format!("name = \"{last}\"\nkind = \"udp\"\ntick"));
    Scene::parse(&text, "joining.toml".as_ref(), &[]).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

/// Two or three peers, the last of which lives elsewhere, and what their links are like until it comes to stay. If `held`, an arm that wants to rest at 0 holds the first one's device.
fn scenes() -> BoxedStrategy<(Draft, Vec<DraftLink>)> {
    let object = (0.2..1.0, 0.2..3.0, 50.0..600.0, 1.0..10.0, select(&BOTH), select(vec![4_u64, 8]), 0..=12_000_u32);
    let whole = (object, 2..=3_usize, any::<bool>(), -0.03..0.03, 50.0..400.0).prop_map(|(object, count, held, place, arm)| {
        let (mass, damping, stiffness, gain, strategy, every, delay) = object;
        let mut draft = Draft { mass, damping, strategy, update: 1000 * every, split_mass: false, ..Draft::calm(count) };
        (draft.gains, draft.link) = (Gains { stiffness, damping: gain }, format!("delay = \"{delay}us\""));
        draft.peers[0].contact = Contact::Grasp;
        draft.peers[0].position = Some([place, 0.0, 0.0]);
        draft.peers[0].coupling = Gains { stiffness: 800.0, damping: 5.0 };
        if held {
            draft.peers[0].hand = DraftHand::Arm { arm: ArmConfig { mass: 0.3, damping: 10.0, stiffness: arm }, wanted: [0.0; 3] };
        }
        draft
    });
    whole
        .prop_flat_map(|draft| {
            let links = links::any_network(draft.peers.len());
            (Just(draft), links)
        })
        .boxed()
}

/// Lives with silences between them, the last without end.
fn lives() -> BoxedStrategy<Vec<Life>> {
    vec((0..500_u64, 1..500_u64, -0.05..0.05), 1..5)
        .prop_map(|spans| {
            let mut at = 0;
            let mut lives: Vec<Life> = spans
                .into_iter()
                .map(|(silence, stay, place)| {
                    let from = at + silence;
                    at = from + stay + 1;
                    Life { from, to: from + stay, place }
                })
                .collect();
            lives.last_mut().unwrap().to = u64::MAX;
            lives
        })
        .boxed()
}

properties! {
    #![proptest_config(cases(80))]

    #[test]
    fn whoever_joins_late_or_starts_anew_ends_where_the_others_are((mut draft, links) in scenes(), lives in lives()) {
        let settling = Settling::of(&draft);
        prop_assume!(settling.is_some());
        let settling = settling.unwrap();
        let ticks = settling.ticks();
        // Refused until its silence is noticed (100 ms), heard, on its way (12 ms), faded in (250 ms), and every sample of the state sent.
        let whole = (lives.last().unwrap().from as usize + 100 + 8 + 12 + 250).div_ceil(ticks) + settling.memory() + 2;
        let frames = settling.frames(0.01);
        prop_assume!(frames * ticks < 30_000);
        let end = (whole + frames) * ticks + 1;
        draft.duration = end as u64 + 1;
        let (healed, plain) = (lives.last().unwrap().from, &draft.link);
        draft.timeline = vec![format!("at = \"{healed}ms\"\nlink = \"all\"\nset = {{ {plain}, {PLAIN} }}")];
        draft.links = links;
        let motions = session(&elsewhere(&draft), &lives, end as u64);
        let size = settling.size(&draft, &motions, whole);
        let place = motions.iter().flatten().map(|motion| motion.object.0.abs().max(motion.device.0.abs())).fold(0.0, f64::max);
        for frame in whole..=whole + frames {
            let (apart, most) = (spread(&motions, frame * ticks), 2_f64.sqrt() * settling.later(size, frame - whole));
            prop_assert!(apart <= most + settling.rounding(place), "{apart:e} m after {} frames, at most {most:e}", frame - whole);
        }
        // Where an arm holds the object, that is where all end.
        if !matches!(draft.peers[0].hand, DraftHand::None) {
            let last = (whole + frames) * ticks;
            let farthest = motions.iter().map(|motion| motion[last].object.0.abs()).fold(0.0, f64::max);
            prop_assert!(farthest <= 0.01 * size + settling.rounding(place), "{farthest:e} m from where the arm rests");
        }
    }
}

/// The driver above is the scene: with a process that is there from the beginning everything moves as in virtual time, as soon as its pull is whole.
#[test]
fn a_process_that_is_always_there_is_a_peer_of_the_scene() {
    let mut draft = Draft { duration: 3000, update: 8000, damping: 2.0, link: "delay = \"12ms\"".to_owned(), ..Draft::calm(2) };
    draft.gains = Gains { stiffness: 300.0, damping: 5.0 };
    draft.peers[0].contact = Contact::Grasp;
    draft.peers[0].hand = DraftHand::Arm { arm: ArmConfig { mass: 0.3, damping: 10.0, stiffness: 100.0 }, wanted: [0.02, 0.0, 0.0] };
    let always = [Life { from: 0, to: u64::MAX, place: 0.0 }];
    let (live, simulated) = (session(&elsewhere(&draft), &always, 3000), motions(&run(&draft.scene(), Model::Least), 2));
    assert!((0..300).any(|tick| live[1][tick].object.0.to_bits() != simulated[1][tick].object.0.to_bits()), "its pull fades in");
    // Once it is whole the two are motions of one linear scene, and their difference settles.
    for peer in 0..2 {
        assert!((live[peer][2999].object.0 - simulated[peer][2999].object.0).abs() < 1e-3 * 0.02);
    }
}
