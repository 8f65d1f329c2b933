//! Scenes at random.
//!
//! Strategies are boxed, the small ones too. An unboxed strategy is a type of its own with all its parts inside: each property that draws a scene would compile
//! all of them again, and not optimised it would need more than the two megabytes of a test's stack.

use std::time::Duration;

use cohaptic_peer::coordination::{LawForm, LawSettings, LawValue};
use cohaptic_peer::wire::SampleKind;
use cohaptic_peer::{ArmConfig, Contact, Coordination, DeviceConfig, Direction, Enclosure, Gains, SendWhen};
use proptest::collection::vec;
use proptest::option;
use proptest::prelude::*;
use proptest::sample::select;

use crate::{Draft, DraftHand, DraftLink, DraftPeer, Place, contact_to_toml};

/// The laws of the paper.
pub const PAPER: &[Coordination] = &[Coordination::AveragePosition, Coordination::ProportionalDerivative];

/// Anything that a scene can hold: 2 to 5 peers, every kind of link, contact, hand and clock, up to three axes, changes on the way. It may be unstable.
pub fn anything() -> BoxedStrategy<Draft> {
    anything_among(2..=5_usize).boxed()
}

/// [`anything`] with a law of the paper.
pub fn anything_of_the_paper() -> BoxedStrategy<Draft> {
    (anything(), select(PAPER)).prop_map(|(draft, strategy)| Draft { strategy, send_when: None, ..draft }).boxed()
}

/// A strategy with values for the parameters that it has of its own, up to 40 ms, 40 N·s/m or 40 mJ.
fn strategy() -> BoxedStrategy<(Coordination, LawSettings)> {
    let draw = |(law, micros): (Coordination, u32)| {
        let mut settings = LawSettings::default();
        for (place, parameter) in law.parameters().iter().enumerate() {
            let value = match parameter.form {
                LawForm::Duration | LawForm::AutomaticDuration => LawValue::Duration(Duration::from_micros(micros.into())),
                // Up to 40 N·s/m.
                LawForm::AutomaticDamping | LawForm::Damping => LawValue::Number(1e-3 * f64::from(micros)),
                LawForm::Impedance => LawValue::Number(1e-3 * f64::from(micros + 100)),
                // Up to 40 mJ.
                LawForm::Energy => LawValue::Number(1e-6 * f64::from(micros)),
                LawForm::Words(words) => LawValue::Word(micros as usize % words.len()),
                LawForm::Peer => LawValue::Place(micros as usize % 2),
            };
            settings.of_mut(law).set(place, value);
        }
        (law, settings)
    };
    (select(Coordination::ALL), 0..40_000_u32).prop_map(draw).boxed()
}

/// Dead bands.
fn send_when() -> BoxedStrategy<SendWhen> {
    let heartbeat = option::of((1..100_u64).prop_map(Duration::from_millis));
    (0.0..0.99, option::of(1e-6..1e-2), heartbeat)
        .prop_map(|(velocity, position, heartbeat)| SendWhen { velocity: Some(velocity), position, heartbeat })
        .boxed()
}

/// Without what readers refuse for its strategy.
fn with_what_its_strategy_can_have(mut draft: Draft) -> Draft {
    let counts_energy = matches!(draft.strategy, Coordination::PassivityControl | Coordination::SetPosition | Coordination::Wave);
    if counts_energy {
        draft.peers.iter_mut().for_each(|peer| peer.compute_delay = false);
    }
    if matches!(draft.strategy, Coordination::SetPosition | Coordination::Wave) {
        draft.integrator = None;
    }
    if draft.strategy == Coordination::SetPosition {
        draft.timeline.retain(|entry| !entry.contains("coordination ="));
        draft.gains.stiffness = draft.gains.stiffness.max(1.0);
    }
    if draft.strategy == Coordination::Wave {
        draft.peers.iter_mut().for_each(|peer| peer.drift = 0);
    }
    if matches!(draft.strategy, Coordination::Wave | Coordination::ClientServer) {
        draft.send_when = None;
    }
    draft
}

