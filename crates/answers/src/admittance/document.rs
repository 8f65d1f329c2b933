//! The JSON document of admittances.

use cohaptic_stability::Estimate;
use serde::Serialize;

use super::Curve;
use crate::document;

/// Returns the answer of `cohaptic admittance --json`. `interrupted`: whether the user stopped the computation, so that the last frequencies are missing.
pub fn document(peer: &str, curves: &[Curve], files: &[String], interrupted: bool) -> impl Serialize {
    let named = curves.iter().skip(1).map(|curve| {
        document! {
            name: curve.name.as_str(),
            overrides: curve.overrides.as_slice(),
            #[serde(flatten)]
            curve: of_curve(curve),
        }
    });
    document! {
        title: curves.first().map_or("", |curve| &curve.title),
        peer: peer,
        #[serde(flatten)]
        scene: curves.first().map(of_curve),
        // The curves of `--curve`.
        curves: named.collect::<Vec<_>>(),
        files: files,
        interrupted: interrupted,
    }
}

fn of_curve(curve: &Curve) -> impl Serialize + use<> {
    // An extrapolated number with its approximate error.
    let limit = |Estimate { value, error }: Estimate| document! { value: value, error: error };
    let radius = curve.admittance.radius();
    let points = curve.response.points.iter().map(|point| {
        document! { hz: point.hz, magnitude_db: point.magnitude_db(), phase_deg: point.phase_deg(), ideal_db: curve.ideal_db(point.hz) }
    });
    let moment = curve.chance.as_ref().and_then(|chance| chance.as_ref().ok());
    document! {
        verdict: radius.verdict().word(),
        spectral_radius: radius.value,
        error_bound: radius.error,
        warning: curve.warning(),
        viscosity: limit(curve.fit.viscosity),
        inertia: limit(curve.fit.inertia),
        stiffness: limit(curve.fit.stiffness),
        object_mass_kg: curve.mass,
        points: points.collect::<Vec<_>>(),
        // Growth of the second moment per frame, if links have random parts and the second moment can be followed.
        #[serde(flatten)]
        moment: moment.map(|moment| document! {
            mean_square: document! { verdict: moment.verdict().word(), radius: moment.radius.value, error_bound: moment.radius.error },
        }),
        notes: curve.notes(),
    }
}
