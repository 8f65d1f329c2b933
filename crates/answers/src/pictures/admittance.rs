//! A Bode plot.

use cohaptic_picture::{Axis, Line, Look, Marker, Panel, Picture};
use cohaptic_stability::{Admittance, AdmittanceError, FrequencyResponse, PushedAxis, Verdict, ideal};

/// An admittance with what its legend calls it, at frequencies.
#[derive(Clone, Copy, Debug)]
pub struct AdmittanceCurve<'a> {
    /// In the legend.
    pub name: &'a str,
    /// Of which peer, along which axes.
    pub admittance: &'a Admittance,
    /// At the frequencies that were asked for.
    pub response: &'a FrequencyResponse,
}

/// The words about an admittance.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct AdmittanceWords {
    /// The motion over the push: `velocity over force`.
    pub what: String,
    /// The unit of that.
    pub over: &'static str,
    /// What the whole object alone is.
    pub free: &'static str,
    /// The unit of its inertia.
    pub inertia: &'static str,
}

/// In words: the motion over the push, what the whole object alone is, and the units of both.
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

/// A response with its name.
struct Response {
    name: String,
    look: Look,
    /// Frequency \[Hz\] and magnitude \[dB\].
    magnitudes: Vec<(f64, f64)>,
    /// Frequency \[Hz\] and phase \[degrees\].
    phases: Vec<(f64, f64)>,
}

/// The plot of curves in scenes of which the first has that title.
///
/// # Errors
///
/// [`AdmittanceError`] if no frequency is one of the curve.
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
        // One frequency alone is a point.
        if points.len() == 1 { line.marked(Marker::Disc) } else { line }
    }
}

/// Between two points of a line a frequency is this much higher at most: a resonance is round then, and a phase can be followed through its jumps.
const FINEST: f64 = 1.02;

/// The frequencies that were asked for, rising, with enough between them that no two are far apart.
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
    let response = curve.admittance.response(&filled(curve))?;
    let hz = || response.points.iter().map(|point| point.hz);
    Ok(Response {
        name: named(curve),
        look: Look::of(number),
        magnitudes: hz().zip(response.magnitudes_db()).collect(),
        phases: hz().zip(response.phases_deg()).collect(),
    })
}

/// The name, and the verdict where it is no good one: such a curve is nothing that could be measured.
fn named(curve: &AdmittanceCurve<'_>) -> String {
    match curve.admittance.verdict() {
        Verdict::Stable => curve.name.to_owned(),
        verdict @ (Verdict::Marginal | Verdict::Overflow | Verdict::Unstable) => format!("{} ({})", curve.name, verdict.word().to_uppercase()),
    }
}

/// The objects of all curves, as free masses: each mass once.
fn masses(curves: &[AdmittanceCurve<'_>]) -> Vec<Response> {
    let mut masses: Vec<Response> = Vec::new();
    // No number of decibels stands for nothing.
    for curve in curves.iter().filter(|curve| curve.admittance.object_mass().is_finite()) {
        let mass = curve.admittance.object_mass();
        let AdmittanceWords { free, inertia, .. } = admittance_words(curve.admittance);
        let name = format!("{free} of {mass} {inertia}");
        if masses.iter().any(|mass| mass.name == name) {
            continue;
        }
        // Straight over a logarithmic frequency.
        let ends = extent(curve.response.points.iter().map(|point| point.hz))
            .map_or(Vec::new(), |(low, high)| if low < high { vec![low, high] } else { vec![low] });
        let magnitudes = ends.iter().map(|hz| (*hz, 20.0 * ideal(mass, *hz).norm().log10())).collect();
        // One is grey, as all that curves are compared with; more have the looks after those of the curves.
        let look = if masses.is_empty() { Look::reference() } else { Look::of(curves.len() + masses.len() - 1).thin() };
        masses.push(Response { name, look, magnitudes, phases: ends.into_iter().map(|hz| (hz, -90.0 * mass.signum())).collect() });
    }
    masses
}

fn extent(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values.fold(None, |found, value| Some(found.map_or((value, value), |(low, high): (f64, f64)| (low.min(value), high.max(value)))))
}
