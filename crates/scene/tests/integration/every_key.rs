//! A scene file with every key: each key sets the field of the scene that belongs to it.

use core::time::Duration;
use std::path::{Path, PathBuf};

use cohaptic_peer::{ArmConfig, Contact, Coordination, DeviceConfig, Direction, Enclosure, Exchange, Gains, Hand, Integrator, Signal};
use cohaptic_scene::{Axes, Bounds, ChangeKind, LinkSelector, Measure, MeasureName, MeasureSpec, MeasureTravel, Scaling, Scene};
use cohaptic_units::{Bytes, Hertz, Instant, Probability, Rate};
use cohaptic_wan::{
    Bottleneck, Delay, Distribution, DropCause, Framing, GilbertElliott, Jitter, LinkConfig, LinkModel, Loss, Order, Outage, QueueLimit,
};

const MILLISECOND: Duration = Duration::from_millis(1);

pub(crate) fn path() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/integration/data/every-key.toml")
}

fn scene() -> Scene {
    Scene::read(&path(), &[]).unwrap_or_else(|error| panic!("{error}"))
}

fn probability(value: f64) -> Probability {
    Probability::new(value).unwrap()
}

fn at(millis: u64) -> Instant {
    Instant::from_nanos(millis * 1_000_000)
}

#[test]
fn the_header_the_object_and_the_coordination_are_as_written() {
    let scene = scene();
    assert_eq!((scene.title.as_str(), scene.duration, scene.seed, scene.axes), ("Every key", 10_000 * MILLISECOND, 42, Axes::Two));
    assert_eq!((scene.object.mass, scene.object.damping, scene.object.split_mass), (0.45, 0.5, false));
    assert_eq!((scene.object.position, scene.object.velocity), ([0.01, -0.02, 0.0], [0.001, 0.001, 0.0]));
    let enclosure = Enclosure { min: [-0.1, -0.1, 0.0], max: [0.1, 0.2, 0.0], stiffness: 1000.0, damping: 5.0 };
    assert_eq!(scene.object.enclosure, Some(enclosure));
    assert_eq!((scene.coordination.strategy, scene.coordination.scaling), (Coordination::AveragePosition, Scaling::InverseN));
    assert_eq!((scene.coordination.gains, scene.coordination.update), (Gains { stiffness: 2100.0, damping: 5.0 }, 8 * MILLISECOND));
    assert_eq!(scene.integrator, Integrator::RungeKutta4 { steps: 4 });
}

fn fixed(model: &LinkModel) -> &LinkConfig {
    model.as_fixed().unwrap()
}

#[test]
fn a_peer_is_its_own_keys_over_those_of_all_peers() {
    let scene = scene();
    let names: Vec<&str> = scene.peers.iter().map(|peer| peer.name.as_str()).collect();
    assert_eq!(names, ["left", "right", "third", "fourth", "fifth", "sixth"]);
    assert_eq!((scene.peer_index("third"), scene.peer_index("nobody")), (Some(2), None));
    let [left, right, third, ..] = scene.peers.as_slice() else { panic!("six peers") };

    // The mass is its own, the damping that of all: tables are laid over each other.
    assert_eq!(left.device, DeviceConfig { mass: 0.2, damping: 5.0 });
    assert_eq!(left.hand, Some(Hand::Force(Signal::Constant([1.5, -0.5, 0.0]))));
    assert_eq!((left.position, left.velocity), ([0.0; 3], [0.5, 0.25, 0.0]));
    assert_eq!((left.clock.tick, left.clock.offset, left.clock.drift.parts_per_billion()), (MILLISECOND, 300_000 * Duration::from_nanos(1), -20_000));
    assert_eq!((left.phase, left.compute_delay, left.contact), (3, true, Contact::Grasp));
    assert_eq!((left.coupling, left.coupling_scaling), (Gains { stiffness: 3500.0, damping: 5.0 }, Scaling::InverseN));
    let line =
        Bottleneck { framing: Framing { overhead: 28, cells: None }, limit: None, ..Bottleneck::at_rate(Rate::bits_per_sec(10_000_000).unwrap()) };
    assert_eq!(fixed(left.uplink.as_ref().unwrap()).bottleneck, Some(line));
    assert_eq!(fixed(left.downlink.as_ref().unwrap()).delay, Delay::constant(MILLISECOND));

    assert_eq!(right.contact, Contact::Push(Direction { axis: 1, positive: false }));
    assert_eq!((right.clock.offset, right.clock.drift.parts_per_billion()), (300_000 * Duration::from_nanos(1), 10_000));
    assert_eq!((right.position, right.downlink.as_ref()), ([0.01, -0.02, 0.0], None));
    assert_eq!((third.contact, third.hand.as_ref(), third.phase, third.clock.tick), (Contact::None, None, 0, 2 * MILLISECOND));
    assert_eq!((left.exchange, third.exchange), (Exchange::EACH_TICK, Exchange { every: 4, late: true }));
}

