//! Scenes that change on their way are run in arrays too, in stretches from one change to the next: what their events come to, to the bit.

use std::sync::Arc;
use std::time::Duration;

use cohaptic_harness::{Ending, Model, NoObserver, Simulation, run_side_by_side, same_shape};
use cohaptic_peer::coordination::{LawForm, LawSettings, LawValue};
use cohaptic_peer::{Contact, Coordination, Direction, Gains, Hand, Signal};
use cohaptic_scene::{Change, ChangeKind, LinkChange, Scene};
use cohaptic_tests::{Draft, drafts};
use cohaptic_tests_common::{cases, properties};
use cohaptic_units::Instant;
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::select;

use super::arrays::{difference, mesh, run, run_interrupted};
use super::{turning, watched};

/// The scene with its changes later by a span [ns], but none after its end.
fn later(mut scene: Scene, nanos: u64) -> Scene {
    let end = Instant::ZERO.saturating_add(scene.duration);
    for change in &mut scene.timeline {
        change.at = change.at.saturating_add(Duration::from_nanos(nanos)).min(end);
    }
    scene
}

/// What the arrays come to against events, in totals and, if `rows`, row by row.
fn compare(scene: &Scene, rows: bool) -> Result<(), TestCaseError> {
    prop_assert!(same_shape(scene, scene), "it is run in arrays");
    prop_assert_eq!(difference(&run(scene, Model::Least), &run(scene, Model::General)), None);
    if rows {
        prop_assert_eq!(watched::found(scene, |_| ()), None);
    }
    Ok(())
}

properties! {
    #![proptest_config(cases(800))]

    #[test]
    fn one_that_changes_comes_to_what_its_events_come_to(drafts in drafts::changing(Just(1)), nanos in prop_oneof![Just(0), 0..3_000_000_u64]) {
        compare(&later(drafts[0].scene(), nanos), true)?;
    }

    /// Of every law each parameter that can change, before and after changes of gains.
    #[test]
    fn parameters_change_as_with_events(
        drafts in drafts::changing(Just(1)),
        law in select(laws_with_parameters()),
        micros in vec(prop_oneof![Just(0), 0..40_000_u64], 1..5),
        at in vec(0..32_000_000_u64, 4),
    ) {
        let mut scene = drafts[0].scene();
        scene.coordination.strategy = law;
        scene.coordination.settings = settings(law, micros[0]);
        for (micros, at) in micros.iter().skip(1).zip(at) {
            scene.timeline.push(Change { at: Instant::from_nanos(at), what: ChangeKind::Parameters(Box::new(settings(law, *micros))) });
        }
        scene.timeline.sort_by_key(|change| change.at);
        compare(&later(scene, 0), true)?;
    }
}

fn laws_with_parameters() -> Vec<Coordination> {
    let can_change = |law: &Coordination| law.parameters().iter().any(|parameter| parameter.can_change);
    let laws: Vec<Coordination> = Coordination::ALL.iter().copied().filter(can_change).filter(|law| mesh_of(*law).law(0).is_some()).collect();
    assert!(laws.len() >= 4, "{laws:?}");
    laws
}

fn mesh_of(law: Coordination) -> Scene {
    let mut scene = mesh(2, "delay = \"1ms\"");
    scene.coordination.strategy = law;
    scene
}

fn settings(law: Coordination, micros: u64) -> LawSettings {
    let mut settings = LawSettings::default();
    for (place, parameter) in law.parameters().iter().enumerate() {
        let value = match parameter.form {
            LawForm::Duration | LawForm::AutomaticDuration => LawValue::Duration(Duration::from_micros(micros)),
            LawForm::AutomaticDamping | LawForm::Damping => LawValue::Number(1e-3 * f64::from(u32::try_from(micros).unwrap())),
            form @ (LawForm::Impedance | LawForm::Energy | LawForm::Words(_) | LawForm::Peer) => panic!("no law has a parameter like {form:?}"),
        };
        settings.of_mut(law).set(place, value);
    }
    settings
}

properties! {
    #![proptest_config(cases(200))]

    #[test]
    fn those_that_change_side_by_side_come_to_what_each_comes_to_alone(drafts in drafts::changing(prop_oneof![1 => 1..=7_usize, 3 => 7..=9_usize])) {
        let scenes: Vec<Scene> = drafts.iter().map(Draft::scene).collect();
        for (scene, together) in scenes.iter().zip(run_side_by_side(&scenes)) {
            prop_assert_eq!(difference(&together, &run(scene, Model::General)), None);
        }
    }

    /// Changes fall on ticks at which an observer is asked whether to go on, and beside them.
    #[test]
    fn one_that_changes_and_is_interrupted_comes_to_the_same(mut drafts in drafts::changing(Just(1)), at in 1010..1040_u64, nanos in 0..1_000_000_u64) {
        drafts[0].duration = 2500;
        let mut scene = drafts[0].scene();
        let count = scene.timeline.len() as u64;
        for (change, place) in scene.timeline.iter_mut().zip(0..) {
            change.at = Instant::from_nanos((at + place * 20 / count.max(1)) * 1_000_000 + nanos);
        }
        let [least, general] = [Model::Least, Model::General].map(|model| run_interrupted(&scene, model, 1));
        prop_assert_eq!(difference(&least, &general), None);
    }

    #[test]
    fn what_turns_and_changes_comes_to_the_same(
        scene in turning::scene(),
        law in select(&[Coordination::AveragePosition, Coordination::LocalDamping, Coordination::Extrapolated][..]),
        changes in vec((0..32_000_000_u64, 0..6_u8, 0..40_000_u64), 1..6),
    ) {
        let mut timeline: Vec<Change> =
            changes.iter().map(|(at, kind, number)| Change { at: Instant::from_nanos(*at), what: turning_change(law, *kind, *number) }).collect();
        timeline.sort_by_key(|change| change.at);
        let has_arm = |peer: usize| matches!(scene.peers[peer].hand, Some(Hand::Arm { .. }));
        timeline.retain(|change| !matches!(change.what, ChangeKind::Hand { peer, .. } if has_arm(peer)));
        let mut scene = later(Scene { timeline, ..scene }, 0);
        (scene.coordination.strategy, scene.coordination.settings) = (law, settings(law, 7000));
        prop_assert_eq!(difference(&run(&scene, Model::Least), &run(&scene, Model::General)), None);
    }
}

