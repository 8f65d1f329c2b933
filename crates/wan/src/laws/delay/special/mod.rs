//! Special functions that `libm` lacks, accurate to the last digits of an `f64` in both tails.

pub(super) mod gamma;
pub(super) mod gamma_inverse;
pub(super) mod log_gamma;
pub(super) mod normal;
pub(super) mod quadrature;
pub(super) mod root;
mod temme;
