//! Coordination laws on rotation, against the same laws on translation.

use std::path::Path;

use cohaptic_harness::{Model, NoObserver, Simulation, Summary};
use cohaptic_peer::rotation::Attitude;
use cohaptic_scene::Scene;

pub(crate) const LAWS: [&str; 8] = [
    "average-position",
    "proportional-derivative",
    "smoothed-average-position",
    "extrapolated",
    "local-damping",
    "local-lag",
    // With parameters that are given.
    "local-damping\"\nlocal-damping.damping = BETA\nscaling = \"none",
    "local-lag\"\nlocal-lag.lag = \"3ms\"\nscaling = \"none",
];
/// Mass m of the object \[kg\]. The next constant is its inertia J about each axis [kg·m²].
pub(crate) const MASS: f64 = 0.4;
pub(crate) const INERTIA: [f64; 3] = [3e-5, 5e-5, 4e-5];

pub(crate) fn read(text: &str) -> Scene {
    Scene::parse(text, Path::new("turning.toml"), &[]).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

pub(crate) fn run(scene: &Scene) -> Summary {
    let Ok(summary) = Simulation::new(scene, Model::Least).run(&mut NoObserver);
    summary
}

/// Returns a scene whose peers touch nothing. `object` and `gains` have the keys of the object and of the coordination; `peers` has the keys of each peer.
pub(crate) fn untouched(axes: u8, law: &str, object: &str, gains: &str, peers: &[String]) -> String {
    let mut text = format!(
        "[scene]\nduration = \"200ms\"\naxes = {axes}\n[object]\n{object}\n[coordination]\nupdate = \"2ms\"\n{gains}\nstrategy = \"{law}\"\n\
         [link]\ndelay = \"5ms\"\n[peer]\ncontact = \"none\"\ndevice = {{ mass = 0.1 }}\n"
    );
    for (place, keys) in peers.iter().enumerate() {
        text += &format!("[[peers]]\nname = \"p{place}\"\ncompute-delay = {}\n{keys}\n", place % 2);
    }
    text
}

/// About one principal axis a turn is a translation of mass J, but for sin θ in place of θ: half of the angles leave an eighth of the difference.
#[test]
fn about_one_axis_each_law_is_that_of_a_translation() {
    // Angles and angular velocities about z at the beginning.
    let start = [(1e-3, 0.01), (-5e-4, 0.02), (0.0, -0.03)];
    for law in LAWS {
        let differences = [1.0, 0.5].map(|size| {
            let turn = |(angle, rate): &(f64, f64)| {
                let half = 0.5 * size * angle;
                format!("orientation = [{:?}, 0, 0, {:?}]\nangular-velocity = [0, 0, {:?}]", half.cos(), half.sin(), size * rate)
            };
            let moves = |(angle, rate): &(f64, f64)| format!("position = {:?}\nvelocity = {:?}", size * angle, size * rate);
            let object = format!("mass = {MASS}\ninertia = {INERTIA:?}\nrotational-damping = [1e-5, 2e-5, 4e-5]");
            let gains = "stiffness = 0\nrotational-stiffness = [0.011, 0.012, 0.02]\nrotational-damping = [1e-4, 0, 5e-5]";
            let beta = |value: f64| law.replace("BETA", &format!("{value:?}"));
            let turns = untouched(3, &beta(2.0), &object, gains, &start.each_ref().map(turn));
            let object = format!("mass = {}\ndamping = 4e-5", INERTIA[2]);
            // Orientations are not extrapolated.
            let law = beta(2.0 * INERTIA[2] / MASS).replace("extrapolated", "average-position");
            let moves = untouched(1, &law, &object, "stiffness = 0.02\ndamping = 5e-5", &start.each_ref().map(moves));
            let (turns, moves) = (run(&read(&turns)), run(&read(&moves)));
            let apart = turns.peers.iter().zip(&moves.peers).map(|(turns, moves)| {
                let Attitude { orientation, rate } = turns.attitude.unwrap();
                let angle = 2.0 * orientation[3].atan2(orientation[0]);
                (angle - moves.position[0]).abs() + 1e-2 * (rate[2] - moves.velocity[0]).abs()
            });
            apart.fold(0.0, f64::max)
        });
        // A difference of first order, of a hundredth of these, would halve.
        assert!((differences[0] / differences[1] - 8.0).abs() < 0.01, "{law}: {differences:?}");
    }
}

/// Held at one point r, that point moves across r as a copy of the mass 1/(1/m + r²/J) that is touched, and the point at −J/(m·r) as one of mass m that is not, with
/// gains in proportion. In the plane all that is left out is odd, and of third order.
#[test]
fn at_one_grasp_each_law_is_that_of_a_translation() {
    let (inertia, grasp) = (2e-4, 0.03);
    let across = 1.0 / (1.0 / MASS + grasp * grasp / inertia);
    let start = [(1e-4, 1e-3), (-5e-5, -2e-3)];
    // Orientations are not extrapolated.
    for law in LAWS.into_iter().filter(|law| *law != "extrapolated") {
        let differences = [1.0, 0.5].map(|size| {
            let touch = "coupling = { stiffness = 300, damping = 2 }\ncontact = \"grasp\"";
            let turn = |(position, angle): &(f64, f64)| {
                let half = 0.5 * size * angle;
                let position = size * position;
                format!(
                    "position = [0, {position:?}, 0]\norientation = [{:?}, 0, 0, {:?}]\ngrasp = [{grasp:?}, 0, 0]\n{touch}",
                    half.cos(),
                    half.sin()
                )
            };
            let scene = |mass: f64, peers: &[String]| {
                let share = mass / MASS;
                let beta = law.replace("BETA", &format!("{:?}", 2.0 * share));
                let gains = format!("stiffness = {:?}\ndamping = {:?}", 200.0 * share, 2.0 * share);
                run(&read(&untouched(1, &beta, &format!("mass = {mass:?}\ndamping = {share:?}"), &gains, peers)))
            };
            let object = format!("mass = {MASS}\ndamping = 1\ninertia = {inertia}");
            let turns = untouched(3, &law.replace("BETA", "2.0"), &object, "stiffness = 200\ndamping = 2", &start.each_ref().map(turn));
            let turns = run(&read(&turns));
            let at = |arm: f64| start.each_ref().map(|(position, angle)| format!("position = {:?}", size * (position + arm * angle)));
            let (touched, pivot) = (scene(across, &at(grasp).map(|keys| format!("{keys}\n{touch}"))), scene(MASS, &at(-inertia / MASS / grasp)));
            let apart = |place: usize| {
                let [w, _, _, z] = turns.peers[place].attitude.unwrap().orientation;
                let at = |arm: f64| turns.peers[place].position[1] + arm * 2.0 * z.atan2(w);
                (at(grasp) - touched.peers[place].position[0]).abs() + (at(-inertia / MASS / grasp) - pivot.peers[place].position[0]).abs()
            };
            apart(0).max(apart(1))
        });
        assert!((differences[0] / differences[1] - 8.0).abs() < 0.05, "{law}: {differences:?}");
    }
}

/// Parameters that the timeline sets at instant zero act as parameters of the scene.
#[test]
fn parameters_that_change_at_once_are_those_of_the_beginning() {
    for (law, table, changed) in [
        ("smoothed-average-position", "smoothed-average-position.lag = \"4ms\"", "smoothed-average-position = { lag = \"9ms\" }"),
        ("local-lag", "local-lag.lag = \"0ms\"", "local-lag = { lag = \"6ms\" }"),
        ("local-lag", "local-lag.lag = \"6ms\"", "local-lag = { lag = \"2ms\" }"),
        ("local-damping", "local-damping.damping = 0.5", "local-damping = { damping = 3.0 }"),
        ("average-position", "rotational-stiffness = [0.02, 0.02, 0.03]", "rotational-stiffness = [0.03, 0.02, 0.02]"),
        ("proportional-derivative", "rotational-damping = 1e-5", "rotational-damping = [2e-5, 0, 0]"),
    ] {
        let object = format!("mass = {MASS}\ninertia = {INERTIA:?}");
        let peers = ["angular-velocity = [1, -2, 0.5]".to_owned(), "orientation = [1, -0.5, 0.4, 0]".to_owned()];
        let of = |table: &str, timeline: &str| {
            run(&read(&format!("{timeline}\n{}", untouched(3, law, &object, &format!("stiffness = 200\n{table}"), &peers)))).peers
        };
        let written = changed.replace(" = { ", ".").replace(" }", "");
        let before = of(table, "");
        let later = of(table, &format!("timeline = [{{ at = \"0s\", coordination = {{ {changed} }} }}]"));
        let from_the_beginning = of(&written, "");
        assert_ne!(before, later, "{changed}");
        assert_eq!(later, from_the_beginning, "{changed}");
    }
}
