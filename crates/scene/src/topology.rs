//! Which peers send to which, if not all to all.

use std::ops::Range;
use std::sync::Arc;

use cohaptic_linkfile::reading::named_file::{Fault, line_span};
use cohaptic_peer::Coordination;
use cohaptic_peer::coordination::Pull;
use cohaptic_wan::LinkModel;

use crate::{LinkTable, Scene};

/// The neighbours of each peer: those to which it sends, and from which it hears. Both are the same peers, with weights that are mutual.
///
/// It takes memory for each pair of neighbours, and none for others.
#[derive(Clone, PartialEq, Debug)]
pub struct Topology {
    kind: TopologyKind,
    /// By peer where its neighbours begin, and at last where they end.
    first: Vec<usize>,
    neighbours: Vec<u32>,
    /// Beside the neighbours; empty if all weigh 1.
    weights: Vec<f64>,
}

/// The form of a topology.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum TopologyKind {
    /// Each peer has as many neighbours before it as behind it.
    Ring {
        /// How many it has.
        neighbours: usize,
    },
    /// One peer has all others for neighbours, and they have no other.
    Star {
        /// Its place in [`Scene::peers`].
        hub: usize,
    },
    /// As a matrix of weights says.
    Graph,
}

/// Why numbers are no weights between peers, and which of them is wrong.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
#[error("{message}")]
pub struct WeightsError {
    /// The row of the number, from 0.
    pub row: usize,
    /// Its column; `None`: the row as a whole.
    pub column: Option<usize>,
    /// The fault, and what was expected.
    pub message: String,
}

impl Topology {
    /// A ring on which each of `peers` has that number of neighbours, half of them on either side; `None` unless it is even, above 0 and below `peers`.
    #[must_use]
    pub fn ring(peers: usize, neighbours: usize) -> Option<Self> {
        let fits = neighbours > 0 && neighbours.is_multiple_of(2) && neighbours < peers;
        fits.then(|| {
            let half = neighbours / 2;
            let of = |peer: usize| {
                let mut near: Vec<usize> = (1..=half).flat_map(|step| [(peer + step) % peers, (peer + peers - step) % peers]).collect();
                near.sort_unstable();
                near
            };
            Self::unweighted(TopologyKind::Ring { neighbours }, (0..peers).map(of))
        })
    }

    /// A star of `peers` around one of them; `None` if that is none of them, or they are fewer than two.
    #[must_use]
    pub fn star(peers: usize, hub: usize) -> Option<Self> {
        let of = |peer: usize| if peer == hub { (0..peers).filter(|other| *other != hub).collect() } else { vec![hub] };
        (hub < peers && peers >= 2).then(|| Self::unweighted(TopologyKind::Star { hub }, (0..peers).map(of)))
    }

    /// The graph of these weights, a row a peer: those above zero are of neighbours.
    ///
    /// # Errors
    ///
    /// [`WeightsError`] unless the rows are as long as there are of them, no weight is negative or not finite, those between two peers are equal both ways, none
    /// is of a peer with itself, and each peer is reached from each other.
    pub fn graph(rows: &[Vec<f64>]) -> Result<Self, WeightsError> {
        let peers = rows.len();
        let refuse = |row, column, message| Err(WeightsError { row, column, message });
        for (row, weights) in rows.iter().enumerate() {
            if weights.len() != peers {
                let message = format!("row {} has {} weights and there are {peers} rows: expected as many", row + 1, weights.len());
                return refuse(row, None, message);
            }
            for (column, weight) in weights.iter().enumerate() {
                let mutual = rows[column].get(row).copied();
                let wrong = if !weight.is_finite() || *weight < 0.0 {
                    "expected a finite number that is not negative".to_owned()
                } else if row == column && *weight != 0.0 {
                    "a peer is no neighbour of itself: expected 0".to_owned()
                } else if row > column && mutual != Some(*weight) {
                    format!("weights are mutual: expected {} as in row {}, column {}", mutual.unwrap_or(0.0), column + 1, row + 1)
                } else {
                    continue;
                };
                return refuse(row, Some(column), format!("the weight in row {}, column {} is {weight}: {wrong}", row + 1, column + 1));
            }
        }
        let neighbours = |row: &Vec<f64>| row.iter().enumerate().filter(|(_, weight)| **weight > 0.0).map(|(peer, _)| peer).collect();
        let mut graph = Self::unweighted(TopologyKind::Graph, rows.iter().map(neighbours));
        let weights: Vec<f64> = rows.iter().flatten().copied().filter(|weight| *weight > 0.0).collect();
        if weights.iter().any(|weight| weight.to_bits() != 1.0_f64.to_bits()) {
            graph.weights = weights;
        }
        match graph.unreached() {
            None => Ok(graph),
            Some(peer) => {
                let message = format!("no chain of neighbours leads from the first peer to that of row {}: expected a connected graph", peer + 1);
                refuse(peer, None, message)
            }
        }
    }

