//! Second moment of a linear system in triangular coordinates, driven by unit noise once per step, for a given growth factor γ per step.

use num_complex::Complex64;

/// Solution X of γX = T·X·T* + b·b* for an upper triangular T and a vector b. Buffers are kept for the next solution.
#[derive(Clone, Debug, Default)]
pub(crate) struct Variance {
    size: usize,
    /// Entries of X, row by row; Hermitian.
    moment: Vec<Complex64>,
    /// Entries of X·T*, row by row.
    product: Vec<Complex64>,
    /// Entries of T, row by row.
    triangle: Vec<Complex64>,
    /// Entries of b.
    input: Vec<Complex64>,
}

impl Variance {
    /// Solves the equation for `size` rows. Only entries of `matrix` (row, column) on and above the diagonal are read.
    ///
    /// Each entry of X follows from the entries below and to the right (Bartels & Stewart 1972; Kitagawa 1977, for the discrete equation). The only
    /// assumption about the eigenvalues of T is that γ is above the modulus of the product of any two of them.
    pub(crate) fn solve(&mut self, gamma: f64, size: usize, matrix: impl Fn(usize, usize) -> Complex64, input: impl Fn(usize) -> Complex64) {
        self.size = size;
        let Self { moment, product, triangle, input: source, .. } = self;
        for list in [&mut *moment, &mut *product, &mut *triangle] {
            list.clear();
            list.resize(size * size, Complex64::default());
        }
        source.clear();
        source.extend((0..size).map(input));
        for row in 0..size {
            for column in row..size {
                triangle[row * size + column] = matrix(row, column);
            }
        }
        for row in (0..size).rev() {
            let own = triangle[row * size + row];
            for column in (0..=row).rev() {
                // Rows below `row` of X·T* are complete, since rows are solved from the last one up.
                let mut sum = source[row] * source[column].conj();
                for below in row + 1..size {
                    sum += triangle[row * size + below] * product[below * size + column];
                }
                // Entries of this row right of the diagonal are known by symmetry from the rows below, the other ones from this loop.
                let mut right = Complex64::default();
                for place in column + 1..size {
                    right += moment[row * size + place] * triangle[column * size + place].conj();
                }
                let entry = (sum + own * right) / (gamma - own * triangle[column * size + column].conj());
                moment[row * size + column] = entry;
                moment[column * size + row] = entry.conj();
            }
            for column in 0..size {
                product[row * size + column] = (column..size).map(|place| moment[row * size + place] * triangle[column * size + place].conj()).sum();
            }
        }
    }

    /// Returns the variance of the last state.
    pub(crate) fn of_noise(&self) -> f64 {
        self.moment.last().map_or(0.0, |last| last.re)
    }

    /// Returns the variance of an output Σ output(i)·state(i), and the covariance of that output with the last state.
    pub(crate) fn of_output(&self, output: impl Fn(usize) -> Complex64) -> (f64, f64) {
        let size = self.size;
        let (mut square, mut product) = (Complex64::default(), Complex64::default());
        for row in 0..size {
            let with: Complex64 = (0..size).map(|column| self.moment[row * size + column] * output(column).conj()).sum();
            square += output(row) * with;
            product += output(row) * self.moment[row * size + size - 1];
        }
        (square.re, product.re)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares the solution with the series Σ γ^(−k−1)·T^k·b·(T^k·b)* for a matrix with a nearly defective block.
    #[test]
    fn the_solution_is_the_sum_of_the_series() {
        let complex = Complex64::new;
        let matrix = [
            [complex(0.9, 0.1), complex(2.0, -1.0), complex(0.3, 0.0), complex(-1.0, 0.5)],
            [complex(0.0, 0.0), complex(0.9, 0.1 + 1e-9), complex(1.5, 0.2), complex(0.7, 0.0)],
            [complex(0.0, 0.0), complex(0.0, 0.0), complex(-0.5, 0.0), complex(0.1, 0.9)],
            [complex(0.0, 0.0), complex(0.0, 0.0), complex(0.0, 0.0), complex(0.25, 0.0)],
        ];
        let input = [complex(1.0, 0.0), complex(-0.5, 2.0), complex(0.0, 0.3), complex(1.0, 0.0)];
        let output = [complex(0.4, 0.0), complex(0.0, 1.0), complex(-0.2, 0.6), complex(3.0, 0.0)];
        let gamma = 0.95;
        let mut variance = Variance::default();
        variance.solve(gamma, 4, |row, column| matrix[row][column], |row| input[row]);
        let (mut state, mut share) = (input, 1.0 / gamma);
        let (mut square, mut product, mut noise) = (0.0, 0.0, 0.0);
        // The moduli of the eigenvalues are below 0.9056, so that a term shrinks by 0.8201/0.95 = 0.863 per step. 400 steps leave 10⁻²⁵.
        for _ in 0..400 {
            let seen: Complex64 = output.iter().zip(&state).map(|(output, state)| output * state).sum();
            square += share * seen.norm_sqr();
            product += share * (seen * state[3].conj()).re;
            noise += share * state[3].norm_sqr();
            state = matrix.map(|row| row.iter().zip(&state).map(|(entry, state)| entry * state).sum());
            share /= gamma;
        }
        let (found, with) = variance.of_output(|place| output[place]);
        assert!((found - square).abs() < 1e-12 * square && (with - product).abs() < 1e-12 * square, "{found} {square}, {with} {product}");
        assert!((variance.of_noise() - noise).abs() < 1e-14);
    }
}