/// [`anything`] with this number of peers.
pub fn anything_among(peers: impl Strategy<Value = usize> + 'static) -> BoxedStrategy<Draft> {
    (peers, 1..=3_usize)
        .prop_flat_map(|(count, axes)| {
            let header = (30..200_u64, any::<u32>(), 0.05..2.0, 0.0..2.0, any::<bool>(), option::weighted(0.3, walls()));
            let bodies = (
                place(0.02),
                place(0.2),
                (strategy(), option::weighted(0.2, send_when())),
                gains(2000.0, 20.0),
                prop_oneof![Just(2000_u64), Just(8000)],
            );
            let peers = (vec(any_peer(axes), count), any_clocks(count));
            let network = (link(), vec((0..count, 1..count, link()), 0..3), vec(option::weighted(0.2, link()), 2 * count));
            let rest = (integrator(), vec((1..30_u64, change(count, axes)), 0..4));
            let parts = (header.boxed(), bodies.boxed(), peers.boxed(), network.boxed(), rest.boxed());
            parts.prop_map(move |(header, bodies, (mut peers, clocks), network, (integrator, changes))| {
                let (duration, seed, mass, damping, split_mass, enclosure) = header;
                let (position, velocity, ((strategy, settings), send_when), gains, update) = bodies;
                let (link, links, mut lines) = network;
                for (number, (peer, clock)) in peers.iter_mut().zip(clocks).enumerate() {
                    peer.name = format!("p{number}");
                    (peer.tick, peer.offset, peer.drift) = clock;
                    peer.phase %= update / peer.tick;
                    (peer.uplink, peer.downlink) = (lines.pop().flatten(), lines.pop().flatten());
                }
                let name = |peer: usize| peers[peer % count].name.clone();
                let mut links: Vec<DraftLink> =
                    links.into_iter().map(|(from, step, keys)| DraftLink { from: name(from), to: name(from + step), keys }).collect();
                links.sort_by(|a, b| (&a.from, &a.to).cmp(&(&b.from, &b.to)));
                links.dedup_by(|a, b| (&a.from, &a.to) == (&b.from, &b.to));
                let timeline = changes
                    .into_iter()
                    .filter(|(_, change)| !matches!(change, Change::Hand(peer, _) if matches!(peers[*peer].hand, DraftHand::Arm { .. })))
                    .map(|(at, change)| format!("at = \"{at}ms\"\n{}", change.to_toml(axes)))
                    .collect();
                let draft = Draft {
                    duration,
                    seed,
                    axes,
                    mass,
                    damping,
                    split_mass,
                    position,
                    velocity,
                    enclosure,
                    strategy,
                    gains,
                    settings,
                    send_when,
                    update,
                    integrator,
                    peers,
                    link,
                    links,
                    timeline,
                };
                with_what_its_strategy_can_have(draft)
            })
        })
        .boxed()
}

/// Scenes of one shape that need no events, if nobody watches: this number of them, with equal peers, ticks and durations, without access lines. Everything else
/// may differ, in half of the cases even the links.
pub fn alike(scenes: impl Strategy<Value = usize> + 'static) -> BoxedStrategy<Vec<Draft>> {
    of_one_shape(scenes, link_or_delay(), false).boxed()
}

/// [`alike`], with one timeline.
pub fn changing(scenes: impl Strategy<Value = usize> + 'static) -> BoxedStrategy<Vec<Draft>> {
    of_one_shape(scenes, link_or_delay(), true).boxed()
}

