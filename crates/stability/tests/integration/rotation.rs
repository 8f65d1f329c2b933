//! Analyses of objects that turn.

use cohaptic_peer::DeviceConfig;
use cohaptic_scene::Scene;
use cohaptic_stability::{
    Admittance, AdmittanceError, Family, FamilyScratch, KeyRange, Method, PartKind, PushedAxis, Unwatched, analyse, mean_square, monodromy,
};

/// Scene of two peers with the paper's parameters, who hold an object that turns.
const TURNS: &str = r#"
    scene        = { duration = "1s", count = 2, axes = 3 }
    object       = { mass = 0.45, inertia = 2.7e-4 }
    coordination = { strategy = "average-position", stiffness = 1000.0, damping = 5.0, update = "8ms" }
    peer         = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
    link         = { delay = "8ms" }
"#;

fn scene(overrides: &[&str]) -> Scene {
    let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
    Scene::parse(TURNS, "turns.toml".as_ref(), &overrides).unwrap()
}

/// Nine radii of the differences across the grasp, and nine of the pivots, computed apart from this program: J is 2.7·10⁻⁴ kg·m².
#[test]
fn one_grasp_for_all_has_the_radii_computed_elsewhere() {
    for (peers, delay, grasp, stiffness, across, pivot) in [
        (3, 24, 0.03, 1000.0, 0.929_838_311, 1.038_068_529),
        (5, 8, 0.02, 2000.0, 0.864_191_270, 0.974_580_702),
        (2, 8, 0.03, 500.0, 0.862_751_514, 0.946_850_240),
    ] {
        let set = [
            format!("scene.count={peers}"),
            format!("link.delay={delay}ms"),
            format!("peer.grasp=[{grasp}, 0, 0]"),
            format!("coordination.stiffness={stiffness}"),
        ];
        let found = analyse(&scene(&set.each_ref().map(String::as_str)), Method::Reduced).unwrap();
        let difference = |motion: &str| {
            let mode = found.modes.iter().find(|mode| mode.motion.starts_with(motion)).unwrap();
            mode.parts.iter().find(|part| matches!(part.kind, PartKind::Apart { .. })).unwrap().radius.value
        };
        for (motion, expected) in [("touched 2", across), ("pivot", pivot)] {
            assert!((difference(motion) - expected).abs() <= 5.5e-10, "{peers}, {motion}: {}", difference(motion));
        }
        assert!((found.radius.value - across.max(pivot)).abs() <= 5.5e-10, "{found:?}");
        assert_eq!(found.rigid_modes, 6);
    }
}

/// Four radii of all components together, computed apart from this program.
#[test]
fn all_components_together_have_the_radii_computed_elsewhere() {
    let bodies = "object.inertia=[1.2e-4, 2.0e-4, 2.6e-4]";
    let common: [(&[&str], f64); 4] = [
        (&["peers.peer1.grasp=[0.03, 0, 0]", "peers.peer2.grasp=[-0.03, 0, 0]"], 1.047_025_161_376),
        (
            &[
                "coordination.strategy=proportional-derivative",
                "scene.count=3",
                "coordination.stiffness=600",
                "link.delay=12ms",
                bodies,
                "coordination.rotational-stiffness=0.5",
                "coordination.rotational-damping=0.002",
                "object.rotational-damping=0.001",
                "peers.peer1.grasp=[0.03, 0, 0]",
                "peers.peer2.grasp=[-0.015, 0.025, 0]",
                "peers.peer3.grasp=[-0.01, -0.02, 0.02]",
            ],
            0.968_737_804_367,
        ),
        (
            &[
                "scene.count=4",
                "coordination.stiffness=1500",
                bodies,
                "coordination.rotational-stiffness=[0.9, 0.7, 0.8]",
                "coordination.rotational-damping=0.003",
            ],
            0.967_744_324_489,
        ),
        (
            &[
                "scene.count=3",
                "link.delay=16ms",
                bodies,
                "peer.grasp=[0.02, 0.01, 0]",
                "peer.device.inertia=[2e-5, 2e-5, 1e-5]",
                "peer.device.rotational-damping=0.002",
                "peer.coupling.rotational-stiffness=3",
                "peer.coupling.rotational-damping=0.002",
            ],
            0.995_984_642_280,
        ),
    ];
    for (overrides, expected) in common {
        for method in [Method::Full, Method::Reduced] {
            let found = analyse(&scene(overrides), method).unwrap();
            assert!((found.radius.value - expected).abs() <= 5.1e-13 + found.radius.error, "{overrides:?}: {:?}", found.radius);
            assert!(found.radius.error < 1e-10 && found.rigid_modes == 6, "{found:?}");
        }
    }
}

