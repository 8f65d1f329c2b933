//! The scenes whose verdicts are timed.

use cohaptic_scene::Scene;
use cohaptic_stability::{Family, KeyRange};

/// The paper's parameters (Rakhsha & Constantinescu 2015, Section 3) with everybody touching, Td = Tn.
const PAPER: &str = r#"
    scene        = { duration = "2s", count = 3 }
    object       = { mass = 0.45 }
    coordination = { strategy = "average-position", stiffness = 1000.0, damping = 5.0, update = "8ms" }
    peer         = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
    link         = { delay = "8ms" }
"#;

/// A number of equal peers, with those changes.
///
/// # Panics
///
/// If a change is none.
#[must_use]
pub fn equal(peers: usize, changes: &[String]) -> Scene {
    let overrides: Vec<String> = [format!("scene.count={peers}")].iter().chain(changes).cloned().collect();
    Scene::parse(PAPER, "paper.toml".as_ref(), &overrides).expect("a scene")
}

/// A number of equal peers with KT from 0 to 6000 N/m and KC from 100 to 6000 N/m, with those changes.
///
/// # Panics
///
/// Never: the scene has these keys.
#[must_use]
pub fn family(peers: usize, changes: &[String]) -> Family {
    let overrides: Vec<String> = [format!("scene.count={peers}")].iter().chain(changes).cloned().collect();
    let keys = ["coordination.stiffness=0..6000", "peer.coupling.stiffness=100..6000"].map(|key| KeyRange::parse(key).expect("a range"));
    Family::new(PAPER, "paper.toml".as_ref(), &overrides, keys.to_vec()).expect("a family")
}

/// The curves of the paper's Figure 3, BT = BC = 0: proportional-derivative for 2 to 5 peers, average-position for 2 to 8; over links that lose that share
/// of the samples \[%\].
#[must_use]
pub fn figure_3(loss: u32) -> Vec<Family> {
    let curve = |strategy: &str, peers: usize| {
        let undamped = ["coordination.damping=0".to_owned(), "peer.coupling.damping=0".to_owned()];
        let changes = [format!("coordination.strategy={strategy}"), format!("link.loss={loss}%")];
        family(peers, &[changes, undamped].concat())
    };
    (2..=5).map(|peers| curve("proportional-derivative", peers)).chain((2..=8).map(|peers| curve("average-position", peers))).collect()
}

/// Eight peers no two of which are equal, over links of a delay \[ms\].
///
/// # Panics
///
/// If the scene is none, which a test would show.
#[must_use]
pub fn eight_different(delay: u32) -> Scene {
    let mut text = PAPER.replace(", count = 3", "");
    for peer in 1..=8 {
        let number = f64::from(peer);
        let (mass, damping) = (0.08 + 0.01 * number, 4.0 + 0.25 * number);
        let (stiffness, coupling) = (3000.0 + 100.0 * number, 4.0 + 0.25 * number);
        text += &format!(
            "[[peers]]\nname = \"{peer}\"\ndevice = {{ mass = {mass:?}, damping = {damping:?} }}\n\
             coupling = {{ stiffness = {stiffness:?}, damping = {coupling:?} }}\n"
        );
    }
    Scene::parse(&text, "eight.toml".as_ref(), &[format!("link.delay={delay}ms")]).expect("a scene")
}

#[cfg(test)]
mod tests {
    use cohaptic_stability::{Method, analyse};

    use super::*;

    #[test]
    fn eight_different_peers_have_one_radius_by_both_methods() {
        let scene = eight_different(8);
        let [full, reduced] = [Method::Full, Method::Reduced].map(|method| analyse(&scene, method).unwrap());
        assert!((full.radius.value - reduced.radius.value).abs() < 1e-12);
        // Four states of a body each and two of a sample, less the common position; the reduced path needs one number of a sample.
        assert_eq!(full.dimension, 8 * 6 - 1);
        assert_eq!(figure_3(0).len(), 11);
    }
}
