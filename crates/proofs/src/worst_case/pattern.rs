//! Patterns: the allowed sequences of symbols, as the paths of a finite directed graph whose edges carry symbols.

use thiserror::Error;

/// Largest number of edges, and of nodes, of a pattern.
const MOST_EDGES: usize = 1 << 20;

/// One allowed step, from node to node.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(crate) struct Edge {
    /// Node before the step, from 0.
    pub(crate) from: usize,
    /// Node after the step, from 0.
    pub(crate) to: usize,
    /// Symbol of the step, from 0: the index of a matrix of an automaton.
    pub(crate) symbol: usize,
}

/// The sequences of symbols that a network can produce: the sequences along the infinite paths of a graph, which may begin at any node.
///
/// Nodes that lie on no cycle are allowed: an infinite path passes each of them at most once.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Pattern {
    nodes: usize,
    symbols: usize,
    edges: Vec<Edge>,
    /// Number of the strongly connected component, indexed by node.
    component: Vec<usize>,
}

/// Reasons why a graph is not a pattern.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Error)]
#[non_exhaustive]
pub enum PatternError {
    /// The graph has no node.
    #[error("a pattern needs at least one node")]
    NoNode,
    /// The number of symbols is zero.
    #[error("a pattern needs at least one symbol")]
    NoSymbol,
    /// An edge begins or ends at a node that does not exist.
    #[error("edge {edge} names node {node}, but there are {nodes}, counted from 0")]
    Node {
        /// Number of the edge, from 0.
        edge: usize,
        /// Node that the edge names.
        node: usize,
        /// Number of nodes of the graph.
        nodes: usize,
    },
    /// A symbol does not exist.
    #[error("symbol {symbol} does not exist: there are {symbols}, counted from 0")]
    Symbol {
        /// Symbol that an edge names.
        symbol: usize,
        /// Number of symbols.
        symbols: usize,
    },
    /// The graph is too large.
    #[error("the pattern would have more than {most} edges")]
    TooLarge {
        /// Largest number of edges.
        most: usize,
    },
}

impl Pattern {
    /// Returns the pattern of a graph.
    ///
    /// # Errors
    ///
    /// [`PatternError`] if the graph has no node or no symbol, if an edge names a node or symbol that does not exist, or if the graph has more than 2²⁰ edges
    /// or nodes.
    pub(crate) fn of(nodes: usize, edges: Vec<Edge>, symbols: usize) -> Result<Self, PatternError> {
        if nodes == 0 {
            return Err(PatternError::NoNode);
        }
        if symbols == 0 {
            return Err(PatternError::NoSymbol);
        }
        if edges.len().max(nodes) > MOST_EDGES {
            return Err(PatternError::TooLarge { most: MOST_EDGES });
        }
        for (edge, step) in edges.iter().enumerate() {
            if let Some(&node) = [step.from, step.to].iter().find(|node| **node >= nodes) {
                return Err(PatternError::Node { edge, node, nodes });
            }
            if step.symbol >= symbols {
                return Err(PatternError::Symbol { symbol: step.symbol, symbols });
            }
        }
        let component = components(nodes, &edges);
        Ok(Self { nodes, symbols, edges, component })
    }

    #[cfg(test)]
    /// Returns the pattern in which every symbol can occur at every time.
    ///
    /// # Errors
    ///
    /// [`PatternError`] if `symbols` is zero or more than 2²⁰.
    pub(crate) fn free(symbols: usize) -> Result<Self, PatternError> {
        Self::of(1, (0..symbols.min(MOST_EDGES + 1)).map(|symbol| Edge { from: 0, to: 0, symbol }).collect(), symbols)
    }

