//! Analysis of equal peers on a graph. An edge leads from a heard peer to a hearing peer.
//!
//! In a scene without a topology every peer hears all other peers. If each of N equal peers hears only its neighbours, with mutual weights W and row sums D,
//! then the averaging matrix D⁻¹W has a full set of eigenvectors and real eigenvalues λ from −1 to 1, because D^½·D⁻¹W·D^−½ is symmetric. Along an
//! eigenvector all peers make the same motion, scaled by the peer's entry, and each peer hears λ times its own samples. The scene therefore splits into N
//! systems of a single node. The eigenvalue 1 occurs once for each connected part of the graph, and each part can be displaced as a whole.

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

/// A graph of equal peers. An edge leads from a heard peer to a hearing peer.
#[derive(Clone, PartialEq, Debug)]
pub enum Graph {
    /// Every peer hears all other peers, as in a scene without a topology. Eigenvalues: λ = 1 once and λ = −1/(N−1), N−1 times.
    Complete,
    /// Each peer hears n neighbours, n/2 on either side. Eigenvalues: λ = (2/n)·Σ cos(2πkm/N) over m from 1 to n/2, for k from 0 to N−1.
    Ring {
        /// Number n of heard neighbours of a peer: even, above 0 and below N. Ignored for two peers, since two peers hear each other.
        neighbours: usize,
    },
    /// The first peer hears all other peers, and each further peer hears only the first. Eigenvalues: λ = 1, λ = 0 (N−2 times), and λ = −1.
    Star,
    /// Each peer hears further peers with mutual weights, given as a symmetric matrix of N rows with a zero diagonal.
    Weighted(Matrix),
}

/// Reason against an analysis of peers on a graph.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum GraphError {
    /// The scene cannot be analysed at all.
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
    /// The peers or their links differ.
    #[error("peer {peer} or a link of it is not like the others: expected equal peers and equal links on a graph")]
    Unequal {
        /// Name of the first peer unlike peer 0 of the scene.
        peer: String,
    },
    /// A weight is negative, not finite or not mutual, the diagonal is not zero, or the matrix has the wrong size.
    #[error("weight {row},{column} is {found}: expected a symmetric matrix of {peers} rows of numbers that are not negative, zero on the diagonal")]
    Weight {
        /// Row of the weight, from 0.
        row: usize,
        /// Column of the weight, from 0.
        column: usize,
        /// The weight found; NaN if the matrix has the wrong size.
        found: f64,
        /// The number of peers.
        peers: usize,
    },
    /// A peer hears no other peer.
    #[error("peer {peer} hears nobody: expected a weight above zero for each peer")]
    Alone {
        /// Name of the peer.
        peer: String,
    },
    /// The number of neighbours on a ring is zero or odd, or not below the number of peers.
    #[error("{peers} peers on a ring with {neighbours} neighbours each: expected an even number of neighbours, fewer than there are peers")]
    Neighbours {
        /// The number of peers.
        peers: usize,
        /// The number of neighbours of each peer.
        neighbours: usize,
    },
    /// The strategy's force is a sum over the heard peers, and not all peers hear equally many peers, so the stiffnesses differ.
    #[error(
        "proportional-derivative coordination is stiffer the more a peer hears, so these peers are not equal: expected average-position, or a graph in which all hear as much"
    )]
    Irregular,
    /// The scene has one-sided contacts or walls, and is not linear.
    #[error("a scene that is not linear cannot be analysed on a graph: expected contact = \"grasp\" or \"none\" and no enclosure")]
    NotLinear,
}

/// Turns the error of an analysis on a graph into the error for a scene with this graph as its topology.
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

/// Analyses the scene's equal peers as if each peer heard only its neighbours on `graph`.
///
/// # Errors
///
/// [`GraphError`] if the peers or links are not equal, if the scene is not linear, or if the graph does not fit the number of peers.
pub fn analyse_on(scene: &Scene, graph: &Graph) -> Result<Analysis, GraphError> {
    analyse_on_watched(scene, graph, &Unwatched)
}

