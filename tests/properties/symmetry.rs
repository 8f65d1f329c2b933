//! Space has no origin, and peers have no rank.

use cohaptic_harness::Model;
use cohaptic_peer::wire::SampleKind;
use cohaptic_tests::{Draft, Log, Tick, drafts, run};
use cohaptic_tests_common::{cases, properties};
use proptest::prelude::*;

properties! {
    #![proptest_config(cases(200))]

    /// A power of two as the shift, so that shifting itself rounds each initial position once and no more.
    #[test]
    fn a_shifted_scene_moves_as_the_scene_does(draft in drafts::well_behaved(2..=5_usize, drafts::link()), power in -2..7, left in any::<bool>()) {
        let shift = if left { -libm::exp2(f64::from(power)) } else { libm::exp2(f64::from(power)) };
        let mut shifted = draft.clone();
        shifted.position[0] += shift;
        for position in shifted.peers.iter_mut().filter_map(|peer| peer.position.as_mut()) {
            position[0] += shift;
        }
        let (here, there) = (run(&draft.scene(), Model::Least), run(&shifted.scene(), Model::Least));
        let tolerance = rounding(&draft, &here, shift.abs());
        prop_assert_eq!(here.ticks.len(), there.ticks.len());
        prop_assert_eq!(&here.packets, &there.packets);
        for (a, b) in here.ticks.iter().zip(&there.ticks) {
            for (a, b) in [(a.object, b.object), (a.device, b.device), (a.target, b.target)] {
                let error = (b.position[0] - shift - a.position[0]).abs();
                prop_assert!(error <= tolerance, "{error:e} > {tolerance:e}");
            }
        }
    }

    /// A sum of two does not depend on their order, so with three peers nothing rounds differently. Lines that packets share are left out: there the
    /// packet to the first peer goes first.
    #[test]
    fn three_peers_in_another_order_move_as_before(mut draft in drafts::anything_among(Just(3)), order in Just(vec![0, 1, 2]).prop_shuffle()) {
        // Energies and waves are added in the order in which they arrive, and a server is one of the peers.
        if draft.strategy.kind(&draft.settings) != SampleKind::State {
            draft.strategy = drafts::PAPER[0];
        }
        for peer in &mut draft.peers {
            (peer.uplink, peer.downlink) = (None, None);
        }
        let (before, after) = (run(&draft.scene(), Model::Least), run(&permuted(&draft, &order).scene(), Model::Least));
        for (place, peer) in order.iter().enumerate() {
            let (one, other) = (before.of(*peer), after.of(place));
            prop_assert_eq!(one.len(), other.len());
            for (a, b) in one.iter().zip(other) {
                prop_assert_eq!(**a, Tick { peer: *peer, ..*b });
            }
        }
    }

    #[test]
    fn many_peers_in_another_order_move_as_before(
        (draft, order) in drafts::well_behaved(4..=7_usize, drafts::link())
            .prop_flat_map(|draft| { let order: Vec<usize> = (0..draft.peers.len()).collect(); (Just(draft), Just(order).prop_shuffle()) })
    ) {
        let (before, after) = (run(&draft.scene(), Model::Least), run(&permuted(&draft, &order).scene(), Model::Least));
        let tolerance = rounding(&draft, &before, 0.0);
        for (place, peer) in order.iter().enumerate() {
            for (a, b) in before.of(*peer).iter().zip(after.of(place)) {
                for (a, b) in [(a.object, b.object), (a.device, b.device)] {
                    let error = (a.position[0] - b.position[0]).abs();
                    prop_assert!(error <= tolerance, "{error:e} > {tolerance:e}");
                }
            }
        }
    }

    /// Names are the addresses of random numbers and of nothing else.
    #[test]
    fn names_mean_nothing_where_nothing_is_drawn(mut draft in drafts::anything(), link in drafts::fixed_link()) {
        (draft.link, draft.links) = (link, Vec::new());
        draft.timeline.retain(|entry| !entry.contains("link = "));
        for peer in &mut draft.peers {
            (peer.uplink, peer.downlink) = (None, None);
        }
        let mut renamed = draft.clone();
        for peer in &mut renamed.peers {
            let name = format!("z{}-né", 9 - peer.name.len());
            let (old, new) = (format!("\"{}\"", peer.name), format!("{name}{}", peer.name));
            for entry in &mut renamed.timeline {
                *entry = entry.replace(&old, &format!("\"{new}\""));
            }
            peer.name = new;
        }
        let (one, other) = (run(&draft.scene(), Model::Least), run(&renamed.scene(), Model::Least));
        prop_assert_eq!(one.ticks, other.ticks);
        prop_assert_eq!(one.packets, other.packets);
    }
}

/// The same peers, with their names, in another order: the one in place i is `order[i]` of before.
fn permuted(draft: &Draft, order: &[usize]) -> Draft {
    Draft { peers: order.iter().map(|peer| draft.peers[*peer].clone()).collect(), ..draft.clone() }
}

/// How far two computations of one well-behaved scene can be apart at its end, if each rounds in its own way.
///
/// Positions are of the size p = |shift| + x. Each of n ticks rounds each of them (u·p) and puts into each force an error of at most 4·u·K·p with the
/// sum K of all gains: differences of neighbours are exact, their mean has a few roundings. In a scene that does not swing up, a force error F over
/// the time t carries a mass no farther than it would a free one: F·t²/(2m). Velocities round too, u·v a tick, over t. A factor of 8 for the two
/// computations, and for masses that pull one another.
fn rounding(draft: &Draft, log: &Log, shift: f64) -> f64 {
    let largest = |value: &dyn Fn(&Tick) -> f64| log.ticks.iter().map(|tick| value(tick).abs()).fold(0.0, f64::max);
    let position = shift + largest(&|tick| tick.object.position[0].abs().max(tick.device.position[0].abs()));
    let velocity = largest(&|tick| tick.object.velocity[0].abs().max(tick.device.velocity[0].abs()));
    let stiffness = |gain: fn(&cohaptic_peer::Gains) -> f64| {
        let coupling = draft.peers.iter().map(|peer| gain(&peer.coupling)).fold(0.0, f64::max);
        coupling + super::count(draft.peers.len()) * gain(&draft.gains)
    };
    let lightest = draft.peers.iter().map(|peer| peer.device.mass).fold(draft.mass, f64::min);
    let time = log.end().as_secs_f64();
    let ticks = time * 1000.0;
    let force = 4.0 * super::ROUNDING * (stiffness(|gains| gains.stiffness) * position + stiffness(|gains| gains.damping) * velocity);
    8.0 * (ticks * super::ROUNDING * (position + velocity * time) + force * time * time / (2.0 * lightest))
}
