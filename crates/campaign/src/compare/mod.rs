//! Comparison of strategies: the runs of a campaign whose first key is the strategy, summed up per strategy and compared seed by seed.

mod comparison;
mod interval;
mod measured;
mod strategies;

pub(crate) use comparison::compared;
pub use comparison::{Cell, Comparison, Figures, MOST_NUMBERS_COMPARED};
pub use interval::{Estimate, Share};
pub use measured::MeasuredColumn;
pub use strategies::{Strategies, StrategiesError};
