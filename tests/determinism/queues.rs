//! Lines and token buckets for which no sample waits, because the one before has just left, and those for which one does, because it has not: the same as event by event, to
//! the bit.

use std::sync::Arc;

use cohaptic_harness::{Ending, Model, NoObserver, Simulation, run_side_by_side, same_shape};
use cohaptic_peer::Gains;
use cohaptic_peer::wire::SampleKind;
use cohaptic_scene::{Change, ChangeKind, Scene, Topology};
use cohaptic_tests::{Draft, drafts};
use cohaptic_tests_common::{cases, properties};
use cohaptic_units::Instant;
use proptest::prelude::*;

use super::arrays::{difference, mesh, run, run_interrupted};
use super::watched::found;

/// How many bits a second a line sends, of those that are offered: the samples of a link, a little less, a little more, or far more.
fn parts() -> BoxedStrategy<(f64, i64)> {
    (prop_oneof![3 => Just(1.0), 1 => 0.8..1.3, 1 => Just(100.0)], -1..=1_i64).boxed()
}

fn disciplines() -> BoxedStrategy<String> {
    prop_oneof![
        Just("\"tail-drop\"".to_owned()),
        Just("\"head-drop\"".to_owned()),
        (1..20_u32, 1..60_u32, 0..200_u32).prop_map(|(target, interval, mtu)| {
            format!("{{ codel = {{ target = \"{target}ms\", interval = \"{interval}ms\", mtu = \"{mtu}B\" }} }}")
        }),
        (1..20_u32, any::<bool>())
            .prop_map(|(target, ecn)| { format!("{{ fq-codel = {{ target = \"{target}ms\", interval = \"30ms\", mtu = \"64B\", ecn = {ecn} }} }}") }),
        (1..20_u32, any::<bool>())
            .prop_map(|(target, ecn)| format!("{{ pie = {{ target = \"{target}ms\", burst = \"30ms\", mtu = \"64B\", ecn = {ecn} }} }}")),
        (1..20_u32, 1..9_u32)
            .prop_map(|(target, factor)| format!("{{ dualpi2 = {{ target = \"{target}ms\", tupdate = \"3ms\", coupling-factor = {factor} }} }}")),
        (0..100_u32, 0.0..1.0).prop_map(|(min, weight)| format!(
            "{{ red = {{ min = \"{min}B\", max = \"300B\", max-probability = 0.5, weight = {}, mean-packet = \"64B\" }} }}",
            1.0 - weight
        )),
    ]
    .boxed()
}

/// Keys of a link, of which the rates are written as `{rate}` and `{tokens}`.
fn keys() -> BoxedStrategy<String> {
    let delay = prop_oneof![
        Just("delay = \"9ms\""),
        Just("delay = \"9ms\", jitter = \"2ms\""),
        Just("delay = \"9ms\", jitter = { sd = \"2ms\", correlation = 0.5 }, loss = { gilbert-elliott = { p = 0.2, r = 0.3 } }"),
        Just("delay = \"1100ms\", jitter = \"30ms\", loss = 0.1"),
    ];
    let line = (disciplines(), 0..500_u32)
        .prop_map(|(discipline, limit)| format!(", rate = \"{{rate}}bit\", queue = {{ limit = \"{limit}B\", discipline = {discipline} }}"));
    let bucket = (0..200_u32).prop_map(|more| format!(", token-bucket = {{ rate = \"{{tokens}}bit\", burst = \"{{size+{more}}}B\" }}"));
    (delay, prop::option::weighted(0.8, line), prop::option::weighted(0.3, bucket))
        .prop_map(|(delay, line, bucket)| format!("{delay}{}{}", line.unwrap_or_default(), bucket.unwrap_or_default()))
        .boxed()
}

/// Keys with the rates, as parts of what is offered.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    clippy::cast_sign_loss,
    reason = "sizes of some bytes, rates of some kilobits a second"
)]
fn written(keys: &str, draft: &Draft, line: (f64, i64), tokens: (f64, i64)) -> String {
    let size = SampleKind::State.datagram_len(draft.axes);
    let offered = 8e6 * size as f64 / draft.update as f64;
    let rate = |(part, more): (f64, i64)| ((offered * part) as u64).saturating_add_signed(more).to_string();
    let keys = keys.replace("{rate}", &rate(line)).replace("{tokens}", &rate(tokens));
    let Some((before, rest)) = keys.split_once("{size+") else { return keys };
    let (more, after) = rest.split_once('}').unwrap();
    format!("{before}{}{after}", size + more.parse::<usize>().unwrap())
}

