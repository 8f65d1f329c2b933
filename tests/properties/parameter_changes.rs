//! Changes of the parameters of strategies in the timeline: at the beginning they are what the file says there, and later they act from their instant on.

use std::time::Duration;

use cohaptic_harness::Model;
use cohaptic_harness::measures::{MeasuredRun, Measures};
use cohaptic_peer::coordination::{LawForm, LawSettings, LawValue};
use cohaptic_peer::{Coordination, SendWhen};
use cohaptic_scene::{Change, ChangeKind, Scene};
use cohaptic_tests::drafts::{fixed_link, well_behaved};
use cohaptic_tests::run;
use cohaptic_tests_common::{cases, properties};
use cohaptic_units::Instant;
use proptest::prelude::*;
use proptest::sample::select;

/// Every parameter that can change: of which strategy, and its place there.
fn parameters() -> Vec<(Coordination, usize)> {
    let of = |strategy: Coordination| (0..strategy.parameters().len()).filter(move |place| strategy.parameters()[*place].can_change);
    Coordination::ALL.iter().flat_map(|strategy| of(*strategy).map(|place| (*strategy, place))).collect()
}

/// A value of a parameter of that form; a reserve begins at 0, so that nothing is rounded when it grows.
fn value(form: LawForm, second: bool) -> LawValue {
    match form {
        LawForm::Duration | LawForm::AutomaticDuration => LawValue::Duration(Duration::from_millis(if second { 21 } else { 8 })),
        LawForm::AutomaticDamping | LawForm::Damping | LawForm::Impedance => LawValue::Number(if second { 31.0 } else { 12.0 }),
        LawForm::Energy => LawValue::Number(if second { 0.004 } else { 0.0 }),
        LawForm::Words(_) | LawForm::Peer => unreachable!("no word and no peer can change"),
    }
}

/// The scene with a value of a parameter from the beginning.
fn with(scene: &Scene, (strategy, place): (Coordination, usize), second: bool) -> Scene {
    let mut scene = scene.clone();
    scene.coordination.strategy = strategy;
    scene.coordination.settings.of_mut(strategy).set(place, value(strategy.parameters()[place].form, second));
    scene
}

fn change(at: Duration, settings: LawSettings) -> Change {
    Change { at: Instant::ZERO.saturating_add(at), what: ChangeKind::Parameters(Box::new(settings)) }
}

properties! {
    #![proptest_config(cases(40))]

    #[test]
    fn a_change_at_the_beginning_is_a_value_at_the_beginning(draft in well_behaved(2..5_usize, fixed_link()), parameter in select(parameters())) {
        let scene = draft.scene();
        let (second, mut changed) = (with(&scene, parameter, true), with(&scene, parameter, false));
        changed.timeline.insert(0, change(Duration::ZERO, second.coordination.settings));
        prop_assert_eq!(run(&changed, Model::General).ticks, run(&second, Model::General).ticks, "{:?}", parameter);
    }

    /// Up to the change everything is as without it, and a change to the value that there is changes nothing.
    #[test]
    fn a_change_acts_from_its_instant_on(draft in well_behaved(2..5_usize, fixed_link()), parameter in select(parameters())) {
        let scene = draft.scene();
        let (first, second) = (with(&scene, parameter, false), with(&scene, parameter, true));
        let at = first.duration / 2;
        let run_with = |settings: LawSettings| {
            let mut changed = first.clone();
            changed.timeline.push(change(at, settings));
            changed.timeline.sort_by_key(|change| change.at);
            run(&changed, Model::General).ticks
        };
        let plain = run(&first, Model::General).ticks;
        prop_assert_eq!(run_with(first.coordination.settings), plain.clone(), "{:?}", parameter);
        let before = |ticks: Vec<_>| ticks.into_iter().filter(|tick: &cohaptic_tests::Tick| tick.at < Instant::ZERO.saturating_add(at)).collect::<Vec<_>>();
        prop_assert_eq!(before(run_with(second.coordination.settings)), before(plain), "{:?}", parameter);
    }

    #[test]
    fn dead_bands_at_the_beginning_are_dead_bands_of_the_file(draft in well_behaved(2..5_usize, fixed_link()), position in 1e-5..1e-3_f64) {
        let (mut changed, mut written) = (draft.scene(), draft.scene());
        let when = SendWhen { velocity: Some(0.1), position: Some(position), heartbeat: None };
        written.coordination.send_when = Some(when);
        changed.timeline.insert(0, Change { at: Instant::ZERO, what: ChangeKind::SendWhen(when) });
        prop_assert_eq!(run(&changed, Model::General).ticks, run(&written, Model::General).ticks);
    }
}

/// Two copies of 0.225 kg in one place with bO = 1 N·s/m slide freely, β = 10 N·s/m for 50 ms and then 40 N·s/m: v decays by exp(−(11 + 41)·0.05/0.225), and
/// β takes its share of the energy in each half.
#[test]
fn a_copy_slides_by_the_damping_of_each_time() {
    let text = r#"
        scene = { duration = "100ms", count = 2 }
        object = { mass = 0.45, damping = 1.0, velocity = [0.2] }
        coordination = { strategy = "local-damping", stiffness = 0.0, update = "8ms", local-damping = { damping = 10.0 } }
        peer = { device = { mass = 0.1 }, contact = "none" }
        link = { delay = "5ms" }
        timeline = [{ at = "50ms", coordination = { local-damping = { damping = 40.0 } } }]
        measure = { names = ["energy_j"] }
    "#;
    let scene = Scene::parse(text, "slide.toml".as_ref(), &[]).unwrap();
    let MeasuredRun { summary, values: measured, .. } = Measures::run(&scene, Model::Least);
    let (mass, v0) = (0.225_f64, 0.2_f64);
    let v1 = v0 * (-11.0 * 0.05 / mass).exp();
    let v2 = v1 * (-41.0 * 0.05 / mass).exp();
    for peer in &summary.peers {
        // A hundred steps, each of a few roundings.
        assert!((peer.velocity[0] - v2).abs() < 1e-13 * v0, "{} is not {v2}", peer.velocity[0]);
    }
    let expected = -2.0 * 0.5 * mass * (10.0 / 11.0 * (v0 * v0 - v1 * v1) + 40.0 / 41.0 * (v1 * v1 - v2 * v2));
    let energy = measured[0].value.unwrap();
    assert!((energy - expected).abs() < 1e-12 * expected.abs(), "{energy} is not {expected}");
}
