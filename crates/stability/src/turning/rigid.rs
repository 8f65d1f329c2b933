//! Displacements and turns of everything together that no force resists.

use super::algebra::cross;
use super::frame::Turning;
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

/// Returns the displacements (a, c) with δp = a, δθ = c that do not move any grasp point held by the spring of an arm: six without an arm, three about one
/// held point, one about a line of held points, else none. Each displacement is 1 in its own reference and 0 in the other references.
pub(super) fn displacements(nodes: &[Node]) -> Vec<Displacement> {
    let length = nodes[0].length;
    let mut held = nodes.iter().filter(|node| node.touching && node.armed).map(|node| node.grasp);
    let unit = |axis: usize| -> [f64; 6] { std::array::from_fn(|component| if component == axis { 1.0 } else { 0.0 }) };
    let Some(first) = held.next() else {
        return (0..6).map(|axis| Displacement::alike(nodes, unit(axis), axis)).collect();
    };
    // The displacement a = r×c leaves the point r at rest, since a + c×r = 0.
    let about = |turn: [f64; 3], reference: usize| {
        let moved = cross(first, turn).map(|moved| moved / length);
        Displacement::alike(nodes, [moved[0], moved[1], moved[2], turn[0], turn[1], turn[2]], reference)
    };
    let arms: Vec<[f64; 3]> = held.map(|grasp| std::array::from_fn(|axis| grasp[axis] - first[axis])).collect();
    let size = |vector: [f64; 3]| vector[0].hypot(vector[1]).hypot(vector[2]);
    let Some(line) = arms.iter().copied().max_by(|a, b| size(*a).total_cmp(&size(*b))).filter(|line| size(*line) > 0.0) else {
        return (0..3).map(|axis| about(std::array::from_fn(|other| if other == axis { 1.0 } else { 0.0 }), 3 + axis)).collect();
    };
    // A held point off the line by no more than rounding counts as on the line.
    let off = |arm: &[f64; 3]| size(cross(line, *arm)) > 8.0 * f64::EPSILON * size(line) * size(line);
    if arms.iter().any(off) {
        return Vec::new();
    }
    let most = (0..3).max_by(|a, b| line[*a].abs().total_cmp(&line[*b].abs())).unwrap_or(0);
    vec![about(line.map(|component| component / line[most]), 3 + most)]
}

/// Returns the combinations of the candidates that a frame maps to themselves. Each is 1 in its own reference and 0 in the other references.
pub(super) fn unmoved(turning: &Turning<'_>, candidates: Vec<Vec<([f64; 6], Vec<f64>)>>) -> Vec<Displacement> {
    let mut candidates: Vec<Displacement> = candidates.into_iter().map(|nodes| Displacement { nodes, reference: 0 }).collect();
    let image = |by: &Displacement| {
        let from = turning.displaced(by);
        let reached = turning.reached(&from);
        reached.iter().zip(&from).map(|(reached, from)| reached - from).collect::<Vec<f64>>()
    };
    let mut images: Vec<Vec<f64>> = candidates.iter().map(image).collect();
    // Gaussian elimination by columns, the largest entry first. A frame maps each of the remaining combinations to itself.
    loop {
        let entries =
            images.iter().enumerate().flat_map(|(column, image)| image.iter().enumerate().map(move |(row, entry)| (column, row, entry.abs())));
        let Some((pivot, row, size)) = entries.max_by(|a, b| a.2.total_cmp(&b.2)) else { return Vec::new() };
        // Entries up to this size are rounding: a frame rounds lengths of some metres some hundred times.
        if size <= 1e-11 {
            break;
        }
        let (by, moved) = (candidates.swap_remove(pivot), images.swap_remove(pivot));
        for (candidate, image) in candidates.iter_mut().zip(&mut images) {
            let factor = image[row] / moved[row];
            candidate.subtract(&by, factor);
            image.iter_mut().zip(&moved).for_each(|(entry, moved)| *entry -= factor * moved);
        }
    }
    // The reference of a displacement is the component of the first copy that the displacement moves most. Division by this component is safe.
    for place in 0..candidates.len() {
        let reference = (0..6).max_by(|a, b| candidates[place].first(*a).abs().total_cmp(&candidates[place].first(*b).abs())).unwrap_or(0);
        let zero = Displacement { nodes: candidates[place].nodes.iter().map(|(_, device)| ([0.0; 6], vec![0.0; device.len()])).collect(), reference };
        let chosen = std::mem::replace(&mut candidates[place], zero);
        candidates[place].subtract(&chosen, -1.0 / chosen.first(reference));
        let chosen = candidates[place].clone();
        for other in (0..candidates.len()).filter(|other| *other != place) {
            let factor = candidates[other].first(reference);
            candidates[other].subtract(&chosen, factor);
        }
    }
    candidates
}
