//! The orthogonal complement of some vectors, by reflections with the longest vector first (Golub & Van Loan 2013, Algorithm 5.4.1).

use crate::Matrix;

/// Returns an orthonormal basis, as columns, of the vectors of `size` entries that are orthogonal to all given vectors. The given vectors may depend on each
/// other: the part of a vector that the others do not span counts as zero if its length is at most `least`.
pub fn orthogonal_complement(mut vectors: Vec<Vec<f64>>, size: usize, least: f64) -> Matrix {
    let mut reflectors: Vec<Vec<f64>> = Vec::new();
    while reflectors.len() < size {
        let done = reflectors.len();
        // Only entries from `done` on are orthogonal to the vectors already taken: earlier reflections have turned those onto the first axes.
        let length = |vector: &Vec<f64>| vector[done..].iter().map(|entry| entry * entry).sum::<f64>().sqrt();
        let lengths: Vec<f64> = vectors.iter().map(length).collect();
        let Some(longest) = (0..vectors.len()).max_by(|one, other| lengths[*one].total_cmp(&lengths[*other])) else { break };
        if lengths[longest].is_nan() || lengths[longest] <= least {
            break;
        }
        let mut reflector = vectors.swap_remove(longest);
        reflector[..done].fill(0.0);
        reflector[done] += lengths[longest].copysign(reflector[done]);
        vectors.iter_mut().for_each(|vector| reflect(vector, &reflector));
        reflectors.push(reflector);
    }
    let mut basis = Matrix::zeros(size, size - reflectors.len());
    for column in 0..basis.columns() {
        let mut vector = vec![0.0; size];
        vector[reflectors.len() + column] = 1.0;
        // The reflections in reverse order turn the remaining axes into the complement.
        reflectors.iter().rev().for_each(|reflector| reflect(&mut vector, reflector));
        for (row, entry) in vector.into_iter().enumerate() {
            basis[(row, column)] = entry;
        }
    }
    basis
}

/// Reflects a vector x at the plane orthogonal to the reflector v: x − 2·v·(vᵀx)/(vᵀv).
fn reflect(vector: &mut [f64], reflector: &[f64]) {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let factor = 2.0 * dot(vector, reflector) / dot(reflector, reflector);
    for (entry, other) in vector.iter_mut().zip(reflector) {
        *entry -= factor * other;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_complement_is_orthonormal_and_orthogonal_to_all() {
        // The third vector is the sum of the first two.
        let vectors = vec![vec![1.0, 2.0, 0.0, -1.0, 3.0], vec![0.0, 1e-3, 1e-3, 0.0, 0.0], vec![1.0, 2.001, 1e-3, -1.0, 3.0]];
        let basis = orthogonal_complement(vectors.clone(), 5, 1e-9);
        assert_eq!((basis.rows(), basis.columns()), (5, 3));
        let unit = basis.transposed().times(&basis);
        for (place, entry) in unit.entries().iter().enumerate() {
            let expected = if place / 3 == place % 3 { 1.0 } else { 0.0 };
            assert!((entry - expected).abs() < 1e-15, "{place}: {entry}");
        }
        for vector in &vectors {
            assert!(basis.transposed().times_column(vector).iter().all(|product| product.abs() < 1e-14));
        }
    }

    #[test]
    fn of_no_vectors_it_is_everything_and_of_enough_nothing() {
        assert_eq!(orthogonal_complement(Vec::new(), 3, 0.0), Matrix::identity(3));
        assert_eq!(orthogonal_complement(vec![vec![1e-10, 0.0]], 2, 1e-9), Matrix::identity(2));
        assert_eq!(orthogonal_complement(vec![vec![1.0, 0.0], vec![1.0, 1.0]], 2, 1e-9).columns(), 0);
    }
}