properties! {
    #![proptest_config(cases(300))]

    /// The timeline makes links others, while samples are on lines and before them.
    #[test]
    fn what_is_inside_when_links_change_comes_to_the_same(
        mut drafts in drafts::alike(Just(1)), keys in prop::array::uniform3(keys()), parts in prop::array::uniform3((parts(), parts())), at in prop::array::uniform2(0..300_000_u32),
    ) {
        let draft = &mut drafts[0];
        let [link, first, second] = std::array::from_fn(|place| written(&keys[place], draft, parts[place].0, parts[place].1));
        (draft.link, draft.gains, draft.duration) = (link, draft.gains.scaled(0.1), 400);
        draft.links.clear();
        for (at, keys) in [(at[0].min(at[1]), first), (at[0].max(at[1]), second)] {
            draft.timeline.push(format!("at = \"{at}us\"\nlink = \"all\"\nset = {{ {keys} }}"));
        }
        let scene = draft.scene();
        prop_assert!(same_shape(&scene, &scene), "it is run in arrays");
        let expected = run(&scene, Model::General);
        prop_assert_eq!(difference(&run(&scene, Model::Least), &expected), None, "{}, {:?}", draft.link, draft.timeline);
    }
}

properties! {
    #![proptest_config(cases(600))]

    #[test]
    fn they_come_to_what_their_events_come_to(
        mut drafts in drafts::alike(Just(1)), keys in keys(), (part, more) in parts(), tokens in parts(), on_ring: bool, breaths in 1..3_usize,
    ) {
        let draft = &mut drafts[0];
        draft.link = written(&keys, draft, (part, more), tokens);
        draft.links.clear();
        draft.gains = draft.gains.scaled(0.1);
        draft.duration = if draft.link.contains("1100ms") { 1500 } else { draft.duration };
        let scene = draft.scene();
        let topology = if on_ring { Topology::ring(scene.peers.len(), 2).map(Arc::new) } else { None };
        let scene = Scene { topology, ..scene };
        let is_in_arrays = same_shape(&scene, &scene);
        prop_assert!(is_in_arrays || scene.has_gains_by_peer(), "it is run in arrays");
        let expected = run(&scene, Model::General);
        prop_assert_eq!(difference(&run(&scene, Model::Least), &expected), None, "{}", draft.link);
        let Ok(on_threads) = Simulation::new(&scene, Model::Least).on_threads(2).run(&mut NoObserver);
        prop_assert_eq!(difference(&on_threads, &expected), None, "{}", draft.link);
        if is_in_arrays {
            prop_assert_eq!(found(&scene, |_| ()), None, "{}", draft.link);
            for together in run_side_by_side(&vec![scene.clone(); 8]) {
                prop_assert_eq!(difference(&together, &expected), None, "{}", draft.link);
            }
        }
        let interrupted = |model| run_interrupted(&scene, model, breaths);
        prop_assert_eq!(difference(&interrupted(Model::Least), &interrupted(Model::General)), None, "{}", draft.link);
    }
}

/// Queues decide about all that happens until the next sample. A run that diverges ends in between: what did not happen by then is not counted, the observer is
/// asked once at each instant, and sees the rows that events show.
#[test]
fn a_run_that_diverges_has_counted_what_happened() {
    let codel = |ecn: bool| format!("{{ codel = {{ target = \"5ms\", interval = \"30ms\", ecn = {ecn} }} }}");
    let red = |ecn: bool| {
        let curve = "min = \"64B\", max = \"320B\", max-probability = 0.5, weight = 0.1, mean-packet = \"64B\"";
        format!("{{ red = {{ {curve}, ecn = {ecn} }} }}")
    };
    let of_flows = |ecn: bool| format!("{{ fq-codel = {{ target = \"5ms\", interval = \"30ms\", mtu = \"64B\", ecn = {ecn} }} }}");
    let pie = |ecn: bool| format!("{{ pie = {{ target = \"5ms\", burst = \"0ms\", mtu = \"64B\", ecn = {ecn} }} }}");
    let all = |ecn| [codel(ecn), of_flows(ecn), pie(ecn), red(ecn)];
    let dualpi2 = "{ dualpi2 = { target = \"5ms\" } }".to_owned();
    for discipline in ["\"head-drop\"".to_owned(), dualpi2].into_iter().chain(all(false)).chain(all(true)) {
        // Samples come every 8 ms, and take 8.5 ms each.
        let link = format!("delay = \"9ms\", jitter = \"2ms\", rate = \"60kbit\", queue = {{ limit = \"9 packets\", discipline = {discipline} }}");
        for shift in [0, 2, 5] {
            let mut scene = mesh(11, &link);
            let what = ChangeKind::Coordination(Gains { stiffness: 3e7, damping: 5.0 });
            scene.timeline.push(Change { at: Instant::from_nanos((1500 + shift) * 1_000_000), what });
            assert!(same_shape(&scene, &scene), "it is run in arrays");
            let expected = run(&scene, Model::General);
            assert!(matches!(expected.ending, Ending::Diverged(_)), "{discipline}");
            assert_eq!(difference(&run_interrupted(&scene, Model::Least, usize::MAX), &expected), None, "{discipline}");
            assert_eq!(found(&scene, |_| ()), None, "{discipline}");
        }
    }
}
