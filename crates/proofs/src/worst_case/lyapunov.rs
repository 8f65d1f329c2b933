//! The search for a quadratic certificate. Nothing here has to be right: what it finds is checked by [`Certificate`](super::Certificate).
//!
//! The nodes of one strongly connected component have to agree on how large their shapes are relative to each other; components have nothing to do with
//! each other. A shape is kept as an upper triangle R with P = RᵀR; in the coordinates z = R·x of its ends an edge is the matrix X = R_to A R_from⁻¹, and
//! the smallest rate of the shapes is the largest ‖X‖₂.
//!
//! The first shapes come from an iteration that costs a few factorisations a round whatever the size ([`join`](super::join)); as long as the number of
//! unknowns allows, Newton's method on a barrier goes on from there ([`barrier`](super::barrier)).

use cohaptic_stability::{Matrix, Watch};

use super::automaton::Automaton;
use super::component::{Component, Step};
use super::norm::gram;
use super::{barrier, join};

/// The most unknowns for which a barrier's Hessian, whose factorisation costs their third power, is worth it.
const MOST_UNKNOWNS: usize = 1300;
/// Rounds of the first iteration, whose shapes hardly change after that.
const ROUNDS: usize = 24;
/// What a search ends with: believed, not proved.
#[derive(Clone, Debug)]
pub(super) struct Found {
    /// The rate that the shapes have.
    pub rate: f64,
    /// Per node of the pattern.
    pub shapes: Vec<Matrix>,
}

/// The best shapes that were found, for matrices whose entries are near 1; `None` if the watch ends it.
pub(super) fn search(automaton: &Automaton, accuracy: f64, watch: &dyn Watch) -> Option<Found> {
    let mut found = Found { rate: 0.0, shapes: vec![Matrix::identity(automaton.size()); automaton.pattern().nodes()] };
    for component in components(automaton) {
        let mut best = join::iterate(&component, ROUNDS, watch)?;
        let unknowns = component.nodes.len() * component.size * (component.size + 1) / 2;
        if unknowns <= MOST_UNKNOWNS {
            best = barrier::improve(&component, best, accuracy, watch)?;
        }
        found.rate = found.rate.max(best.square.sqrt());
        for (node, factor) in component.nodes.iter().zip(&best.factors) {
            found.shapes[*node] = gram(factor);
        }
    }
    Some(found)
}

/// The components that have an edge, by their first edge.
fn components(automaton: &Automaton) -> Vec<Component<'_>> {
    let pattern = automaton.pattern();
    let mut components: Vec<Component<'_>> = Vec::new();
    // Which component, and which node of it, a node of the pattern is; the component's own name comes first.
    let mut named = vec![None; pattern.nodes()];
    let mut place = vec![None; pattern.nodes()];
    for edge in automaton.recurrent() {
        let component = *named[pattern.component(edge.from)].get_or_insert_with(|| {
            components.push(Component { size: automaton.size(), nodes: Vec::new(), edges: Vec::new() });
            components.len() - 1
        });
        let component = &mut components[component];
        let mut local = |node: usize| {
            *place[node].get_or_insert_with(|| {
                component.nodes.push(node);
                component.nodes.len() - 1
            })
        };
        let (from, to) = (local(edge.from), local(edge.to));
        component.edges.push(Step { from, to, matrix: &automaton.matrices()[edge.symbol] });
    }
    components
}
