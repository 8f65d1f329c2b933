//! Equal peers on a graph: which peer hears which.
//!
//! A scene without a topology lets everybody hear everybody. Where each of N equal peers hears only its neighbours, with weights that are mutual, the averaging matrix
//! D⁻¹W has a full set of eigenvectors and real eigenvalues λ from −1 to 1 (D^½·D⁻¹W·D^−½ is symmetric). Along each eigenvector every peer does the same thing,
//! scaled, and hears λ times its own samples: the scene is as many systems of one node. λ = 1 is there once for each connected part, which can be
//! displaced as a whole.

pub(crate) mod enclosed;

use cohaptic_peer::coordination::Pull;
use cohaptic_scene::{Scene, Topology, TopologyKind};

use crate::analysis::combine;
use crate::combinations::combinations;
use crate::lifted::{Lifted, Node};
use crate::network::NominalNetwork;
use crate::parts::{alone, lifted_part};
use crate::pieces::{Piece, pieces};
use crate::rounding::real;
use crate::structure::Structure;
use crate::{Analysis, AnalysisError, ContactMode, Matrix, Method, PartKind, Unwatched, Watch};

/// Which peer hears which.
#[derive(Clone, PartialEq, Debug)]
pub enum Graph {
    /// Everybody hears everybody, as in a scene: λ = 1 and N−1 times −1/(N−1).
    Complete,
    /// Each hears as many before it as behind it, n in all: λ = (2/n)·Σ cos(2πkm/N) over m from 1 to n/2.
    Ring {
        /// How many it hears, n: an even number below N; among two peers each hears the other whatever it is.
        neighbours: usize,
    },
    /// The first hears all others, who hear the first alone: λ = 1, N−2 times 0, and −1.
    Star,
    /// Each hears the others with mutual weights: a symmetric matrix of N rows.
    Weighted(Matrix),
}

/// Why peers cannot be analysed on a graph.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum GraphError {
    /// The scene cannot be analysed at all.
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
    /// The peers or their links differ.
    #[error("peer {peer} or a link of it is not like the others: expected equal peers and equal links on a graph")]
    Unequal {
        /// The first peer that differs from the first one.
        peer: String,
    },
    /// The matrix of weights is none.
    #[error("weight {row},{column} is {found}: expected a symmetric matrix of {peers} rows of numbers that are not negative, zero on the diagonal")]
    Weight {
        /// The row, from 0.
        row: usize,
        /// The column, from 0.
        column: usize,
        /// The weight found; NaN where there is none.
        found: f64,
        /// The number of peers.
        peers: usize,
    },
    /// Somebody hears nobody.
    #[error("peer {peer} hears nobody: expected a weight above zero for each peer")]
    Alone {
        /// Its name.
        peer: String,
    },
    /// There are fewer peers than a ring needs.
    #[error("{peers} peers on a ring with {neighbours} neighbours each: expected an even number of neighbours, fewer than there are peers")]
    Neighbours {
        /// The number of peers.
        peers: usize,
        /// The number of neighbours.
        neighbours: usize,
    },
    /// The stiffness of a peer would depend on how many it hears.
    #[error(
        "proportional-derivative coordination is stiffer the more a peer hears, so these peers are not equal: expected average-position, or a graph in which all hear as much"
    )]
    Irregular,
    /// One-sided contacts or walls.
    #[error("a scene that is not linear cannot be analysed on a graph: expected contact = \"grasp\" or \"none\" and no enclosure")]
    NotLinear,
}

/// Why a scene with a topology is refused.
pub fn on_this_topology(error: GraphError) -> AnalysisError {
    match error {
        GraphError::Analysis(error) => error,
        GraphError::Unequal { .. }
        | GraphError::Weight { .. }
        | GraphError::Alone { .. }
        | GraphError::Neighbours { .. }
        | GraphError::Irregular
        | GraphError::NotLinear => AnalysisError::OnTopology { why: error.to_string() },
    }
}

/// Analyses the scene's equal peers as if each heard only its neighbours on that graph.
///
/// # Errors
///
/// [`GraphError`] if the peers are not equal, the scene is not linear, or the weights make no sense.
pub fn analyse_on(scene: &Scene, graph: &Graph) -> Result<Analysis, GraphError> {
    analyse_on_watched(scene, graph, &Unwatched)
}

/// [`analyse_on`], watched.
///
/// # Errors
///
/// As for [`analyse_on`], and [`AnalysisError::Stopped`] if the watch ends it.
pub fn analyse_on_watched(scene: &Scene, graph: &Graph, watch: &dyn Watch) -> Result<Analysis, GraphError> {
    let network = NominalNetwork::of(scene).map_err(GraphError::Analysis)?;
    let mut modes = Vec::new();
    for piece in pieces(scene, "a graph")? {
        modes.push(of_piece(&piece, graph, &network, watch)?);
    }
    Ok(combine(modes, Method::Reduced, &network, scene))
}

