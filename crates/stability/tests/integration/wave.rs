//! Waves on the general path.

use cohaptic_scene::Scene;
use cohaptic_stability::{Method, Verdict, analyse};
use cohaptic_tests_common::properties;
use proptest::prelude::*;

/// Three peers with the numbers of the paper, all of which touch.
fn waves(overrides: &[&str]) -> Scene {
    let text = r#"
        scene = { duration = "1s", count = 3 }
        object.mass = 0.45
        coordination = { strategy = "wave", stiffness = 1000.0, update = "8ms" }
        peer = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 }, contact = "grasp" }
        link.delay = "24ms"
    "#;
    let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
    Scene::parse(text, "waves.toml".as_ref(), &overrides).unwrap_or_else(|error| panic!("{error}"))
}

/// The radius equals that of an independent computation, to all digits given.
#[test]
fn waves_have_the_radius_computed_elsewhere() {
    for method in [Method::Reduced, Method::Full] {
        let analysis = analyse(&waves(&[]), method).unwrap();
        assert!((analysis.radius.value - 0.977_927_812).abs() < 5e-10 && analysis.radius.error < 1e-10, "{:?}", analysis.radius);
    }
}

/// Waves carry no position: each copy may be anywhere by itself, unless an arm holds the device that touches it.
#[test]
fn each_copy_has_a_rigid_mode_of_its_own() {
    let arm = "peers=[{name=\"peer1\",hand={arm={mass=0.0,damping=1.0,stiffness=50.0}}}]";
    let rigid = |overrides: &[&str]| analyse(&waves(overrides), Method::Full).unwrap().rigid_modes;
    assert_eq!(rigid(&[]), 3);
    assert_eq!(rigid(&["scene.axes=2", "scene.count=2"]), 4);
    assert_eq!(rigid(&["peers=[{name=\"peer1\",contact=\"none\"}]"]), 4);
    assert_eq!(rigid(&[arm, "scene.count=2"]), 1);
}

/// Holding the last wave changes nothing on links without losses, and changes the radius on links with losses.
#[test]
fn a_wave_that_is_held_matters_where_samples_are_lost() {
    let radius = |overrides: &[&str]| analyse(&waves(overrides), Method::Full).unwrap().radius.value;
    let (hold, loss) = ("coordination.wave.on-loss=hold", "link.loss={packets=[2],every=3}");
    assert!((radius(&[hold]) - radius(&[])).abs() < 1e-12);
    assert!(radius(&[hold, loss]) > radius(&[loss]) + 0.01);
}

fn link() -> impl Strategy<Value = String> {
    let loss = prop_oneof![
        Just(String::new()),
        (0..5_u32, 2..6_u32).prop_map(|(lost, every)| format!(", loss = {{ packets = [{}], every = {every} }}", lost % every)),
    ];
    (prop_oneof![(0..5_u32).prop_map(|periods| 4000 * periods), 0..20_000_u32], loss).prop_map(|(delay, loss)| format!("delay = \"{delay}us\"{loss}"))
}

fn peer() -> impl Strategy<Value = String> {
    (any::<bool>(), 0..4_u32, 0.05..0.3, 1.0..8.0).prop_map(|(grasps, phase, mass, damping)| {
        let contact = if grasps { "grasp" } else { "none" };
        format!("contact = \"{contact}\", phase = {phase}, device = {{ mass = {mass:?}, damping = {damping:?} }}")
    })
}

properties! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    /// Waves that end with the ticks for which they were sent add no energy, so that a damped object comes to rest over any links.
    #[test]
    fn waves_are_stable_over_any_constant_links(
        peers in proptest::collection::vec(peer(), 2..=4),
        links in proptest::collection::vec(link(), 12),
        impedance in 1.0..60.0,
        damping in 0.2..2.0,
    ) {
        let count = peers.len();
        let peers: Vec<String> = peers.iter().enumerate().map(|(place, peer)| format!("{{ name = \"p{place}\", {peer} }}")).collect();
        let pairs = (0..count).flat_map(|from| (0..count).filter(move |to| *to != from).map(move |to| (from, to)));
        let links: Vec<String> =
            pairs.zip(&links).map(|((from, to), link)| format!("{{ from = \"p{from}\", to = \"p{to}\", {link} }}")).collect();
        let text = format!(
            "scene.duration = \"1s\"\nobject = {{ mass = 0.45, damping = {damping:?} }}\n\
             coordination = {{ strategy = \"wave\", stiffness = 0.0, update = \"4ms\", wave.impedance = {impedance:?} }}\n\
             peer = {{ coupling = {{ stiffness = 2000.0, damping = 5.0 }} }}\npeers = [{}]\nlinks = [{}]\n",
            peers.join(", "), links.join(", "),
        );
        let scene = Scene::parse(&text, "waves.toml".as_ref(), &[]).unwrap_or_else(|error| panic!("{error}\n{text}"));
        let analysis = analyse(&scene, Method::Full).unwrap();
        prop_assert_eq!(analysis.verdict(), Verdict::Stable, "{:?}\n{}", analysis.radius, text);
    }
}
