//! Links by their keys: a single link from texts, and the keys of the links of a file, to be shown and changed.

use core::fmt;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use cohaptic_wan::LinkModel;
use toml::de::{DeTable, DeValue};

use crate::document::{BEGINNING, FileError, Node, Sources, Table, Value, key_text, value_text};
use crate::link::read_link;
use crate::reading::{Context, FileReader, Modulators, parse_with, values};

/// Returns the link with the given keys. The keys are texts `KEY=VALUE`, such as `delay=24ms` and `loss={ gilbert-elliott = { p = 0.01, r = 0.1 } }`, with the
/// meaning of `[link]` in a scene. Files named by the keys are looked for in the current folder.
///
/// Unlike in a scene, `loss=1` is refused. Words of `tc` can stand in place of these texts, and in `tc` the words `loss 1` mean 1 %. `loss=100%` and `loss=0`
/// are accepted.
///
/// # Errors
///
/// [`FileError`], whose [`override_text`](crate::Diagnostic::override_text) is `link.` and the text with the fault.
pub fn link_from_keys(keys: &[String]) -> Result<LinkModel, FileError> {
    let overrides: Vec<String> = keys.iter().map(|key| format!("link.{key}")).collect();
    read_overrides(&overrides, Path::new("link.toml"), &Arc::default(), FileReader::ANY, refuse_fractions)
}

/// Refuses a chance without unit under a key whose word in `tc` takes percent.
fn refuse_fractions(link: &Node, context: Context<'_>) {
    let entries = link.as_table().map_or(&[][..], |table| &table.0);
    for entry in entries.iter().filter(|entry| ["loss", "duplicate", "corrupt", "reorder"].contains(&entry.name.as_str())) {
        let node = &entry.node;
        let (Value::Integer(_) | Value::Float(_)) = node.value else { continue };
        let Some(probability) = values::probability(node, context).filter(|probability| probability.get() != 0.0) else { continue };
        let number = values::written(node);
        // Rounded to ten decimals of a percent, because digits after those come from the binary form of the number.
        let percent = (probability.get() * 1e12).round() / 1e10;
        let name = &entry.name;
        context.fault_at(
            node,
            format!("{number} has no unit: a scene reads {percent} %, and tc reads {name} {number} as {number} %: expected {percent}% or {number}%"),
        );
    }
}

/// Reads a link from overrides of the keys under `link`. `check` can report further faults. `file` gives the folder of the files named by the keys.
fn read_overrides(
    overrides: &[String],
    file: &Path,
    modulators: &Arc<Modulators>,
    reader: FileReader<'_>,
    check: fn(&Node, Context<'_>),
) -> Result<LinkModel, FileError> {
    let parsed = parse_with(Sources { file, text: "", overrides }, reader, |document, context| {
        // A link with the key `modulated` refers to the modulators of the file, and the overrides have none.
        let context = context.with_modulators(Some(modulators));
        // Without an override the document has no table `link`, and every key has the default.
        let nothing = Node::empty_table(BEGINNING, "link".to_owned());
        let link = document.as_table().and_then(|table| table.get("link")).map_or(&nothing, |entry| &*entry.node);
        check(link, context);
        read_link(link, context)
    })?;
    Ok(parsed.whole)
}

/// Keys of a directed link with values in TOML, in the order of laying over. Of two conflicting keys, the later key applies. Missing keys have the declared
/// defaults.
///
/// The display form is an inline table, `{ delay = "24ms", loss = 0.01 }`, which [`LinkKeys::read`] parses.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct LinkKeys {
    /// Keys with their values. A value is TOML, or a text without quotes set by [`LinkKeys::with`].
    keys: Vec<(String, String)>,
    /// Modulators of the file, to which the key `modulated` refers.
    modulators: Arc<Modulators>,
}

impl LinkKeys {
    /// Returns the keys of a table, in a file with the given modulators.
    #[must_use]
    pub(crate) fn of_table(table: &Table, modulators: &Arc<Modulators>) -> Self {
        Self { keys: keys_of(table), modulators: Arc::clone(modulators) }
    }