#[test]
fn every_kind_of_hand_is_read() {
    let scene = scene();
    let hand = |name: &str| scene.peers[scene.peer_index(name).unwrap()].hand.clone().unwrap();
    let swing = Signal::Sine { amplitude: [0.05, 0.0, 0.0], frequency: Hertz(0.5), phase: 0.0 };
    assert_eq!(hand("right"), Hand::Arm { arm: ArmConfig { mass: 0.4, damping: 3.0, stiffness: 200.0 }, follows: swing });
    let spring = ArmConfig { mass: 0.0, damping: 0.0, stiffness: 100.0 };
    assert_eq!(hand("sixth"), Hand::Arm { arm: spring, follows: Signal::Constant([0.1, 0.2, 0.0]) });
    let Hand::Force(recorded) = hand("fourth") else { panic!("a force") };
    assert_eq!(recorded.value::<2>(at(500)), [1.5, -0.25]);
    let Hand::Arm { follows, .. } = hand("fifth") else { panic!("an arm") };
    assert_eq!(follows.value::<2>(at(250)), [0.01, 0.0]);
}

#[test]
fn a_link_is_its_own_keys_over_those_of_all_links() {
    let scene = scene();
    let usual = fixed(scene.links.between(2, 3));
    assert_eq!(usual.delay, Delay::with_jitter(24 * MILLISECOND, Jitter::new(2 * MILLISECOND, Distribution::Uniform)).unwrap());
    let bursts = GilbertElliott { p: probability(0.01), r: probability(0.1), h: probability(0.5), k: probability(0.999) };
    assert_eq!((usual.loss.clone(), usual.order), (Loss::GilbertElliott(bursts), Order::InOrder));
    let queue = Bottleneck {
        framing: Framing { overhead: 28, cells: None },
        limit: Some(QueueLimit::Packets(100)),
        ..Bottleneck::at_rate(Rate::bits_per_sec(1_000_000).unwrap())
    };
    assert_eq!(usual.bottleneck, Some(queue.clone()));
    assert_eq!(*usual.outages.scheduled(), [Outage { from: at(1_000), to: at(2_000) }, Outage { from: at(3_000), to: at(3_500) }]);

    let there = fixed(scene.links.between(0, 1));
    assert_eq!(there.delay, Delay::with_jitter(40 * MILLISECOND, Jitter::new(MILLISECOND, Distribution::Normal)).unwrap());
    assert_eq!(
        (there.loss.clone(), there.order, there.bottleneck.clone()),
        (Loss::Independent(probability(0.01)), Order::InOrder, Some(queue.clone()))
    );
    assert!(there.outages.is_empty());

    // Every inherited impairment is taken away; the queue goes with its rate.
    let back = fixed(scene.links.between(1, 0));
    assert_eq!((back.delay.clone(), back.loss.clone(), back.bottleneck.clone()), (Delay::constant(24 * MILLISECOND), Loss::None, None));
    assert_eq!(scene.links.configs().len(), 3);
}

#[test]
fn changes_stand_in_order_of_time_and_on_top_of_each_other() {
    let scene = scene();
    let times: Vec<Instant> = scene.timeline.iter().map(|change| change.at).collect();
    assert_eq!(times, [at(2_000), at(3_000), at(4_000), at(4_000), at(10_000)]);
    let ChangeKind::AllLinks(all) = &scene.timeline[0].what else { panic!("links") };
    assert_eq!(all.used().map(|(_, count)| count).sum::<u64>(), 6 * 5);
    // The link without a rate stays without one: its queue means nothing.
    let back = fixed(all.between(1, 0));
    assert_eq!((back.delay.clone(), back.bottleneck.clone()), (Delay::constant(50 * MILLISECOND), None));
    let ChangeKind::Link(change) = &scene.timeline[1].what else { panic!("one link") };
    assert_eq!((change.from, change.to), (0, 1));
    assert_eq!((change.config.mean_delay(), fixed(&change.config).loss.clone()), (50 * MILLISECOND, Loss::Independent(probability(0.2))));
    assert_eq!(fixed(&change.config).bottleneck.as_ref().unwrap().limit, Some(QueueLimit::Bytes(Bytes::new(64_000))));
    assert_eq!(scene.timeline[2].what, ChangeKind::Contact { peer: 2, contact: Contact::Grasp });
    let up = Some(Hand::Force(Signal::Constant([0.0, 1.0, 0.0])));
    assert_eq!(scene.timeline[3].what, ChangeKind::Hand { peer: 2, hand: up });
    assert_eq!(scene.timeline[4].what, ChangeKind::Coordination(Gains { stiffness: 1000.0, damping: 2.0 }));
}

