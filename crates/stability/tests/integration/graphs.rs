//! Equal peers on rings, stars and weighted graphs, against the general path with a strategy that hears only its neighbours.

use cohaptic_peer::{Command, Context, Gains, State, Strategy};
use cohaptic_scene::{Scene, Strategies};
use cohaptic_stability::{
    AnalysisError, Family, FamilyScratch, Graph, GraphError, KeyRange, Matrix, Method, analyse, analyse_on, analyse_with, mean_square,
};

use crate::anchors::scene;

/// Average position over neighbours: a strategy of a user's own.
pub(crate) struct Neighbours {
    /// Weights of the other peers, without the peer itself. Their sum is 1.
    weights: Vec<f64>,
    gains: Gains,
}

impl<const A: usize> Strategy<A> for Neighbours {
    fn command(&mut self, context: &Context<'_, A>) -> Command<A> {
        let mut target = State::<A>::REST;
        for (place, weight) in self.weights.iter().enumerate() {
            let held = context.held.state(place).unwrap();
            for axis in 0..A {
                target.position[axis] += weight * held.position[axis];
                target.velocity[axis] += weight * held.velocity[axis];
            }
        }
        let force = core::array::from_fn(|axis| {
            self.gains.stiffness * (context.own.position[axis] - target.position[axis])
                + self.gains.damping * (context.own.velocity[axis] - target.velocity[axis])
        });
        Command { force, target }
    }

    fn set_gains(&mut self, gains: Gains) {
        self.gains = gains;
    }
}

pub(crate) struct OnGraph(pub(crate) Matrix);

impl Strategies for OnGraph {
    // The analysis is compiled for each type of strategies. `strategies` has boxed strategies too.
    type Strategy<const A: usize> = Box<dyn Strategy<A>>;

    fn strategy<const A: usize>(&self, scene: &Scene, peer: usize) -> Self::Strategy<A> {
        let degree: f64 = self.0.row(peer).iter().sum();
        let weights = (0..self.0.columns()).filter(|other| *other != peer).map(|other| self.0[(peer, other)] / degree).collect();
        Box::new(Neighbours { weights, gains: scene.coordination.gains })
    }
}

fn ring(peers: usize) -> Matrix {
    Matrix::from_fn(peers, peers, |row, column| if (row + 1) % peers == column || (column + 1) % peers == row { 1.0 } else { 0.0 })
}

pub(crate) fn star(peers: usize) -> Matrix {
    Matrix::from_fn(peers, peers, |row, column| if (row == 0) != (column == 0) { 1.0 } else { 0.0 })
}

#[track_caller]
fn agree(overrides: &[&str], graph: &Graph, weights: Matrix) {
    let scene = scene(overrides);
    let reduced = analyse_on(&scene, graph).unwrap();
    let full = analyse_with(&scene, &OnGraph(weights)).unwrap();
    assert!((reduced.radius.value - full.radius.value).abs() < 1e-10, "{graph:?}: {} and {}", reduced.radius.value, full.radius.value);
    assert_eq!((reduced.rigid_modes, reduced.dimension), (full.rigid_modes, full.dimension), "{graph:?}");
}

#[test]
fn a_ring_and_a_star_are_what_the_general_path_says() {
    for peers in [3, 4, 5, 7] {
        let count = format!("scene.count={peers}");
        for delay in ["link.delay=8ms", "link.delay=21ms"] {
            agree(&[&count, delay], &Graph::Ring { neighbours: 2 }, ring(peers));
            agree(&[&count, delay], &Graph::Star, star(peers));
            agree(&[&count, delay], &Graph::Weighted(ring(peers)), ring(peers));
        }
    }
    agree(&["peer.contact=none", "scene.count=4"], &Graph::Ring { neighbours: 2 }, ring(4));
}

#[test]
fn a_weighted_graph_is_what_the_general_path_says() {
    let weights = Matrix::from_fn(5, 5, |row, column| if row == column { 0.0 } else { ((row * column + row + column) % 4) as f64 / 3.0 });
    agree(&["scene.count=5"], &Graph::Weighted(weights.clone()), weights);
}

/// A graph depends only on the ratios of its weights. Weights multiplied by a power of two give the same radius to the bit, even where products overflow.
#[test]
fn weights_of_any_size_are_those_of_size_one() {
    let weights = |unit: f64| Matrix::from_fn(4, 4, |row, column| if row == column { 0.0 } else { unit * (1 + row * column) as f64 });
    let radius = |unit: f64| analyse_on(&scene(&["scene.count=4"]), &Graph::Weighted(weights(unit))).unwrap().radius;
    for exponent in [-900, -600, 600, 900] {
        assert_eq!(radius(2_f64.powi(exponent)), radius(1.0), "2^{exponent}");
    }
}

