//! Matrix inequalities: shapes of quadratic forms, and multipliers of products, which are searched and then checked with bounds of all rounding errors.
//!
//! Each part asks for shapes V and multipliers m with
//!
//! ```text
//! M(V, m) = Z₁ᵀ·V_after·Z₁ − Z₀ᵀ·V_before·Z₀ + Σ m·w·(u·vᵀ + v·uᵀ)/2  < 0
//! ```
//!
//! in which Z₀ and Z₁ give what shapes measure before and after a step, as rows over the same unknowns, and u and v the factors of a product.

mod barrier;
mod parts;
mod verified;

pub(crate) use barrier::search;
pub(crate) use parts::{Inequality, Measured, Part, Product, Row, Solution};
pub(crate) use verified::{holds, rate};
