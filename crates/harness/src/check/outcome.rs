//! What came out of one expectation, as numbers and as words.

use cohaptic_scene::Bounds;
use cohaptic_units::print::{Number, SixDigits};

/// What was expected, what came out, and whether that is as expected.
#[derive(Clone, PartialEq, Debug)]
pub struct Outcome {
    /// The section of `[expect]`: `stable`, `discrepancy`, `position`, `travel`, `rotation-discrepancy`, `orientation`, `loss`, `delay` or `measures`.
    pub key: &'static str,
    /// The quantity that is compared, in words: `mean delay on left->right`.
    pub name: String,
    /// The unit of the numbers below; empty for ratios.
    pub unit: &'static str,
    /// The least value that is expected.
    pub low: Option<f64>,
    /// The greatest value that is expected.
    pub high: Option<f64>,
    /// What came out; `None` where there is no number.
    pub measured: Option<f64>,
    /// Whether that is as expected.
    pub passed: bool,
    /// The expectation in words: `at most 20ms`.
    pub expected: String,
    /// What came out, in words: `24ms`.
    pub found: String,
}

impl Outcome {
    /// The line of an expectation that failed; `None` if it passed.
    #[must_use]
    pub fn failure(&self) -> Option<String> {
        let Self { key, name, expected, found, .. } = self;
        let line = || match *key {
            "stable" => format!("expected {expected}, but {found}"),
            _ => format!("{name}: {found}, expected {expected}"),
        };
        (!self.passed).then(line)
    }

    /// A number within bounds, or not: a number that is not finite never passes. `found` says the number in words.
    pub(super) fn number(key: &'static str, name: String, unit: &'static str, bounds: &Bounds, measured: f64) -> Self {
        // Six digits, but where these would say that a number lies within bounds from which it differs later.
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

    /// Nothing came out, because of this.
    pub(super) fn nothing(key: &'static str, name: String, unit: &'static str, bounds: &Bounds, why: &str) -> Self {
        let (low, high) = (bounds.min, bounds.max);
        Self { key, name, unit, low, high, measured: None, passed: false, expected: range(bounds, unit), found: why.to_owned() }
    }

    /// Whether a scene is stable, as a caller knows it.
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

/// What was found of the stability of a scene.
#[derive(Clone, PartialEq, Debug)]
pub struct Finding {
    /// Whether it is as expected.
    pub passed: bool,
    /// What was found, in words that go on after "but": `a small disturbance grows`.
    pub found: String,
    /// The radius that tells, below 1 where the scene is stable; `None` where none was computed.
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
