//! A server and its clients on the general path, and strategies that have no analysis.

use std::path::Path;

use cohaptic_scene::Scene;
use cohaptic_stability::{AnalysisError, Method, Verdict, analyse};

fn read(name: &str, changes: &[&str]) -> Scene {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios").join(name);
    let changes: Vec<String> = changes.iter().copied().map(str::to_owned).collect();
    Scene::read(&file, &changes).unwrap_or_else(|error| panic!("{error}"))
}

/// The radii equal those of an independent computation, to all digits given.
#[test]
fn a_server_and_its_clients_have_the_radii_computed_elsewhere() {
    let object = "coordination.client-server.returns=object";
    for (name, changes, expected, digits) in [
        ("coordination/client-server.toml", &[][..], 0.904_775_073, 1e-9),
        ("coordination/client-server.toml", &[object], 0.913_552_824, 1e-9),
        ("counterexamples/client-server-coupling.toml", &[], 1.484_734_7, 1e-7),
    ] {
        for method in [Method::Reduced, Method::Full] {
            let analysis = analyse(&read(name, changes), method).unwrap();
            assert!((analysis.radius.value - expected).abs() < digits, "{name} {changes:?}: {:?}", analysis.radius);
        }
    }
}

/// Nothing depends on the device of a client that lets go. The rest of the scene has the eigenvalues of a scene without this client.
#[test]
fn a_client_that_lets_go_changes_nothing() {
    for returns in ["force", "object"] {
        let returns = format!("coordination.client-server.returns={returns}");
        let radius = |changes: &[&str]| {
            let analysis = analyse(&read("coordination/client-server.toml", &[&[returns.as_str()], changes].concat()), Method::Full).unwrap();
            assert_eq!(analysis.verdict(), Verdict::Stable, "{changes:?}");
            analysis.radius.value
        };
        let (with, without) =
            (radius(&["peers.right.contact=none"]), radius(&["peers=[{ name = \"server\", contact = \"none\" }, { name = \"left\" }]"]));
        assert!((with - without).abs() < 1e-12, "{with} {without}");
    }
}

/// Average-position is stable with a coupling with which client-server is not.
#[test]
fn average_position_bears_the_coupling_that_a_server_does_not() {
    let scene = read("counterexamples/client-server-coupling.toml", &["coordination.strategy=average-position"]);
    assert_eq!(analyse(&scene, Method::Reduced).unwrap().verdict(), Verdict::Stable);
}

#[test]
fn what_has_no_analysis_is_refused_by_name() {
    for strategy in ["passivity-control", "set-position"] {
        let scene = read(&format!("coordination/{strategy}.toml"), &[]);
        assert_eq!(analyse(&scene, Method::Reduced), Err(AnalysisError::NoAnalysis { strategy }));
    }
    assert_eq!(analyse(&read("coordination/send-when.toml", &[]), Method::Reduced), Err(AnalysisError::DeadBands));
}