    fn unweighted(kind: TopologyKind, rows: impl Iterator<Item = Vec<usize>>) -> Self {
        let (mut first, mut neighbours) = (vec![0], Vec::new());
        for row in rows {
            neighbours.extend(row.into_iter().map(|peer| u32::try_from(peer).expect("peers are counted in 32 bits")));
            first.push(neighbours.len());
        }
        Self { kind, first, neighbours, weights: Vec::new() }
    }

    /// The first peer that no chain of neighbours leads to from the first.
    fn unreached(&self) -> Option<usize> {
        let mut reached = vec![false; self.peers()];
        let mut next = vec![0];
        while let Some(peer) = next.pop() {
            if !std::mem::replace(&mut reached[peer], true) {
                next.extend(self.neighbours(peer).iter().map(|other| *other as usize).filter(|other| !reached[*other]));
            }
        }
        reached.iter().position(|reached| !reached)
    }

    /// Its form.
    #[must_use]
    pub const fn kind(&self) -> TopologyKind {
        self.kind
    }

    /// The number of peers.
    #[must_use]
    pub const fn peers(&self) -> usize {
        self.first.len() - 1
    }

    /// The number of directed links.
    #[must_use]
    pub const fn links(&self) -> usize {
        self.neighbours.len()
    }

    /// The places of links from a peer, or to it, if links are counted by sender, then receiver, or the other way round.
    ///
    /// # Panics
    ///
    /// If there is no such peer.
    #[must_use]
    pub fn places(&self, peer: usize) -> Range<usize> {
        self.first[peer]..self.first[peer + 1]
    }

    /// The neighbours of a peer, in order.
    ///
    /// # Panics
    ///
    /// If there is no such peer.
    #[must_use]
    pub fn neighbours(&self, peer: usize) -> &[u32] {
        &self.neighbours[self.places(peer)]
    }

    /// The place of another peer among the neighbours of one; `None` if it is none of them.
    #[must_use]
    pub fn place(&self, peer: usize, other: usize) -> Option<usize> {
        if peer >= self.peers() {
            return None;
        }
        self.neighbours(peer).binary_search(&u32::try_from(other).ok()?).ok()
    }

    /// Whether there is a link from one peer to another.
    #[must_use]
    pub fn has_link(&self, from: usize, to: usize) -> bool {
        self.place(from, to).is_some()
    }

    /// Every directed link, by sender, then receiver.
    pub fn pairs(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        (0..self.peers()).flat_map(|from| self.neighbours(from).iter().map(move |to| (from, *to as usize)))
    }

    /// The weights of the neighbours of a peer; `None` if all peers weigh 1.
    fn weights(&self, peer: usize) -> Option<&[f64]> {
        self.weights.get(self.places(peer)).filter(|_| !self.weights.is_empty())
    }

    /// The weight between two peers; 0 if they are no neighbours.
    #[must_use]
    pub fn weight(&self, peer: usize, other: usize) -> f64 {
        self.place(peer, other).map_or(0.0, |place| self.weights(peer).map_or(1.0, |weights| weights[place]))
    }

    /// The sum of the weights of the neighbours of a peer: their number, if all weigh 1.
    ///
    /// # Panics
    ///
    /// If there is no such peer.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "the number of peers is far below 2^53")]
    pub fn degree(&self, peer: usize) -> f64 {
        self.weights(peer).map_or_else(|| self.neighbours(peer).len() as f64, |weights| weights.iter().sum())
    }

    /// The weights of the neighbours of a peer over their mean, so that the mean of what they weigh is the weighted mean; `None` if they are equal.
    ///
    /// # Panics
    ///
    /// If there is no such peer.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "the number of peers is far below 2^53")]
    pub fn relative_weights(&self, peer: usize) -> Option<Vec<f64>> {
        let weights = self.weights(peer).filter(|weights| weights.windows(2).any(|pair| pair[0].to_bits() != pair[1].to_bits()))?;
        let mean = self.degree(peer) / weights.len() as f64;
        Some(weights.iter().map(|weight| weight / mean).collect())
    }

