//! Displacement or turn of everything together.

use super::node::Node;

/// Displacement of everything together that no force resists.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Displacement {
    /// Displacement of the copy's and of the device's components, indexed by node.
    pub(super) nodes: Vec<([f64; 6], Vec<f64>)>,
    /// Component of the first copy that measures the size of the displacement.
    pub(super) reference: usize,
}

impl Displacement {
    /// Returns the displacement that moves every copy by `copy`, and every touching device with its copy.
    pub(super) fn alike(nodes: &[Node], copy: [f64; 6], reference: usize) -> Self {
        let device = |node: &Node| {
            let moved = |grip: &[f64; 6]| if node.touching { grip.iter().zip(&copy).map(|(by, component)| by * component).sum() } else { 0.0 };
            node.grip.iter().map(moved).collect()
        };
        Self { nodes: nodes.iter().map(|node| (copy, device(node))).collect(), reference }
    }

    /// Returns the displacement of a component of the first copy.
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
