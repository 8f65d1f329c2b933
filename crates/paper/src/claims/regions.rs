//! Claims about stability regions: Figures 3 and 4.

use super::{Claim, Verdict};
use crate::case::{Case, Strategy};
use crate::counter::{is_stable, is_unstable, one_more_peer, smallest};
use crate::page::{percent, percents};
use crate::region::{Atlas, PEERS, Setting};
use crate::{PaperError, Watch};

/// Relative change of the area, compared with two peers, up to which the area counts as "largely unaffected".
const UNAFFECTED: f64 = 0.2;

pub(super) fn claims(atlas: &Atlas, watch: &dyn Watch) -> Result<Vec<Claim>, PaperError> {
    let mut claims = vec![larger(atlas), contains(atlas, watch)?];
    claims.extend(unaffected(atlas, watch)?);
    claims.push(decreases(atlas, watch)?);
    Ok(claims)
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

fn larger(atlas: &Atlas) -> Claim {
    let (holds, fails) = split(|setting| {
        let (ap, pd) = (atlas.areas(setting, Strategy::Ap), atlas.areas(setting, Strategy::Pd));
        ap.iter().zip(&pd).zip(PEERS).all(|((ap, pd), peers)| peers == 2 || ap > pd)
    });
    let line = |setting: Setting| {
        let (ap, pd) = (atlas.areas(setting, Strategy::Ap), atlas.areas(setting, Strategy::Pd));
        format!("{}: AP {}, PD {}", setting.words(), percents(&ap), percents(&pd))
    };
    let lines: Vec<String> = Setting::all().into_iter().map(line).collect();
    let ours = format!("Stable share of 0..6000 N/m × 0..6000 N/m for N = 2, 3, 4, 5, 8. {}.", lines.join(". "));
    let claim = "AP increases the stability region compared with PD";
    Claim::new("region-larger", claim, "Figs. 3, 4", ours, verdict(&holds, &fails))
}

/// Returns whether PD is clearly stable and AP clearly unstable: a point of PD's region outside AP's.
fn only_pd_is_stable(case: &Case) -> Result<bool, PaperError> {
    Ok(case.peers > 2 && is_stable(&case.with(Strategy::Pd))? && is_unstable(case)?)
}

fn contains(atlas: &Atlas, watch: &dyn Watch) -> Result<Claim, PaperError> {
    let most = |setting: Setting| PEERS.map(|peers| atlas.only_pd(setting, peers)).into_iter().fold(0.0, f64::max);
    let (inside, outside) = split(|setting| most(setting) == 0.0);
    let shares: Vec<String> = outside.iter().map(|setting| format!("up to {} ({})", percent(most(*setting)), setting.words())).collect();
    let shares = if shares.is_empty() { "none".to_owned() } else { shares.join("; ") };
    let found = smallest(watch, only_pd_is_stable)?;
    // Section 5 without arms: two of three peers touching, and 48 ms read as a round trip.
    let section_5 = Case { delay_us: 24_000, touching: 2, ..Case::paper(Strategy::Ap, 3) };
    let ours = format!(
        "Of the square of Figs. 3 and 4, all touching, stable with PD and not with AP: {shares}. In Section 5, two of three touching without arms, 24 ms one way, KT = 1000 N/m: \
         AP ρ = {:.4}, PD ρ = {:.4}.",
        section_5.radius()?.value,
        section_5.with(Strategy::Pd).radius()?.value
    );
    let claim = "Gains that are stable with PD are stable with AP: AP's region contains PD's";
    let claim = |verdict| Claim::new("region-contains", claim, "Figs. 3, 4; “can keep … stable for stiffer coordination”", ours, verdict);
    Ok(match found {
        None if outside.is_empty() => claim(Verdict::Holds),
        None => claim(Verdict::HoldsWhere(list(&inside))),
        Some(case) => {
            let radii = format!("AP ρ = {:.4}, PD ρ = {:.4}", case.radius()?.value, case.with(Strategy::Pd).radius()?.value);
            let place = format!("{}: {radii}", without_strategy(&case));
            let how = format!("Run it as it is and with --against coordination.strategy=proportional-derivative. {radii} over a frame of 8 ms.");
            claim(Verdict::FailsAt(place)).with_scene(&case, how)
        }
    })
}

/// Describes a case without its strategy, for statements about both strategies.
pub(super) fn without_strategy(case: &Case) -> String {
    let words = case.words();
    words.strip_prefix("AP, ").or_else(|| words.strip_prefix("PD, ")).unwrap_or(&words).to_owned()
}

fn unaffected(atlas: &Atlas, watch: &dyn Watch) -> Result<Vec<Claim>, PaperError> {
    // The change of largest size, with its sign.
    let change = |setting: Setting, strategy: Strategy| {
        let areas = atlas.areas(setting, strategy);
        let two = areas.first().copied().unwrap_or(f64::NAN);
        areas.iter().map(|area| area / two - 1.0).fold(0.0, |most: f64, change| if change.abs() > most.abs() { change } else { most })
    };
    let (holds, fails) = split(|setting| change(setting, Strategy::Ap).abs() <= UNAFFECTED);
    let line = |setting: Setting| format!("{}: {:+.0} %", setting.words(), 100.0 * change(setting, Strategy::Ap));
    let lines: Vec<String> = Setting::all().into_iter().map(line).collect();
    let ours = format!(
        "Largest change of AP's area from that of N = 2, up to N = 8; at most {:.0} % counts as unaffected. {}.",
        100.0 * UNAFFECTED,
        lines.join(". ")
    );
    let claim = "AP's stability region is largely unaffected by N, whatever the damping";
    let areas = Claim::new("ap-unaffected", claim, "Figs. 3, 4", ours, verdict(&holds, &fails));
    let one_more = smallest(watch, |case| Ok(is_stable(case)? && is_unstable(&one_more_peer(case))?))?;
    let areas = match one_more {
        None => areas,
        Some(case) => {
            let more = one_more_peer(&case);
            let radii = format!("ρ = {:.4}, and {:.4} with N = {}", case.radius()?.value, more.radius()?.value, more.peers);
            let how = format!(
                "The simplest scene found in which one peer more makes AP unstable: {radii}. Run it as it is and with --set scene.count={}.",
                more.peers
            );
            areas.with_scene(&case, how)
        }
    };
    Ok(vec![areas])
}

fn decreases(atlas: &Atlas, watch: &dyn Watch) -> Result<Claim, PaperError> {
    let (holds, fails) = split(|setting| atlas.areas(setting, Strategy::Pd).windows(2).all(|pair| pair[1] < pair[0]));
    let line = |setting: Setting| format!("{}: {}", setting.words(), percents(&atlas.areas(setting, Strategy::Pd)));
    let lines: Vec<String> = Setting::all().into_iter().map(line).collect();
    let ours = format!("PD's stable share for N = 2, 3, 4, 5, 8. {}.", lines.join(". "));
    let found = smallest(watch, |case| {
        let pd = case.with(Strategy::Pd);
        Ok(is_unstable(&pd)? && is_stable(&one_more_peer(&pd))?)
    })?;
    let claim = Claim::new("pd-decreases", "PD's stability region decreases as N grows", "Figs. 3, 4", ours, verdict(&holds, &fails));
    Ok(match found {
        None => claim,
        Some(case) => {
            let (pd, more) = (case.with(Strategy::Pd), one_more_peer(&case.with(Strategy::Pd)));
            let radii = format!("ρ = {:.4}, and {:.4} with N = {}", pd.radius()?.value, more.radius()?.value, more.peers);
            let how = format!(
                "The simplest scene found in which one peer more makes PD stable: {radii}. Run it as it is and with --set scene.count={}.",
                more.peers
            );
            claim.with_scene(&pd, how)
        }
    })
}
