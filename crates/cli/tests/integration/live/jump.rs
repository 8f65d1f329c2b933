//! The bound on what silence, coming back and coming back elsewhere do to a force: `docs/live.md`.

use std::collections::BTreeMap;

use super::records::{Packet, Tick, trajectory};
use crate::integration::desk::Desk;

/// Of the scene: KT [N/m], BT [N·s/m], and the share of `fade` that a tick is.
const STIFFNESS: f64 = 600.0;
const DAMPING: f64 = 5.0;
const SHARE: f64 = 1.0 / 250.0;
/// Number of other peers of each peer.
const OTHERS: f64 = 2.0;

/// Returns the state that a peer holds of a simulated peer at each tick: the state of the sender's copy at the tick at which the newest sample was sent.
fn held(ticks: &[Tick], sender: &[Tick], packets: &[&Packet]) -> Vec<(f64, f64)> {
    let mut arrivals: Vec<(u64, u64, u64)> = packets.iter().filter_map(|packet| Some((packet.arrived?, packet.sequence, packet.sent))).collect();
    arrivals.sort_unstable();
    let states: BTreeMap<u64, (f64, f64)> = sender.iter().map(|tick| (tick.at, (tick.xo, tick.vo))).collect();
    let (mut arrivals, mut newest, mut holds) = (arrivals.into_iter().peekable(), None, (0.0, 0.0));
    let mut at_tick = |tick: &Tick| {
        while let Some((_, sequence, sent)) = arrivals.next_if(|(arrived, ..)| *arrived <= tick.at) {
            if newest.is_none_or(|newest| sequence > newest) {
                newest = Some(sequence);
                holds = states[&sent];
            }
        }
        holds
    };
    ticks.iter().map(&mut at_tick).collect()
}

/// By how much the force changes more in some tick than it may, at most [N]. The program is at rest in one of `places`, or begins at 0.
fn largest_excess(ticks: &[Tick], held: &[(f64, f64)], places: &[f64]) -> f64 {
    let apart = places.iter().flat_map(|a| places.iter().map(move |b| (a - b).abs())).fold(0.0, f64::max);
    let excess = ticks.windows(2).zip(held.windows(2)).map(|(ticks, held)| {
        let (before, now) = (ticks[0], ticks[1]);
        let far = places.iter().map(|place| (place - before.xo).abs().max((place - now.xo).abs())).fold(0.0, f64::max);
        let fading = SHARE / OTHERS * (STIFFNESS * (far + apart) + DAMPING * before.vo.abs().max(now.vo.abs()));
        let (dx, dv) = ((now.xo - before.xo).abs(), (now.vo - before.vo).abs());
        let (ds, dsv) = ((held[1].0 - held[0].0).abs() / OTHERS, (held[1].1 - held[0].1).abs() / OTHERS);
        (now.ft - before.ft).abs() - fading - STIFFNESS * (dx + ds) - DAMPING * (dv + dsv)
    });
    excess.fold(f64::MIN, f64::max)
}

/// Checks that the force of neither simulated user jumps.
pub(super) fn assert_no_jump(desk: &Desk, packets: &[Packet], places: &[f64; 2]) {
    let record = trajectory(desk, "out");
    let places = [0.0, places[0], places[1]];
    for (name, other) in [("left", "third"), ("third", "left")] {
        let (ticks, link) = (&record[name], format!("{other}->{name}"));
        let carried: Vec<&Packet> = packets.iter().filter(|packet| packet.link == link).collect();
        let held = held(ticks, &record[other], &carried);
        let excess = largest_excess(ticks, &held, &places);
        assert!(excess < 1e-9, "the force on {name} changes by {excess} N more in a tick than it may");
        // The program is felt: a force that ignored it would pass as well. Without it, FT would be that of the other alone, at half the weight.
        let alone = |(tick, (s, sv)): (&Tick, &(f64, f64))| (STIFFNESS * (tick.xo - s) + DAMPING * (tick.vo - sv)) / OTHERS;
        let most = ticks.iter().zip(&held).map(|pair| (pair.0.ft - alone(pair)).abs()).fold(0.0, f64::max);
        assert!(most > 1.0, "the program pulls at {name} with {most} N at most");
        // And the bound is far below what a jump would be: the way between its places, at once.
        let fading = SHARE / OTHERS * STIFFNESS * 4.0 * 0.1;
        assert!(STIFFNESS / OTHERS * (places[2] - places[1]) > 30.0 * fading);
    }
}
