//! Keys of files, part by part of the dotted path, and the words of a key.

use cohaptic_linkfile::document::{Node, Value};
use cohaptic_linkfile::schema::{Form, Table};

use super::Offer;

/// Returns texts `KEY=` and `KEY=WORD` that begin with the complete parts of `typed`: `scene.du` gives the keys of `[scene]`.
pub(super) fn offers(root: &'static Table, document: &Node, typed: &str) -> Vec<Offer> {
    let (done, found) = match typed.split_once('=') {
        Some((key, _)) => {
            let path: Vec<&str> = key.split('.').collect();
            let places = places(root, document, &path);
            (format!("{key}="), places.iter().flat_map(|place| words(place.form)).collect())
        }
        None => match typed.rsplit_once('.') {
            Some((done, _)) => (format!("{done}."), parts(root, document, &done.split('.').collect::<Vec<_>>())),
            None => (String::new(), keys(&Place { form: Form::Table(root), node: Some(document) })),
        },
    };
    let mut offers: Vec<Offer> = Vec::new();
    for Offer { text, about } in found {
        let offer = Offer { text: format!("{done}{text}"), about };
        // Several forms of one value, such as two tables, can have the same key.
        if offers.iter().all(|other| other.text != offer.text) {
            offers.push(offer);
        }
    }
    offers
}

/// Returns the names of the ends of links: the peers of a scene or the programs of a relay. Names with characters of meaning to a shell are left out.
pub(super) fn ends(document: &Node) -> Vec<String> {
    let count = entry(Some(document), "scene").and_then(|scene| entry(Some(scene), "count"));
    // Largest number of peers of a scene. The reader refuses a greater number, and the list would take long.
    const MOST: i128 = 100_000;
    if let Some(Value::Integer(Some(count))) = count.map(|count| &count.value) {
        return (1..=(*count).min(MOST)).map(|number| format!("peer{number}")).collect();
    }
    let lists = ["peers", "programs"].into_iter().flat_map(|list| entries(entry(Some(document), list)));
    let names = lists.filter_map(|peer| entry(Some(peer), "name")?.as_text());
    names.filter(|name| is_word(name)).map(str::to_owned).collect()
}

/// A value of a file: the declared form, and the file's own value, if any.
#[derive(Clone, Copy)]
struct Place<'a> {
    form: Form,
    node: Option<&'a Node>,
}

/// Returns the next parts of the path after the complete parts `done`.
fn parts(root: &'static Table, document: &Node, done: &[&str]) -> Vec<Offer> {
    let others =
        |but: &str| ends(document).into_iter().filter(|name| name != but).map(|name| Offer { text: format!("{name}."), about: "" }).collect();
    match done {
        ["peers" | "programs"] if is_list(root, done[0]) => others(""),
        ["links"] if is_list(root, "links") => others(""),
        ["links", from] if is_list(root, "links") => others(from),
        _ => places(root, document, done).iter().flat_map(keys).collect(),
    }
}

/// Returns the places with the path `path`: a place per possible form of the value.
fn places<'a>(root: &'static Table, document: &'a Node, path: &[&str]) -> Vec<Place<'a>> {
    let root_place = Place { form: Form::Table(root), node: Some(document) };
    match path {
        // Both ends of a link name the entry of the link. An entry has the keys of a link whether the file has the entry or not.
        ["links", _, _, rest @ ..] if is_list(root, "links") => {
            below(&root_place, &["links", "0"]).iter().flat_map(|link| below(link, rest)).collect()
        }
        _ => below(&root_place, path),
    }
}