    /// Whether the neighbours of each peer weigh as much.
    #[must_use]
    pub fn is_regular(&self) -> bool {
        (1..self.peers()).all(|peer| self.degree(peer).to_bits() == self.degree(0).to_bits())
    }
}

/// The numbers of a text: a row a line, numbers between commas; empty lines are left out.
///
/// # Errors
///
/// The place of the first field that is no number.
pub fn read_weights(text: &str) -> Result<Vec<Vec<f64>>, Fault> {
    let rows = rows_of(text);
    let number = |(line, row): &(usize, &str), field: &str| {
        let message = || format!("found {:?}: expected numbers between commas", field.trim());
        let start = line_span(text, *line).start + field.as_ptr() as usize - row.trim_start().as_ptr() as usize;
        field.trim().parse().map_err(|_| Fault { span: start..start + field.len(), message: message() })
    };
    rows.iter().map(|row| row.1.trim().split(',').map(|field| number(row, field)).collect()).collect()
}

/// The lines that are not empty, with their numbers from 1.
fn rows_of(text: &str) -> Vec<(usize, &str)> {
    text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty()).map(|(number, line)| (number + 1, line)).collect()
}

/// The graph that a text is of that number of peers.
pub(crate) fn parse_graph(text: &str, peers: usize) -> Result<Arc<Topology>, Fault> {
    let rows = read_weights(text)?;
    let lines = rows_of(text);
    let at = |row: usize| lines.get(row).map_or(text.len()..text.len(), |line| line_span(text, line.0));
    if rows.len() != peers {
        let message = format!("the file has {} rows of weights: expected {peers}, one for each peer", rows.len());
        return Err(Fault { span: at(rows.len().min(peers)), message });
    }
    Topology::graph(&rows).map(Arc::new).map_err(|WeightsError { row, column, message }| {
        let line = at(row);
        let before = |column: usize| text[line.clone()].split(',').take(column).map(|field| field.len() + 1).sum::<usize>();
        let span = column.map_or_else(
            || line.clone(),
            |column| {
                let start = line.start + before(column);
                start..(line.start + before(column + 1)).saturating_sub(1).max(start)
            },
        );
        Fault { span, message }
    })
}

