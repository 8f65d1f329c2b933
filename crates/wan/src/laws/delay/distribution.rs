//! The forms of laws.

use alloc::sync::Arc;

use super::{DistTable, Empirical};

/// Form of a law. The table of the [module](crate::law) defines each form and its delays at the floor.
#[derive(Clone, PartialEq, Debug, Default)]
pub enum Distribution {
    /// Normal, cut at the floor.
    #[default]
    Normal,
    /// Uniform over µ ± √3·σ.
    Uniform,
    /// Pareto of tail index 3, as in netem's table, but exact: its standard deviation is the given one, and its tail has no end.
    Pareto,
    /// Mixture of ¼ normal and ¾ Pareto of netem, exact, cut at the floor.
    ParetoNormal,
    /// Lognormal from the floor.
    LogNormal,
    /// Gamma from the floor.
    Gamma,
    /// Weibull from the floor.
    Weibull,
    /// Laplace, cut at the floor.
    Laplace,
    /// Given values, shifted and stretched to the given mean and deviation.
    Empirical(Arc<Empirical>),
    /// Entries of a `.dist` file as netem uses them: σ·entry/8192 around the mean, cut at the floor. Mean and deviation of the delays depend on the table.
    Table(Arc<DistTable>),
}

impl Distribution {
    /// Returns the name of the law.
    pub(crate) fn words(&self) -> &'static str {
        match self {
            Self::Normal => "normal",
            Self::Uniform => "uniform",
            Self::Pareto => "Pareto",
            Self::ParetoNormal => "Pareto-normal",
            Self::LogNormal => "lognormal",
            Self::Gamma => "gamma",
            Self::Weibull => "Weibull",
            Self::Laplace => "Laplace",
            Self::Empirical(_) => "measured",
            Self::Table(_) => "tabulated",
        }
    }
}