    /// Returns each key with its value as TOML.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &str)> {
        self.keys.iter().map(|(key, value)| (key.as_str(), value.as_str()))
    }

    /// Returns the value of a key as TOML, or `None` if the key is not given.
    #[must_use]
    pub fn get(&self, key: &str) -> Option<&str> {
        self.iter().find(|(name, _)| *name == key).map(|(_, value)| value)
    }

    /// Returns a copy of the keys with a further key laid over the keys so far. A value with faulty TOML is taken as a text, as in `--set`: `8ms` needs no
    /// quotes. Key and value are checked only by [`LinkKeys::model`].
    #[must_use]
    pub fn with(&self, key: &str, value: &str) -> Self {
        // A key that is given again moves to the end, because of two conflicting keys the later key applies.
        let mut keys: Vec<_> = self.keys.iter().filter(|(name, _)| name != key).cloned().collect();
        keys.push((key.to_owned(), value.trim().to_owned()));
        Self { keys, modulators: Arc::clone(&self.modulators) }
    }

    /// Returns the link with these keys. `folder` is the folder of the file with the keys, in which files named by the keys are looked for.
    ///
    /// # Errors
    ///
    /// [`FileError`], whose [`override_text`](crate::Diagnostic::override_text) is `link.KEY=VALUE` of the key with the fault.
    pub fn model(&self, folder: &Path) -> Result<LinkModel, FileError> {
        self.model_with(folder, FileReader::ANY)
    }

    /// Like [`model`](Self::model), but `reader` reads the files named by the keys. For keys that may come from a stranger.
    ///
    /// # Errors
    ///
    /// As [`model`](Self::model). [`FileError::bare_message`] of an error quotes no content of these files.
    pub fn model_with(&self, folder: &Path, reader: FileReader<'_>) -> Result<LinkModel, FileError> {
        let overrides: Vec<String> = self.iter().map(|(key, value)| format!("link.{key}={value}")).collect();
        read_overrides(&overrides, &folder.join("link.toml"), &self.modulators, reader, |_, _| ())
    }

    /// Parses the display form of keys. The result has the modulators of these keys. Returns `None` if the text is no table of keys and values. Keys and values
    /// are checked only by [`LinkKeys::model`].
    #[must_use]
    pub fn read(&self, table: &str) -> Option<Self> {
        // The parser reads documents, and a bare inline table is no document.
        let text = format!("link = {table}");
        let document = Node::document(DeTable::parse(&text).ok()?.get_ref()).ok()?;
        // A text such as "{}\nscene = 3" would add a second key to the document.
        let [only] = document.as_table()?.0.as_slice() else { return None };
        Some(Self { keys: keys_of(only.node.as_table()?), modulators: Arc::clone(&self.modulators) })
    }
}

impl fmt::Display for LinkKeys {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.keys.is_empty() {
            return f.write_str("{}");
        }
        let mut before = "{";
        for (key, value) in &self.keys {
            // A text without quotes gets quotes, because the display form is TOML.
            let value = if is_toml(value) { value.clone() } else { value_text(&text_node(value)) };
            write!(f, "{before} {} = {value}", key_text(key))?;
            before = ",";
        }
        f.write_str(" }")
    }
}

/// Keys of directed links, by the indices of sender and receiver.
pub type KeysOfLinks = BTreeMap<(usize, usize), LinkKeys>;

/// Returns the keys of a table with values as TOML.
fn keys_of(table: &Table) -> Vec<(String, String)> {
    table.0.iter().map(|entry| (entry.name.clone(), value_text(&entry.node))).collect()
}

fn is_toml(value: &str) -> bool {
    DeValue::parse(value).is_ok()
}

