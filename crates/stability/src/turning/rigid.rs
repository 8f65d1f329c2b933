//! Displacements and turns of everything together, which nothing resists.

use super::node::Node;

/// The components of the copies under a displacement that nothing resists: y of all of them, and which of the components of the first copy tells how far it is.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Displacement {
    pub(super) copy: [f64; 6],
    pub(super) reference: usize,
}

/// All displacements (a, c) with δp = a, δθ = c that leave the grasp points at rest that an arm's spring holds: six, three about a point, one about a line, or none.
/// Each is 1 in its own reference and 0 in those of the others.
pub(super) fn displacements(nodes: &[Node]) -> Vec<Displacement> {
    let length = nodes[0].length;
    let mut held = nodes.iter().filter(|node| node.touching && node.armed).map(|node| node.grasp);
    let unit = |axis: usize| -> [f64; 6] { std::array::from_fn(|component| if component == axis { 1.0 } else { 0.0 }) };
    let Some(first) = held.next() else {
        return (0..6).map(|axis| Displacement { copy: unit(axis), reference: axis }).collect();
    };
    // With a = r×c the point r stays: a + c×r = 0.
    let about = |turn: [f64; 3], reference: usize| {
        let moved = cross(first, turn).map(|moved| moved / length);
        Displacement { copy: [moved[0], moved[1], moved[2], turn[0], turn[1], turn[2]], reference }
    };
    let arms: Vec<[f64; 3]> = held.map(|grasp| std::array::from_fn(|axis| grasp[axis] - first[axis])).collect();
    let size = |vector: [f64; 3]| vector[0].hypot(vector[1]).hypot(vector[2]);
    let Some(line) = arms.iter().copied().max_by(|a, b| size(*a).total_cmp(&size(*b))).filter(|line| size(*line) > 0.0) else {
        return (0..3).map(|axis| about(std::array::from_fn(|other| if other == axis { 1.0 } else { 0.0 }), 3 + axis)).collect();
    };
    // Points off the line by less than rounding are on it.
    let off = |arm: &[f64; 3]| size(cross(line, *arm)) > 8.0 * f64::EPSILON * size(line) * size(line);
    if arms.iter().any(off) {
        return Vec::new();
    }
    let most = (0..3).max_by(|a, b| line[*a].abs().total_cmp(&line[*b].abs())).unwrap_or(0);
    vec![about(line.map(|component| component / line[most]), 3 + most)]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
