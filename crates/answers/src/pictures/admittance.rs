//! The Bode plot of admittances.

use cohaptic_picture::{Axis, Line, Look, Marker, Panel, Picture};
use cohaptic_stability::{Admittance, AdmittanceError, FrequencyResponse, PushedAxis, Verdict, ideal};

/// An admittance with a name for the legend and with values.
#[derive(Clone, Copy, Debug)]
pub struct AdmittanceCurve<'a> {
    /// Name in the legend, without the verdict: see [`legend_name`](crate::legend_name).
    pub name: &'a str,
    /// Admittance of a peer, along or about the axes.
    pub admittance: &'a Admittance,
    /// Values at the requested frequencies.
    pub response: &'a FrequencyResponse,
}

/// Names and units of the quantities of an admittance.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct AdmittanceWords {
    /// Motion over push, such as `velocity over force`.
    pub what: String,
    /// Unit of motion over push.
    pub over: &'static str,
    /// Name of the object alone, the reference curve.
    pub free: &'static str,
    /// Unit of the inertia of the object alone.
    pub inertia: &'static str,
}

/// Returns the names and units of an admittance, which depend on whether push and motion are along or about an axis.
pub(crate) fn admittance_words(admittance: &Admittance) -> AdmittanceWords {
    let [push, seen] = admittance.axes();
    let along = |axis: PushedAxis| format!(" {} {}", if axis.is_turn() { "about" } else { "along" }, axis.word().trim_start_matches('r'));
    let [force, velocity] = if push == seen { [push, seen].map(|_| String::new()) } else { [push, seen].map(along) };
    let name = |axis: PushedAxis, turned: &'static str, moved: &'static str| if axis.is_turn() { turned } else { moved };
    let (push_name, seen_name) = (name(push, "torque", "force"), name(seen, "angular velocity", "velocity"));
    let (over, free, inertia) = match (push.is_turn(), seen.is_turn()) {
        (false, false) => ("m/(N·s)", "free mass", "kg"),
        (true, true) => ("rad/(N·m·s)", "free turn", "kg·m²"),
        (false, true) => ("rad/(N·s)", "free object", "kg·m"),
        (true, false) => ("m/(N·m·s)", "free object", "kg·m"),
    };
    AdmittanceWords { what: format!("{seen_name}{velocity} over {push_name}{force}"), over, free, inertia }
}

/// A named curve.
struct Response {
    name: String,
    look: Look,
    /// Points: frequency \[Hz\] and magnitude \[dB\].
    magnitudes: Vec<(f64, f64)>,
    /// Points: frequency \[Hz\] and phase \[degrees\].
    phases: Vec<(f64, f64)>,
}

/// Draws the curves. `title`: title of the first scene. `peer`: name of the pushed peer.
///
/// # Errors
///
/// [`AdmittanceError`] if a frequency of a curve is not above 0, or is above half the rate of the peer's ticks.
pub fn admittance_picture(title: &str, peer: &str, curves: &[AdmittanceCurve<'_>]) -> Result<Picture, AdmittanceError> {
    let mut responses = masses(curves);
    for (number, curve) in curves.iter().enumerate() {
        responses.push(responded(number, curve)?);
    }
    let frequency = || Axis::new("Frequency").symbol("f").unit("Hz").logarithmic().tight();
    let (what, over) = curves.first().map_or_else(Default::default, |curve| {
        let words = admittance_words(curve.admittance);
        (words.what, words.over)
    });
    let magnitude = Axis::new("Magnitude").unit(format!("dB re 1 {over}")).multiples_of(20).tight().ends_at_ticks();
    let phase = Axis::new("Phase").unit("degrees").multiples_of(45).tight().ends_at_ticks();
    let above = Panel::new(frequency(), magnitude).with_all(responses.iter().map(|response| response.line(&response.magnitudes)));
    let below = Panel::new(frequency(), phase).with_all(responses.iter().map(|response| response.line(&response.phases)));
    let title = format!("{title}: {what} of {peer}");
    Ok(Picture::new(title).shared_x().aspect(0.4).panel(above).panel(below))
}

impl Response {
    fn line(&self, points: &[(f64, f64)]) -> Line {
        let line = Line::new(points.iter().copied(), self.look).named(self.name.as_str());
        // A line with one point is invisible without a mark.
        if points.len() == 1 { line.marked(Marker::Disc) } else { line }
    }
}

/// Largest ratio of neighbouring frequencies of a drawn line: a resonance is then drawn round, and a phase can be followed through its jumps.
const FINEST: f64 = 1.02;

/// Returns the requested frequencies in rising order, filled up so that neighbours differ at most by the ratio [`FINEST`].
fn filled(curve: &AdmittanceCurve<'_>) -> Vec<f64> {
    let mut asked: Vec<f64> = curve.response.points.iter().map(|point| point.hz).collect();
    asked.sort_by(f64::total_cmp);
    let between = |pair: &[f64]| {
        let (low, high) = (pair[0], pair[1]);
        std::iter::successors(Some(low), |hz| Some(hz * FINEST)).take_while(move |hz| *hz < high).collect::<Vec<f64>>()
    };
    asked.windows(2).flat_map(between).chain(asked.last().copied()).collect()
}

fn responded(number: usize, curve: &AdmittanceCurve<'_>) -> Result<Response, AdmittanceError> {
    // Computed again, because the curve has values only at the requested frequencies.
    let response = curve.admittance.response(&filled(curve))?;
    let hz = || response.points.iter().map(|point| point.hz);
    Ok(Response {
        name: named(curve),
        look: Look::of(number),
        magnitudes: hz().zip(response.magnitudes_db()).collect(),
        phases: hz().zip(response.phases_deg()).collect(),
    })
}

/// Returns the name of a curve, with the verdict unless the scene is stable: the curve of an unstable scene cannot be measured.
fn named(curve: &AdmittanceCurve<'_>) -> String {
    match curve.admittance.verdict() {
        Verdict::Stable => curve.name.to_owned(),
        verdict @ (Verdict::Marginal | Verdict::Overflow | Verdict::Unstable) => format!("{} ({})", curve.name, verdict.word().to_uppercase()),
    }
}

/// Returns the curves of the objects alone, one per mass.
fn masses(curves: &[AdmittanceCurve<'_>]) -> Vec<Response> {
    let mut masses: Vec<Response> = Vec::new();
    // A mass without a finite value has no curve.
    for curve in curves.iter().filter(|curve| curve.admittance.object_mass().is_finite()) {
        let mass = curve.admittance.object_mass();
        let AdmittanceWords { free, inertia, .. } = admittance_words(curve.admittance);
        let name = format!("{free} of {mass} {inertia}");
        if masses.iter().any(|mass| mass.name == name) {
            continue;
        }
        // On a logarithmic axis of frequency the curve is a straight line, so two points suffice.
        let ends = extent(curve.response.points.iter().map(|point| point.hz))
            .map_or(Vec::new(), |(low, high)| if low < high { vec![low, high] } else { vec![low] });
        let magnitudes = ends.iter().map(|hz| (*hz, 20.0 * ideal(mass, *hz).norm().log10())).collect();
        // The first reference is grey. Further references have the looks after the looks of the curves.
        let look = if masses.is_empty() { Look::reference() } else { Look::of(curves.len() + masses.len() - 1).thin() };
        masses.push(Response { name, look, magnitudes, phases: ends.into_iter().map(|hz| (hz, -90.0 * mass.signum())).collect() });
    }
    masses
}

fn extent(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values.fold(None, |found, value| Some(found.map_or((value, value), |(low, high): (f64, f64)| (low.min(value), high.max(value)))))
}
