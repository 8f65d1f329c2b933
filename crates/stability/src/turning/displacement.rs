//! A displacement or turn of everything together.

use super::node::Node;

/// A displacement that nothing resists: how it moves the copy and the device of each node, and which of the components of the first copy tells how far it is.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Displacement {
    pub(super) nodes: Vec<([f64; 6], Vec<f64>)>,
    pub(super) reference: usize,
}

impl Displacement {
    /// All copies alike, and with each the device that touches it.
    pub(super) fn alike(nodes: &[Node], copy: [f64; 6], reference: usize) -> Self {
        let device = |node: &Node| {
            let moved = |grip: &[f64; 6]| if node.touching { grip.iter().zip(&copy).map(|(by, component)| by * component).sum() } else { 0.0 };
            node.grip.iter().map(moved).collect()
        };
        Self { nodes: nodes.iter().map(|node| (copy, device(node))).collect(), reference }
    }

    /// A component of the first copy.
    pub(super) fn first(&self, component: usize) -> f64 {
        self.nodes[0].0[component]
    }

    pub(super) fn subtract(&mut self, other: &Self, factor: f64) {
        for ((copy, device), (by_copy, by_device)) in self.nodes.iter_mut().zip(&other.nodes) {
            let pairs = copy.iter_mut().chain(device).zip(by_copy.iter().chain(by_device));
            pairs.for_each(|(entry, by)| *entry -= factor * by);
        }
    }
}
