//! Explanation of operators: the model of each person.

use cohaptic_peer::Hand;
use cohaptic_peer::operator::{MovesConfig, OperatorLaw, Seen};
use cohaptic_scene::{PeerSpec, Scene};
use cohaptic_units::print::{Number, Span};

use super::{Rows, names};

/// Sources of the law of movements. The defaults of a scene are of the order that these sources report.
const OF_MOVES: &str = "minimum jerk (Flash & Hogan 1985), move and wait (Sheridan & Ferrell 1963), noise as the length (Harris & Wolpert 1998), visual delay \
                        (Keele & Posner 1968); a model of nobody in particular, with numbers of the usual order";
/// Source of the law of tracking.
const OF_CROSSOVER: &str =
    "the crossover model (McRuer & Jex 1967): hand and object together are an integrator with a delay; a model of nobody in particular";

impl Rows {
    /// Adds a row for each different person of the scene.
    pub(super) fn operators(&mut self, scene: &Scene) {
        let mut groups: Vec<(String, &'static str, Vec<&PeerSpec>)> = Vec::new();
        for (peer, spec) in scene.peers.iter().enumerate() {
            let Some((model, reason)) = described(scene, peer, spec) else { continue };
            match groups.iter_mut().find(|(other, ..)| *other == model) {
                Some((_, _, peers)) => peers.push(spec),
                None => groups.push((model, reason, vec![spec])),
            }
        }
        for (model, reason, peers) in groups {
            self.model(&format!("operator of {}", names(&peers)), model, reason);
        }
        self.stability_with_operators(scene);
    }

    /// Adds the analysis of stability of a scene with persons, by the law of their hands.
    fn stability_with_operators(&mut self, scene: &Scene) {
        let any = |is: fn(&OperatorLaw) -> bool| (0..scene.peers.len()).any(|peer| scene.operator(peer).is_some_and(|operator| is(&operator.law)));
        if any(|law| matches!(law, OperatorLaw::Crossover { .. })) {
            let (model, reason) = if scene.rotation.is_some() {
                ("refused", "an object that turns is analysed without operators who track")
            } else {
                ("wanted and seen places are states of a frame", "the law is linear; point, map and boundary follow it, and nothing else does")
            };
            self.model("stability with operators who track", model, reason);
        }
        if any(|law| matches!(law, OperatorLaw::Moves(_))) {
            let reason = "each movement is planned by a look after the movement before, which is not linear";
            self.model("stability with operators who make movements", "their arms alone", reason);
        }
    }
}

/// Returns the model of the person at the hand of a peer and its reason; `None` without a person.
fn described(scene: &Scene, peer: usize, spec: &PeerSpec) -> Option<(String, &'static str)> {
    let Some(Hand::Operator { arm, operator }) = &spec.hand else { return None };
    let seen = match operator.sees {
        Seen::Own => "the own copy".to_owned(),
        Seen::Peer(other) => format!("the newest sample of {}", scene.peers[other].name),
    };
    let seen = format!("sees {seen}, {} late", Span(operator.visual_delay));
    let arm = format!("an arm of {} kg, {} N·s/m and {} N/m", Number(arm.mass), Number(arm.damping), Number(arm.stiffness));
    let (law, reason) = match &operator.law {
        OperatorLaw::Moves(moves) => (of_moves(moves, &Span(scene.expected_delay(peer))), OF_MOVES),
        OperatorLaw::Crossover { frequency } => {
            (format!("crossover: the velocity of the hand is {} rad/s times the error", Number(*frequency)), OF_CROSSOVER)
        }
    };
    Some((format!("{law}; {seen}; {arm}"), reason))
}

/// Returns whether the movements of a person of the scene are random.
pub(super) fn has_noise(scene: &Scene) -> bool {
    let noisy = |law: &OperatorLaw| matches!(law, OperatorLaw::Moves(moves) if moves.noise > 0.0);
    (0..scene.peers.len()).filter_map(|peer| scene.operator(peer)).any(|operator| noisy(&operator.law))
}

fn of_moves(moves: &MovesConfig, expects: &Span) -> String {
    let MovesConfig { reaction, duration, speed, step, noise, learns, expects: _ } = moves;
    let mut text = format!("movements of {}, the first after {}", Span(*duration), Span(*reaction));
    if let Some(speed) = speed {
        text.push_str(&format!(", with at most {} m/s", Number(*speed)));
    }
    if let Some(step) = step {
        text.push_str(&format!(", at most {} m long", Number(*step)));
    }
    if *noise > 0.0 {
        text.push_str(&format!(", noise {} of the length", Number(*noise)));
    }
    let learning = if *learns > 0.0 { format!("learns the gain by {} of each movement", Number(*learns)) } else { "takes the gain for 1".to_owned() };
    format!("{text}; {learning}; waits for a delay of {expects}")
}