/// A change of a scene of two peers or more that turn.
fn turning_change(law: Coordination, kind: u8, number: u64) -> ChangeKind {
    let (peer, part) = ((number % 2) as usize, 1e-4 * f64::from(u32::try_from(number).unwrap()));
    let triple = [0.1 * part, 0.0, -0.02 * part];
    match kind {
        0 => ChangeKind::Coordination(Gains { stiffness: 100.0 * part, damping: part }),
        1 => ChangeKind::RotationalGains(Gains { stiffness: Some([0.01 * part, 0.011 * part, 0.012 * part]), damping: None }),
        2 => ChangeKind::Contact {
            peer,
            contact: [Contact::None, Contact::Grasp, Contact::Push(Direction { axis: 1, positive: true })][(number / 2 % 3) as usize],
        },
        3 => ChangeKind::HandTorque { peer, torque: (!number.is_multiple_of(3)).then_some(Signal::Constant(triple)) },
        4 => ChangeKind::Hand { peer, hand: (!number.is_multiple_of(3)).then_some(Hand::Force(Signal::Constant(triple))) },
        _ => ChangeKind::Parameters(Box::new(settings(law, number))),
    }
}

/// On threads: links of all and of one pair change, between ticks and at the end, and so do contacts, hands, gains and parameters.
#[test]
fn changes_on_threads_come_to_what_those_on_one_come_to() {
    let links = [
        "delay = \"24ms\", jitter = \"3ms\", loss = \"5%\"",
        "delay = \"9ms\", jitter = \"2ms\", rate = \"100kbit\", queue = { limit = \"3 packets\", discipline = \"codel\" }",
        "delay = \"20ms\", jitter = { sd = \"8ms\", distribution = \"uniform\" }, order = \"allow-reordering\", outage = [{ from = \"40ms\", to = \"60ms\" }]",
        "delay = \"5ms\"",
    ]
    .map(|link| mesh(26, link).links);
    let push = Contact::Push(Direction { axis: 0, positive: true });
    let hand = Hand::Force(Signal::Constant([0.7, 0.0, 0.0]));
    let kinds = [
        ChangeKind::Coordination(Gains { stiffness: 40.0, damping: 1.0 }),
        ChangeKind::Contact { peer: 3, contact: push },
        ChangeKind::Hand { peer: 25, hand: Some(hand) },
        ChangeKind::Parameters(Box::new(settings(Coordination::LocalLag, 3000))),
        ChangeKind::Contact { peer: 25, contact: Contact::None },
        ChangeKind::Parameters(Box::new(settings(Coordination::LocalLag, 12_000))),
    ];
    let change = |(what, at): (ChangeKind, u64)| Change { at: Instant::from_nanos(at), what };
    for with_links in [false, true] {
        for first in 0..links.len() {
            let mut scene = mesh(26, "delay = \"24ms\"");
            scene.links = links[first].clone();
            scene.duration = Duration::from_millis(1100);
            scene.coordination.strategy = Coordination::LocalLag;
            scene.coordination.settings = settings(Coordination::LocalLag, 7000);
            scene.coordination.gains = scene.coordination.gains.scaled(0.05);
            scene.timeline = kinds.iter().cloned().zip((0..).map(|place| place * 61_300_000)).map(change).collect();
            if with_links {
                let of_all = (1..links.len()).map(|next| ChangeKind::AllLinks(links[(first + next) % links.len()].clone()));
                let config = Arc::clone(&links[2].configs()[0]);
                let of_one = ChangeKind::Link(LinkChange { from: 25, to: 3, config });
                scene.timeline.extend(of_all.chain([of_one]).zip([30_000_001, 100_000_000, 1_100_000_000, 1_100_000_000]).map(change));
                scene.timeline.sort_by_key(|change| change.at);
            }
            let general = run(&scene, Model::General);
            assert_eq!(general.ending, Ending::Complete);
            for threads in [1, 2, 3] {
                let Ok(summary) = Simulation::new(&scene, Model::Least).on_threads(threads).run(&mut NoObserver);
                assert_eq!(difference(&summary, &general), None, "links {first}, changed: {with_links}, {threads} threads");
            }
        }
    }
}
