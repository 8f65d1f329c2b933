//! What a disturbance does with `wave` is what the monodromy matrix says, from waves at zero on: the matrix is made from states that are put into peers one
//! by one, the run knows nothing of them.

use cohaptic_harness::Model;
use cohaptic_peer::coordination::LawValue;
use cohaptic_peer::{Contact, Coordination};
use cohaptic_stability::{Monodromy, StateKind, monodromy};
use cohaptic_tests::{Draft, DraftHand, DraftLink, Log, drafts, run};
use cohaptic_tests_common::{cases, properties};
use proptest::collection::vec;
use proptest::prelude::*;

const FRAMES: usize = 4;

/// Two or three peers over links of any constant delays and patterns of loss.
fn linear() -> BoxedStrategy<Draft> {
    let link = (0..30_000_u64, 0..3_u64, 1..4_u64);
    (drafts::anything_among(2..=3_usize), vec(link, 6), 0.5..50.0, 0..2_usize)
        .prop_map(|(mut draft, links, impedance, on_loss)| {
            (draft.strategy, draft.send_when, draft.integrator, draft.enclosure) = (Coordination::Wave, None, None, None);
            let settings = draft.settings.of_mut(Coordination::Wave);
            settings.set(0, LawValue::Number(impedance));
            settings.set(1, LawValue::Word(on_loss));
            draft.timeline.clear();
            draft.link = String::new();
            let names: Vec<String> = draft.peers.iter().map(|peer| peer.name.clone()).collect();
            let pairs = names.iter().flat_map(|from| names.iter().filter(move |to| *to != from).map(move |to| (from.clone(), to.clone())));
            let keys = |(delay, lost, every): (u64, u64, u64)| {
                let loss = if lost < every { format!(", loss = {{ packets = [{lost}], every = {every} }}") } else { String::new() };
                format!("delay = \"{delay}us\"{loss}")
            };
            draft.links = pairs.zip(links).map(|((from, to), link)| DraftLink { from, to, keys: keys(link) }).collect();
            for peer in &mut draft.peers {
                (peer.drift, peer.compute_delay, peer.uplink, peer.downlink) = (0, false, None, None);
                // A frame begins at 0, when nothing has happened yet.
                peer.offset %= 1000 * peer.tick;
                if matches!(peer.contact, Contact::Push(_)) {
                    peer.contact = Contact::Grasp;
                }
                peer.hand = match peer.hand {
                    DraftHand::Arm { arm, .. } => {
                        // The position of the last sample is relative to the copy, but where an arm holds it: it begins at 0.
                        peer.position = Some([0.0; 3]);
                        DraftHand::Arm { arm, wanted: [0.0; 3] }
                    }
                    DraftHand::None | DraftHand::Force(_) | DraftHand::Sine { .. } => DraftHand::None,
                };
            }
            draft
        })
        .boxed()
}

/// The states of the bodies at the beginning of a frame; `None` for what no run records.
fn bodies(monodromy: &Monodromy, draft: &Draft, log: &Log, frame: usize) -> Vec<Option<f64>> {
    let start = monodromy.frame.as_nanos() * frame as u128;
    let value = |peer: usize, kind: StateKind| {
        let ticks = log.of(peer);
        let tick = ticks.iter().find(|tick| u128::from(tick.at.as_nanos()) >= start).unwrap();
        let relative =
            |position: f64, axis: usize| if monodromy.relative[peer][axis].is_some() { position - tick.object.position[axis] } else { position };
        match kind {
            StateKind::DevicePosition { axis } if draft.peers[peer].contact == Contact::None => Some(tick.device.position[axis]),
            StateKind::DevicePosition { axis } => Some(relative(tick.device.position[axis], axis)),
            StateKind::DeviceVelocity { axis } => Some(tick.device.velocity[axis] * monodromy.time),
            StateKind::ObjectPosition { axis } => Some(relative(tick.object.position[axis], axis)),
            StateKind::ObjectVelocity { axis } => Some(tick.object.velocity[axis] * monodromy.time),
            StateKind::PendingCoupling { .. }
            | StateKind::PendingForce { .. }
            | StateKind::LatestPosition { .. }
            | StateKind::LatestVelocity { .. }
            | StateKind::ReadingPosition { .. }
            | StateKind::ReadingVelocity { .. }
            | StateKind::KeptCoupling { .. }
            | StateKind::Memory { .. }
            | StateKind::WantedPosition { .. }
            | StateKind::SeenPosition { .. }
            | StateKind::SamplePosition { .. }
            | StateKind::SampleVelocity { .. }
            | StateKind::SampleForce { .. }
            | StateKind::SampleWave { .. } => None,
        }
    };
    monodromy.states.iter().map(|state| value(state.peer, state.kind)).collect()
}

properties! {
    #![proptest_config(cases(30))]

    #[test]
    fn waves_move_bodies_as_the_matrix_says(mut draft in linear()) {
        let matrix = monodromy(&draft.scene()).unwrap();
        draft.duration = (u64::try_from(matrix.frame.as_millis()).unwrap() + 1) * (FRAMES as u64 + 1);
        let log = run(&draft.scene(), Model::Least);
        let largest_row = (0..matrix.matrix.rows()).map(|row| matrix.matrix.row(row).iter().map(|entry| entry.abs()).sum::<f64>()).fold(0.0, f64::max);
        // No wave is on its way.
        let mut expected: Vec<f64> = bodies(&matrix, &draft, &log, 0).into_iter().map(|state| state.unwrap_or(0.0)).collect();
        let (mut largest, mut tolerance) = (0.0_f64, 0.0);
        for frame in 1..=FRAMES {
            largest = expected.iter().fold(largest, |largest, entry| largest.max(entry.abs()));
            tolerance = tolerance * largest_row.max(1.0) + (matrix.error + 1e-13) * (largest + 0.01);
            expected = matrix.matrix.times_column(&expected);
            for ((found, expected), name) in bodies(&matrix, &draft, &log, frame).iter().zip(&expected).zip(&matrix.states) {
                let Some(found) = found else { continue };
                prop_assert!((found - expected).abs() <= tolerance, "{} of {}: {found:e}, expected {expected:e} within {tolerance:e}", name.kind, name.peer);
            }
        }
// Of a contact that is far from stable little is left to compare.
        prop_assume!(tolerance < 1e-3 * largest);
    }
}
