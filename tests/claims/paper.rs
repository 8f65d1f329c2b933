//! Scenes with the numbers of the paper.

use cohaptic_peer::{Contact, Coordination, Gains};
use cohaptic_stability::{Method, Verdict, analyse};
use cohaptic_tests::Draft;

/// Both strategies, AP first.
pub(crate) const BOTH: [Coordination; 2] = [Coordination::AveragePosition, Coordination::ProportionalDerivative];

/// Section 4 of the paper: mO = 0.45 kg, mH = 0.1 kg, bH = 5 N·s/m, KC = 3500 N/m, KT = 1000 N/m, BT = BC = 5 N·s/m, Tc = 1 ms, Tn = 8 ms. The first
/// `touching` peers touch the object.
pub(crate) fn paper(strategy: Coordination, peers: usize, touching: usize) -> Draft {
    let mut draft = Draft { strategy, update: 8000, ..Draft::calm(peers) };
    draft.peers.iter_mut().take(touching).for_each(|peer| peer.contact = Contact::Grasp);
    draft
}

/// The same with these couplings.
pub(crate) fn coupled(mut draft: Draft, stiffness: f64, damping: f64) -> Draft {
    draft.peers.iter_mut().for_each(|peer| peer.coupling = Gains { stiffness, damping });
    draft
}

/// The same with the other strategy.
pub(crate) fn with(draft: &Draft, strategy: Coordination) -> Draft {
    Draft { strategy, ..draft.clone() }
}

/// What the spectral radius of the scene says, the nominal one where links leave something to chance.
pub(crate) fn nominal(draft: &Draft) -> Verdict {
    analyse(&draft.scene(), Method::Reduced).unwrap().verdict()
}
