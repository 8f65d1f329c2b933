//! Reader of the files of the library.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use cohaptic_wan::parameters::{Form, Key, Table, optional, required, words};

use super::{Direction, Grade, Line, Profile, Reason, Source, modulator_name};
use crate::document::{Node, Sources, Value, value_text};
use crate::link::{read_link, read_modulators};
use crate::reading::{Context, Modulators, TableReader, parse, values};

use crate::link::keys::{LINK_TABLE, MODULATOR};

static ROOT: Table = Table::of(&[&[
    required("name", Form::Text, "The name, without version and direction"),
    required("version", Form::Integer(1, 1000), "The version, which never changes"),
    required("what", Form::Text, "What is modelled"),
    optional("where", Form::Text, "Where it was measured"),
    optional("when", Form::Text, "When it was measured"),
    required("method", Form::Text, "How the numbers were made"),
    required("not-modelled", Form::List(&Form::Text), "What of the real link is missing"),
    required("sources", Form::Table(&SOURCES), "The sources by name"),
    optional("modulators", Form::List(&Form::Table(&MODULATOR)), "The modulators of both directions"),
    required("down", Form::Table(&LINK_TABLE), "The link towards the user"),
    required("up", Form::Table(&LINK_TABLE), "The link away from the user"),
    required("because", Form::Table(&BECAUSE), "Why each key has its value"),
    optional("between", Form::Table(&BETWEEN), "How links of this kind differ"),
]]);
static SOURCES: Table = Table::with_others(&[], &Form::Table(&SOURCE));
static SOURCE: Table = Table::of(&[&[
    required("cite", Form::Text, "Authors, title, where and when"),
    required("read", Form::Text, "How it was read: source, transcription, computed or recalled"),
    required("data-licence", Form::Text, "The licence of its data, and what is used"),
]]);
static BECAUSE: Table = Table::of(&[&of_directions(Form::Table(&REASONS))]);
static REASONS: Table = Table::with_others(&[], &Form::Table(&REASON));
static REASON: Table = Table::of(&[&[
    required("grade", Form::Words(const { &words(&Grade::WORDS) }), "How far the number is known"),
    required("source", Form::List(&Form::Text), "Names of sources"),
    required("how", Form::Text, "How the number follows"),
]]);
static BETWEEN: Table = Table::of(&[&of_directions(Form::Table(&RANGES))]);
static RANGES: Table = Table::with_others(&[], &Form::Pair(&Form::Text));

/// Returns the keys of a table with entries for both directions together, and for each direction alone.
const fn of_directions(form: Form) -> [Key; 3] {
    [optional("both", form, "Of both directions"), optional("down", form, "Towards the user"), optional("up", form, "Away from the user")]
}

/// Reads a profile. `file` is its name, for messages.
///
/// # Panics
///
/// If the text is no profile: the texts are part of this program, and a test reads each.
#[expect(clippy::panic, reason = "the texts are part of this program, and a test reads each")]
pub(super) fn profile(file: &str, text: &str) -> Profile {
    let file = format!("{file}.toml");
    // A profile names no further file, so that the folder of the name does not matter.
    let read = parse(Sources { file: Path::new(&file), text, overrides: &[] }, read_profile);
    read.unwrap_or_else(|error| panic!("{error}")).whole
}

fn read_profile(node: &Node, context: Context<'_>) -> Option<Profile> {
    let mut table = TableReader::new(node, context, &ROOT, "a profile")?;
    let name: String = table.read("name", text)?;
    let version = u32::try_from(table.value::<u64>("version")?).ok()?;
    // Modulators come before both directions, because the keys of a direction name them.
    let chains = table.get("modulators");
    let modulators = owned(&name, version, &*read_modulators(chains, context)?);
    let [because, between] = ["because", "between"].map(|key| table.get(key));
    let line = |keys: &Node, direction: Direction| {
        // A fault in a key is found here, and not later by the first file that names the profile.
        read_link(keys, context.with_modulators(Some(&modulators)))?;
        let reasons = entries_of(because, direction, |node| read_reason(node, context))?;
        let between = entries_of(between, direction, |node| <[String; 2]>::try_from(texts(node, context)?).ok())?;
        Some(Line { keys: keys.clone(), reasons, between })
    };
    let profile = Profile {
        what: table.read("what", text)?,
        place: table.maybe("where", text)?.unwrap_or_default(),
        when: table.maybe("when", text)?.unwrap_or_default(),
        method: table.read("method", text)?,
        not_modelled: table.read("not-modelled", texts)?,
        sources: table.read("sources", |node, context| {
            node.as_table()?.0.iter().map(|entry| Some((entry.name.clone(), read_source(&entry.node, context)?))).collect()
        })?,
        down: table.read("down", |keys, _| line(keys, Direction::Down))?,
        up: table.read("up", |keys, _| line(keys, Direction::Up))?,
        name,
        version,
        // The list was read above, so that any other value has been refused.
        chains: chains.map_or_else(Vec::new, |node| match &node.value {
            Value::List(list) => list.iter().map(|chain| value_text(chain)).collect(),
            Value::Text(_) | Value::Integer(_) | Value::Float(_) | Value::Boolean(_) | Value::Date | Value::Table(_) => Vec::new(),
        }),
        modulators,
    };
    table.finish();
    Some(profile)
}

