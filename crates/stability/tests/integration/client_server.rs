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

/// Arms hold the devices of both clients, so that without a returned force nothing is left that moves freely.
const ARMS: [&str; 2] = [
    "peers.left.hand={ arm = { mass = 0.5, damping = 20.0, stiffness = 300.0 } }",
    "peers.right.hand={ arm = { mass = 0.5, damping = 20.0, stiffness = 300.0 } }",
];

/// Over a constant delay displacements add up to positions, and the analysis is that of states.
#[test]
fn displacements_are_followed_where_they_add_up_to_positions() {
    for changes in [&[][..], &["coordination.client-server.returns=object"], &[ARMS[0], ARMS[1], "coordination.client-server.returns=none"]] {
        let of = |sends: &str| analyse(&read("coordination/client-server.toml", &[changes, &[sends]].concat()), Method::Reduced).unwrap();
        let (states, increments) = (of("coordination.client-server.sends=states"), of("coordination.client-server.sends=increments"));
        assert_eq!((increments.radius.value, increments.dimension), (states.radius.value, states.dimension), "{changes:?}");
    }
}

/// No force comes back, so the object swings alone on couplings to two devices. The couplings are sampled at each tick h: with K = 200 N/m, B = 10 N·s/m and
/// m = 0.45 kg the product of both eigenvalues of a tick is 1 − B·h/m + K·h²/(2·m) = 0.978. The devices on their arms come to rest sooner.
#[test]
fn without_a_returned_force_the_object_swings_alone() {
    let scene = read("coordination/client-server.toml", &[ARMS[0], ARMS[1], "coordination.client-server.returns=none"]);
    let analysis = analyse(&scene, Method::Full).unwrap();
    // Eight ticks a frame, and the square root of the product for each eigenvalue.
    assert!((analysis.radius.value - 0.978_f64.powi(4)).abs() < 1e-9, "{:?}", analysis.radius);
    // Without arms nothing brings the devices together again.
    let free = analyse(&read("coordination/client-server.toml", &["coordination.client-server.returns=none"]), Method::Full).unwrap();
    assert_eq!(free.verdict(), Verdict::Marginal, "{:?}", free.radius);
}

#[test]
fn displacements_over_a_line_that_does_more_than_delay_are_refused_by_name() {
    let increments = "coordination.client-server.sends=increments";
    for (change, line, peer) in [
        ("link.loss=5%", "the link from left to server", "left"),
        ("links=[{ from = \"right\", to = \"server\", duplicate = { probability = 0.1 } }]", "the link from right to server", "right"),
        ("links=[{ from = \"right\", to = \"server\", loss = { packets = [3], every = 10 } }]", "the link from right to server", "right"),
        ("peers.right.uplink.jitter=1ms", "the uplink of right", "right"),
        ("peers.server.downlink.rate=1Mbit", "the downlink of server", "left"),
    ] {
        let scene = read("coordination/client-server.toml", &[increments, change]);
        let expected = AnalysisError::LostIncrements { line: line.to_owned(), peer: peer.to_owned() };
        assert_eq!(analyse(&scene, Method::Reduced), Err(expected), "{change}");
        let states = read("coordination/client-server.toml", &[change]);
        assert!(analyse(&states, Method::Reduced).is_ok(), "{change}");
    }
    // Samples from the server may get lost: a lost sample costs the clients of this scene one force, and no sum.
    let back = "links=[{ from = \"server\", to = \"left\", loss = { packets = [3], every = 10 } }]";
    analyse(&read("coordination/client-server.toml", &[increments, back]), Method::Reduced).unwrap();
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