#[test]
fn a_scene_that_splits_has_the_radius_of_all_components_together() {
    let six = ["peer.device.inertia=[2e-5, 2e-5, 1e-5]", "peer.coupling.rotational-stiffness=3", "peer.device.rotational-damping=0.001"];
    for (splits, overrides) in [
        (true, &["scene.count=3", "object.inertia=[1.2e-4, 2.0e-4, 2.6e-4]", "peer.grasp=[0.01, -0.02, 0.025]", "object.damping=1"][..]),
        (true, &["scene.count=4", "coordination.scaling=inverse-n", "object.split-mass=true", six[0], six[1], six[2]]),
        (true, &["peers.peer2.contact=none", "coordination.strategy=proportional-derivative", "peer.grasp=[0, 0.02, 0]", "peer.compute-delay=1"]),
        (true, &["coordination.strategy=extrapolated", "coordination.rotational-stiffness=0.4", "link.delay=20ms", "simulation.integrator=rk4"]),
        (false, &["coordination.strategy=extrapolated", "peer.grasp=[0.02, 0, 0]", "scene.count=4"]),
        (true, &["coordination.strategy=local-damping", "object.inertia=[1.2e-4, 2.0e-4, 2.6e-4]", "scene.count=3", "object.split-mass=true"]),
        (true, &["coordination.strategy=local-damping", "peer.grasp=[0.02, 0.01, 0]", "coordination.scaling=inverse-n", "scene.count=3"]),
        (true, &["coordination.strategy=local-damping", "coordination.local-damping.damping=9", "peer.grasp=[0, 0.02, 0]"]),
        (false, &["coordination.strategy=local-damping", "object.inertia=[1.2e-4, 2.0e-4, 2.6e-4]", "peer.grasp=[0, 0.02, 0]"]),
        (false, &["peer.grasp=[0.02, 0, 0]", six[0], six[1], six[2], "scene.count=3", "peers.peer3.contact=none"]),
    ] {
        let scene = scene(overrides);
        assert_eq!(scene.rotation_parts().unwrap().is_ok(), splits);
        let [reduced, full] = [Method::Reduced, Method::Full].map(|method| analyse(&scene, method).unwrap());
        assert!((reduced.radius.value - full.radius.value).abs() < 1e-10, "{overrides:?}: {:?}, {:?}", reduced.radius, full.radius);
        assert_eq!((reduced.rigid_modes, reduced.dimension), (full.rigid_modes, full.dimension), "{overrides:?}");
    }
}

/// A law with memory is analysed in one-axis parts with the same law, and refused by name if the motion does not split into such parts.
#[test]
fn laws_that_remember_are_followed_in_parts() {
    for law in ["smoothed-average-position", "local-lag"] {
        let (strategy, bodies) = (format!("coordination.strategy={law}"), "object.inertia=[1.2e-4, 2.0e-4, 2.6e-4]");
        let found = analyse(&scene(&[&strategy, bodies, "peer.grasp=[0, 0, 0]"]), Method::Reduced).unwrap();
        let turn = found.modes.iter().find(|mode| mode.motion == "rz").unwrap();
        let share = 2.6e-4 / 0.45;
        let translation = scene(&[
            &strategy,
            "scene={duration=\"1s\", count=2}",
            "object={mass=2.6e-4}",
            &format!("coordination.stiffness={:?}", 1000.0 * share),
            &format!("coordination.damping={:?}", 5.0 * share),
            "peer.contact=none",
        ]);
        let expected = analyse(&translation, Method::Reduced).unwrap().radius;
        assert!((turn.radius.value - expected.value).abs() <= turn.radius.error + expected.error, "{law}: {:?} {expected:?}", turn.radius);
        for overrides in [[&strategy, bodies, "peers.peer2.grasp=[0.02, 0, 0]"], [&strategy, bodies, "peer.grasp=[0.02, 0, 0]"]] {
            let scene = scene(&overrides);
            if scene.rotation_parts().unwrap().is_ok() {
                analyse(&scene, Method::Reduced).unwrap();
            }
            let refused = analyse(&scene, Method::Full).unwrap_err().to_string();
            assert!(refused.starts_with(&format!("{law} of an object that turns is analysed only where its motion splits")), "{refused}");
        }
    }
}

