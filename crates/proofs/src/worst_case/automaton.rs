//! Automata: a pattern with one matrix per symbol of the pattern.

use cohaptic_stability::Matrix;
use thiserror::Error;

use super::pattern::{Edge, Pattern, PatternError};

/// A switched linear system: along an infinite path of its pattern, every step multiplies the state by the matrix of its symbol.
///
/// The matrices are square, of one size, and finite.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Automaton {
    pattern: Pattern,
    matrices: Vec<Matrix>,
    size: usize,
}

/// Reasons why a pattern and matrices are not an automaton.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Error)]
#[non_exhaustive]
pub enum AutomatonError {
    /// The graph is not a pattern.
    #[error(transparent)]
    Pattern(#[from] PatternError),
    /// The number of matrices differs from the number of symbols.
    #[error("the pattern has {symbols} symbols, but there are {matrices} matrices")]
    Count {
        /// Number of symbols of the pattern.
        symbols: usize,
        /// Number of matrices given.
        matrices: usize,
    },
    /// A matrix does not have the size of the first matrix, is not square, or is empty.
    #[error("matrix {matrix} is {rows} by {columns}, not {size} by {size}")]
    Shape {
        /// Number of the matrix, from 0.
        matrix: usize,
        /// Number of rows of the matrix.
        rows: usize,
        /// Number of columns of the matrix.
        columns: usize,
        /// Number of rows and columns expected, at least 1.
        size: usize,
    },
    /// A matrix has an entry that is infinite or not a number.
    #[error("matrix {matrix} has an entry that is not a finite number")]
    NotFinite {
        /// Number of the matrix, from 0.
        matrix: usize,
    },
}

impl Automaton {
    /// Returns the automaton of a pattern with `matrices[s]` as the matrix of symbol s.
    ///
    /// # Errors
    ///
    /// [`AutomatonError`] if the number of matrices differs from the number of symbols, if the matrices are not square and of one size, or if an entry is not
    /// finite.
    pub(crate) fn new(pattern: Pattern, matrices: Vec<Matrix>) -> Result<Self, AutomatonError> {
        if pattern.symbols() != matrices.len() {
            return Err(AutomatonError::Count { symbols: pattern.symbols(), matrices: matrices.len() });
        }
        let size = matrices.first().map_or(1, Matrix::rows).max(1);
        for (matrix, entries) in matrices.iter().enumerate() {
            let (rows, columns) = (entries.rows(), entries.columns());
            if (rows, columns) != (size, size) {
                return Err(AutomatonError::Shape { matrix, rows, columns, size });
            }
            if !entries.is_finite() {
                return Err(AutomatonError::NotFinite { matrix });
            }
        }
        Ok(Self { pattern, matrices, size })
    }

    #[cfg(test)]
    /// Returns the automaton of a graph with its matrices: [`Pattern::of`], then [`Automaton::new`].
    ///
    /// # Errors
    ///
    /// The errors of both functions.
    pub(crate) fn of(nodes: usize, edges: Vec<Edge>, matrices: Vec<Matrix>) -> Result<Self, AutomatonError> {
        Self::new(Pattern::of(nodes, edges, matrices.len())?, matrices)
    }

    #[cfg(test)]
    /// Returns the automaton in which every matrix can occur at every time: [`Pattern::free`].
    ///
    /// # Errors
    ///
    /// The errors of [`Pattern::free`] and [`Automaton::new`].
    pub(crate) fn free(matrices: Vec<Matrix>) -> Result<Self, AutomatonError> {
        Self::new(Pattern::free(matrices.len())?, matrices)
    }

    #[cfg(test)]
    /// Returns the automaton in which matrix number `hit` occurs at most `most` times in a row, and every other matrix at every time: [`Pattern::runs`].
    ///
    /// # Errors
    ///
    /// The errors of [`Pattern::runs`] and [`Automaton::new`].
    pub(crate) fn runs(matrices: Vec<Matrix>, hit: usize, most: u32) -> Result<Self, AutomatonError> {
        Self::new(Pattern::runs(matrices.len(), hit, most)?, matrices)
    }