    /// Returns the pattern in which the symbol `hit` occurs at most `most` times in a row, and every other symbol at every time. If `hit` stands for a lost
    /// packet, these are bounded runs of loss. With `most` zero the symbol `hit` never occurs.
    ///
    /// At node k the last k symbols were `hit`.
    ///
    /// # Errors
    ///
    /// [`PatternError`] if `symbols` is zero, if `hit` is not below `symbols`, or if the pattern would have more than 2²⁰ edges.
    pub(crate) fn runs(symbols: usize, hit: usize, most: u32) -> Result<Self, PatternError> {
        if hit >= symbols {
            return Err(if symbols == 0 { PatternError::NoSymbol } else { PatternError::Symbol { symbol: hit, symbols } });
        }
        let too_large = PatternError::TooLarge { most: MOST_EDGES };
        let most = usize::try_from(most).map_err(|_| too_large)?;
        // The number of edges is known before the edges take memory.
        if most.saturating_add(1).saturating_mul(symbols) > MOST_EDGES {
            return Err(too_large);
        }
        // At node `most` the symbol `hit` would lead to a node beyond, so that edge is left out below.
        let step = |from: usize, symbol: usize| Edge { from, to: if symbol == hit { from + 1 } else { 0 }, symbol };
        let edges = (0..=most).flat_map(|from| (0..symbols).map(move |symbol| step(from, symbol))).filter(|edge| edge.to <= most).collect();
        Self::of(most + 1, edges, symbols)
    }

    /// Returns the pattern of several independent patterns, with one symbol of each pattern in every step.
    ///
    /// The first pattern is the most significant digit of a joint symbol: for two patterns the joint symbol is `a * second.symbols() + b`. Nodes are numbered
    /// the same way.
    ///
    /// # Errors
    ///
    /// [`PatternError`] if `patterns` is empty, or if the product would have more than 2²⁰ edges.
    pub(crate) fn product(patterns: &[Self]) -> Result<Self, PatternError> {
        let (first, others) = patterns.split_first().ok_or(PatternError::NoNode)?;
        let too_large = PatternError::TooLarge { most: MOST_EDGES };
        others.iter().try_fold(first.clone(), |all, next| {
            let nodes = all.nodes.checked_mul(next.nodes).ok_or(too_large)?;
            let symbols = all.symbols.checked_mul(next.symbols).ok_or(too_large)?;
            // Both patterns make a step at once, so every pair of edges is a joint edge.
            if all.edges.len().checked_mul(next.edges.len()).is_none_or(|edges| edges > MOST_EDGES) {
                return Err(too_large);
            }
            let both = |a: &Edge, b: &Edge| Edge {
                from: a.from * next.nodes + b.from,
                to: a.to * next.nodes + b.to,
                symbol: a.symbol * next.symbols + b.symbol,
            };
            let edges = all.edges.iter().flat_map(|a| next.edges.iter().map(move |b| both(a, b))).collect();
            Self::of(nodes, edges, symbols)
        })
    }

    /// Returns the number of nodes.
    #[must_use]
    pub(crate) const fn nodes(&self) -> usize {
        self.nodes
    }

    /// Returns the number of symbols, including symbols that occur on no edge.
    #[must_use]
    pub(crate) const fn symbols(&self) -> usize {
        self.symbols
    }

    /// Returns all edges, in the order given.
    #[must_use]
    pub(crate) fn edges(&self) -> &[Edge] {
        &self.edges
    }

    /// Returns whether an edge lies on a cycle. An infinite path takes edges on no cycle only finitely often.
    #[must_use]
    pub(crate) fn recurs(&self, edge: &Edge) -> bool {
        self.component[edge.from] == self.component[edge.to]
    }

    /// Returns the number of the strongly connected component of a node, below the number of nodes. Equal numbers mean the same component.
    pub(super) fn component(&self, node: usize) -> usize {
        self.component[node]
    }
}