/// Like [`analyse_on`], with a watch that can stop the analysis.
///
/// # Errors
///
/// As for [`analyse_on`], and [`AnalysisError::Stopped`] if the watch ends the analysis.
pub fn analyse_on_watched(scene: &Scene, graph: &Graph, watch: &dyn Watch) -> Result<Analysis, GraphError> {
    let network = NominalNetwork::of(scene).map_err(GraphError::Analysis)?;
    let mut modes = Vec::new();
    for piece in pieces(scene, "a graph")? {
        modes.push(of_piece(&piece, graph, &network, watch)?);
    }
    Ok(combine(modes, Method::Reduced, &network, scene))
}

/// Analyses one piece of the scene. The motion of a piece is independent of all other pieces.
fn of_piece(piece: &Piece<'_>, graph: &Graph, network: &NominalNetwork, watch: &dyn Watch) -> Result<ContactMode, GraphError> {
    let scene = &*piece.scene;
    let combinations = combinations(piece).map_err(GraphError::Analysis)?;
    let [combination] = combinations.as_slice() else {
        return Err(GraphError::NotLinear);
    };
    let structure = Structure::of(&[scene], network, &combination.contacts)?;
    // Equal peers over equal links form a single class. A class of more than one member has a timetable of a node hearing itself.
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
        // Only a whole connected part, λ = 1, can be displaced without a force.
        let tied = structure.tied || !together;
        if !tied {
            rigid_modes += copies;
        }
        let kind = if together { PartKind::Together } else { PartKind::Mode { weight: eigenvalue.value() } };
        let lifted = Lifted { weights: &weight, timetable, tied, ..quotient };
        parts.push(lifted_part(&lifted, kind, copies * combination.axes, Method::Reduced, watch)?);
    }
    // The size of the whole scene's matrix, for the report: two numbers per sample on the way, and two states of each loose device.
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

/// Returns the node of each of the equal peers. `degree` is the number or total weight of the heard peers of each peer, or `None` if not all peers have the
/// same degree.
///
/// # Errors
///
/// [`GraphError::Irregular`] for a law with a sum over the heard peers, if `degree` is `None`.
pub fn node_on(scene: &Scene, structure: &Structure, degree: Option<f64>) -> Result<Node, GraphError> {
    let mut node = structure.node(scene, 0);
    let pulls = [scene.coordination.strategy.pull(), scene.coordination.pull];
    for _ in pulls.into_iter().filter(|pull| *pull == Pull::Sum) {
        // The structure's law sums over all N−1 other peers; on the graph the sum is over `degree` peers.
        let degree = degree.ok_or(GraphError::Irregular)?;
        node.law = node.law.scaled(degree / real(scene.peers.len() - 1));
    }
    Ok(node)
}

/// An eigenvalue of an averaging matrix. The eigenvalue 1 is known without rounding and is a separate case, since only motions with λ = 1 may drift.
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

/// Returns the weights between peers: row and column are the `from` and `to` of a pair of the topology, and pairs without a link have weight 0.
pub fn weights_of(topology: &Topology) -> Matrix {
    let mut weights = Matrix::zeros(topology.peers(), topology.peers());
    for (from, to) in topology.pairs() {
        weights[(from, to)] = topology.weight(from, to);
    }
    weights
}

impl Graph {
    /// Returns the eigenvalues of the averaging matrix with their multiplicities, and the number or total weight of the heard peers of each peer, or `None`
    /// if not all peers have the same number or weight. An eigenvalue of weights may be listed more than once.
    #[expect(clippy::type_complexity, reason = "used once, above")]
    fn spectrum(&self, scene: &Scene) -> Result<(Vec<(Eigenvalue, usize)>, Option<f64>), GraphError> {
        let peers = scene.peers.len();
        let n = real(peers);
        Ok(match self {
            Self::Complete => (vec![(Eigenvalue::One, 1), (Eigenvalue::Other(-1.0 / (n - 1.0)), peers - 1)], Some(n - 1.0)),
            // Two peers hear each other on every graph; the number of neighbours is not checked.
            Self::Ring { .. } | Self::Star if peers == 2 => (vec![(Eigenvalue::One, 1), (Eigenvalue::Other(-1.0), 1)], Some(1.0)),
            Self::Ring { neighbours } if *neighbours == 0 || neighbours % 2 != 0 || *neighbours >= peers => {
                return Err(GraphError::Neighbours { peers, neighbours: *neighbours });
            }
            Self::Ring { neighbours } => {
                let angle = |k: usize, m: usize| 2.0 * std::f64::consts::PI * real(k * m % peers) / n;
                let half = neighbours / 2;
                let eigenvalue = |k: usize| (1..=half).map(|m| libm::cos(angle(k, m))).sum::<f64>() / real(half);
                // k and N − k have the same eigenvalue; k = N/2 is its own partner.
                let pair = |k: usize| (Eigenvalue::Other(eigenvalue(k)), if 2 * k == peers { 1 } else { 2 });
                (std::iter::once((Eigenvalue::One, 1)).chain((1..=peers / 2).map(pair)).collect(), Some(real(*neighbours)))
            }
            Self::Star => (vec![(Eigenvalue::One, 1), (Eigenvalue::Other(0.0), peers - 2), (Eigenvalue::Other(-1.0), 1)], None),
            Self::Weighted(weights) => weighted(weights, scene)?,
        })
    }
}