/// Each of two pairs without links between the pairs can be displaced as a whole, which gives two rigid-body modes.
#[test]
fn parts_that_are_not_connected_are_displaced_one_by_one() {
    let pairs = Matrix::from_fn(4, 4, |row, column| if row != column && row / 2 == column / 2 { 1.0 } else { 0.0 });
    let analysis = analyse_on(&scene(&["scene.count=4"]), &Graph::Weighted(pairs)).unwrap();
    assert_eq!(analysis.rigid_modes, 2);
    let pair = analyse(&scene(&["scene.count=2", "object.split-mass=false", "object.mass=0.1125"]), Method::Reduced).unwrap();
    assert!((analysis.radius.value - pair.radius.value).abs() < 1e-12);
}

#[test]
fn a_complete_graph_is_the_scene_itself() {
    for strategy in ["average-position", "proportional-derivative"] {
        let scene = scene(&["scene.count=6", &format!("coordination.strategy={strategy}")]);
        let (on_graph, plain) = (analyse_on(&scene, &Graph::Complete).unwrap(), analyse(&scene, Method::Reduced).unwrap());
        assert_eq!(on_graph.radius.value.to_bits(), plain.radius.value.to_bits());
        assert_eq!((on_graph.rigid_modes, on_graph.dimension), (plain.rigid_modes, plain.dimension));
    }
}

#[test]
fn what_cannot_be_on_a_graph_is_refused() {
    let refused = |overrides: &[&str], graph: Graph| analyse_on(&scene(overrides), &graph).unwrap_err();
    assert_eq!(refused(&["peers.peer2.device.mass=0.2"], Graph::Ring { neighbours: 2 }), GraphError::Unequal { peer: "peer2".into() });
    assert_eq!(refused(&["coordination.strategy=proportional-derivative"], Graph::Star), GraphError::Irregular);
    assert!(matches!(refused(&["peer.contact={ push = '+x' }"], Graph::Ring { neighbours: 2 }), GraphError::NotLinear));
    assert!(matches!(refused(&[], Graph::Weighted(Matrix::zeros(3, 3))), GraphError::Alone { .. }));
    assert!(matches!(refused(&[], Graph::Weighted(ring(4))), GraphError::Weight { row: 0, column: 0, .. }));
    let lopsided = Matrix::from_fn(3, 3, |row, column| if row < column { 1.0 } else { 0.0 });
    assert!(matches!(refused(&[], Graph::Weighted(lopsided)), GraphError::Weight { row: 0, column: 1, .. }));
}

/// A family of scenes with a topology has the radius of each scene on its graph. Analyses that do not follow a topology are refused with their names.
#[test]
fn a_topology_of_a_scene_is_its_graph() {
    const TEXT: &str = r#"
        scene = { duration = "1s", count = 6 }
        object = { mass = 0.3, split-mass = false, damping = 1.0 }
        coordination = { strategy = "average-position", stiffness = 100.0, damping = 3.0, update = "8ms" }
        peer = { contact = "none", device = { mass = 0.1, damping = 1.0 }, tick = "2ms" }
        topology = { kind = "ring", neighbours = 4 }
        link = { delay = "16ms" }
    "#;
    let file = std::path::Path::new("ring.toml");
    let on = |stiffness: f64| {
        let scene = Scene::parse(TEXT, file, &[format!("coordination.stiffness={stiffness:?}")]).unwrap();
        (analyse(&scene, Method::Reduced).unwrap(), analyse_on(&scene.without_topology(), &Graph::Ring { neighbours: 4 }).unwrap())
    };
    let keys = vec![KeyRange::parse("coordination.stiffness=10..2000").unwrap()];
    let family = Family::new(TEXT, file, &[], keys).unwrap();
    for stiffness in [10.0, 444.5, 2000.0] {
        let (scene, graph) = on(stiffness);
        assert_eq!((scene.radius, scene.modes[0].parts.len()), (graph.radius, graph.modes[0].parts.len()), "{stiffness}");
        let cell = family.bounded_radius(&[stiffness], &mut FamilyScratch::default()).unwrap();
        assert_eq!(cell.radius, graph.radius, "{stiffness}");
    }
    let scene = Scene::parse(TEXT, file, &[]).unwrap();
    for method in [Method::Full, Method::Determinant] {
        assert!(matches!(analyse(&scene, method), Err(AnalysisError::Topology { .. })));
    }
    assert!(matches!(mean_square(&scene), Err(AnalysisError::Topology { what: "the mean square" })));
    let few = Graph::Ring { neighbours: 6 };
    assert_eq!(analyse_on(&scene.without_topology(), &few).unwrap_err(), GraphError::Neighbours { peers: 6, neighbours: 6 });
}
