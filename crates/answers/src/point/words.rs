//! The text about a verdict.

use cohaptic_proofs::{SceneWorstCase, WorstVerdict};
use cohaptic_scene::Scene;
use cohaptic_stability::{Analysis, ContactMode, Judgement, Method, Part, PartKind, Radius, Verdict, VerdictKind, nominal_head};
use cohaptic_units::print::Span;

use super::{speed, worst_mode};
use crate::{figure, notes};

/// Greatest number of listed modes of contact. The worst mode is always listed.
const MOST_MODES: usize = 16;

/// Returns the text about a verdict. `worst`: the worst case over the network, if requested.
#[must_use]
pub fn words(scene: &Scene, judgement: &Judgement, worst: Option<&SceneWorstCase>) -> String {
    let Judgement { verdict, analysis, mean_square, left_out } = judgement;
    let sentence = sentence(*verdict, mean_square.is_some());
    // A nominal verdict must not stand alone: the head tells the parts of the links left out.
    let mut text = match judgement.kind() {
        VerdictKind::Nominal => format!("{}\n\n{}: {sentence}\n", scene.title, nominal_head(left_out).replacen('n', "N", 1)),
        VerdictKind::Certain | VerdictKind::MeanSquare => format!("{}\n\n{sentence}\n", scene.title),
    };
    let mut line = |line: String| text.push_str(&format!("  {line}\n"));
    if let Some(mean_square) = mean_square {
        line(format!("mean-square radius {} over a frame of {}", number(mean_square.radius), Span(mean_square.frame)));
        // Both verdicts are given, because a scene may be stable at the mean of the delays and unstable in the mean square.
        line(format!("with delays at their mean and no losses: {}", analysis.verdict().word()));
    }
    line(format!("spectral radius {} over a frame of {}", number(analysis.radius), Span(analysis.frame)));
    line(speed::words(analysis));
    let rigid = match analysis.rigid_modes {
        0 => "no rigid-body mode to remove".to_owned(),
        1 => "1 rigid-body mode removed".to_owned(),
        count => format!("{count} rigid-body modes removed"),
    };
    let states = if analysis.dimension == 1 { "state" } else { "states" };
    let way =
        if scene.rotation.is_some() && analysis.method == Method::Full { "full (the whole state, linearised)" } else { method(analysis.method) };
    line(format!("{} {states}, {rigid}; method: {way}", analysis.dimension));
    if analysis.modes.len() > 1 {
        modes(analysis, &mut line);
    }
    // A mode of a single part has nothing to list.
    if let Some(mode) = worst_mode(analysis).filter(|mode| mode.parts.len() > 1) {
        line(String::new());
        let of_mode = [mode.motion.as_str(), mode.contacts.as_str()].into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(", ");
        line(if of_mode.is_empty() { "parts that do not mix".to_owned() } else { format!("parts that do not mix, {of_mode}") });
        for part in &mode.parts {
            line(format!("  {:<44}{:>4} states, {:>4} times  {}", name(scene, part), part.size, part.copies, number(part.radius)));
        }
    }
    let notes = notes(judgement);
    if let Some(worst) = worst {
        worst_case(worst, &notes, &mut line);
    }
    if !notes.is_empty() {
        line(String::new());
        notes.iter().for_each(|note| line(format!("note: {note}")));
    }
    // Empty lines lose their indentation.
    text.replace("\n  \n", "\n\n")
}

fn sentence(verdict: Verdict, mean_square: bool) -> &'static str {
    match (verdict, mean_square) {
        (Verdict::Stable, false) => "STABLE: every disturbance of the relative motion dies out",
        (Verdict::Marginal, false) => "MARGINAL: the spectral radius is too close to 1 for a verdict, given its error",
        (Verdict::Overflow, false) => {
            "OVERFLOW: nothing is known of the spectral radius, because the numbers, or their errors, left the range of the computation"
        }
        (Verdict::Unstable, false) => "UNSTABLE: some disturbance of the relative motion grows without end",
        (Verdict::Stable, true) => "STABLE in the mean square: the variance of every disturbance of the relative motion dies out",
        (Verdict::Marginal, true) => "MARGINAL: the mean-square radius is too close to 1 for a verdict, given its error",
        (Verdict::Overflow, true) => {
            "OVERFLOW: nothing is known of the mean-square radius, because the numbers, or their errors, left the range of the computation"
        }
        (Verdict::Unstable, true) => "UNSTABLE in the mean square: the variance of some disturbance of the relative motion grows without end",
    }
}

