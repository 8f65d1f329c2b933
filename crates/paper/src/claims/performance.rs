//! Claims about the admittance of the object: Figure 5 and the viscosity.

use super::regions::without_strategy;
use super::{Claim, Verdict};
use crate::Watch;
use crate::case::{Case, Mass, Strategy};
use crate::counter::smallest;
use crate::figures::admittance::{Fit, Responses};
use crate::page::percent;
use crate::{Options, PaperError};

pub(super) fn claims(responses: &Responses, _options: Options, watch: &dyn Watch) -> Result<Vec<Claim>, PaperError> {
    Ok(vec![less_viscous(responses, watch)?, law(responses), grows(responses), nearer(responses)])
}

/// Returns pairs of AP and PD fits of otherwise equal scenes. Both scenes must be stable, because nobody can feel a diverging scene; with two peers AP and
/// PD are the same.
fn pairs(responses: &Responses) -> impl Iterator<Item = (&Fit, &Fit)> {
    // The sweep makes AP and PD of each scene next to each other, so the two filtered lists have equal scenes at equal positions.
    let of = |strategy: Strategy| responses.fits.iter().filter(move |fit| fit.case.strategy == strategy);
    of(Strategy::Ap).zip(of(Strategy::Pd)).filter(|(ap, pd)| ap.case.peers > 2 && ap.is_stable && pd.is_stable)
}

/// Returns the viscosity of a case \[N·s/m\], or `None` for an unstable scene, whose viscosity nobody could feel.
fn felt(case: &Case) -> Result<Option<f64>, PaperError> {
    let admittance = cohaptic_stability::Admittance::of(&case.scene()?, 0)?;
    let stable = admittance.verdict() == cohaptic_stability::Verdict::Stable;
    Ok(stable.then(|| admittance.fit_low_frequency().viscosity.value))
}

fn less_viscous(responses: &Responses, watch: &dyn Watch) -> Result<Claim, PaperError> {
    let all: Vec<_> = pairs(responses).collect();
    let less = all.iter().filter(|(ap, pd)| ap.viscosity < pd.viscosity).count();
    let printed = |peers: usize| {
        let pair = all.iter().find(|(ap, _)| ap.case == Case { touching: 1, ..Case::paper(Strategy::Ap, peers) });
        pair.map_or_else(
            || format!("N = {peers}: one of the two is unstable"),
            |(ap, pd)| format!("N = {peers}: AP {:.1}, PD {:.1}", ap.viscosity, pd.viscosity),
        )
    };
    let ours = format!(
        "KT = 1000 N/m, 8 ms one way, one touching, in N·s/m: {}. AP's is the lower one in {less} of {} pairs of stable scenes (N up to 16, three delays, three gains).",
        [3, 4, 5].map(printed).join("; "),
        all.len()
    );
    // A difference below a millionth counts as equal.
    let found = smallest(watch, |case| {
        if case.peers < 3 || case.touching == 0 || case.mass == Mass::Whole && case.damping == 0.0 {
            return Ok(false);
        }
        Ok(felt(case)?.zip(felt(&case.with(Strategy::Pd))?).is_some_and(|(ap, pd)| ap > pd * (1.0 + 1e-6)))
    })?;
    let verdict = |place: String| if place.is_empty() { Verdict::Holds } else { Verdict::FailsAt(place) };
    // The search may find nothing although pairs of the sweep fail, because the sweep has other parameters.
    let place = match &found {
        Some(case) => without_strategy(case),
        None if less < all.len() => format!("{} of {} pairs of scenes", all.len() - less, all.len()),
        None => String::new(),
    };
    let claim = "AP renders less viscous dynamics than PD";
    let claim = Claim::new("less-viscous", claim, "Fig. 5; Section 5.2", ours, verdict(place));
    Ok(match found {
        None => claim,
        Some(case) => claim.with_scene(&case, "AP renders the more viscous object.".to_owned()),
    })
}

fn law(responses: &Responses) -> Claim {
    let worst = |strategy: Strategy, most: usize, law: fn(&Fit) -> f64| {
        let of = responses.fits.iter().filter(|fit| fit.is_stable && fit.case.strategy == strategy && fit.case.peers <= most);
        of.map(|fit| (law(fit) / fit.viscosity - 1.0).abs()).fold(0.0, f64::max)
    };
    let plain: fn(&Fit) -> f64 = |fit| fit.law;
    let whole: fn(&Fit) -> f64 = |fit| fit.law_with_damping;
    let of = |most, law| [worst(Strategy::Ap, most, law), worst(Strategy::Pd, most, law)];
    let (five, sixteen) = (of(5, plain), of(16, plain));
    let exact = of(16, whole);
    let ours = format!(
        "Largest error of the law in stable scenes up to N = 5: AP {}, PD {}; up to N = 16: {}, {}. With the part of the damping, N = 16 included: {}, {}.",
        percent(five[0]),
        percent(five[1]),
        percent(sixteen[0]),
        percent(sixteen[1]),
        percent(exact[0]),
        percent(exact[1])
    );
    let verdict = if five[0] < 0.05 && five[1] < 0.12 {
        Verdict::Holds
    } else {
        Verdict::FailsAt(format!("{} with AP, {} with PD", percent(five[0]), percent(five[1])))
    };
    let claim =
        "The viscosity comes from the delay: b = bH + σ·KT·(Td + (M−1)·Tc/2), σ = N for AP and N(N−1) for PD, within 5 % and 12 % up to N = 5";
    Claim::new("viscosity-law", claim, "no formula; “low packet update rate, delays … and the damping”", ours, verdict)
}