/// Returns the modulators under the same names, with random numbers of the profile's own: another profile may have a modulator of the same name.
fn owned(profile: &str, version: u32, modulators: &Modulators) -> Arc<Modulators> {
    let renamed = modulators
        .iter()
        .map(|(name, (modulator, states))| (name.clone(), (modulator.renamed(&modulator_name(profile, version, name)), states.clone())));
    Arc::new(renamed.collect())
}

/// Returns the entries for one direction. An entry of the direction replaces the same entry of both directions.
fn entries_of<T>(table: Option<&Node>, direction: Direction, read: impl Fn(&Node) -> Option<T>) -> Option<BTreeMap<String, T>> {
    let of = |key: &str| table.and_then(Node::as_table)?.get(key)?.node.as_table();
    // The map keeps the last entry of a key.
    let entries = [of("both"), of(direction.word())].into_iter().flatten().flat_map(|table| &table.0);
    entries.map(|entry| Some((entry.name.clone(), read(&entry.node)?))).collect()
}

fn read_source(node: &Node, context: Context<'_>) -> Option<Source> {
    let mut table = TableReader::new(node, context, &SOURCE, "a source")?;
    let source = Source { cite: table.read("cite", text)?, read: table.read("read", text)?, licence: table.read("data-licence", text)? };
    table.finish();
    Some(source)
}

fn read_reason(node: &Node, context: Context<'_>) -> Option<Reason> {
    let mut table = TableReader::new(node, context, &REASON, "a reason")?;
    let reason = Reason { grade: table.choice("grade", &Grade::WORDS)?, sources: table.read("source", texts)?, how: table.read("how", text)? };
    table.finish();
    Some(reason)
}

fn text(node: &Node, context: Context<'_>) -> Option<String> {
    values::text(node, context, "a text").map(str::to_owned)
}

fn texts(node: &Node, context: Context<'_>) -> Option<Vec<String>> {
    values::list(node, context, "a list of texts")?.iter().map(|node| text(node, context)).collect()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use crate::link::library::{Direction, Grade, profiles};

    /// Every number can be followed to its source: each key of each direction, the keys of the states of a modulator among them, has a reason; each source that a
    /// reason names exists and is used; only an assumption has no source; and a source that was read says where it can be read.
    #[test]
    fn each_key_has_a_grade_and_a_source() {
        for profile in profiles() {
            let mut used = BTreeSet::new();
            for direction in Direction::BOTH {
                let line = profile.line(direction);
                let table = line.keys.as_table().unwrap();
                let modulated = table.get("modulated").and_then(|entry| entry.node.as_table());
                let states = modulated.into_iter().flat_map(|table| &table.0).filter_map(|entry| entry.node.as_table());
                let keys: BTreeSet<&str> = states.chain([table]).flat_map(|table| &table.0).map(|entry| entry.name.as_str()).collect();
                let reasons: BTreeSet<&str> = line.reasons.keys().map(String::as_str).collect();
                assert!(keys.is_subset(&reasons), "{} {}: {keys:?} {reasons:?}", profile.title(), direction.word());
                for (key, reason) in &line.reasons {
                    assert!(reason.grade == Grade::C || !reason.sources.is_empty(), "{} {key}", profile.title());
                    assert!(
                        !reason.how.is_empty() && reason.sources.iter().all(|source| profile.sources.contains_key(source)),
                        "{} {key}",
                        profile.title()
                    );
                    // A halved round trip must say so.
                    assert!(key != "delay" || reason.grade != Grade::B || reason.how.contains("assumed"), "{}", profile.title());
                    used.extend(reason.sources.iter().cloned());
                }
                assert!(line.between.keys().all(|key| keys.contains(key.as_str())), "{}", profile.title());
            }
            for (name, source) in &profile.sources {
                let has_place = ["doi:", "arXiv:", "https://"].iter().any(|place| source.cite.contains(place));
                match source.read.as_str() {
                    "source" => assert!(has_place, "{} {name}: {}", profile.title(), source.cite),
                    // The person who copied the figures is not always known. The page says that nobody has looked into the source itself.
                    "transcription" | "computed" => {}
                    "recalled" => assert!(!has_place && source.cite.contains("not found again"), "{} {name}: {}", profile.title(), source.cite),
                    other => panic!("{} {name}: {other}", profile.title()),
                }
            }
            assert_eq!(used, profile.sources.keys().cloned().collect(), "{}", profile.title());
            assert_eq!(profile.grade() == Grade::Preset, profile.name.contains('/'), "{}", profile.title());
        }
    }
}