/// The modes of a scene that moves apart from all others.
fn of_piece(piece: &Piece<'_>, graph: &Graph, network: &NominalNetwork, watch: &dyn Watch) -> Result<ContactMode, GraphError> {
    let scene = &*piece.scene;
    let combinations = combinations(piece).map_err(GraphError::Analysis)?;
    let [combination] = combinations.as_slice() else {
        return Err(GraphError::NotLinear);
    };
    let structure = Structure::of(&[scene], network, &combination.contacts)?;
    let (Some(timetable), None) = (&structure.apart[0], structure.classes.get(1)) else {
        let peer = structure.classes.get(1).map_or(0, |class| class[0]);
        return Err(GraphError::Unequal { peer: scene.peers[peer].name.clone() });
    };
    let peers = scene.peers.len();
    let (spectrum, degree) = graph.spectrum(scene)?;
    let node = [node_on(scene, &structure, degree)?];
    let quotient = structure.quotient(scene, &node);
    let mut parts = Vec::new();
    let mut rigid_modes = 0;
    for (eigenvalue, copies) in spectrum {
        let together = eigenvalue == Eigenvalue::One;
        let weight = Matrix::from_fn(1, 1, |_, _| eigenvalue.value());
        let tied = structure.tied || !together;
        if !tied {
            rigid_modes += copies;
        }
        let kind = if together { PartKind::Together } else { PartKind::Mode { weight: eigenvalue.value() } };
        let lifted = Lifted { weights: &weight, timetable, tied, ..quotient };
        parts.push(lifted_part(&lifted, kind, copies * combination.axes, Method::Reduced, watch)?);
    }
    let mut dimension = peers * (node[0].states() + 2 * structure.timetable.depth[0]);
    if let Some((part, rigid)) = alone(&structure, scene, 0, combination.axes) {
        parts.push(part);
        rigid_modes += rigid;
        dimension += 2 * peers;
    }
    let radius = crate::parts::radius_of(&parts);
    let (rigid_modes, dimension) = (rigid_modes * combination.axes, (dimension - rigid_modes) * combination.axes);
    Ok(ContactMode { motion: piece.motion.clone(), contacts: String::new(), radius, parts, rigid_modes, dimension, frame: timetable.frame })
}

/// The node that stands for equal peers of which each hears that number or weight of others, if all hear as much.
///
/// # Errors
///
/// [`GraphError::Irregular`] for a law whose force is a sum over those that a peer hears, if not all hear as much.
pub fn node_on(scene: &Scene, structure: &Structure, degree: Option<f64>) -> Result<Node, GraphError> {
    let mut node = structure.node(scene, 0);
    let pulls = [scene.coordination.strategy.pull(), scene.coordination.pull];
    for _ in pulls.into_iter().filter(|pull| *pull == Pull::Sum) {
        // The sum over as many as are heard, in place of that over all others.
        let degree = degree.ok_or(GraphError::Irregular)?;
        node.law = node.law.scaled(degree / real(scene.peers.len() - 1));
    }
    Ok(node)
}

/// An eigenvalue of an averaging matrix; 1 is known exactly.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Eigenvalue {
    One,
    Other(f64),
}

impl Eigenvalue {
    const fn value(self) -> f64 {
        match self {
            Self::One => 1.0,
            Self::Other(value) => value,
        }
    }
}

impl From<&Topology> for Graph {
    fn from(topology: &Topology) -> Self {
        match topology.kind() {
            TopologyKind::Ring { neighbours } => Self::Ring { neighbours },
            TopologyKind::Star { .. } => Self::Star,
            TopologyKind::Graph => Self::Weighted(weights_of(topology)),
        }
    }
}

/// The weights between peers, a row a peer.
pub fn weights_of(topology: &Topology) -> Matrix {
    let mut weights = Matrix::zeros(topology.peers(), topology.peers());
    for (from, to) in topology.pairs() {
        weights[(from, to)] = topology.weight(from, to);
    }
    weights
}

