//! Outcome of one expectation, as numbers and as text.

use cohaptic_scene::Bounds;
use cohaptic_units::print::{Number, SixDigits};

/// Expected and measured values of an expectation, and the verdict.
#[derive(Clone, PartialEq, Debug)]
pub struct Outcome {
    /// Section of `[expect]`: `stable`, `discrepancy`, `position`, `travel`, `rotation-discrepancy`, `orientation`, `loss`, `delay`, `measures` or `task`.
    pub key: &'static str,
    /// Compared quantity as text: `mean delay on left->right`.
    pub name: String,
    /// Unit of the numbers below; empty for ratios.
    pub unit: &'static str,
    /// Least expected value; `None` without a lower bound.
    pub low: Option<f64>,
    /// Greatest expected value; `None` without an upper bound.
    pub high: Option<f64>,
    /// Measured value; `None` if there is no number.
    pub measured: Option<f64>,
    /// `true` if the expectation holds.
    pub passed: bool,
    /// Expectation as text: `at most 20ms`.
    pub expected: String,
    /// Measured value as text: `24ms`.
    pub found: String,
}

impl Outcome {
    /// Returns the line of a failed expectation; `None` if the expectation holds.
    #[must_use]
    pub(crate) fn failure(&self) -> Option<String> {
        let Self { key, name, expected, found, .. } = self;
        let line = || match *key {
            "stable" => format!("expected {expected}, but {found}"),
            _ => format!("{name}: {found}, expected {expected}"),
        };
        (!self.passed).then(line)
    }

    /// Returns the outcome of a measured number. A number that is not finite fails. `found` is the number as text.
    pub(super) fn number(key: &'static str, name: String, unit: &'static str, bounds: &Bounds, measured: f64) -> Self {
        // Six digits, unless the rounded number is within the bounds and the exact number is not, or the other way round.
        let rounded = SixDigits(measured).to_string();
        let says_the_same = rounded.parse().is_ok_and(|rounded| bounds.contain(rounded) == bounds.contain(measured));
        let said = if says_the_same { rounded } else { Number(measured).to_string() };
        let found = if unit.is_empty() { said } else { format!("{said} {unit}") };
        Self {
            measured: Some(measured),
            passed: measured.is_finite() && bounds.contain(measured),
            found,
            ..Self::nothing(key, name, unit, bounds, "")
        }
    }

    /// Returns the outcome without a number, which fails. `why` is the text of `found`.
    pub(super) fn nothing(key: &'static str, name: String, unit: &'static str, bounds: &Bounds, why: &str) -> Self {
        let (low, high) = (bounds.min, bounds.max);
        Self { key, name, unit, low, high, measured: None, passed: false, expected: range(bounds, unit), found: why.to_owned() }
    }

    /// Returns the outcome of the expectation `stable` from a finding.
    pub(super) fn stability(stable: bool, finding: Finding) -> Self {
        let Finding { passed, found, radius } = finding;
        let (low, high) = match radius {
            None => (None, None),
            Some(_) if stable => (None, Some(1.0)),
            Some(_) => (Some(1.0), None),
        };
        let (name, expected) = ("stability".to_owned(), if stable { "stable" } else { "unstable" }.to_owned());
        Self { key: "stable", name, unit: "", low, high, measured: radius, passed, expected, found }
    }
}

/// Finding about the stability of a scene.
#[derive(Clone, PartialEq, Debug)]
pub struct Finding {
    /// `true` if the finding is as expected.
    pub passed: bool,
    /// Finding as text that continues after "but": `a small disturbance grows`.
    pub found: String,
    /// Computed radius, below 1 if the scene is stable; `None` if no radius was computed.
    pub radius: Option<f64>,
}

fn range(bounds: &Bounds, unit: &str) -> String {
    let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
    match (bounds.min, bounds.max) {
        (Some(min), Some(max)) => format!("{} to {}{unit}", Number(min), Number(max)),
        (Some(min), None) => format!("at least {}{unit}", Number(min)),
        (None, Some(max)) => format!("at most {}{unit}", Number(max)),
        (None, None) => "any number".into(),
    }
}
