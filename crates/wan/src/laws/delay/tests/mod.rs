//! Tests of the laws against references, against each other, and against random draws.

mod correlation;
mod properties;
mod quantiles;
pub(in crate::laws::delay) mod reference;
mod refusals;
mod statistics;

use super::*;

/// Returns the law with the name that the reference uses.
fn law(name: &str, mean: f64, sd: f64, floor: f64) -> Law {
    let distribution = match name {
        "normal" => Distribution::Normal,
        "uniform" => Distribution::Uniform,
        "pareto" => Distribution::Pareto,
        "paretonormal" => Distribution::ParetoNormal,
        "lognormal" => Distribution::LogNormal,
        "gamma" => Distribution::Gamma,
        "weibull" => Distribution::Weibull,
        "laplace" => Distribution::Laplace,
        "empirical" => empirical(&[1.0, 2.0, 2.5, 2.5, 7.0, 8.0, 30.0]),
        "table" => table("-9000 -4000 -4000 0 1000 5000 12000 20000"),
        other => panic!("no law is named {other}"),
    };
    Law::new(&distribution, mean, sd, Some(floor)).unwrap()
}

fn empirical(values: &[f64]) -> Distribution {
    Distribution::Empirical(Arc::new(Empirical::new(values.to_vec()).unwrap()))
}

fn table(text: &str) -> Distribution {
    Distribution::Table(Arc::new(DistTable::parse(text).unwrap()))
}

/// Returns one law of every form and of every behaviour at the floor.
fn every_law() -> Vec<(&'static str, Law)> {
    [
        ("normal", 24.0, 2.0, 0.0),
        ("normal", 3.0, 2.0, 0.0),
        ("normal", 3.0, 2.0, 3.0),
        ("uniform", 24.0, 2.0, 0.0),
        ("pareto", 24.0, 2.0, 0.0),
        ("paretonormal", 24.0, 2.0, 0.0),
        ("paretonormal", 3.0, 2.0, 2.0),
        ("lognormal", 24.0, 2.0, 20.0),
        ("lognormal", 24.0, 50.0, 0.0),
        ("gamma", 24.0, 2.0, 20.0),
        ("gamma", 24.0, 2.0, 0.0),
        ("gamma", 24.0, 0.002, 0.0),
        ("gamma", 24.0, 24.0, 0.0),
        ("gamma", 24.0, 60.0, 0.0),
        ("weibull", 24.0, 2.0, 20.0),
        ("weibull", 24.0, 0.1, 0.0),
        ("weibull", 24.0, 60.0, 0.0),
        ("laplace", 24.0, 2.0, 0.0),
        ("laplace", 3.0, 2.0, 2.0),
        ("empirical", 24.0, 2.0, 0.0),
        ("table", 24.0, 2.0, 0.0),
        ("table", 3.0, 2.0, 1.5),
    ]
    .map(|(name, mean, sd, floor)| (name, law(name, mean, sd, floor)))
    .into()
}
