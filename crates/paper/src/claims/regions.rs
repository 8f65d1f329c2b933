//! Claims about stability regions: Figures 3 and 4.

use super::{Claim, Topic, Verdict, WITH_PD};
use crate::case::{Case, Strategy};
use crate::counter::{is_stable, is_unstable, one_more_peer, smallest};
use crate::region::{Atlas, PEERS, Setting};
use crate::table::{Table, cell, percent};
use crate::{PaperError, Watch};

/// Relative change of the area, compared with two peers, up to which the area counts as "largely unaffected".
const UNAFFECTED: f64 = 0.2;

/// Figures with the regions.
const FIGURES: [&str; 2] = ["fig-3", "fig-4"];

pub(super) fn claims(atlas: &Atlas, watch: &dyn Watch) -> Result<Vec<Claim>, PaperError> {
    Ok(vec![larger(atlas), contains(atlas, watch)?, unaffected(atlas, watch)?, decreases(atlas, watch)?])
}

/// Joins settings in words.
fn list(settings: &[Setting]) -> String {
    settings.iter().map(Setting::words).collect::<Vec<_>>().join("; ")
}

/// Divides all settings into those with `holds` true and those with `holds` false.
fn split(holds: impl Fn(Setting) -> bool) -> (Vec<Setting>, Vec<Setting>) {
    Setting::all().into_iter().partition(|setting| holds(*setting))
}

fn verdict(holds: &[Setting], fails: &[Setting]) -> Verdict {
    if fails.is_empty() {
        Verdict::Holds
    } else if holds.is_empty() {
        Verdict::FailsAt(format!("each of the {} readings of the figures", fails.len()))
    } else {
        Verdict::HoldsWhere(list(holds))
    }
}

/// Returns a table per damping, with a row per number of peers and a column per reading of the figures. `number` gives a cell of a reading, given the index in
/// [`PEERS`].
fn by_reading(what: &str, number: impl Fn(Setting, usize) -> String) -> Vec<Table> {
    let all = Setting::all();
    let of_damping = |settings: &[Setting]| {
        let damping = settings.first().map_or(0.0, |setting| setting.damping);
        // The settings of a damping come in pairs of equal masses.
        let groups = settings.chunks(2).filter_map(|pair| Some((pair.first()?.mass.words(), pair.len())));
        let delays: Vec<String> = settings.iter().map(|setting| format!("{} ms", setting.delay_us / 1000)).collect();
        let head: Vec<&str> = std::iter::once("N").chain(delays.iter().map(String::as_str)).collect();
        Table::new(format!("{what}, BT = BC = {damping} N·s/m"), &head).grouped(std::iter::once(("", 1)).chain(groups)).all(
            PEERS.iter().enumerate().map(|(place, peers)| {
                std::iter::once(peers.to_string()).chain(settings.iter().map(|setting| number(*setting, place))).collect::<Vec<_>>()
            }),
        )
    };
    // The damping changes slowest in the list of settings, so each half has a single damping.
    all.chunks(all.len() / 2).map(of_damping).collect()
}

fn larger(atlas: &Atlas) -> Claim {
    let areas = |setting: Setting| (atlas.areas(setting, Strategy::Ap), atlas.areas(setting, Strategy::Pd));
    // With two peers the strategies are the same.
    let is_larger = |ap: f64, pd: f64, peers: usize| peers == 2 || ap > pd;
    let (holds, fails) = split(|setting| {
        let (ap, pd) = areas(setting);
        ap.iter().zip(&pd).zip(PEERS).all(|((ap, pd), peers)| is_larger(*ap, *pd, peers))
    });
    let all = Setting::all();
    let table = |pair: &[Setting]| {
        let Some(Setting { damping, mass, .. }) = pair.first() else { return Table::default() };
        let delays: Vec<String> = pair.iter().map(|setting| format!("{} ms one way", setting.delay_us / 1000)).collect();
        let strategies = pair.iter().flat_map(|_| Strategy::BOTH.map(Strategy::word));
        let head: Vec<&str> = std::iter::once("N").chain(strategies).collect();
        Table::new(format!("Stable share of the square [%], BT = BC = {damping} N·s/m, {}", mass.words()), &head)
            .grouped(std::iter::once(("", 1)).chain(delays.iter().map(|delay| (delay.as_str(), 2))))
            .all(PEERS.iter().enumerate().map(|(place, peers)| {
                let cells = pair.iter().flat_map(|setting| {
                    let (ap, pd) = areas(*setting);
                    let number = |areas: &[f64]| 100.0 * areas.get(place).copied().unwrap_or(f64::NAN);
                    let (ap, pd) = (number(&ap), number(&pd));
                    [cell(format!("{ap:.1}"), !is_larger(ap, pd, *peers)), format!("{pd:.1}")]
                });
                std::iter::once(peers.to_string()).chain(cells).collect::<Vec<_>>()
            }))
    };
    // A map of a failing reading says more than a map of a further agreement.
    let shown = fails.first().or_else(|| holds.first()).copied();
    let claim = Claim {
        claim: "AP increases the stability region compared with PD",
        short: "more gains are stable with AP than with PD",
        paper: "Figs. 3, 4",
        says: "AP has the larger stability region, with and without damping: PD is drawn for up to five users, AP for up to eight.",
        ours: format!(
            "AP's region is the larger one for each of N = 3, 4, 5 and 8 in {} of the {} readings of the figures. The square is 0 to 6000 N/m of KT and of KC; all users touch.",
            holds.len(),
            all.len()
        ),
        // The settings of a pair differ in the delay alone.
        tables: all.chunks(2).map(table).collect(),
        figures: &FIGURES,
        why: "The paper prints no areas, and does not say which mass a copy has in the figures, nor whether 8 ms are one way. PD has N−1 springs and dampers per copy: it is the \
              stiffer and the more damped coordination at the same KT and BT.",
        verdict: verdict(&holds, &fails),
        ..Claim::blank("region-larger", Topic::Regions)
    };
    let scene = shown.map_or_else(String::new, |setting| setting.case(Strategy::Ap, 8).text());
    let how = if fails.is_empty() {
        "A map of the gains that are stable for eight users, with AP and with PD."
    } else {
        "A map of the gains that are stable for eight users, with AP and with PD, for the first reading in which the claim fails."
    };
    let map = "stability map FILE --x coordination.stiffness=100..5900 --y peer.coupling.stiffness=100..5900 --grid 30x30 --curve \
               coordination.strategy=proportional-derivative";
    claim.shown_by(scene, how, &[map])
}

