//! The search for a quadratic certificate. No proof depends on the search, because [`Certificate`](super::Certificate) checks the found shapes.
//!
//! The shapes of one strongly connected component are searched together, because edges in both directions fix their relative sizes. Different components are
//! searched one by one. A shape P is kept as an upper triangle R with P = RᵀR. In the coordinates z = R·x of its ends an edge is the matrix X = R_to A
//! R_from⁻¹, and the smallest rate of the shapes is the largest ‖X‖₂.
//!
//! The first shapes come from an iteration with a few factorisations a round at any size ([`join`](super::join)). If the number of unknowns allows, Newton's
//! method on a barrier improves these shapes ([`barrier`](super::barrier)).

use cohaptic_stability::{Matrix, Watch};

use super::automaton::Automaton;
use super::component::{Component, Step};
use super::norm::gram;
use super::{barrier, join};

/// Largest number of unknowns of the barrier. The factorisation of the barrier's Hessian costs the third power of this number.
const MOST_UNKNOWNS: usize = 1300;
/// Number of rounds of the first iteration. The shapes hardly change after so many rounds.
const ROUNDS: usize = 24;
/// The result of a search: shapes and their computed rate, not yet checked.
#[derive(Clone, Debug)]
pub(super) struct Found {
    /// Computed rate of the shapes.
    pub rate: f64,
    /// Shapes, indexed by node of the pattern.
    pub shapes: Vec<Matrix>,
}

/// Returns the best found shapes, for matrices with entries near 1; `None` if the watch ends the search. Nodes without an edge on a cycle keep the identity,
/// since no edge constrains their shape.
pub(super) fn search(automaton: &Automaton, accuracy: f64, watch: &dyn Watch) -> Option<Found> {
    let mut found = Found { rate: 0.0, shapes: vec![Matrix::identity(automaton.size()); automaton.pattern().nodes()] };
    for component in components(automaton) {
        let mut best = join::iterate(&component, ROUNDS, watch)?;
        let unknowns = component.nodes.len() * component.size * (component.size + 1) / 2;
        if unknowns <= MOST_UNKNOWNS {
            best = barrier::improve(&component, best, accuracy, watch)?;
        }
        // The growth of the automaton is the largest growth of a component, because a path stays in one component in the end.
        found.rate = found.rate.max(best.square.sqrt());
        for (node, factor) in component.nodes.iter().zip(&best.factors) {
            found.shapes[*node] = gram(factor);
        }
    }
    Some(found)
}

/// Returns the components with an edge, in the order of their first edges.
fn components(automaton: &Automaton) -> Vec<Component<'_>> {
    let pattern = automaton.pattern();
    let mut components: Vec<Component<'_>> = Vec::new();
    // `named`: index in `components`, indexed by the pattern's number of a component. `place`: index of a node within its component, indexed by node of the
    // pattern.
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