fn of_one_shape(
    scenes: impl Strategy<Value = usize> + 'static,
    link: impl Strategy<Value = String> + Clone + 'static,
    with_timeline: bool,
) -> BoxedStrategy<Vec<Draft>> {
    let counts = prop_oneof![3 => 2..=5_usize, 1 => 6..=11_usize];
    (scenes, counts)
        .prop_flat_map(move |(scenes, count)| {
            let drafts = vec((anything_among(Just(count)), link.clone(), vec((0..count, 1..count, link.clone()), 0..3)), scenes);
            (drafts, any::<bool>(), 0.9..2.0).prop_map(move |(mut drafts, same_links, stiffer)| {
                let has_arms = drafts.iter().any(|(draft, ..)| draft.peers.iter().any(|peer| matches!(peer.hand, DraftHand::Arm { .. })));
                let mut timeline = std::mem::take(&mut drafts[0].0.timeline);
                timeline.retain(|entry| with_timeline && !(has_arms && entry.contains("hand =")));
                for (draft, link, links) in &mut drafts {
                    draft.timeline.clone_from(&timeline);
                    draft.send_when = None;
                    if draft.strategy.kind(&draft.settings) != SampleKind::State {
                        draft.strategy = Coordination::AveragePosition;
                    }
                    draft.link.clone_from(link);
                    let names: Vec<String> = draft.peers.iter().map(|peer| peer.name.clone()).collect();
                    draft.links.clear();
                    for (from, step, keys) in links {
                        let (from, to) = (names[*from].clone(), names[(*from + *step) % names.len()].clone());
                        if !draft.links.iter().any(|link| (&link.from, &link.to) == (&from, &to)) {
                            draft.links.push(DraftLink { from, to, keys: keys.clone() });
                        }
                    }
                    // Now and then one diverges before the others.
                    draft.gains.stiffness *= stiffer;
                }
                let first = drafts[0].0.clone();
                for (draft, ..) in &mut drafts {
                    (draft.axes, draft.update, draft.duration) = (first.axes, first.update, first.duration);
                    if same_links {
                        (draft.link, draft.links) = (first.link.clone(), first.links.clone());
                    }
                    for (peer, like) in draft.peers.iter_mut().zip(&first.peers) {
                        (peer.tick, peer.offset, peer.drift, peer.phase) =
                            (first.peers[0].tick, 0, 0, like.phase % (first.update / first.peers[0].tick));
                        (peer.uplink, peer.downlink) = (None, None);
                        if let Contact::Push(direction) = &mut peer.contact {
                            direction.axis %= first.axes;
                        }
                    }
                }
                drafts.into_iter().map(|(draft, ..)| draft).collect()
            })
        })
        .boxed()
}

/// A scene whose motions stay bounded and depend continuously on where bodies begin: gains far from the edge of stability at the ages that `link` and
/// update make, grasps but no pushes, no walls, constant forces, equal clocks, one axis. The gains of the proportional-derivative strategy are the
/// smaller, the more peers there are.
pub fn well_behaved(peers: impl Strategy<Value = usize> + 'static, link: impl Strategy<Value = String> + Clone + 'static) -> BoxedStrategy<Draft> {
    peers
        .prop_flat_map(move |count| {
            let peer = (any::<bool>(), any::<bool>(), 0..2_u64, 0.1..0.3, 1.0..5.0, gains(1500.0, 8.0), -1.0..1.0, -0.01..0.01);
            let header = (any::<u32>(), 0.5..1.0, 0.5..2.0, select(PAPER), 50.0..300.0, 5.0..15.0, 1..=4_u64);
            (header.boxed(), vec(peer.boxed(), count), link.clone()).prop_map(move |(header, peers, link)| {
                let (seed, mass, damping, strategy, stiffness, gain, multiple) = header;
                let mut draft = Draft { seed, mass, damping, split_mass: false, strategy, link, update: multiple * 2000, ..Draft::calm(count) };
                let several = strategy == Coordination::ProportionalDerivative;
                let share = if several { f64::from(u32::try_from(count - 1).unwrap()) } else { 1.0 };
                draft.gains = Gains { stiffness: stiffness / share, damping: gain / share };
                for (peer, drawn) in draft.peers.iter_mut().zip(peers) {
                    let (grasps, late, phase, mass, damping, coupling, force, position) = drawn;
                    peer.contact = if grasps { Contact::Grasp } else { Contact::None };
                    (peer.compute_delay, peer.phase, peer.coupling) = (late, phase, coupling);
                    peer.device = DeviceConfig { mass, damping };
                    peer.hand = DraftHand::Force([force, 0.0, 0.0]);
                    peer.position = Some([position, 0.0, 0.0]);
                }
                draft
            })
        })
        .boxed()
}

/// Keys of a link without chance.
pub fn fixed_link() -> BoxedStrategy<String> {
    prop_oneof![Just(String::new()), (0..6000_u32).prop_map(|us| format!("delay = \"{us}us\""))].boxed()
}

/// Keys of a [`link`], in half of the cases of nothing but a constant delay.
fn link_or_delay() -> BoxedStrategy<String> {
    prop_oneof![link(), constant_delay()].boxed()
}

fn constant_delay() -> BoxedStrategy<String> {
    (0..40_000_u32).prop_map(|us| format!("delay = \"{us}us\", jitter = \"0s\"")).boxed()
}