fn grows(responses: &Responses) -> Claim {
    let mut shrinks = Vec::new();
    let mut looked_at = 0_usize;
    for fit in responses.fits.iter().filter(|fit| fit.is_stable) {
        // The next larger number of peers in an otherwise equal scene; "all touch" is compared with "all touch".
        let like = |other: &&Fit| {
            let touches = (fit.case.touching == fit.case.peers) == (other.case.touching == other.case.peers);
            let same = Case { peers: fit.case.peers, touching: fit.case.touching, ..other.case } == fit.case;
            other.is_stable && other.case.peers > fit.case.peers && same && touches
        };
        if let Some(next) = responses.fits.iter().find(like) {
            looked_at += 1;
            if next.viscosity <= fit.viscosity {
                shrinks.push(next.case.words());
            }
        }
    }
    let of = |strategy| {
        let one = responses.fits.iter().filter(|fit| fit.case == Case { touching: 1, ..Case::paper(strategy, fit.case.peers) });
        one.map(|fit| format!("{:.0}{}", fit.viscosity, if fit.is_stable { "" } else { " (unstable)" })).collect::<Vec<_>>().join(", ")
    };
    let ours = format!(
        "N = 2, 3, 4, 5, 8, 16 with KT = 1000 N/m, 8 ms one way, one touching: AP {} N·s/m, PD {}. More peers render more in {} of {looked_at} steps between stable scenes.",
        of(Strategy::Ap),
        of(Strategy::Pd),
        looked_at - shrinks.len()
    );
    let verdict = shrinks.first().map_or(Verdict::Holds, |first| Verdict::FailsAt(first.clone()));
    Claim::new("damping-grows", "The damping rendered to users increases with the number of peers", "Fig. 5", ours, verdict)
}

fn nearer(responses: &Responses) -> Claim {
    let mut lines = Vec::new();
    let mut below = f64::INFINITY;
    let mut fails = false;
    let mut unstable = Vec::new();
    for (one, word) in [(true, "one touching"), (false, "all touching")] {
        for peers in [3, 4, 5] {
            let touching = if one { 1 } else { peers };
            let curve = |strategy| responses.curve(strategy, peers, touching);
            let Some((ap, pd)) = curve(Strategy::Ap).zip(curve(Strategy::Pd)) else { continue };
            unstable.extend(
                [ap, pd].into_iter().filter(|curve| !curve.is_stable).map(|curve| format!("{} N = {peers}, {word}", curve.case.strategy.word())),
            );
            let nearer: Vec<bool> = ap.distances.iter().zip(&pd.distances).map(|(ap, pd)| ap < pd).collect();
            let count = nearer.iter().filter(|nearer| **nearer).count();
            let first = nearer.iter().position(|nearer| !nearer).and_then(|first| responses.frequencies.get(first));
            let until = first.map_or_else(String::new, |hz| format!(", at all below {hz:.2} Hz"));
            if let Some(hz) = first {
                fails = true;
                below = below.min(*hz);
            }
            lines.push(format!("N = {peers}, {word}: at {} of frequencies{until}", percent(crate::region::share(count, nearer.len()))));
        }
    }
    let of = |strategy, peers| {
        let curve = responses.curve(strategy, peers, 1).and_then(|curve| curve.decibels.first().copied());
        curve.map_or_else(String::new, |decibels| format!("{decibels:.2} dB"))
    };
    let ours = format!(
        "Distance |ln(Y/Y0)| from the ideal 0.45 kg, 0.01 to 40 Hz; AP is the nearer one: {}. At 0.01 Hz, one touching: N = 2 {}, AP N = 3 {}, PD N = 3 {}, ideal {:.2} dB: both are far from a mass there, \
         a damper. Curves of unstable scenes, which nobody could measure: {}.",
        lines.join("; "),
        of(Strategy::Ap, 2),
        of(Strategy::Ap, 3),
        of(Strategy::Pd, 3),
        responses.ideal().first().copied().unwrap_or(f64::NAN),
        if unstable.is_empty() { "none".to_owned() } else { unstable.join("; ") }
    );
    let verdict = if fails { Verdict::HoldsWhere(format!("the frequency is below {below:.2} Hz")) } else { Verdict::Holds };
    Claim::new("nearer-to-mass", "AP's admittance is closer to that of a pure mass than PD's", "Fig. 5", ours, verdict)
}