/// Returns whether a case with AP and more than two peers is clearly unstable, and the same case with PD clearly stable: a point of PD's region outside AP's.
fn only_pd_is_stable(case: &Case) -> Result<bool, PaperError> {
    Ok(case.peers > 2 && is_stable(&case.with(Strategy::Pd))? && is_unstable(case)?)
}

fn contains(atlas: &Atlas, watch: &dyn Watch) -> Result<Claim, PaperError> {
    let most = |setting: Setting| PEERS.map(|peers| atlas.only_pd(setting, peers)).into_iter().fold(0.0, f64::max);
    // The claim is about every point, so a single cell outside is enough to contradict.
    let (inside, outside) = split(|setting| most(setting) == 0.0);
    let found = smallest(watch, only_pd_is_stable)?;
    // Section 5 without arms: two of three peers touching, and 48 ms read as a round trip.
    let section_5 = Case { delay_us: 24_000, touching: 2, ..Case::paper(Strategy::Ap, 3) };
    let ours = format!(
        "Up to {} of the square of Figs. 3 and 4 is stable with PD and not with AP, depending on the reading. In Section 5 without arms, at KT = 1000 N/m and 24 ms one way, AP \
         has ρ = {:.4} and PD ρ = {:.4}.",
        percent(Setting::all().into_iter().map(most).fold(0.0, f64::max)),
        section_5.radius()?.value,
        section_5.with(Strategy::Pd).radius()?.value
    );
    let tables = by_reading("Stable with PD and not with AP [% of the square]", |setting, place| {
        let share = atlas.only_pd(setting, PEERS[place]);
        cell(format!("{:.1}", 100.0 * share), share > 0.0)
    });
    let radii = match &found {
        Some(case) => format!("AP has ρ = {:.4}, PD ρ = {:.4}", case.radius()?.value, case.with(Strategy::Pd).radius()?.value),
        None => String::new(),
    };
    let verdict = match &found {
        None if outside.is_empty() => Verdict::Holds,
        // The maps may show cells outside even if the search finds nothing.
        None => Verdict::HoldsWhere(list(&inside)),
        Some(case) => Verdict::FailsAt(format!("{}: {radii}", without_strategy(case))),
    };
    let claim = Claim {
        claim: "Gains that are stable with PD are stable with AP: AP's region contains PD's",
        short: "AP is stable wherever PD is",
        paper: "Figs. 3, 4",
        says: "AP can keep the cooperation stable for stiffer coordination than PD.",
        ours,
        tables,
        figures: &FIGURES,
        why: "The paper compares how large the regions are, and does not ask whether one lies within the other. KT stands for two stiffnesses: a copy is held by KT with AP and by \
              (N−1)·KT with PD.",
        verdict,
        ..Claim::blank("region-contains", Topic::Regions)
    };
    let (case, how) = match found {
        Some(case) => (case, format!("The simplest scene found: {radii}. Below 1 a disturbance dies out.")),
        None => (section_5, "A scene in which both can be compared.".to_owned()),
    };
    Ok(claim.shown_by(case.text(), how, &["stability point FILE", &format!("stability point FILE {WITH_PD}")]))
}

/// Describes a case without its strategy, for statements about both strategies.
pub(super) fn without_strategy(case: &Case) -> String {
    let words = case.words();
    words.strip_prefix("AP, ").or_else(|| words.strip_prefix("PD, ")).unwrap_or(&words).to_owned()
}

