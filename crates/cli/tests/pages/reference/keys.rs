//! The reference of keys.

use cohaptic_linkfile::schema::link::{LINK_TABLE, MODULATOR};
use cohaptic_linkfile::schema::{Form, Key, Need, Table, Words};
use cohaptic_scene::Measure;
use cohaptic_scene::schema::FileSchema;

use super::{WRITTEN, entry, prose};

const LINKS: &str = "reference-link-keys.md";
const SCENES: &str = "reference-keys.md";
const NETWORKS: &str = "reference-network-keys.md";

/// Tables with fewer keys are written out wherever they stand.
const SHORT: usize = 3;

const OF_SCENES: &str = "\
Every key of [scenes](scenes.md). Links have a [page of their own](reference-link-keys.md). Values with units are explained in
[scenes.md](scenes.md#how-values-are-written).

Behind a key stand its form, and its default or whether it must be given. A key with points, `device.mass`, stands in a table: `device = { mass = 0.1 }`. Brackets, `position[]`, mark a list. A *required* key must be given. One that is *required for all* must be
given there or in the table that holds for all, such as `[peer]`. Any other key without a default may be left out.
";
const OF_NETWORKS: &str = "\
Every key of [relay files](relay.md), [router files](router.md) and [files of exec](exec.md#several-programs-each-on-a-host-of-its-own). Links have a [page of their own](reference-link-keys.md). The notation is that of
[reference-keys.md](reference-keys.md).
";
const OF_LINKS: &str = "\
Every key of a link. [emulator-stages.md](emulator-stages.md) says exactly what each does to a packet. They are taken by `[link]`, `[[links]]`, `uplink` and `downlink` of
[scenes](scenes.md), by [relay files](relay.md) and [files of exec](exec.md), by `[links.NAME]` of [router files](router.md), by `set` in a timeline, by `cohaptic link`, and by
[live control](live-control.md). The notation is that of [reference-keys.md](reference-keys.md).

A link is often laid over another one: `[[links]]` over `[link]`, a change over what holds by then. Each key replaces the earlier one as a whole. Its default takes the earlier one
away, as `\"0s\"` does for `jitter`; `queue` and `overhead` go with `rate`.
";

/// Row of a key: its written name, its form, whether it is required, and its meaning.
type Row = [String; 4];

/// Returns a list of keys and an empty line.
fn list(rows: &[Row]) -> String {
    rows.iter().map(|[key, form, need, meaning]| entry(key, &[form, need], meaning)).collect::<String>() + "\n"
}

/// A key as far as two tables can share it.
type Shape = (&'static str, &'static str, &'static str);

fn shape(table: &Table) -> Vec<Shape> {
    table.keys().map(|key| (key.name, key.about, key.form.unit())).collect()
}

/// Table that the page has already explained.
struct Explained {
    keys: Vec<Shape>,
    name: String,
    page: &'static str,
    anchor: String,
}

/// Tables explained so far, and the page and the anchor of the next rows.
#[derive(Default)]
struct Reference {
    explained: Vec<Explained>,
    page: &'static str,
    anchor: String,
    /// `true` if tables within tables come after the others.
    puts_off: bool,
    later: Vec<(String, &'static str, &'static Table)>,
}

/// The name of each page in `docs`, with its text.
pub(super) fn pages() -> [(&'static str, String); 3] {
    let mut reference = Reference { page: LINKS, puts_off: true, ..Reference::default() };
    let mut links = head("Reference: keys of links", OF_LINKS);
    links += &reference.section("##", "Keys of a link", &LINK_TABLE);
    links += &reference.section("##", "Modulators", &MODULATOR);
    (reference.page, reference.puts_off) = (SCENES, false);
    let scenes = head("Reference: keys of scenes", OF_SCENES) + &reference.file(FileSchema::Scene, "##", "Scene");
    reference.page = NETWORKS;
    let mut networks = head("Reference: keys of relays, routers and exec", OF_NETWORKS);
    let kinds = [
        (FileSchema::Relay, "Relay files", "Relay"),
        (FileSchema::RelayTcp, "Relay files for TCP", "Relay of TCP"),
        (FileSchema::Router, "Router files", "Router"),
        (FileSchema::Exec, "Exec files", "Exec"),
    ];
    for (kind, heading, name) in kinds {
        networks += &format!("## {heading}\n\n{}", reference.file(kind, "###", name));
    }
    [(LINKS, links), (SCENES, scenes), (NETWORKS, networks)].map(|(page, text)| (page, text.trim_end().to_owned() + "\n"))
}

fn head(title: &str, introduction: &str) -> String {
    format!("# {title}\n\n{WRITTEN}\n\n{introduction}\n")
}

/// Returns the heading of a table at the top level of a file, as it is written in TOML.
fn head_of(key: &Key) -> String {
    if matches!(key.form, Form::List(_)) {
        format!("`[[{}]]`", key.name)
    } else if key.form.table().is_some_and(|table| table.others.is_some()) {
        format!("`[{}.NAME]`", key.name)
    } else {
        format!("`[{}]`", key.name)
    }
}

/// Returns the anchor that a forge gives to a heading.
fn anchor(heading: &str) -> String {
    let letter = |letter: char| match letter {
        ' ' => Some('-'),
        letter if letter.is_ascii_alphanumeric() || letter == '-' => Some(letter.to_ascii_lowercase()),
        _ => None,
    };
    heading.chars().filter_map(letter).collect()
}

/// The tables within a form, each with what stands between a key and theirs.
fn tables(form: &'static Form) -> Vec<(&'static str, &'static Table)> {
    match form {
        Form::Table(table) => vec![("", table)],
        Form::AnyOf(forms) => forms.iter().flat_map(tables).collect(),
        Form::List(element) | Form::Pair(element) => tables(element).into_iter().map(|(_, table)| ("[]", table)).collect(),
        Form::Text
        | Form::File
        | Form::Boolean
        | Form::Integer(..)
        | Form::Number(_)
        | Form::Vector(_)
        | Form::Triple(_)
        | Form::Duration
        | Form::PositiveDuration
        | Form::Rate
        | Form::Size
        | Form::Probability
        | Form::Like(_)
        | Form::Words(_) => Vec::new(),
    }
}

impl Reference {
    /// A section for each table at the top of a file.
    fn file(&mut self, kind: FileSchema, marks: &str, name: &str) -> String {
        let mut text = String::new();
        for key in kind.root().keys() {
            let needed = if key.need == Need::Required { " Required." } else { "" };
            let heading = format!("{name} {}", head_of(key));
            text += &format!("{marks} {heading}\n\n{}.{needed}", prose(key.about));
            for (_, inner) in tables(&key.form) {
                text += &self.rest_of_section(&heading, inner);
            }
        }
        text
    }

    /// Returns the section of a table, with the sections of its postponed inner tables.
    fn section(&mut self, marks: &str, heading: &str, table_of: &'static Table) -> String {
        self.anchor = anchor(heading);
        let mut rows = Vec::new();
        self.table("", heading, table_of, &mut rows);
        let mut text = format!("{marks} {heading}\n\n{}", list(&rows));
        let later = std::mem::take(&mut self.later);
        let puts_off = std::mem::replace(&mut self.puts_off, false);
        for group in later.chunk_by(|one, other| one.0 == other.0) {
            let name = &group[0].0;
            self.anchor = anchor(name);
            let mut rows = Vec::new();
            for (_, list, inner) in group {
                self.table(if list.is_empty() { "" } else { "[]." }, &format!("`{name}`"), inner, &mut rows);
            }
            text += &format!("{marks}# `{name}`\n\n{}", list(&rows));
        }
        self.puts_off = puts_off;
        text
    }

    /// Returns the text after the sentence about a table at the top level of a file: the keys of the table, or a link to them.
    fn rest_of_section(&mut self, heading: &str, table_of: &'static Table) -> String {
        self.anchor = anchor(heading);
        let mut rows = Vec::new();
        self.table("", heading, table_of, &mut rows);
        match &rows[..] {
            [only] if only[1].is_empty() => format!(" {}.\n\n", only[3]),
            _ => format!("\n\n{}", list(&rows)),
        }
    }

    /// The rows of a table, or one that names another table with the same keys.
    fn table(&mut self, prefix: &str, name: &str, table: &'static Table, rows: &mut Vec<Row>) {
        let keys = shape(table);
        let mut own: Vec<&'static Key> = table.keys().collect();
        let within = |one: &[Shape], other: &[Shape]| one.iter().all(|key| other.contains(key));
        // With all keys of another table, or with most of them.
        let known = self.explained.iter().filter(|known| !known.keys.is_empty() && within(&known.keys, &keys)).max_by_key(|known| known.keys.len());
        let larger = || self.explained.iter().find(|known| keys.len() >= SHORT && 2 * keys.len() > known.keys.len() && within(&keys, &known.keys));
        if let Some(known) = known.or_else(larger) {
            let missing: Vec<String> = known.keys.iter().filter(|key| !keys.contains(key)).map(|key| format!("`{}`", key.0)).collect();
            let but = if missing.is_empty() { String::new() } else { format!(" but {}", missing.join(", ")) };
            let page = if known.page == self.page { "" } else { known.page };
            let place = if prefix.is_empty() { "…".to_owned() } else { format!("`{prefix}…`") };
            own.retain(|key| !known.keys.contains(&(key.name, key.about, key.form.unit())));
            rows.push([place, String::new(), String::new(), format!("All of [{}]({page}#{}){but}", known.name.replace('`', ""), known.anchor)]);
        } else if keys.len() >= SHORT || prefix.is_empty() {
            self.explained.push(Explained { keys, name: name.to_owned(), page: self.page, anchor: self.anchor.clone() });
        }
        for key in own {
            self.key(prefix, key, rows);
        }
        if let Some(others) = table.others {
            let path = format!("{prefix}NAME");
            for (list, inner) in tables(others) {
                self.table(&format!("{path}{list}."), &format!("`{path}`"), inner, rows);
            }
        }
    }

    fn key(&mut self, prefix: &str, key: &'static Key, rows: &mut Vec<Row>) {
        let path = format!("{prefix}{}", key.name);
        let mut words = Vec::new();
        let form = form(&key.form, &mut words);
        let meanings =
            if words.is_empty() { String::new() } else { format!(". {}", words.join(if words.len() > MOST_IN_A_SENTENCE { ". " } else { "; " })) };
        let inner = tables(&key.form);
        let is_put_off = self.puts_off && prefix.is_empty() && !inner.is_empty();
        let written = if is_put_off { form.replace("table", &format!("[table](#{})", anchor(key.name))) } else { form };
        rows.push([format!("`{path}`"), written, need(key), prose(&format!("{}{meanings}", key.about))]);
        for (list, inner) in inner {
            if is_put_off {
                self.later.push((key.name.to_owned(), list, inner));
            } else {
                self.table(&format!("{path}{list}."), &format!("`{path}`"), inner, rows);
            }
        }
    }
}

fn need(key: &Key) -> String {
    match key.need {
        Need::Required => "*required*".to_owned(),
        Need::RequiredSomewhere => "*required for all*".to_owned(),
        Need::Default(default) => format!("default `{default}`"),
        Need::Optional => String::new(),
    }
}

/// Returns the form of a value in words. Choices of several words are appended to `words`.
fn form(of: &Form, words: &mut Vec<String>) -> String {
    let number =
        |expected: String, many: &str| expected.replacen("a number", many, 1).replace("of at least zero", "≥ 0").replace("above zero", "> 0");
    match of {
        Form::Text => "text".to_owned(),
        Form::File => "file".to_owned(),
        Form::Boolean => "boolean".to_owned(),
        // No limit that anybody meets.
        Form::Integer(least, most) if *most >= u64::from(u32::MAX) => format!("integer ≥ {least}"),
        Form::Integer(least, most) => format!("integer, {least} to {most}"),
        Form::Number(amount) => number(amount.expected(), "number"),
        Form::Vector(amount) => number(amount.expected(), "number or vector"),
        Form::Triple(amount) => number(amount.expected(), "3 numbers"),
        Form::Duration | Form::PositiveDuration => "duration".to_owned(),
        Form::Rate => "rate".to_owned(),
        Form::Size => "size".to_owned(),
        Form::Probability => "probability".to_owned(),
        Form::Like(examples) => format!("text: {}", examples.iter().map(|example| format!("`\"{example}\"`")).collect::<Vec<_>>().join(", ")),
        Form::Words([(word, _)]) => format!("`\"{word}\"`"),
        Form::Words(choices) => {
            words.extend(meanings(choices));
            "word".to_owned()
        }
        Form::Table(_) => "table".to_owned(),
        Form::List(element) => format!("list of {}", many(&form(element, words))),
        Form::Pair(element) => format!("list of two {}", many(&form(element, words))),
        Form::AnyOf(forms) => {
            let mut all: Vec<String> = forms.iter().map(|of| form(of, words)).collect();
            all.dedup();
            all.join(" or ")
        }
    }
}

fn many(form: &str) -> String {
    if ["table", "duration", "size"].contains(&form) { format!("{form}s") } else { form.to_owned() }
}

/// More words than these are explained by a sentence each.
const MOST_IN_A_SENTENCE: usize = 8;

/// Each word with its meaning; words alone where all mean one thing. Measures have a list of their own.
fn meanings(words: Words) -> Vec<String> {
    let alone = || words.iter().map(|(word, _)| format!("`\"{word}\"`")).collect::<Vec<_>>().join(", ");
    if words.first().is_some_and(|(word, _)| *word == Measure::ALL[0].name()) {
        return vec![format!("{}: see [measures](reference-documents.md#measures)", alone())];
    }
    let differ = words.iter().any(|(_, meaning)| *meaning != words[0].1);
    if !differ {
        return vec![alone()];
    }
    words.iter().map(|(word, meaning)| format!("`\"{word}\"`: {meaning}")).collect()
}

#[test]
fn a_table_with_the_keys_of_another_one_names_it() {
    let pages = pages();
    let [links, scenes, networks] = pages.each_ref().map(|(_, text)| text.as_str());
    assert!(
        scenes.contains("\n## Scene `[[peers]]`\n\nOne peer per entry") && scenes.contains("- …: All of [Scene [peer]](#scene-peer)\n"),
        "{scenes}"
    );
    assert!(networks.contains("All of [Keys of a link](reference-link-keys.md#keys-of-a-link)"), "{networks}");
    assert!(scenes.contains("- `stiffness` (number ≥ 0 [N/m]; *required*): Gain on the difference of positions, K_T\n"), "{scenes}");
    assert!(links.contains("\n### `jitter`\n") && links.contains("[table](#jitter)"), "{links}");
}