impl Scene {
    /// The links that there are, by sender, then receiver.
    pub fn linked_pairs(&self) -> Box<dyn Iterator<Item = (usize, usize)> + '_> {
        match &self.topology {
            Some(topology) => Box::new(topology.pairs()),
            None => Box::new(cohaptic_linkfile::mesh::pairs(self.peers.len())),
        }
    }

    /// How many links there are.
    #[must_use]
    pub fn link_count(&self) -> u64 {
        let peers = self.peers.len() as u64;
        self.topology.as_ref().map_or(peers * (peers - 1), |topology| topology.links() as u64)
    }

    /// The configurations of the links that there are, and how many have each: at least one.
    #[must_use]
    pub fn used_links(&self) -> Vec<(&Arc<LinkModel>, u64)> {
        let Some(topology) = &self.topology else { return self.links.used().collect() };
        let configs = self.links.configs();
        let mut counts = vec![0; configs.len()];
        if self.links.is_uniform() {
            counts[0] = topology.links() as u64;
        } else {
            topology.pairs().for_each(|(from, to)| counts[self.links.config_between(from, to)] += 1);
        }
        configs.iter().zip(counts).filter(|(_, count)| *count > 0).collect()
    }

    /// The scene with all peers sending to all, over links as they have them now if all are alike.
    #[must_use]
    pub fn without_topology(&self) -> Self {
        let links = match self.used_links().as_slice() {
            [(only, _)] if !self.links.is_uniform() => LinkTable::new(self.peers.len(), Arc::clone(only), []),
            _ => self.links.clone(),
        };
        Self { topology: None, links, ..self.clone() }
    }

    /// Why the scene cannot have its topology; `None` if it can.
    pub(crate) fn refused_topology(&self) -> Option<String> {
        let strategy = self.coordination.strategy;
        if self.relay && (self.sample_kind().is_personal() || strategy == Coordination::ClientServer) {
            return Some(format!(
                "the strategy {} sends each peer a sample of its own, and a relay hands one on to all: expected another strategy, or no role = \"relay\"",
                strategy.name()
            ));
        }
        self.topology.as_ref()?;
        if self.law(0).is_none() {
            return Some(format!(
                "the strategy {} has every peer hear every other: expected kind = \"full\", or a strategy that follows the mean of what it hears",
                strategy.name()
            ));
        }
        self.rotation
            .is_some()
            .then(|| "an object that turns is followed only where all peers send to all: expected kind = \"full\", or no object.inertia".to_owned())
    }

    /// What the gains of a peer are multiplied by where they count once for each peer that it hears.
    #[must_use]
    pub(crate) fn heard_by(&self, peer: usize) -> f64 {
        self.topology.as_ref().map_or_else(|| crate::assembly::count(self.number() - 1), |topology| topology.degree(peer))
    }

    /// Whether the gains of peers depend on what they hear, and so differ from peer to peer.
    #[must_use]
    pub fn has_gains_by_peer(&self) -> bool {
        let sums = [self.coordination.strategy.pull(), self.coordination.pull].contains(&Pull::Sum);
        self.topology.as_ref().is_some_and(|topology| sums && !topology.is_regular())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ring_has_as_many_neighbours_on_either_side() {
        let ring = Topology::ring(6, 4).unwrap();
        assert_eq!((0..6).map(|peer| ring.neighbours(peer).to_vec()).collect::<Vec<_>>()[..2], [vec![1, 2, 4, 5], vec![0, 2, 3, 5]]);
        assert_eq!((ring.links(), ring.degree(3), ring.is_regular(), ring.relative_weights(0)), (24, 4.0, true, None));
        assert!(ring.pairs().all(|(from, to)| ring.has_link(to, from) && from != to));
        assert_eq!(ring.pairs().count(), 24);
        for (peers, neighbours) in [(6, 0), (6, 3), (6, 6), (2, 2)] {
            assert_eq!(Topology::ring(peers, neighbours), None);
        }
        assert_eq!(Topology::ring(3, 2).unwrap().neighbours(1), [0, 2]);
    }

    #[test]
    fn a_star_has_its_hub_wherever_it_is() {
        let star = Topology::star(4, 2).unwrap();
        assert_eq!((star.neighbours(2), star.neighbours(3)), ([0, 1, 3].as_slice(), [2].as_slice()));
        assert_eq!((star.place(2, 3), star.place(3, 0), star.has_link(9, 0), star.is_regular()), (Some(2), None, false, false));
        assert_eq!((Topology::star(4, 4), Topology::star(1, 0)), (None, None));
    }

    /// Weights 1 and 3 are 0.5 and 1.5 times their mean; equal ones are no weights.
    #[test]
    fn weights_count_over_their_mean() {
        let graph = Topology::graph(&[vec![0.0, 1.0, 3.0], vec![1.0, 0.0, 0.0], vec![3.0, 0.0, 0.0]]).unwrap();
        assert_eq!((graph.relative_weights(0), graph.relative_weights(1)), (Some(vec![0.5, 1.5]), None));
        assert_eq!((graph.degree(0), graph.degree(2), graph.weight(0, 2), graph.weight(1, 2)), (4.0, 3.0, 3.0, 0.0));
    }

    #[test]
    fn what_is_no_graph_is_refused_with_its_place() {
        let refused = |text: &str| {
            let Fault { span, message } = parse_graph(text, 3).unwrap_err();
            assert!(message.contains("expected"), "{message}");
            (text[span].to_owned(), message)
        };
        let mut shown = Vec::new();
        for (text, at) in [
            ("0,1,1\n1, 0,1\n1,1.5,0\n", "1.5"),
            ("0,1,1\n\n1,0,-1\n1,1,0\n", "-1"),
            ("0,NaN,1\n1,0,1\n1,1,0\n", "NaN"),
            ("0,1,1\n1,2,1\n1,1,0\n", "2"),
            ("0,1,1\n1,x,1\n1,1,0\n", "x"),
            ("0,1\n1,0\n", ""),
            ("0,1,1\n1,0\n1,1,0\n", "1,0"),
            ("0,1,0\n1,0,0\n 0,0,0\n", "0,0,0"),
        ] {
            let (found, message) = refused(text);
            assert_eq!(found, at, "{message}");
            shown.push(message);
        }
        assert!(shown[0].contains("row 3, column 2 is 1.5: weights are mutual: expected 1 as in row 2, column 3"), "{}", shown[0]);
        assert!(shown[7].contains("connected"), "{}", shown[7]);
    }
}