/// Returns a claim with the scene in which one peer more changes the verdict; `fallback` if the search has found no such scene.
fn with_one_more(claim: Claim, found: Option<Case>, fallback: Case, becomes: &str) -> Result<Claim, PaperError> {
    let case = found.unwrap_or(fallback);
    let more = one_more_peer(&case);
    let radii = format!("ρ = {:.4}, and {:.4} with N = {}", case.radius()?.value, more.radius()?.value, more.peers);
    let how = match found {
        Some(_) => format!("The simplest scene found in which one user more makes {} {becomes}: {radii}.", case.strategy.word()),
        None => format!("A scene and the same with one user more: {radii}."),
    };
    Ok(claim.shown_by(case.text(), how, &["stability point FILE", &format!("stability point FILE --set scene.count={}", more.peers)]))
}

fn unaffected(atlas: &Atlas, watch: &dyn Watch) -> Result<Claim, PaperError> {
    let change = |setting: Setting, place: usize| {
        let areas = atlas.areas(setting, Strategy::Ap);
        // A missing area becomes NaN, and NaN never counts as unaffected.
        areas.get(place).zip(areas.first()).map_or(f64::NAN, |(area, two)| area / two - 1.0)
    };
    let is_unaffected = |setting: Setting, place: usize| change(setting, place).abs() <= UNAFFECTED;
    let (holds, fails) = split(|setting| (0..PEERS.len()).all(|place| is_unaffected(setting, place)));
    let tables = by_reading("AP's region compared with that of N = 2 [%]", |setting, place| {
        cell(format!("{:+.0}", 100.0 * change(setting, place)), !is_unaffected(setting, place))
    });
    let all = Setting::all().into_iter().flat_map(|setting| (0..PEERS.len()).map(move |place| change(setting, place)));
    let claim = Claim {
        claim: "AP's stability region is largely unaffected by N, whatever the damping",
        short: "the number of users hardly changes which gains are stable with AP",
        paper: "Section 3, Figs. 3, 4",
        says: "AP maintains the stability region largely unaffected by the number of users, regardless of damping.",
        ours: format!(
            "Compared with N = 2 the area changes by {:+.0} to {:+.0} %. Counting changes up to {:.0} % as unaffected, the claim holds in {} of the {} readings.",
            100.0 * all.clone().fold(0.0, f64::min),
            100.0 * all.fold(0.0, f64::max),
            100.0 * UNAFFECTED,
            holds.len(),
            holds.len() + fails.len()
        ),
        tables,
        figures: &FIGURES,
        why: "N changes two things at once: the mass of a copy, mO/N, and the stiffness N/(N−1)·KT. Without damping, copies of mO/N get lighter with each user and the region \
              shrinks; copies that have the whole mass each keep it, and the region grows.",
        verdict: verdict(&holds, &fails),
        ..Claim::blank("ap-unaffected", Topic::Regions)
    };
    // Clear verdicts only, so that rounding cannot make a counterexample.
    let found = smallest(watch, |case| Ok(is_stable(case)? && is_unstable(&one_more_peer(case))?))?;
    with_one_more(claim, found, Case::paper(Strategy::Ap, 3), "unstable")
}

fn decreases(atlas: &Atlas, watch: &dyn Watch) -> Result<Claim, PaperError> {
    let areas = |setting: Setting| atlas.areas(setting, Strategy::Pd);
    let falls = |areas: &[f64], place: usize| place == 0 || areas[place] < areas[place - 1];
    let (holds, fails) = split(|setting| {
        let areas = areas(setting);
        (0..areas.len()).all(|place| falls(&areas, place))
    });
    let tables = by_reading("PD's stable share of the square [%]", |setting, place| {
        let areas = areas(setting);
        cell(format!("{:.1}", 100.0 * areas[place]), !falls(&areas, place))
    });
    let found = smallest(watch, |case| {
        let pd = case.with(Strategy::Pd);
        Ok(is_unstable(&pd)? && is_stable(&one_more_peer(&pd))?)
    })?;
    let claim = Claim {
        claim: "PD's stability region decreases as N grows",
        short: "each user more leaves fewer gains stable with PD",
        paper: "Section 3, Figs. 3, 4",
        says: "PD's stability region decreases as the number of peers grows.",
        ours: format!("PD's region gets smaller at each step of N in {} of the {} readings.", holds.len(), holds.len() + fails.len()),
        tables,
        figures: &FIGURES,
        why: "PD's damping adds up with N as its stiffness does, to (N−1)·BT beside (N−1)·KT, and copies of mO/N get lighter. Which of these counts for more depends on the gains.",
        verdict: verdict(&holds, &fails),
        ..Claim::blank("pd-decreases", Topic::Regions)
    };
    with_one_more(claim, found.map(|case| case.with(Strategy::Pd)), Case::paper(Strategy::Pd, 3), "stable")
}
