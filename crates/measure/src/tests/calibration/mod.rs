//! Calibration: counts how often the truth lies outside a stated interval, for all figures with an error or an interval, over random links.
//!
//! A standard error from 30 batches is judged at 2.045 standard errors, Student's 0.975 quantile with 29 degrees of freedom, and any other at 1.96. With
//! right errors 5 % of the truths lie outside. A figure fails if it has more outside than right errors would give once in 10 000 cases (binomial). There
//! are about 50 figures.

mod fits;
mod links;

use std::collections::BTreeMap;

use statrs::distribution::{Binomial, DiscreteCDF as _};

/// Quantile 0.975 of Student's law with 29 degrees of freedom.
const OF_BATCHES: f64 = 2.045;
/// Quantile 0.975 of the normal law.
const OF_LIKELIHOOD: f64 = 1.96;

/// Number of truths outside, and number of all checks, by figure.
#[derive(Default, Debug)]
struct Tally(BTreeMap<String, [u64; 2]>);

impl Tally {
    fn count(&mut self, figure: impl Into<String>, outside: bool) {
        let [times, of] = self.0.entry(figure.into()).or_default();
        *times += u64::from(outside);
        *of += 1;
    }

    /// Checks that no figure is outside in more than 5 %, and that each figure was checked at least the given number of times.
    fn is_calibrated(&self, figures: &[&str], at_least: u64) {
        assert_eq!(self.0.keys().map(String::as_str).collect::<Vec<_>>(), figures);
        for (figure, &[times, of]) in &self.0 {
            let most = Binomial::new(0.05, of).unwrap().inverse_cdf(0.9999);
            assert!(of >= at_least && times <= most, "{figure}: {times} of {of}, at most {most} expected");
        }
    }
}