/// Keys of a link of any kind.
pub fn link() -> BoxedStrategy<String> {
    link_with(&["tail-drop", "tail-drop", "head-drop", "codel"], option::weighted(0.2, 0.01..0.3))
}

/// Keys of a link whose queue, if there is one, has one of these disciplines, with that probability of a copy.
fn link_with(disciplines: &'static [&'static str], copies: impl Strategy<Value = Option<f64>> + Clone + 'static) -> BoxedStrategy<String> {
    let delay = prop_oneof![Just(None), (0..40_000_u32).prop_map(Some)];
    // In parts per thousand of the delay: a uniform law reaches √3 of it.
    let jitter = option::of((1..550_u32, any::<bool>(), any::<bool>(), option::of(0.1..0.9)));
    let loss = prop_oneof![
        2 => Just(None),
        1 => (0.0..0.5).prop_map(|p: f64| Some(format!("loss = {p:?}"))),
        1 => (0.0..0.3, 0.1..1.0, 0.0..0.3, 0.7..1.0).prop_map(|(p, r, h, k): (f64, f64, f64, f64)| {
            Some(format!("loss = {{ gilbert-elliott = {{ p = {p:?}, r = {r:?}, h = {h:?}, k = {k:?} }} }}"))
        }),
    ];
    let rate = option::of((30..1000_u32, 0..60_u32, option::of((1..6_u32, 0..3_usize, select(disciplines)))));
    let outage = option::weighted(0.3, (0..60_u32, 1..60_u32));
    (delay, jitter, loss, rate, outage, copies)
        .prop_map(|(delay, jitter, loss, rate, outage, copies)| {
            let mut keys = Vec::new();
            if let Some(us) = delay {
                keys.push(format!("delay = \"{us}us\""));
                if let Some((part, normal, in_order, correlation)) = jitter {
                    let distribution = if normal { "normal" } else { "uniform" };
                    let memory = correlation.map_or_else(String::new, |rho: f64| format!(", correlation = {rho:?}"));
                    keys.push(format!("jitter = {{ sd = \"{}ns\", distribution = \"{distribution}\"{memory} }}", us * part));
                    keys.push(format!("order = \"{}\"", if in_order { "in-order" } else { "allow-reordering" }));
                } else {
                    // Laid over another link, a shorter delay must not be left with its jitter.
                    keys.push("jitter = \"0s\"".to_owned());
                }
            }
            keys.extend(loss);
            if let Some((kbit, overhead, queue)) = rate {
                keys.push(format!("rate = \"{kbit}kbit\", overhead = \"{overhead}B\""));
                if let Some((limit, unit, discipline)) = queue {
                    let limit = [format!("{limit} packets"), format!("{}B", 150 * limit), format!("{}us", 1700 * limit)][unit].clone();
                    keys.push(format!("queue = {{ limit = \"{limit}\", discipline = \"{discipline}\" }}"));
                }
            }
            keys.extend(copies.map(|copies: f64| format!("duplicate = {copies:?}")));
            if let Some((from, length)) = outage {
                keys.push(format!("outage = [{{ from = \"{from}ms\", to = \"{}ms\" }}]", from + length));
            }
            keys.join(", ")
        })
        .boxed()
}

fn any_peer(axes: usize) -> BoxedStrategy<DraftPeer> {
    let basics = (any::<bool>(), 0..16_u64, contact(axes), 0.02..0.5, 0.0..10.0, gains(4000.0, 10.0), hand());
    let start = (option::weighted(0.4, place(0.02)), option::weighted(0.4, place(0.3)));
    (basics, start)
        .prop_map(|((compute_delay, phase, contact, mass, damping, coupling, hand), (position, velocity))| DraftPeer {
            compute_delay,
            phase,
            contact,
            device: DeviceConfig { mass, damping },
            coupling,
            hand,
            position,
            velocity,
            ..DraftPeer::calm("")
        })
        .boxed()
}

/// Tick [µs], offset \[ns\] and drift [ppb] of each peer: all the same in half of the scenes.
fn any_clocks(count: usize) -> BoxedStrategy<Vec<(u64, u64, i32)>> {
    let tick = || select(&[500_u64, 1000, 2000][..]);
    let offset = prop_oneof![Just(0), Just(1_000_000), 0..3_000_000_u64];
    let drift = prop_oneof![Just(0), -100_000..100_000_i32, Just(100_000_000), Just(-100_000_000)];
    prop_oneof![tick().prop_map(move |tick| vec![(tick, 0, 0); count]), vec((tick(), offset, drift), count)].boxed()
}