/// Returns the places with the path `path` below a place.
fn below<'a>(place: &Place<'a>, path: &[&str]) -> Vec<Place<'a>> {
    let [first, rest @ ..] = path else { return vec![*place] };
    let node = place.node;
    // All forms of a value are followed, also forms that the file's own value does not have: the user may want to change the form.
    if let Form::AnyOf(forms) = place.form {
        forms.iter().flat_map(|form| below(&Place { form: *form, node }, path)).collect()
    } else if let Form::Table(table) = place.form {
        let form = table.key(first).map(|key| &key.form).or(table.others);
        form.into_iter().flat_map(|form| below(&Place { form: *form, node: entry(node, first) }, rest)).collect()
    } else if let Form::List(element) = place.form {
        below(&Place { form: *element, node: entries(node).find(|entry| last_part(entry) == *first) }, rest)
    } else {
        Vec::new()
    }
}

/// Returns the keys of a table, or the names of the entries of a list, each with the next sign: `=` before a value, `.` before a further part.
fn keys(place: &Place<'_>) -> Vec<Offer> {
    let node = place.node;
    let offers = |name: &str, form: &Form, about| {
        let texts = signs(form).iter().map(|sign| format!("{name}{sign}")).collect::<Vec<_>>();
        texts.into_iter().map(move |text| Offer { text, about })
    };
    if let Form::AnyOf(forms) = place.form {
        forms.iter().flat_map(|form| keys(&Place { form: *form, node })).collect()
    } else if let Form::Table(table) = place.form {
        let declared = table.keys().flat_map(|key| offers(key.name, &key.form, key.about));
        // A table with free names declares no keys for these names. The names come from the file.
        let chosen = node.and_then(Node::as_table).into_iter().flat_map(|table| &table.0).map(|entry| entry.name.as_str());
        let chosen = chosen.filter(|name| table.key(name).is_none() && is_word(name));
        declared.chain(table.others.into_iter().flat_map(|form| chosen.clone().flat_map(|name| offers(name, form, "")))).collect()
    } else if let Form::List(element) = place.form {
        entries(node).map(last_part).filter(|name| is_word(name)).flat_map(|name| offers(name, element, "")).collect()
    } else {
        Vec::new()
    }
}

/// Returns the possible signs after a key with a value of this form.
fn signs(form: &Form) -> &'static [&'static str] {
    let has_keys = |form: &Form| matches!(form, Form::Table(_)) || matches!(form, Form::List(element) if element.table().is_some());
    if has_keys(form) {
        return &["."];
    }
    // A value such as `loss` is a number, or a table with keys.
    if matches!(form, Form::AnyOf(forms) if forms.iter().any(has_keys)) { &["=", "."] } else { &["="] }
}

/// Returns the possible words of a value of this form. Empty for a form without a closed set of words.
fn words(form: Form) -> Vec<Offer> {
    if let Form::AnyOf(forms) = form {
        forms.iter().flat_map(|form| words(*form)).collect()
    } else if let Form::Words(words) = form {
        words.iter().map(|(word, about)| Offer { text: (*word).to_owned(), about }).collect()
    } else if let Form::Boolean = form {
        ["true", "false"].map(|word| Offer { text: word.to_owned(), about: "" }).into()
    } else {
        Vec::new()
    }
}

/// Returns `true` if a list is declared under the key `name` of the table.
fn is_list(table: &Table, name: &str) -> bool {
    table.key(name).is_some_and(|key| matches!(key.form, Form::List(_)))
}

fn entry<'a>(node: Option<&'a Node>, name: &str) -> Option<&'a Node> {
    node?.as_table()?.get(name).map(|entry| &*entry.node)
}

/// Returns the entries of a list. Empty if the value is no list.
fn entries(node: Option<&Node>) -> impl Iterator<Item = &Node> {
    let list = match node.map(|node| &node.value) {
        Some(Value::List(entries)) => entries.as_slice(),
        _ => &[],
    };
    list.iter().map(|entry| &**entry)
}

/// Returns the last part of the path of a list's entry: the word for the entry in a dotted key.
fn last_part(entry: &Node) -> &str {
    entry.path.rsplit('.').next().unwrap_or_default()
}

/// Returns `true` if a shell reads the text as one word without quotes.
fn is_word(text: &str) -> bool {
    !text.is_empty() && text.chars().all(|c| c.is_alphanumeric() || matches!(c, '-' | '_'))
}
