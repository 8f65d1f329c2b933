//! The text about admittances.

use std::fmt::Write as _;

use cohaptic_stability::{Estimate, Verdict};

use super::Curve;
use crate::{AdmittanceWords, figure};

/// Returns the text about all curves, with the tables.
#[must_use]
pub fn words(peer: &str, curves: &[Curve]) -> String {
    let mut text = String::new();
    for (number, curve) in curves.iter().enumerate() {
        // Writing to a string cannot fail.
        let _ = if number == 0 { writeln!(text, "{}", curve.title) } else { writeln!(text, "\nWith {}", curve.name) };
        if let Some(warning) = curve.warning() {
            let _ = writeln!(text, "  WARNING: {warning}");
        }
        let _ = writeln!(text, "\n  {}", subject(peer, curve));
        table(&mut text, curve);
        // Only force and motion along the same axis make a spring, a viscosity and an inertia.
        let [axis, seen] = curve.admittance.axes();
        if axis == seen {
            let _ = writeln!(text, "\n  moved slowly, {peer} feels");
            felt(&mut text, curve);
        } else {
            text.push('\n');
        }
        verdicts(curve).iter().for_each(|line| text.push_str(&format!("  {line}\n")));
        for note in curve.notes() {
            let _ = writeln!(text, "  note: {note}");
        }
    }
    text
}

/// Returns what a curve shows, in words.
pub(super) fn subject(peer: &str, curve: &Curve) -> String {
    let AdmittanceWords { what, free, inertia, .. } = curve.words();
    let mass = cohaptic_units::print::Number(curve.mass);
    format!("{what} at the device of {peer}, compared with that of a {free} of {mass} {inertia}")
}

fn table(text: &mut String, curve: &Curve) {
    let _ = writeln!(text, "{:>14}{:>14}{:>14}{:>14}", "Hz", "dB", "degrees", "free mass dB");
    for point in &curve.response.points {
        let (magnitude, phase) = (point.magnitude_db(), point.phase_deg());
        let _ = writeln!(text, "{:>14}{magnitude:>14.3}{phase:>14.2}{:>14.3}", significant(point.hz), curve.ideal_db(point.hz));
    }
}

/// Returns a frequency with five significant digits, without trailing zeros.
pub(super) fn significant(hz: f64) -> String {
    // Outside of this range plain decimals would show too many zeros.
    if !(1e-4..1e6).contains(&hz) {
        return format!("{hz:.4e}");
    }
    let whole = format!("{hz:.0}").len();
    // Below 1 Hz, eight decimals show at least five digits, because `hz` is at least 1e-4 here.
    let decimals = if hz >= 1.0 { 5_usize.saturating_sub(whole) } else { 8 };
    let text = format!("{hz:.decimals$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// Returns the units of a spring, a viscosity and an inertia.
fn units(curve: &Curve) -> [&'static str; 3] {
    if curve.admittance.axes()[0].is_turn() { ["N·m/rad", "N·m·s/rad", "kg·m²"] } else { ["N/m", "N·s/m", "kg"] }
}

/// Adds the lines about the feeling of a slow hand.
fn felt(text: &mut String, curve: &Curve) {
    for (what, size) in felt_sizes(curve) {
        let _ = writeln!(text, "    {:<16}{size}", format!("{what} of"));
    }
}

/// Returns the feeling of a slow hand: names, each with a size in words. The spring is listed only if the object is tied to the ground.
pub(super) fn felt_sizes(curve: &Curve) -> Vec<(&'static str, String)> {
    let fit = curve.fit;
    let [spring, viscosity, inertia] = units(curve);
    // A free object has a stiffness of exactly zero, without an error.
    let tied = fit.stiffness.value != 0.0 || fit.stiffness.error != 0.0;
    let rows =
        [("a spring", fit.stiffness, spring, tied), ("a viscosity", fit.viscosity, viscosity, true), ("an inertia", fit.inertia, inertia, true)];
    rows.into_iter().filter(|(.., shown)| *shown).map(|(what, estimate, unit, _)| (what, limit(estimate, unit))).collect()
}

fn limit(Estimate { value, error }: Estimate, unit: &str) -> String {
    if value.is_finite() && error.is_finite() { format!("{} +- {error:.1e} {unit}", figure(value, 6)) } else { "no definite size".to_owned() }
}

/// Returns a verdict for people: in capitals unless stable.
fn shown(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Stable => "stable",
        Verdict::Marginal => "MARGINAL",
        Verdict::Overflow => "OVERFLOW",
        Verdict::Unstable => "UNSTABLE",
    }
}

/// Returns the verdict on the scene, a line per radius.
pub(super) fn verdicts(curve: &Curve) -> Vec<String> {
    let radius = curve.admittance.radius();
    let word = shown(radius.verdict());
    let nominal = format!("spectral radius {} +- {:.1e}", figure(radius.value, 12), radius.error);
    match &curve.chance {
        None => vec![format!("the scene is {word}: {nominal}")],
        Some(Err(_)) => vec![format!("with delays at their mean and no losses the scene is {word}: {nominal}")],
        Some(Ok(moment)) => vec![
            format!(
                "in the mean square the scene is {}: mean-square radius {} +- {:.1e}",
                shown(moment.verdict()),
                figure(moment.radius.value, 12),
                moment.radius.error
            ),
            format!("with delays at their mean and no losses it is {word}: {nominal}"),
        ],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frequencies_have_five_digits_or_all_that_they_have() {
        for (hz, shown) in [
            (0.01, "0.01"),
            (1.0, "1"),
            (62.5, "62.5"),
            (12.345_678, "12.346"),
            (100.0, "100"),
            (123_456.7, "123457"),
            (0.011_689_3, "0.0116893"),
            (1e-7, "1.0000e-7"),
        ] {
            assert_eq!(significant(hz), shown);
        }
    }
}
