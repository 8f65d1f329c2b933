//! The page of the library of links: each number with its grade and its source.

use std::fmt::Write as _;

use cohaptic_linkfile::library::{Direction, Grade, Profile, profiles};

use super::WRITTEN;

/// Returns the page.
pub(super) fn page() -> String {
    let mut page = format!(
        "# Reference: links with a name\n\n{WRITTEN}\n\nThe links that `cohaptic link --list` names, each with the sources of its numbers. [how-to-named-link.md](how-to-named-link.md) says how to use \
         them. Every key has a grade:\n\n"
    );
    for (word, _, meaning) in Grade::WORDS {
        let _ = writeln!(page, "- **{word}**: {meaning}");
    }
    page.push_str(
        "\nA source says where it can be read, and how it was read here: as the *source* itself, in a *transcription* of its figures by somebody else, *computed*, or \
         *recalled*, where the figures were once read and the source was not found again.\n",
    );
    let (presets, measured): (Vec<Profile>, Vec<Profile>) = profiles().partition(|profile| profile.grade() == Grade::Preset);
    page.push_str("\n## Links with sources\n");
    for profile in &measured {
        section(&mut page, profile);
    }
    page.push_str(
        "\n## Tables of tools\n\nNobody measured these links. A tool names a round trip, and each direction has half of it here; Apple's delays are one-way. The tools \
         themselves do something else: DevTools delays requests and not packets, by 5, 3.75 and 2.75 times the round trip, and uses 0.8 or 0.9 of the rate.\n\n\
         | name | delay down, up | rate down, up | source |\n| --- | --- | --- | --- |\n",
    );
    for profile in &presets {
        let of = |key: &str| Direction::BOTH.map(|direction| value(profile, direction, key)).join(", ");
        let sources = profile.sources.values().map(|source| format!("{} (read: {})", source.cite, source.read)).collect::<Vec<_>>().join("; ");
        let _ = writeln!(page, "| `{}` | {} | {} | {sources} |", profile.title(), of("delay"), of("rate"));
    }
    page
}

fn value(profile: &Profile, direction: Direction, key: &str) -> String {
    let keys = profile.line(direction).keys();
    keys.iter().find(|(name, _)| *name == key).map_or_else(String::new, |(_, value)| value.trim_matches('"').to_owned())
}

fn section(page: &mut String, profile: &Profile) {
    let measured = [profile.place.as_str(), profile.when.as_str()].into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(", ");
    let measured = if measured.is_empty() { String::new() } else { format!(" ({measured})") };
    let _ = write!(
        page,
        "\n### `{}`\n\n{}{measured}. Grade {}. {}.\n\nNot modelled: {}.\n",
        profile.title(),
        profile.what,
        profile.grade().word(),
        profile.method,
        profile.not_modelled.join("; ")
    );
    for direction in Direction::BOTH {
        let line = profile.line(direction);
        let _ = writeln!(page, "\n`{}/{}`\n\n```toml", profile.title(), direction.word());
        for (key, value) in line.keys() {
            let _ = writeln!(page, "{key} = {value}");
        }
        page.push_str("```\n\n");
        for (key, reason) in &line.reasons {
            let sources = if reason.sources.is_empty() { String::new() } else { format!(" ({})", reason.sources.join(", ")) };
            let _ = writeln!(page, "- `{key}`: **{}**{sources}, {}", reason.grade.word(), reason.how);
        }
        for (key, [low, high]) in &line.between {
            let _ = writeln!(page, "- `{key}` between links: {low} to {high}, from the 10th to the 90th percentile");
        }
    }
    if !profile.chains.is_empty() {
        page.push_str("\nModulators\n\n```toml\n");
        profile.chains.iter().for_each(|chain| {
            let _ = writeln!(page, "{chain}");
        });
        page.push_str("```\n");
    }
    page.push_str("\nSources\n\n");
    for (name, source) in &profile.sources {
        let _ = writeln!(page, "- {name}: {} (read: {}; data: {})", source.cite, source.read, source.licence);
    }
}