fn text_node(text: &str) -> Node {
    Node { value: Value::Text(text.to_owned()), place: BEGINNING, path: String::new() }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use std::cell::RefCell;
    use std::path::PathBuf;

    use cohaptic_units::Probability;
    use cohaptic_wan::parameters::{Form, Key};
    use cohaptic_wan::{Delay, Distribution, Jitter, LINK_KIND_PARAMETERS, LINK_PARAMETERS, LinkConfig, Loss, Modulator, ModulatorState, Sojourn};

    use super::*;

    fn link(keys: &[&str]) -> Result<LinkModel, FileError> {
        link_from_keys(&keys.iter().map(|key| (*key).to_owned()).collect::<Vec<_>>())
    }

    #[test]
    fn keys_make_a_link() {
        let delay = Delay::with_jitter(Duration::from_millis(24), Jitter::new(Duration::from_millis(2), Distribution::Normal)).unwrap();
        let expected = LinkConfig { delay, loss: Loss::Independent(Probability::new(0.01).unwrap()), ..LinkConfig::default() };
        assert_eq!(link(&["delay=24ms", "jitter={ sd = \"2ms\" }", "loss=1%"]).unwrap(), expected.into());
        assert_eq!(link(&[]).unwrap(), LinkModel::default());
    }

    #[test]
    fn a_chance_without_unit_is_refused_with_both_readings() {
        for (text, parts) in [
            ("loss=1", ["a scene reads 100 %", "tc reads loss 1 as 1 %", "expected 100% or 1%"]),
            ("loss=0.07", ["a scene reads 7 %", "tc reads loss 0.07 as 0.07 %", "expected 7% or 0.07%"]),
            ("duplicate=0.5", ["a scene reads 50 %", "tc reads duplicate 0.5 as 0.5 %", "expected 50% or 0.5%"]),
            ("corrupt=1", ["a scene reads 100 %", "tc reads corrupt 1 as 1 %", "expected 100% or 1%"]),
            ("reorder=0.25", ["a scene reads 25 %", "tc reads reorder 0.25 as 0.25 %", "expected 25% or 0.25%"]),
        ] {
            let error = link(&["delay=9ms", text]).unwrap_err();
            assert_eq!(error.diagnostic().unwrap().override_text(), Some(format!("link.{text}").as_str()));
            assert!(parts.iter().all(|part| error.to_string().contains(part)), "{error}");
        }
        for text in ["loss=0", "loss=0.0", "loss=100%", "loss={ bursts = { loss = 0.02, length = 4 } }", "corrupt={ probability = 0.01 }"] {
            assert!(link(&[text]).is_ok(), "{text}");
        }
        // Keys of a scene stand where no words may.
        assert!(LinkKeys::default().with("loss", "1").model(Path::new(".")).is_ok());
    }

    #[test]
    fn a_fault_names_the_text_that_has_it() {
        for (keys, text) in [
            (["delay=24ms", "los=1%"], "link.los=1%"),
            (["delay=24 parsecs", "loss=1%"], "link.delay=24 parsecs"),
            (["delay", "loss=1%"], "link.delay"),
        ] {
            let error = link(&keys).unwrap_err();
            let diagnostic = error.diagnostic().unwrap();
            assert_eq!(diagnostic.override_text(), Some(text), "{error}");
            assert!(diagnostic.message().contains("expected"), "{error}");
        }
    }

    /// Returns the number of keys that name a file, among `keys` and the keys of their tables and lists.
    fn files_below(keys: &[Key]) -> usize {
        fn of(form: &Form) -> usize {
            match form {
                Form::File => 1,
                Form::Table(table) => table.keys().map(|key| of(&key.form)).sum::<usize>() + table.others.map_or(0, of),
                Form::List(form) | Form::Pair(form) => of(form),
                Form::AnyOf(forms) => forms.iter().map(of).sum(),
                Form::Text | Form::Boolean | Form::Integer(..) | Form::Number(_) | Form::Vector(_) | Form::Triple(_) | Form::Duration => 0,
                Form::PositiveDuration => 0,
                Form::Rate | Form::Size | Form::Probability | Form::Like(_) | Form::Words(_) => 0,
            }
        }
        // The states of `modulated` repeat the keys of a link.
        keys.iter().filter(|key| key.name != "modulated").map(|key| of(&key.form)).sum()
    }

    /// Keys that name a file, words of tc-netem among them, each with the name of the file.
    const FILES: [(&str, &str, &str); 11] = [
        ("replay", "\"a/fates.csv\"", "desk/a/fates.csv"),
        ("trace", "\"up.trace\"", "desk/up.trace"),
        ("trace", "{ file = \"up.trace\", bytes = \"1500B\" }", "desk/up.trace"),
        ("jitter", "{ sd = \"2ms\", distribution = { table = \"../x.dist\" } }", "desk/../x.dist"),
        ("jitter", "{ sd = \"2ms\", distribution = { empirical = \"/etc/shadow\" } }", "/etc/shadow"),
        ("cross-traffic", "{ trace = \"cross.csv\" }", "desk/cross.csv"),
        ("slots", "{ delay = \"9ms\", jitter = { sd = \"2ms\", distribution = { empirical = \"slots.csv\" } } }", "desk/slots.csv"),
        ("netem", "\"delay 20ms 5ms distribution /etc/law\"", "/etc/law.dist"),
        ("netem", "\"delay 20ms slot distribution law 2ms 1ms\"", "desk/law.dist"),
        ("modulated", "{ by = \"cell\", bad = { trace = \"bad.trace\" } }", "desk/bad.trace"),
        ("modulated", "{ by = \"cell\", bad = { jitter = { sd = \"1ms\", distribution = { table = \"bad.dist\" } } } }", "desk/bad.dist"),
    ];

    /// A key of the catalogue that names a file and is missing from [`FILES`] fails the count.
    #[test]
    fn every_file_that_keys_name_is_asked_of_the_reader_and_nothing_of_it_is_quoted() {
        let in_catalogue: usize = LINK_PARAMETERS.into_iter().chain([LINK_KIND_PARAMETERS.as_slice()]).map(files_below).sum();
        assert_eq!(in_catalogue, 8, "replay, trace, trace.file, cross-traffic.trace, and table and empirical of jitter and of slots");
        let state = |next: [f64; 2]| ModulatorState { sojourn: Some(Sojourn::Fixed(Duration::from_secs(1))), next: next.to_vec() };
        let modulator = Modulator::new("cell", vec![state([0.0, 1.0]), state([1.0, 0.0])]).unwrap();
        let names = ["good", "bad"].map(str::to_owned).to_vec();
        let modulators = Arc::new(Modulators::from([("cell".to_owned(), (modulator, names))]));
        for (key, value, file) in FILES {
            // Cross-traffic without a rate is refused before its file is.
            let rate = (key == "cross-traffic").then_some(("rate", "\"1Mbit\""));
            let keys = std::iter::once((key, value)).chain(rate).map(|(key, value)| (key.to_owned(), value.to_owned()));
            let keys = LinkKeys { keys: keys.collect(), modulators: Arc::clone(&modulators) };
            let asked = RefCell::new(Vec::new());
            let secret = |path: &Path| {
                asked.borrow_mut().push(path.to_path_buf());
                Ok(b"root:$6$secret:19000:0:99999:7:::\n".to_vec())
            };
            let error = keys.model_with(Path::new("desk"), FileReader(&secret)).unwrap_err();
            assert_eq!(*asked.borrow(), [PathBuf::from(file)], "{key} = {value}");
            assert!(error.to_string().contains("secret"), "the owner of the file sees its line: {error}");
            assert!(!error.bare_message().contains("secret") && error.bare_message().contains(file), "{}", error.bare_message());
        }
    }

    #[test]
    fn a_key_is_replaced_or_added_and_a_fault_in_it_is_named() {
        let keys = LinkKeys::default().with("delay", "8ms").with("loss", "0.1").with("delay", "\"9ms\"");
        assert_eq!(keys.to_string(), "{ loss = 0.1, delay = \"9ms\" }");
        let folder = Path::new("");
        assert_eq!(keys.model(folder).unwrap(), link(&["loss=10%", "delay=9ms"]).unwrap());
        let text = keys.with("delay", "4 \"µs\"\n");
        assert_eq!(LinkKeys::default().read(&text.to_string()).unwrap().get("delay"), Some(r#""4 \"µs\"""#));
        let error = keys.with("delay", "4 parsecs").model(folder).unwrap_err();
        assert_eq!(error.diagnostic().unwrap().override_text(), Some("link.delay=4 parsecs"));
        assert!(keys.with("from", "left").model(folder).is_err());
        assert!(keys.with("scene", "1").with("", "1").model(folder).is_err());
        for text in ["", "{", "{ a = 1 } b", "7", "{}\nscene = 3", "{ a = 1 }\n[b]"] {
            assert_eq!(keys.read(text), None, "{text}");
        }
    }
}