impl Graph {
    /// The different eigenvalues of the averaging matrix with their multiplicities; and how many (or how much weight) each peer hears, if all hear as much.
    #[expect(clippy::type_complexity, reason = "used once, above")]
    fn spectrum(&self, scene: &Scene) -> Result<(Vec<(Eigenvalue, usize)>, Option<f64>), GraphError> {
        let peers = scene.peers.len();
        let n = real(peers);
        Ok(match self {
            Self::Complete => (vec![(Eigenvalue::One, 1), (Eigenvalue::Other(-1.0 / (n - 1.0)), peers - 1)], Some(n - 1.0)),
            // Two peers hear each other, whatever the graph is called.
            Self::Ring { .. } | Self::Star if peers == 2 => (vec![(Eigenvalue::One, 1), (Eigenvalue::Other(-1.0), 1)], Some(1.0)),
            Self::Ring { neighbours } if *neighbours == 0 || neighbours % 2 != 0 || *neighbours >= peers => {
                return Err(GraphError::Neighbours { peers, neighbours: *neighbours });
            }
            Self::Ring { neighbours } => {
                let angle = |k: usize, m: usize| 2.0 * std::f64::consts::PI * real(k * m % peers) / n;
                let half = neighbours / 2;
                let eigenvalue = |k: usize| (1..=half).map(|m| libm::cos(angle(k, m))).sum::<f64>() / real(half);
                let pair = |k: usize| (Eigenvalue::Other(eigenvalue(k)), if 2 * k == peers { 1 } else { 2 });
                (std::iter::once((Eigenvalue::One, 1)).chain((1..=peers / 2).map(pair)).collect(), Some(real(*neighbours)))
            }
            Self::Star => (vec![(Eigenvalue::One, 1), (Eigenvalue::Other(0.0), peers - 2), (Eigenvalue::Other(-1.0), 1)], None),
            Self::Weighted(weights) => weighted(weights, scene)?,
        })
    }
}

/// The spectrum of D⁻¹W, from that of the symmetric D^−½·W·D^−½.
#[expect(clippy::type_complexity, reason = "as for the other graphs")]
fn weighted(weights: &Matrix, scene: &Scene) -> Result<(Vec<(Eigenvalue, usize)>, Option<f64>), GraphError> {
    let peers = scene.peers.len();
    let at = |row: usize, column: usize| {
        if weights.rows() == peers && weights.columns() == peers { weights[(row, column)] } else { f64::NAN }
    };
    for row in 0..peers {
        for column in 0..peers {
            let (found, mutual) = (at(row, column), at(column, row));
            let fits = found.is_finite() && found >= 0.0 && found.to_bits() == mutual.to_bits() && (row != column || found == 0.0);
            if !fits {
                return Err(GraphError::Weight { row, column, found, peers });
            }
        }
    }
    let degrees: Vec<f64> = (0..peers).map(|row| weights.row(row).iter().sum()).collect();
    if let Some(peer) = degrees.iter().position(|degree| *degree <= 0.0) {
        return Err(GraphError::Alone { peer: scene.peers[peer].name.clone() });
    }
    // Unknown where a sum of weights is beyond all numbers.
    let found = symmetric(weights).map(|(symmetric, _)| crate::eigenvalues(&symmetric));
    let mut eigenvalues = found.map_or_else(|| vec![f64::NAN; peers], |found| found.iter().map(|value| value.re).collect());
    eigenvalues.sort_by(f64::total_cmp);
    // As many of them are 1 as there are connected parts: these are the largest.
    let ones = components(weights);
    eigenvalues.truncate(peers - ones);
    let mut spectrum = vec![(Eigenvalue::One, ones)];
    spectrum.extend(eigenvalues.into_iter().map(|value| (Eigenvalue::Other(value), 1)));
    let regular = degrees.iter().all(|degree| (degree - degrees[0]).abs() <= 1e-12 * degrees[0]);
    Ok((spectrum, regular.then_some(degrees[0])))
}

/// D^−½·W·D^−½ and the row sums D; `None` if a sum is beyond all numbers.
fn symmetric(weights: &Matrix) -> Option<(Matrix, Vec<f64>)> {
    let size = weights.rows();
    let degrees: Vec<f64> = (0..size).map(|row| weights.row(row).iter().sum()).collect();
    if degrees.iter().any(|degree| !degree.is_finite()) {
        return None;
    }
    // Divided one by one, nothing leaves the range of numbers: no weight is above its degree.
    let entry = |row: usize, column: usize| weights[(row, column)] / degrees[row].sqrt() / degrees[column].sqrt();
    Some((Matrix::from_fn(size, size, entry), degrees))
}

/// How many parts of the graph are not connected with one another.
fn components(weights: &Matrix) -> usize {
    let mut seen = vec![false; weights.rows()];
    let mut parts = 0;
    for start in 0..weights.rows() {
        if seen[start] {
            continue;
        }
        parts += 1;
        let mut reached = vec![start];
        while let Some(peer) = reached.pop() {
            if !std::mem::replace(&mut seen[peer], true) {
                reached.extend((0..weights.columns()).filter(|other| weights[(peer, *other)] > 0.0 && !seen[*other]));
            }
        }
    }
    parts
}
