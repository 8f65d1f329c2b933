//! Random drawing of a scene without links. Most numbers are round.

use cohaptic_peer::{ArmConfig, Contact, Coordination, DeviceConfig, Direction, Enclosure, Gains};

use super::draft::{Draft, DraftHand, DraftPeer, Place};
use crate::strategies::grid::{Dice, Span};

/// Converts a number of thousandths.
fn thousandths(count: u64) -> f64 {
    f64::from(u32::try_from(count).unwrap_or(u32::MAX)) / 1e3
}

/// Draws a number from a range that is given in thousandths.
fn number(low: u64, high: u64, dice: &mut Dice<'_>) -> f64 {
    thousandths(dice.number(Span { low, high, step: 1 }))
}

/// Draws components with absolute values up to `most` thousandths. A component is zero in a quarter of all cases.
fn place(most: u64, dice: &mut Dice<'_>) -> Place {
    [(); 3].map(|()| {
        let size = if dice.one_in(4) { 0.0 } else { number(0, most, dice) };
        if size > 0.0 && dice.one_in(2) { -size } else { size }
    })
}

fn gains(stiffness: u64, damping: u64, dice: &mut Dice<'_>) -> Gains {
    Gains { stiffness: number(1_000, 1_000 * stiffness, dice), damping: number(0, 1_000 * damping, dice) }
}

pub(super) fn draft(peers: usize, dice: &mut Dice<'_>) -> Draft {
    let mut draft = Draft::calm(peers);
    draft.duration = dice.number(Span { low: 100, high: 2_000, step: 1 });
    draft.seed = u32::try_from(dice.below(1_000)).unwrap_or(0);
    draft.axes = dice.pick(1, &[1, 2, 3]);
    draft.mass = number(50, 2_000, dice);
    draft.damping = if dice.one_in(2) { number(1, 2_000, dice) } else { 0.0 };
    draft.split_mass = dice.one_in(2);
    draft.strategy = dice.pick(Coordination::AveragePosition, &[Coordination::ProportionalDerivative]);
    draft.gains = gains(2_000, 20, dice);
    draft.update = 1_000 * dice.pick(1, &[1, 2, 4, 8, 10]);
    if dice.one_in(3) {
        (draft.position, draft.velocity) = (place(20, dice), place(200, dice));
    }
    if dice.one_in(4) {
        let (min, size) = (place(30, dice), number(1, 50, dice));
        let (stiffness, damping) = (number(1_000, 1_000_000, dice), number(0, 20_000, dice));
        draft.enclosure = Some(Enclosure { min, max: min.map(|end| end + size), stiffness, damping });
    }
    if dice.one_in(4) {
        draft.integrator = Some((dice.pick("semi-implicit-euler", &["rk4"]), 1 + u32::try_from(dice.below(4)).unwrap_or(0)));
    }
    // Hands are drawn last: contacts need the number of axes, and the phase of a peer lies within one period of sending.
    let (axes, ticks) = (draft.axes, draft.update / 1_000);
    draft.peers.iter_mut().for_each(|peer| touch(peer, axes, ticks, dice));
    draft
}

fn touch(peer: &mut DraftPeer, axes: usize, ticks: u64, dice: &mut Dice<'_>) {
    let axis = usize::try_from(dice.below(axes as u64)).unwrap_or(0);
    let push = Contact::Push(Direction { axis, positive: dice.one_in(2) });
    peer.contact = dice.pick(Contact::Grasp, &[Contact::Grasp, Contact::None, push]);
    peer.compute_delay = dice.one_in(2);
    peer.phase = if dice.one_in(2) { dice.below(ticks) } else { 0 };
    peer.device = DeviceConfig { mass: number(20, 500, dice), damping: number(0, 10_000, dice) };
    peer.coupling = gains(4_000, 10, dice);
    peer.hand = match dice.below(4) {
        0 => DraftHand::None,
        1 => DraftHand::Force(place(2_000, dice)),
        2 => DraftHand::Sine { amplitude: place(2_000, dice), frequency: number(0, 50_000, dice), phase: number(0, 6_000, dice) },
        _ => {
            let arm = ArmConfig { mass: number(0, 500, dice), damping: number(0, 20_000, dice), stiffness: number(0, 200_000, dice) };
            DraftHand::Arm { arm, wanted: place(20, dice) }
        }
    };
    if dice.one_in(4) {
        peer.offset = dice.number(Span { low: 1, high: 3_000_000, step: 1 });
        peer.drift = i32::try_from(dice.below(200_001)).unwrap_or(0) - 100_000;
    }
    if dice.one_in(4) {
        (peer.position, peer.velocity) = (Some(place(20, dice)), Some(place(300, dice)));
    }
}
