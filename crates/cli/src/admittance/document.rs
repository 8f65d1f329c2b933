//! The JSON document of an admittance.

use cohaptic_stability::Estimate;
use serde::Serialize;

use super::curve::Curve;

/// What `cohaptic admittance --json` prints.
#[derive(Serialize)]
pub(super) struct AdmittanceDocument<'a> {
    title: &'a str,
    peer: &'a str,
    #[serde(flatten)]
    scene: Option<CurveDocument>,
    /// Those of `--curve`.
    curves: Vec<Named<'a>>,
    files: &'a [String],
    /// Whether points at the end of the frequencies are missing because the user asked for the end.
    interrupted: bool,
}

#[derive(Serialize)]
struct Named<'a> {
    name: &'a str,
    overrides: &'a [String],
    #[serde(flatten)]
    curve: CurveDocument,
}

#[derive(Serialize)]
struct CurveDocument {
    verdict: &'static str,
    spectral_radius: f64,
    error_bound: f64,
    warning: Option<&'static str>,
    viscosity: Limit,
    inertia: Limit,
    stiffness: Limit,
    object_mass_kg: f64,
    points: Vec<Point>,
    /// That of the second moment, where links leave something to chance and it can be followed.
    #[serde(skip_serializing_if = "Option::is_none")]
    mean_square: Option<MeanSquareDocument>,
    notes: Vec<String>,
}

/// The growth of the second moment in a frame.
#[derive(Serialize)]
struct MeanSquareDocument {
    verdict: &'static str,
    radius: f64,
    error_bound: f64,
}

/// A number that was extrapolated, and about how far it may be off.
#[derive(Serialize)]
struct Limit {
    value: f64,
    error: f64,
}

#[derive(Serialize)]
struct Point {
    hz: f64,
    magnitude_db: f64,
    phase_deg: f64,
    ideal_db: f64,
}

impl<'a> AdmittanceDocument<'a> {
    pub(super) fn new(peer: &'a str, curves: &'a [Curve], files: &'a [String], interrupted: bool) -> Self {
        let named = |curve: &'a Curve| Named { name: &curve.name, overrides: &curve.overrides, curve: CurveDocument::of(curve) };
        Self {
            title: curves.first().map_or("", |curve| &curve.title),
            peer,
            scene: curves.first().map(CurveDocument::of),
            curves: curves.iter().skip(1).map(named).collect(),
            files,
            interrupted,
        }
    }
}

impl CurveDocument {
    fn of(curve: &Curve) -> Self {
        let limit = |Estimate { value, error }: Estimate| Limit { value, error };
        let radius = curve.admittance.radius();
        let points = curve.response.points.iter().map(|point| Point {
            hz: point.hz,
            magnitude_db: point.magnitude_db(),
            phase_deg: point.phase_deg(),
            ideal_db: curve.ideal_db(point.hz),
        });
        Self {
            verdict: radius.verdict().word(),
            spectral_radius: radius.value,
            error_bound: radius.error,
            warning: curve.warning(),
            viscosity: limit(curve.fit.viscosity),
            inertia: limit(curve.fit.inertia),
            stiffness: limit(curve.fit.stiffness),
            object_mass_kg: curve.mass,
            points: points.collect(),
            mean_square: curve.chance.as_ref().and_then(|chance| chance.as_ref().ok()).map(|moment| MeanSquareDocument {
                verdict: moment.verdict().word(),
                radius: moment.radius.value,
                error_bound: moment.radius.error,
            }),
            notes: curve.notes(),
        }
    }
}