/// Returns the number of the strongly connected component of every node (Kosaraju 1978, as in Sharir 1981). A first search orders the nodes by the time at
/// which the search leaves them; a second search follows edges backward, from the node that was left last to the node that was left first. Both searches keep
/// their own stack instead of recursion, because a run of a million losses is a path of that length.
fn components(nodes: usize, edges: &[Edge]) -> Vec<usize> {
    let mut forward = vec![Vec::new(); nodes];
    let mut backward = vec![Vec::new(); nodes];
    for edge in edges {
        forward[edge.from].push(edge.to);
        backward[edge.to].push(edge.from);
    }
    let mut left = Vec::with_capacity(nodes);
    let mut seen = vec![false; nodes];
    for start in 0..nodes {
        if std::mem::replace(&mut seen[start], true) {
            continue;
        }
        // Entries: a node, and the number of edges from the node that were tried.
        let mut stack = vec![(start, 0)];
        while let Some((node, tried)) = stack.pop() {
            let Some(&next) = forward[node].get(tried) else {
                left.push(node);
                continue;
            };
            // A node is left only after all its edges were tried, so the node goes back under the node that is tried next.
            stack.push((node, tried + 1));
            if !std::mem::replace(&mut seen[next], true) {
                stack.push((next, 0));
            }
        }
    }
    let mut component = vec![usize::MAX; nodes];
    for (name, &start) in left.iter().rev().enumerate() {
        let mut stack = vec![start];
        while let Some(node) = stack.pop() {
            if component[node] == usize::MAX {
                component[node] = name;
                stack.extend(&backward[node]);
            }
        }
    }
    component
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_edge_that_names_nothing_is_refused() {
        let edge = |from, to, symbol| Edge { from, to, symbol };
        assert_eq!(Pattern::of(0, vec![], 1), Err(PatternError::NoNode));
        assert_eq!(Pattern::of(1, vec![], 0), Err(PatternError::NoSymbol));
        assert_eq!(Pattern::of(2, vec![edge(0, 1, 0), edge(1, 2, 0)], 1), Err(PatternError::Node { edge: 1, node: 2, nodes: 2 }));
        assert_eq!(Pattern::of(2, vec![edge(0, 1, 3)], 3), Err(PatternError::Symbol { symbol: 3, symbols: 3 }));
        assert_eq!(Pattern::runs(2, 2, 1), Err(PatternError::Symbol { symbol: 2, symbols: 2 }));
        assert_eq!(Pattern::runs(0, 0, 1), Err(PatternError::NoSymbol));
        assert!(matches!(Pattern::runs(2, 1, u32::MAX), Err(PatternError::TooLarge { .. })));
        assert!(matches!(Pattern::free(usize::MAX), Err(PatternError::TooLarge { .. })));
        assert_eq!(Pattern::product(&[]), Err(PatternError::NoNode));
        let long = Pattern::runs(2, 1, 3000).unwrap();
        assert!(matches!(Pattern::product(&[long.clone(), long]), Err(PatternError::TooLarge { .. })));
    }

    /// The number of words of each length along the paths from node 0; with at most one hit in a row these are the Fibonacci numbers.
    #[test]
    fn runs_are_bounded_and_nothing_else_is() {
        let words = |most: u32, length: usize| {
            let pattern = Pattern::runs(2, 1, most).unwrap();
            let mut count = vec![0_u64; pattern.nodes()];
            count[0] = 1;
            for _ in 0..length {
                let mut next = vec![0; pattern.nodes()];
                for edge in pattern.edges() {
                    next[edge.to] += count[edge.from];
                }
                count = next;
            }
            count.iter().sum::<u64>()
        };
        assert_eq!((1..=8).map(|length| words(1, length)).collect::<Vec<_>>(), [2, 3, 5, 8, 13, 21, 34, 55]);
        assert_eq!((1..=6).map(|length| words(2, length)).collect::<Vec<_>>(), [2, 4, 7, 13, 24, 44]);
        assert_eq!(words(0, 7), 1);
    }

    #[test]
    fn a_product_has_one_symbol_of_each() {
        let product = Pattern::product(&[Pattern::runs(2, 1, 1).unwrap(), Pattern::runs(3, 2, 2).unwrap()]).unwrap();
        assert_eq!((product.nodes(), product.symbols(), product.edges().len()), (6, 6, 3 * 8));
        // The first link loses (symbol 1, node 0 to 1) while the second loses its second in a row (symbol 2, node 1 to 2).
        assert!(product.edges().contains(&Edge { from: 1, to: 3 + 2, symbol: 3 + 2 }));
        // No link loses from where its run is full.
        assert!(product.edges().iter().all(|edge| (edge.from < 3 || edge.symbol < 3) && (edge.from % 3 < 2 || edge.symbol % 3 < 2)));
    }

    #[test]
    fn only_edges_on_cycles_recur() {
        let edge = |from, to| Edge { from, to, symbol: 0 };
        // 0 → 1 ⇄ 2 → 3, and 3 to itself.
        let pattern = Pattern::of(5, vec![edge(0, 1), edge(1, 2), edge(2, 1), edge(2, 3), edge(3, 3)], 1).unwrap();
        assert_eq!(pattern.edges().iter().map(|edge| pattern.recurs(edge)).collect::<Vec<_>>(), [false, true, true, false, true]);
        // A long line neither recurs nor overflows the stack.
        let line = Pattern::of(100_000, (1..100_000).map(|node| edge(node - 1, node)).collect(), 1).unwrap();
        assert!(line.edges().iter().all(|edge| !line.recurs(edge)));
    }
}