/// Returns the spectrum of D⁻¹W, computed from the symmetric matrix D^−½·W·D^−½ with the same eigenvalues, and the common row sum as in `Graph::spectrum`.
#[expect(clippy::type_complexity, reason = "as for the other graphs")]
fn weighted(weights: &Matrix, scene: &Scene) -> Result<(Vec<(Eigenvalue, usize)>, Option<f64>), GraphError> {
    let peers = scene.peers.len();
    let at = |row: usize, column: usize| {
        if weights.rows() == peers && weights.columns() == peers { weights[(row, column)] } else { f64::NAN }
    };
    for row in 0..peers {
        for column in 0..peers {
            let (found, mutual) = (at(row, column), at(column, row));
            // The bits are compared because D^−½·W·D^−½ has real eigenvalues only if the weights are exactly mutual.
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
    // If a sum of weights overflows, the eigenvalues are unknown and become NaN.
    let found = symmetric(weights).map(|(symmetric, _)| crate::eigenvalues(&symmetric));
    let mut eigenvalues = found.map_or_else(|| vec![f64::NAN; peers], |found| found.iter().map(|value| value.re).collect());
    eigenvalues.sort_by(f64::total_cmp);
    // Each connected part has the eigenvalue 1 once. No eigenvalue is larger, so the end of the sorted list is cut off.
    let ones = components(weights);
    eigenvalues.truncate(peers - ones);
    let mut spectrum = vec![(Eigenvalue::One, ones)];
    spectrum.extend(eigenvalues.into_iter().map(|value| (Eigenvalue::Other(value), 1)));
    // Row sums are rounded, so equal degrees may differ in the last digits. A larger difference changes the force of a law that sums over the heard peers.
    let regular = degrees.iter().all(|degree| (degree - degrees[0]).abs() <= 1e-12 * degrees[0]);
    Ok((spectrum, regular.then_some(degrees[0])))
}

/// Returns D^−½·W·D^−½ and the row sums D, or `None` if a sum is not finite.
fn symmetric(weights: &Matrix) -> Option<(Matrix, Vec<f64>)> {
    let size = weights.rows();
    let degrees: Vec<f64> = (0..size).map(|row| weights.row(row).iter().sum()).collect();
    if degrees.iter().any(|degree| !degree.is_finite()) {
        return None;
    }
    // The two roots divide one after the other: their product could overflow or underflow, while no weight exceeds its row sum.
    let entry = |row: usize, column: usize| weights[(row, column)] / degrees[row].sqrt() / degrees[column].sqrt();
    Some((Matrix::from_fn(size, size, entry), degrees))
}

/// Returns the number of connected parts of the graph.
fn components(weights: &Matrix) -> usize {
    let mut seen = vec![false; weights.rows()];
    let mut parts = 0;
    for start in 0..weights.rows() {
        if seen[start] {
            continue;
        }
        parts += 1;
        // Depth-first search. A peer may be pushed by several neighbours, hence the check of `seen` when the peer is taken out.
        let mut reached = vec![start];
        while let Some(peer) = reached.pop() {
            if !std::mem::replace(&mut seen[peer], true) {
                reached.extend((0..weights.columns()).filter(|other| weights[(peer, *other)] > 0.0 && !seen[*other]));
            }
        }
    }
    parts
}