/// Returns the text about the worst case alone.
#[must_use]
pub fn worst_in_words(worst: &SceneWorstCase) -> String {
    let mut text = String::new();
    worst_case(worst, &[], &mut |line: String| text.push_str(&format!("{line}\n")));
    text.trim_end().to_owned()
}

/// Adds the lines about the worst case, with the pattern of the lower bound. `said`: notes already in the text.
fn worst_case(worst: &SceneWorstCase, said: &[String], line: &mut impl FnMut(String)) {
    let verdict = match worst.verdict() {
        WorstVerdict::Stable => "stable whatever the network does within these bounds",
        WorstVerdict::Undecided => "not decided: 1 lies between the bounds; a larger --products or a smaller --accuracy may decide",
        WorstVerdict::Unstable => "unstable under some pattern within these bounds",
    };
    line(String::new());
    line(format!("worst case: {verdict}"));
    line(format!("  growth per sending period between {} and {}", figure(worst.lower, 6), figure(worst.upper, 6)));
    if worst.is_open() {
        let apart = 100.0 * (worst.upper / worst.lower - 1.0);
        line(format!("  open: the bounds are {} % apart, more than 1 %; a larger --products may bring them closer", figure(apart, 1)));
    }
    if let Some(rate) = worst.certificate {
        line(format!("  a quadratic certificate, checked, proves {}", figure(rate, 6)));
    }
    let part = worst.worst();
    if !part.sequence.is_empty() {
        line(format!("  the pattern that grows as the lower bound: {}", part.sequence));
    }
    worst.notes.iter().filter(|note| !said.contains(note)).for_each(|note| line(format!("  note: {note}")));
}

fn modes(analysis: &Analysis, line: &mut impl FnMut(String)) {
    line(String::new());
    let turns = analysis.modes.iter().any(|mode| !mode.motion.is_empty());
    line(match (turns, analysis.combines_contacts()) {
        (false, _) => format!("{} combinations of contacts, the worst first", analysis.modes.len()),
        (true, false) => "motions that do not mix, the worst first".to_owned(),
        (true, true) => "motions that do not mix, each with its combinations of contacts, the worst first".to_owned(),
    });
    let mut sorted: Vec<&ContactMode> = analysis.modes.iter().collect();
    // The worst mode comes first, so it is listed even if the list is cut.
    sorted.sort_by(|one, other| other.radius.value.total_cmp(&one.radius.value));
    for mode in sorted.iter().take(MOST_MODES) {
        let away = if mode.motion.is_empty() || analysis.combines_contacts() { "away from the walls" } else { "" };
        let contacts = if mode.contacts.is_empty() { away } else { &mode.contacts };
        let contacts = [mode.motion.as_str(), contacts].into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(": ");
        line(format!("  {contacts:<44}{:<9} {}", mode.radius.verdict().word(), number(mode.radius)));
    }
    if sorted.len() > MOST_MODES {
        line(format!("  ... and {} more", sorted.len() - MOST_MODES));
    }
}

fn name(scene: &Scene, part: &Part) -> String {
    let peer = |peer: usize| &scene.peers[peer].name;
    match part.kind {
        PartKind::Whole => "the whole scene".to_owned(),
        PartKind::Together => "all, equal peers as their average".to_owned(),
        PartKind::Apart { peer: first } => format!("differences of peers equal to {}", peer(first)),
        PartKind::Mode { weight } => format!("neighbours that do {weight:.6} of the same"),
        PartKind::LooseDevice { peer: first } => format!("the device of {}, which touches nothing", peer(first)),
    }
}

fn method(method: Method) -> &'static str {
    match method {
        Method::Reduced => "reduced (equal peers taken together)",
        Method::Determinant => "determinant (long delays as roots of a small determinant)",
        Method::Full => "full (the whole state, through the code that simulates)",
    }
}

fn number(radius: Radius) -> String {
    let Radius { value, error } = radius;
    format!("{} +- {error:.1e}", figure(value, 12))
}
