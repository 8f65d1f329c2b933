//! How often does the truth lie outside of a stated interval? Every figure with an error or an interval, over random links.
//!
//! A standard error is judged at 2.045 of it, Student's 0.975 quantile with 29 degrees of freedom, where it comes from 30 batches, and at 1.96 elsewhere:
//! then 5 % are outside if it is right. More than that is refused where it happens in one of 10 000 right ones (binomial); there are about 50 figures.

mod fits;
mod links;

use std::collections::BTreeMap;

use statrs::distribution::{Binomial, DiscreteCDF as _};

/// Student, 29 degrees of freedom.
const OF_BATCHES: f64 = 2.045;
/// Normal.
const OF_LIKELIHOOD: f64 = 1.96;

/// How often the truth was outside, and how often it could have been, by figure.
#[derive(Default, Debug)]
struct Tally(BTreeMap<String, [u64; 2]>);

impl Tally {
    fn count(&mut self, figure: impl Into<String>, outside: bool) {
        let [times, of] = self.0.entry(figure.into()).or_default();
        *times += u64::from(outside);
        *of += 1;
    }

    /// No figure is outside more often than in 5 %, and each was looked at so often at least.
    fn is_calibrated(&self, figures: &[&str], at_least: u64) {
        assert_eq!(self.0.keys().map(String::as_str).collect::<Vec<_>>(), figures);
        for (figure, &[times, of]) in &self.0 {
            let most = Binomial::new(0.05, of).unwrap().inverse_cdf(0.9999);
            assert!(of >= at_least && times <= most, "{figure}: {times} of {of}, at most {most} expected");
        }
    }
}