fn contact(axes: usize) -> BoxedStrategy<Contact> {
    let push = (0..axes, any::<bool>()).prop_map(|(axis, positive)| Contact::Push(Direction { axis, positive }));
    prop_oneof![Just(Contact::Grasp), Just(Contact::None), push].boxed()
}

fn hand() -> BoxedStrategy<DraftHand> {
    prop_oneof![
        Just(DraftHand::None),
        force(),
        (0.0..0.5, 0.0..20.0, 0.0..200.0, place(0.02))
            .prop_map(|(mass, damping, stiffness, wanted)| DraftHand::Arm { arm: ArmConfig { mass, damping, stiffness }, wanted }),
    ]
    .boxed()
}

fn force() -> BoxedStrategy<DraftHand> {
    prop_oneof![
        place(2.0).prop_map(DraftHand::Force),
        (place(2.0), 0.0..50.0, -4.0..4.0).prop_map(|(amplitude, frequency, phase)| DraftHand::Sine { amplitude, frequency, phase }),
    ]
    .boxed()
}

fn walls() -> BoxedStrategy<Enclosure> {
    // They need not hold the origin: then the object is thrown back at once.
    (place(0.03), 0.001..0.05, 1.0..1000.0, 0.0..20.0)
        .prop_map(|(min, size, stiffness, damping)| Enclosure { min, max: min.map(|end| end + size), stiffness, damping })
        .boxed()
}

fn integrator() -> BoxedStrategy<Option<(&'static str, u32)>> {
    prop_oneof![3 => Just(None), 1 => (select(&["semi-implicit-euler", "rk4"][..]), 1..5_u32).prop_map(Some)].boxed()
}

fn gains(stiffness: f64, damping: f64) -> BoxedStrategy<Gains> {
    (0.0..stiffness, 0.0..damping).prop_map(|(stiffness, damping)| Gains { stiffness, damping }).boxed()
}

/// Components up to `size`, and now and then a zero of either sign.
fn place(size: f64) -> BoxedStrategy<Place> {
    let component = prop_oneof![4 => -size..size, 1 => Just(0.0), 1 => Just(-0.0)].boxed();
    [component.clone(), component.clone(), component].boxed()
}

#[derive(Clone, Debug)]
enum Change {
    Link(String),
    Contact(usize, Contact),
    Hand(usize, DraftHand),
    Gains(Gains),
}

fn change(count: usize, axes: usize) -> BoxedStrategy<Change> {
    prop_oneof![
        link().prop_filter("a change changes something", |keys| !keys.is_empty()).prop_map(Change::Link),
        (0..count, contact(axes)).prop_map(|(peer, contact)| Change::Contact(peer, contact)),
        (0..count, prop_oneof![Just(DraftHand::None), force()]).prop_map(|(peer, hand)| Change::Hand(peer, hand)),
        gains(2000.0, 20.0).prop_map(Change::Gains),
    ]
    .boxed()
}

impl Change {
    fn to_toml(&self, axes: usize) -> String {
        let vector = |place: &Place| format!("{:?}", &place[..axes]);
        match self {
            Self::Link(keys) => format!("link = \"all\"\nset = {{ {keys} }}"),
            Self::Contact(peer, contact) => format!("peer = \"p{peer}\"\nset = {{ contact = {} }}", contact_to_toml(*contact)),
            Self::Hand(peer, hand) => {
                let hand = match hand {
                    DraftHand::Force(force) => format!("{{ force = {} }}", vector(force)),
                    DraftHand::Sine { amplitude, frequency, phase } => {
                        format!("{{ sine = {{ amplitude = {}, frequency = {frequency:?}, phase = {phase:?} }} }}", vector(amplitude))
                    }
                    DraftHand::None | DraftHand::Arm { .. } => "\"none\"".to_owned(),
                };
                format!("peer = \"p{peer}\"\nset = {{ hand = {hand} }}")
            }
            Self::Gains(Gains { stiffness, damping }) => format!("coordination = {{ stiffness = {stiffness:?}, damping = {damping:?} }}"),
        }
    }
}
