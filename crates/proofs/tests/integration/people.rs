//! Proofs do not follow people who track a target, and say so by name.

use cohaptic_proofs::{Effort, Links, Patterns, ProvenLine, ProvenRegion, prove_every_number, prove_switching, worst_case};
use cohaptic_scene::Scene;
use cohaptic_stability::{Family, KeyRange, Unwatched};

const TWO: &str = r#"
    scene        = { duration = "1s", count = 2 }
    object       = { mass = 0.45 }
    coordination = { strategy = "average-position", stiffness = 1000.0, damping = 5.0, update = "8ms" }
    peer         = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 }, hand = { operator = {} } }
    link         = { delay = "24ms" }
    task         = { kind = "track", sines = [{ amplitude = 0.02, frequency = 0.1 }] }
"#;

#[track_caller]
fn refused<T, E: std::fmt::Display>(what: &str, found: Result<T, E>) {
    let Err(error) = found else { panic!("{what} answers") };
    let expected = format!("{what} does not follow the operator of peer1, whose law is \"crossover\": ");
    assert!(error.to_string().starts_with(&expected), "{error}");
}

#[test]
fn every_proof_refuses_people_who_track() {
    let scene = Scene::parse(TWO, "two.toml".as_ref(), &[]).unwrap();
    let family = |keys: &[&str]| {
        let keys = keys.iter().map(|key| KeyRange::parse(key).unwrap()).collect();
        Family::new(TWO, "two.toml".as_ref(), &[], keys).unwrap()
    };
    let stiffness = "coordination.stiffness=100..1000";
    refused("the proof for every number of peers", prove_every_number(&scene, 2, None, &Unwatched));
    refused("the proof of contacts that switch", prove_switching(&scene, &Unwatched));
    refused("a proof", ProvenLine::prove(&family(&[stiffness]), 1.0, &Unwatched));
    refused("a proof", ProvenRegion::prove(&family(&[stiffness, "coordination.damping=1..10"]), 1, None, &Unwatched));
    for links in [Links::Together, Links::Each] {
        let patterns = Patterns { losses_in_a_row: 1, delay: None, links };
        refused("the worst case", worst_case(&scene, &patterns, &Effort::default()));
    }
}
