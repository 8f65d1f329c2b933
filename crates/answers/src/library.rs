//! Links of the library in words: the list of `cohaptic link --list`, and one profile with the source of each number.

use core::fmt::Write as _;
use std::collections::BTreeMap;

use cohaptic_linkfile::library::{Direction, Grade, Line, Profile, Reason, Source, profiles};
use serde::Serialize;

use crate::document;

/// Returns the answer of `cohaptic link --list --json` or `--show --json`: profiles with all numbers, reasons and sources.
pub fn document(profiles: impl IntoIterator<Item = Profile>) -> impl Serialize {
    document! { profiles: profiles.into_iter().map(|profile| of_profile(&profile)).collect::<Vec<_>>() }
}

/// Returns the document of one profile. Values of keys are TOML.
pub fn of_profile(profile: &Profile) -> impl Serialize + use<> {
    let line = |line: &Line| {
        let reason = |(key, reason): (&String, &Reason)| {
            (key.clone(), document! { grade: reason.grade.word(), sources: reason.sources.clone(), how: reason.how.clone() })
        };
        document! {
            keys: line.keys().into_iter().map(|(key, value)| (key.to_owned(), value)).collect::<BTreeMap<String, String>>(),
            reasons: line.reasons.iter().map(reason).collect::<BTreeMap<_, _>>(),
            between: line.between.clone(),
        }
    };
    let source = |(name, source): (&String, &Source)| {
        (name.clone(), document! { cite: source.cite.clone(), read: source.read.clone(), licence: source.licence.clone() })
    };
    document! {
        name: profile.name.clone(),
        version: profile.version,
        what: profile.what.clone(),
        place: profile.place.clone(),
        when: profile.when.clone(),
        grade: profile.grade().word(),
        method: profile.method.clone(),
        not_modelled: profile.not_modelled.clone(),
        down: line(&profile.down),
        up: line(&profile.up),
        modulators: profile.chains.clone(),
        sources: profile.sources.iter().map(source).collect::<BTreeMap<_, _>>(),
    }
}

/// Returns the list of all profiles: first those with sources, then the tables of tools. Each row has the name with its version, the grade, the delay and the
/// rate in both directions, and what is modelled.
#[must_use]
pub fn list() -> String {
    let (presets, measured): (Vec<Profile>, Vec<Profile>) = profiles().partition(|profile| profile.grade() == Grade::Preset);
    let mut text = String::new();
    for (title, group) in [("links with sources", measured), ("tables of tools, not measured", presets)] {
        let _ = writeln!(text, "{title}");
        for profile in group {
            let of = |key: &str| Direction::BOTH.map(|direction| figure(profile.line(direction), key)).join(", ");
            let (title, grade) = (profile.title(), profile.grade().word());
            let _ = writeln!(text, "  {title:<22} {grade:<7} delay {:<19} rate {:<21} {}", of("delay"), of("rate"), profile.what);
        }
    }
    text.push_str("figures: down, up; `cohaptic link NAME --show` says where each comes from\n");
    text
}

/// Returns the value of a key for the list, without quotes; a word for a value that changes with the state of a modulator, and for a value that is missing.
fn figure(line: &Line, key: &str) -> String {
    let value = line.keys().into_iter().find(|(name, _)| *name == key).map(|(_, value)| value.trim_matches('"').to_owned());
    // The states of a modulator replace the key of the line, so the value of the line alone would mislead.
    let is_varied = line.keys().iter().any(|(name, value)| *name == "modulated" && value.contains(&format!("{key} = ")));
    match value {
        _ if is_varied => "varies".to_owned(),
        Some(value) => value,
        None => "-".to_owned(),
    }
}

/// Returns a profile in words: what the profile models, its sources, each key with grade and reason, ranges between links, and what is missing.
#[must_use]
pub fn words(profile: &Profile) -> String {
    let mut text = format!("{}: {}\n", profile.title(), profile.what);
    // Tables of tools have neither place nor time, because nobody measured a link.
    let measured =
        [profile.place.as_str(), profile.when.as_str()].map(str::trim).into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(", ");
    if !measured.is_empty() {
        let _ = writeln!(text, "measured: {measured}");
    }
    let grade = profile.grade();
    let _ = writeln!(
        text,
        "grade: {} ({})\nmethod: {}\nnot modelled: {}",
        grade.word(),
        grade.meaning(),
        profile.method,
        profile.not_modelled.join("; ")
    );
    if let Some(note) = profile.note() {
        let _ = writeln!(text, "note: {note}");
    }
    for direction in Direction::BOTH {
        let _ = writeln!(text, "\n{}/{}", profile.title(), direction.word());
        line_words(&mut text, profile.line(direction));
    }
    if !profile.chains.is_empty() {
        text.push_str("\nmodulators\n");
    }
    for chain in &profile.chains {
        let _ = writeln!(text, "  {chain}");
    }
    text.push_str("\nsources\n");
    for (name, source) in &profile.sources {
        let _ = writeln!(text, "  {name}: {} (read: {}; data: {})", source.cite, source.read, source.licence);
    }
    text
}

fn line_words(text: &mut String, line: &Line) {
    for (key, value) in line.keys() {
        let _ = writeln!(text, "  {key} = {value}");
    }
    for (key, reason) in &line.reasons {
        let sources = if reason.sources.is_empty() { "no source".to_owned() } else { reason.sources.join(", ") };
        let _ = writeln!(text, "    {key}: {} ({sources}), {}", reason.grade.word(), reason.how);
    }
    for (key, [low, high]) in &line.between {
        let _ = writeln!(text, "    {key} between links: {low} to {high}, from the 10th to the 90th percentile");
    }
}
