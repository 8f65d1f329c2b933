//! The JSON document of an admittance.

use cohaptic_stability::Estimate;
use serde::Serialize;

use super::curve::Curve;

/// What `cohaptic admittance --json` prints.
#[derive(Serialize)]
pub(super) struct Document<'a> {
    title: &'a str,
    peer: &'a str,
    #[serde(flatten)]
    scene: Option<CurveDocument<'a>>,
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
    curve: CurveDocument<'a>,
}

#[derive(Serialize)]
struct CurveDocument<'a> {
    verdict: &'static str,
    spectral_radius: f64,
    error_bound: f64,
    warning: Option<&'static str>,
    viscosity: Limit,
    inertia: Limit,
    stiffness: Limit,
    object_mass_kg: f64,
    points: Vec<Point>,
    notes: &'a [String],
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

impl<'a> Document<'a> {
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

impl<'a> CurveDocument<'a> {
    fn of(curve: &'a Curve) -> Self {
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
            notes: curve.admittance.notes(),
        }
    }
}