#[test]
fn every_expectation_is_read() {
    let expect = scene().expect.unwrap();
    assert_eq!((expect.stable, expect.discrepancy), (Some(true), Some(Bounds { min: Some(0.0), max: Some(0.5) })));
    let position = &expect.positions[0];
    assert_eq!((position.peer, position.axis, position.at, position.bounds), (0, 1, at(1_000), Bounds { min: Some(-1.0), max: Some(1.0) }));
    let travel = &expect.travel[0];
    assert_eq!((travel.peer, travel.axis, travel.distance, travel.bounds), (1, 0, 0.1, Bounds { min: Some(1.0), max: Some(1.2) }));
    assert_eq!((expect.loss[0].link, expect.loss[0].cause, expect.loss[0].max), (LinkSelector::All, Some(DropCause::Loss), Some(probability(0.02))));
    assert_eq!((expect.loss[1].link, expect.loss[1].cause, expect.loss[1].min), (LinkSelector::Uplink(0), None, None));
    assert_eq!((expect.delay[0].link, expect.delay[0].min), (LinkSelector::Between { from: 0, to: 1 }, Some(23 * MILLISECOND)));
    assert_eq!(expect.delay[1].link, LinkSelector::Downlink(0));
    let named = |measure: Measure, peer: Option<usize>| MeasureName { measure, peer };
    let expected: Vec<(MeasureName, Bounds)> = expect.measures.iter().map(|expected| (expected.name, expected.bounds)).collect();
    let energy = (named(Measure::PeerEnergy, Some(0)), Bounds { min: Some(-1.0), max: Some(1.0) });
    assert_eq!(expected, [energy, (named(Measure::AgeP99, None), Bounds { min: None, max: Some(0.1) })]);
}

#[test]
fn every_measure_that_is_asked_for_is_read() {
    let MeasureSpec { names, settings } = scene().measure.unwrap();
    let named = |measure: Measure, peer: Option<usize>| MeasureName { measure, peer };
    assert_eq!(names, [named(Measure::Energy, None), named(Measure::PeerEnergy, Some(2)), named(Measure::AgeP99, None)]);
    assert_eq!(settings.travel, MeasureTravel { peer: 1, axis: 1, distance: 0.05 });
    assert_eq!((settings.band, settings.probe), (0.002, None));
}

#[test]
fn an_override_goes_wherever_its_path_leads() {
    let set = |overrides: &[&str]| {
        let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
        Scene::read(&path(), &overrides).unwrap_or_else(|error| panic!("{error}"))
    };
    assert_eq!(set(&["coordination.stiffness=1000"]).coordination.gains.stiffness, 1000.0);
    assert_eq!(set(&["link.delay=8ms"]).links.between(2, 3).mean_delay(), 8 * MILLISECOND);
    assert_eq!(set(&["link.delay=\"8ms\"", "link.delay = \"9ms\""]).links.between(2, 3).mean_delay(), 9 * MILLISECOND);
    assert_eq!(set(&["peers.left.contact='none'"]).peers[0].contact, Contact::None);
    assert_eq!(set(&["peers.0.device.mass=3"]).peers[0].device.mass, 3.0);
    assert_eq!(set(&["links.left.right.delay=70ms"]).links.between(0, 1).mean_delay(), 70 * MILLISECOND);
    assert_eq!(set(&["links.third.left.delay=70ms"]).links.between(2, 0).mean_delay(), 70 * MILLISECOND);
    assert_eq!(fixed(set(&["links.left.right={ jitter = \"0s\" }"]).links.between(0, 1)).delay, Delay::constant(24 * MILLISECOND));
    assert_eq!(set(&["timeline.0.at=9s"]).timeline[3].at, at(9_000));
    assert_eq!(set(&["expect.travel.0.max=1.5s"]).expect.unwrap().travel[0].bounds.max, Some(1.5));
    assert!(set(&["timeline=[]"]).timeline.is_empty());
    assert_eq!(fixed(set(&["link.rate=unlimited", "timeline=[]"]).links.between(2, 3)).bottleneck, None);
}

#[test]
fn peers_made_by_number_can_be_changed_one_by_one() {
    let text = "scene = { duration = \"1s\", count = 1000 }\nobject.mass = 1\ncoordination = { strategy = \"average-position\", stiffness = 1, update = \"8ms\" }\n\
                peer = { device.mass = 0.1, coupling.stiffness = 100 }\nlink.delay = \"5ms\"\n[[peers]]\nname = \"peer3\"\ntick = \"2ms\"";
    let overrides = ["peers.peer7.contact=none".to_owned(), "links.peer1.peer2.delay=9ms".to_owned()];
    let scene = Scene::parse(text, Path::new(""), &overrides).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((scene.title.as_str(), scene.peers.len(), scene.links.configs().len()), ("scene", 1000, 2));
    assert_eq!((scene.peers[2].clock.tick, scene.peers[6].contact, scene.peers[999].contact), (2 * MILLISECOND, Contact::None, Contact::Grasp));
    assert_eq!((scene.links.between(0, 1).mean_delay(), scene.links.between(1, 0).mean_delay()), (9 * MILLISECOND, 5 * MILLISECOND));
}

#[test]
fn the_same_text_is_the_same_scene() {
    assert_eq!(scene(), scene());
}
