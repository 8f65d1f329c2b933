//! A peer more changes no random number of the links that were there before.

use std::collections::BTreeMap;

use cohaptic_harness::Model;
use cohaptic_peer::Coordination;
use cohaptic_peer::coordination::LawValue;
use cohaptic_tests::{Draft, DraftPeer, drafts, run};
use cohaptic_tests_common::{cases, properties};
use cohaptic_units::Instant;
use cohaptic_wan::Fate;
use proptest::prelude::*;

/// What became of each packet: for each link by name, by sequence number and copy, when it was sent and its fates.
type Fates = BTreeMap<(String, String), BTreeMap<(u64, u8), Vec<(Instant, Fate)>>>;

fn fates(draft: &Draft) -> Fates {
    let mut fates = Fates::new();
    for row in run(&draft.scene(), Model::Least).packets {
        let name = |peer: usize| draft.peers[peer].name.clone();
        let link = fates.entry((name(row.path.from.index()), name(row.path.to.index()))).or_default();
        link.entry((row.sequence, row.copy)).or_default().push((row.offered, row.fate));
    }
    fates
}

properties! {
    #![proptest_config(cases(500))]

    #[test]
    fn a_bystander_changes_no_fate_on_other_links(mut draft in drafts::anything(), place in 0..6_usize) {
        for peer in &mut draft.peers {
            // What shares a line with the bystander's packets may well change.
            (peer.uplink, peer.downlink) = (None, None);
            // A scene that diverges ends early, and how early depends on who takes part.
            peer.contact = cohaptic_peer::Contact::None;
        }
        draft.gains.stiffness /= 100.0;
        draft.gains.damping /= 100.0;
        draft.enclosure = None;
        // With dead bands, motion says what is sent.
        draft.send_when = None;
        draft.timeline.retain(|entry| entry.contains("link = "));
        let before = fates(&draft);
        let place = place % (draft.peers.len() + 1);
        draft.peers.insert(place, DraftPeer { tick: draft.peers[0].tick, ..DraftPeer::calm("bystander") });
        // The server stays the same peer.
        let settings = draft.settings.of_mut(Coordination::ClientServer);
        let server = settings.place(0);
        settings.set(0, LawValue::Place(if place <= server { server + 1 } else { server }));
        let after = fates(&draft);
        for (link, fates) in &before {
            prop_assert_eq!(Some(fates), after.get(link), "{:?}", link);
        }
    }
}
