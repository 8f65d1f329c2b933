//! Exact map of a tick with at least 100 bits.

use cohaptic_peer::{Plant, StepMap};

use super::number::{Number, absolute};

/// Number of terms of the series. The first term left out is below 0.5³⁰/31! = 1.1e-43 of the first one.
const TERMS: u32 = 30;

/// Returns the map of one tick of `nanos` \[ns\]. Mass, damping and stiffness are the program's doubles, taken exactly. The tick is nanos/10⁹, not the double
/// nearest to it.
///
/// The columns of exp(X) − I with X = h·[0 1 0; −k/m −b/m 1/m; 0 0 0] are summed separately: each term is X times the preceding term, divided by its index. A
/// step in which a row of X has a norm above ½ is halved first, and the map of the whole step is the map of two halves in sequence.
pub(crate) fn exact_map<T: Number>(plant: &Plant, nanos: f64) -> StepMap<T> {
    let mut h = T::of(nanos) / T::of(1e9);
    let (k, b, inverse) = (T::of(plant.stiffness), T::of(plant.damping), T::of(1.0) / T::of(plant.mass));
    // The largest row norm of X: the first row is h, the second one is `row`.
    let norm = |h: T| {
        let row = absolute(k * inverse * h) + absolute(b * inverse * h) + absolute(inverse * h);
        if row > h { row } else { h }
    };
    let mut halvings = 0;
    // The bound ends the loop for an infinite coefficient.
    while norm(h) > T::of(0.5) && halvings < 1000 {
        h = h * T::of(0.5);
        halvings += 1;
    }
    // The term of the force starts at (0, 0, 1): the force is constant, so its own derivative is zero.
    let column = |start: [T; 3]| {
        let (mut term, mut sum) = (start, [T::of(0.0); 2]);
        for n in 1..=TERMS {
            let share = h / T::of(f64::from(n));
            term = [share * term[1], share * ((term[2] - b * term[1] - k * term[0]) * inverse), T::of(0.0)];
            sum = [sum[0] + term[0], sum[1] + term[1]];
        }
        sum
    };
    let (one, zero) = (T::of(1.0), T::of(0.0));
    let (by_x, by_v, by_f) = (column([one, zero, zero]), column([zero, one, zero]), column([zero, zero, one]));
    let mut map = StepMap::new([[by_x[0], by_v[0]], [by_x[1], by_v[1]]], by_f);
    // Each halving is undone by a map of two equal steps.
    for _ in 0..halvings {
        map = twice(&map);
    }
    map
}

/// Returns the map of two equal steps under one held force: E ← 2E + E·E.
fn twice<T: Number>(map: &StepMap<T>) -> StepMap<T> {
    let (e, g) = map.coefficients();
    let product = |i: usize, j: usize| e[i][0] * e[0][j] + e[i][1] * e[1][j];
    let state = [0, 1].map(|i| [0, 1].map(|j| e[i][j] + e[i][j] + product(i, j)));
    let force = [0, 1].map(|i| g[i] + g[i] + (e[i][0] * g[0] + e[i][1] * g[1]));
    StepMap::new(state, force)
}
