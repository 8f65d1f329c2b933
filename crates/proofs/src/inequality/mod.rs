//! Matrix inequalities whose unknowns are shapes of quadratic forms and multipliers of products. One module searches a solution, another checks the solution
//! with bounds of all rounding errors.
//!
//! Each part of an inequality asks for shapes V and multipliers m with
//!
//! ```text
//! M(V, m) = Z₁ᵀ·V_after·Z₁ − Z₀ᵀ·V_before·Z₀ + Σ m·w·(u·vᵀ + v·uᵀ)/2  < 0
//! ```
//!
//! in which the rows of Z₀ and Z₁ give the states that the shapes measure before and after a step, over the same unknowns. The rows u and v are the factors of
//! a product, and w is the weight of the product.

mod barrier;
mod parts;
mod verified;

pub(crate) use barrier::search;
pub(crate) use parts::{Inequality, Measured, Part, Product, Row, Solution};
pub(crate) use verified::{holds, rate};