    #[cfg(test)]
    /// Returns the automaton of several independent links that act on one state: [`Pattern::product`], with one matrix for every joint symbol.
    ///
    /// # Errors
    ///
    /// The errors of [`Pattern::product`] and [`Automaton::new`].
    pub(crate) fn product(links: &[Pattern], matrices: Vec<Matrix>) -> Result<Self, AutomatonError> {
        Self::new(Pattern::product(links)?, matrices)
    }

    /// Returns the pattern, which says what sequences are allowed.
    #[must_use]
    pub(crate) const fn pattern(&self) -> &Pattern {
        &self.pattern
    }

    /// Returns the matrices, indexed by symbol.
    #[must_use]
    pub(crate) fn matrices(&self) -> &[Matrix] {
        &self.matrices
    }

    /// Returns the number of rows of every matrix.
    #[must_use]
    pub(crate) const fn size(&self) -> usize {
        self.size
    }

    /// Returns the edges on cycles. Only these edges decide how fast products grow, because a path takes every other edge at most once.
    pub(super) fn recurrent(&self) -> impl Iterator<Item = &Edge> {
        self.pattern.edges().iter().filter(|edge| self.pattern.recurs(edge))
    }

    /// Returns the automaton with every matrix times 2^`exponent`. The scaling is exact unless an entry underflows or overflows.
    pub(super) fn scaled(&self, exponent: i32) -> Self {
        let factor = libm::ldexp(1.0, exponent);
        let matrices = self.matrices.iter().map(|matrix| matrix.scaled(factor)).collect();
        Self { pattern: self.pattern.clone(), matrices, size: self.size }
    }

    /// Returns the exponent of the power of two that brings the largest entry of all matrices on cycles to between a half and 1; 0 if all entries are zero.
    pub(super) fn exponent(&self) -> i32 {
        let largest = self.recurrent().map(|edge| self.matrices[edge.symbol].largest()).fold(0.0, f64::max);
        // Within ±1000 both the factor and its inverse are normal numbers.
        if largest > 0.0 { (-libm::frexp(largest).1).clamp(-1000, 1000) } else { 0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn matrices_must_be_square_of_one_size_finite_and_as_many_as_symbols() {
        let square = Matrix::identity(2);
        assert_eq!(Automaton::free(vec![]), Err(AutomatonError::Pattern(PatternError::NoSymbol)));
        assert_eq!(Automaton::new(Pattern::free(2).unwrap(), vec![square.clone()]), Err(AutomatonError::Count { symbols: 2, matrices: 1 }));
        let wide = Matrix::zeros(2, 3);
        assert_eq!(Automaton::free(vec![square.clone(), wide]), Err(AutomatonError::Shape { matrix: 1, rows: 2, columns: 3, size: 2 }));
        assert_eq!(Automaton::free(vec![Matrix::zeros(0, 0)]), Err(AutomatonError::Shape { matrix: 0, rows: 0, columns: 0, size: 1 }));
        assert_eq!(Automaton::free(vec![square.clone(), square.scaled(f64::NAN)]), Err(AutomatonError::NotFinite { matrix: 1 }));
        assert_eq!(Automaton::runs(vec![square.clone(), square.clone()], 1, 3).unwrap().pattern().nodes(), 4);
        let links = [Pattern::runs(2, 1, 1).unwrap(), Pattern::runs(2, 1, 2).unwrap()];
        assert_eq!(Automaton::product(&links, vec![square; 4]).unwrap().pattern().nodes(), 6);
    }

    #[test]
    fn scaling_by_a_power_of_two_is_exact() {
        let automaton = Automaton::free(vec![Matrix::identity(2).scaled(3e-200)]).unwrap();
        let scaled = automaton.scaled(automaton.exponent());
        assert!((0.5..1.0).contains(&scaled.matrices()[0].largest()));
        assert_eq!(scaled.scaled(-automaton.exponent()), automaton);
    }
}
