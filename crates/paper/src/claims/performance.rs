//! Claims about the admittance of the object: Figure 5 and the viscosity.

use super::regions::without_strategy;
use super::{Claim, Topic, Verdict};
use crate::Watch;
use crate::case::{Case, Mass, Strategy};
use crate::counter::smallest;
use crate::figures::admittance::{Fit, Responses};
use crate::table::{Table, cell, percent};
use crate::{Options, PaperError};

pub(super) fn claims(responses: &Responses, _options: Options, watch: &dyn Watch) -> Result<Vec<Claim>, PaperError> {
    Ok(vec![less_viscous(responses, watch)?, law(responses), grows(responses), nearer(responses)])
}

/// Numbers of peers in the tables of viscosities.
const PEERS: [usize; 6] = [2, 3, 4, 5, 8, 16];

/// Returns the scene of Figure 5 with one user touching.
const fn of_figure_5(strategy: Strategy, peers: usize) -> Case {
    Case { touching: 1, ..Case::paper(strategy, peers) }
}

/// Returns the viscosities in the scenes of Figure 5, with a row per number of peers of `peers`.
fn viscosities(responses: &Responses, peers: &[usize], fails: impl Fn(&Fit, &Fit) -> bool) -> Table {
    let of = |strategy, peers| responses.fits.iter().find(|fit| fit.case == of_figure_5(strategy, peers));
    let number = |fit: &Fit| format!("{:.1}{}", fit.viscosity, if fit.is_stable { "" } else { " (unstable)" });
    let row = |peers: &usize| {
        let (ap, pd) = (of(Strategy::Ap, *peers)?, of(Strategy::Pd, *peers)?);
        Some(vec![peers.to_string(), cell(number(ap), fails(ap, pd)), number(pd)])
    };
    Table::new("Viscosity that a slow hand feels [N·s/m], KT = 1000 N/m, 8 ms one way, one user touching", &["N", "AP", "PD"])
        .all(peers.iter().filter_map(row))
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
    // A difference below a millionth counts as equal.
    let found = smallest(watch, |case| {
        // With two peers the strategies are the same, and without a touch nobody feels the object.
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
    let is_felt = |ap: &Fit, pd: &Fit| ap.is_stable && pd.is_stable;
    let table = viscosities(responses, &PEERS[1..], |ap, pd| is_felt(ap, pd) && ap.viscosity >= pd.viscosity);
    let claim = Claim {
        claim: "AP renders less viscous dynamics than PD",
        short: "a slowly moved object feels less viscous with AP than with PD",
        paper: "Fig. 5; Section 5.2",
        says: "AP injects less damping into the loop, so the object that users feel is less viscous.",
        ours: format!(
            "AP's viscosity is the lower one in {less} of {} pairs of scenes that are stable with both: up to 16 users, three delays, three gains, one or all touching.",
            all.len()
        ),
        tables: vec![table],
        verdict: verdict(place),
        ..Claim::blank("less-viscous", Topic::Feel)
    };
    let how = if found.is_some() {
        "The simplest scene found in which AP's object is the more viscous one."
    } else {
        "Three users, one of whom touches the object."
    };
    let case = found.unwrap_or_else(|| of_figure_5(Strategy::Ap, 3));
    Ok(claim.shown_by(case.text(), how, &FELT))
}

/// Commands that compare what the first user feels with AP and with PD.
const FELT: [&str; 2] =
    ["admittance FILE --peer peer1 --at 0.1", "admittance FILE --peer peer1 --at 0.1 --set coordination.strategy=proportional-derivative"];

fn law(responses: &Responses) -> Claim {
    let worst = |strategy: Strategy, most: usize, law: fn(&Fit) -> f64| {
        let of = responses.fits.iter().filter(|fit| fit.is_stable && fit.case.strategy == strategy && fit.case.peers <= most);
        of.map(|fit| (law(fit) / fit.viscosity - 1.0).abs()).fold(0.0, f64::max)
    };
    let plain: fn(&Fit) -> f64 = |fit| fit.law;
    let whole: fn(&Fit) -> f64 = |fit| fit.law_with_damping;
    let of = |most, law| [worst(Strategy::Ap, most, law), worst(Strategy::Pd, most, law)];
    let five = of(5, plain);
    let rows = [("the law, N to 5", five), ("the law, N to 16", of(16, plain)), ("with the part of BT, N to 16", of(16, whole))];
    let table = Table::new("Largest error of the law in stable scenes", &["", "AP", "PD"])
        .all(rows.into_iter().map(|(name, [ap, pd])| vec![name.to_owned(), percent(ap), percent(pd)]));
    // The bounds of the claim's sentence: 5 % for AP and 12 % for PD.
    let verdict = if five[0] < 0.05 && five[1] < 0.12 {
        Verdict::Holds
    } else {
        Verdict::FailsAt(format!("{} with AP, {} with PD", percent(five[0]), percent(five[1])))
    };
    let claim = Claim {
        claim: "The viscosity comes from the delay: b = bH + σ·KT·(Td + (M−1)·Tc/2), σ = N for AP and N(N−1) for PD, within 5 % and 12 % up to N = 5",
        short: "the viscosity follows from the delay by a formula",
        is_own: true,
        paper: "no formula there",
        says: "The object is viscous due to the low packet update rate, the delays, and the damping of the coordination.",
        ours:
            "bH is the damping of all devices that touch, Td the delay one way, Tc the tick, and M the number of ticks from one sample to the next."
                .to_owned(),
        tables: vec![table],
        verdict,
        ..Claim::blank("viscosity-law", Topic::Feel)
    };
    claim.shown_by(of_figure_5(Strategy::Ap, 3).text(), "The law gives 39.5 N·s/m for AP: 5 + 3·1000·(0.008 + 0.0035).", &FELT[..1])
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
        // The sweep lists numbers of peers in ascending order, so the first match is the next number.
        if let Some(next) = responses.fits.iter().find(like) {
            looked_at += 1;
            if next.viscosity <= fit.viscosity {
                shrinks.push(next.case.words());
            }
        }
    }
    let claim = Claim {
        claim: "The damping rendered to users increases with the number of peers",
        short: "each user more makes the object feel more viscous",
        paper: "Fig. 5",
        says: "Damping of the object increases with peer count, since each link introduces additional damping.",
        ours: format!("More users feel more viscosity in {} of {looked_at} steps of N between stable scenes.", looked_at - shrinks.len()),
        tables: vec![viscosities(responses, &PEERS, |_, _| false)],
        verdict: shrinks.first().map_or(Verdict::Holds, |first| Verdict::FailsAt(first.clone())),
        ..Claim::blank("damping-grows", Topic::Feel)
    };
    let commands = [FELT[0], "admittance FILE --peer peer1 --at 0.1 --set scene.count=4"];
    claim.shown_by(of_figure_5(Strategy::Ap, 3).text(), "Three users, and four.", &commands)
}

fn nearer(responses: &Responses) -> Claim {
    let mut below = f64::INFINITY;
    let mut rows = Vec::new();
    for peers in [3, 4, 5] {
        let mut row = vec![peers.to_string()];
        for touching in [1, peers] {
            let curve = |strategy| responses.curve(strategy, peers, touching);
            let Some((ap, pd)) = curve(Strategy::Ap).zip(curve(Strategy::Pd)) else { continue };
            let nearer: Vec<bool> = ap.distances.iter().zip(&pd.distances).map(|(ap, pd)| ap < pd).collect();
            let count = nearer.iter().filter(|nearer| **nearer).count();
            // The claim holds up to the first frequency at which PD is nearer.
            let first = nearer.iter().position(|nearer| !nearer).and_then(|first| responses.frequencies.get(first)).copied();
            below = below.min(first.unwrap_or(f64::INFINITY));
            let unstable: Vec<&str> = [ap, pd].into_iter().filter(|curve| !curve.is_stable).map(|curve| curve.case.strategy.word()).collect();
            row.push(cell(percent(crate::region::share(count, nearer.len())), first.is_some()));
            row.push(first.map_or_else(|| "all".to_owned(), |hz| format!("{hz:.2} Hz")));
            row.push(if unstable.is_empty() { "none".to_owned() } else { unstable.join(", ") });
        }
        rows.push(row);
    }
    let first = |strategy, peers| responses.curve(strategy, peers, 1).and_then(|curve| curve.decibels.first().copied()).unwrap_or(f64::NAN);
    let decibels = Table::new("Admittance at 0.01 Hz [dB re 1 m/(N·s)], one user touching; a free mass has the ideal", &["N", "AP", "PD", "ideal"])
        .all([2, 3, 4, 5].map(|peers| {
            let ideal = responses.ideal().first().copied().unwrap_or(f64::NAN);
            // With two peers the strategies are the same, and only AP was computed.
            let pd = first(if peers == 2 { Strategy::Ap } else { Strategy::Pd }, peers);
            vec![peers.to_string(), format!("{:.2}", first(Strategy::Ap, peers)), format!("{pd:.2}"), format!("{ideal:.2}")]
        }));
    let head = ["N", "of frequencies", "always below", "unstable", "of frequencies", "always below", "unstable"];
    let table = Table::new("Where AP is the nearer one, of the frequencies from 0.01 to 40 Hz", &head)
        .grouped([("", 1), ("one user touching", 3), ("all touching", 3)])
        .all(rows);
    let claim = Claim {
        claim: "AP's admittance is closer to that of a pure mass than PD's",
        short: "AP's object feels more like a pure mass than PD's",
        paper: "Fig. 5",
        says: "AP's admittance is closer to that of a pure mass than PD's.",
        ours: "AP is the nearer one at low frequencies. Nearness is the distance |ln(Y/Y0)| from the admittance Y0 of 0.45 kg. Both are far from a mass at low frequencies, where \
               a hand feels a damper. Nobody could measure the curves of unstable scenes."
            .to_owned(),
        tables: vec![table, decibels],
        figures: &["fig-5"],
        why: "The paper judges by its curves, which leave open the device and the coupling. At high frequencies these two are felt in place of the object.",
        verdict: if below.is_finite() { Verdict::HoldsWhere(format!("the frequency is below {below:.2} Hz")) } else { Verdict::Holds },
        ..Claim::blank("nearer-to-mass", Topic::Feel)
    };
    let bode = "admittance FILE --peer peer1 --to 40 --curve coordination.strategy=proportional-derivative --out admittance";
    claim.shown_by(of_figure_5(Strategy::Ap, 3).text(), "Draws both curves for three users, one of whom touches the object.", &[bode])
}