/// A map or a line gives the radii of its scenes.
#[test]
fn a_family_of_scenes_that_turn_has_their_radii() {
    for grasp in ["peer.grasp=[0, 0, 0]", "peer.grasp=[0.02, 0.01, 0]", "peers.peer2.grasp=[0.02, 0.01, 0]"] {
        for key in ["coordination.stiffness=500..1500", "object.mass=0.3..0.6", "link.delay=8ms..16ms"] {
            let range = KeyRange::parse(key).unwrap();
            let (name, middle) = (range.key.clone(), if key.contains("ms") { 16.0 } else { 0.5 * (range.low + range.high) });
            let unit = range.unit.clone();
            let family = Family::new(TURNS, "turns.toml".as_ref(), &[grasp.to_owned()], vec![range]).unwrap();
            let found = family.bounded_radius(&[middle], &mut FamilyScratch::default()).unwrap().radius;
            let expected = analyse(&scene(&[grasp, &format!("{name}={middle}{unit}")]), Method::Reduced).unwrap().radius;
            assert!((found.value - expected.value).abs() <= found.error + expected.error, "{grasp}, {key}: {found:?} {expected:?}");
        }
    }
}

/// Of a network with chance the parts are followed, and what does not split is refused by name.
#[test]
fn chance_is_followed_in_the_parts() {
    let lossy = |grasp: &str| scene(&[grasp, "link.loss=20%", "scene.count=3"]);
    let whole = mean_square(&lossy("peer.grasp=[0.03, 0, 0]")).unwrap();
    let mut parts = lossy("peer.grasp=[0.03, 0, 0]").rotation_parts().unwrap().unwrap().parts;
    // Where a part has no device, one that comes to rest sooner than all else does not count.
    let quick = DeviceConfig { mass: 0.1, damping: 5.0 };
    parts.iter_mut().flat_map(|part| &mut part.scene.peers).for_each(|spec| spec.device = quick);
    let of_parts: Vec<_> = parts.iter().map(|part| mean_square(&part.scene).unwrap().radius).collect();
    let largest = of_parts.iter().copied().max_by(|a, b| a.value.total_cmp(&b.value)).unwrap();
    assert!((whole.radius.value - largest.value).abs() <= whole.radius.error + largest.error && largest.value > 0.9, "{whole:?} {of_parts:?}");
    let error = mean_square(&lossy("peers.peer2.grasp=[0.03, 0, 0]")).unwrap_err();
    assert!(error.to_string().contains("the object is held at different points"), "{error}");
}

/// About an axis it is that of the scene of one axis with the inertia and the gains of the turn.
#[test]
fn the_admittance_of_a_turn_is_that_of_its_scene() {
    let about = |more: &[&str], axis| Admittance::between_watched(&scene(more), 0, Some(axis), None, &Unwatched);
    let turns = ["peer.device.inertia=[2e-5, 3e-5, 1e-5]", "peer.device.rotational-damping=0.001", "peer.coupling.rotational-stiffness=3"];
    let one = [
        "scene.axes=1",
        "object.mass=2.7e-4",
        "coordination.stiffness=0.6",
        "coordination.damping=0.003",
        "peer.device={ mass = 3e-5, damping = 0.001 }",
        "peer.coupling={ stiffness = 3, damping = 0 }",
    ];
    let one: Vec<String> = one.iter().map(|text| (*text).to_owned()).collect();
    let one = Scene::parse(&TURNS.replace(", inertia = 2.7e-4", ""), "one.toml".as_ref(), &one).unwrap();
    for hz in [0.1, 3.0, 40.0] {
        let found = about(&turns, PushedAxis::Ry).unwrap().at(hz).unwrap();
        let expected = Admittance::of(&one, 0).unwrap().at(hz).unwrap();
        assert!((found.value - expected.value).norm() <= found.error + expected.error, "{found:?} {expected:?}");
    }
    assert!(matches!(about(&[], PushedAxis::Rx), Err(AdmittanceError::DoesNotTurn { axis: "rx", .. })));
    let error = about(&["peer.grasp=[0.01, 0, 0]", "peers.peer2.contact.push=+x"], PushedAxis::X).unwrap_err();
    assert!(error.to_string().starts_with("a one-sided contact of an object that turns"), "{error}");
    assert!(matches!(Admittance::between_watched(&one, 0, Some(PushedAxis::Rx), None, &Unwatched), Err(AdmittanceError::NoSuchAxis { axis: "rx" })));
}

#[test]
fn what_does_not_follow_turns_refuses_them_by_name() {
    let error = monodromy(&scene(&[])).unwrap_err();
    assert!(error.to_string().starts_with("the monodromy matrix does not follow an object that turns"), "{error}");
    let error = analyse(&scene(&["peers.peer2.contact.push=+x", "peers.peer1.grasp=[0.01, 0, 0]"]), Method::Reduced).unwrap_err();
    assert!(error.to_string().starts_with("a one-sided contact of an object that turns"), "{error}");
}
