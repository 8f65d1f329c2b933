//! A scene for another number of peers.

use toml::{Table, Value};

/// How many peers a scene has.
pub(super) fn count(scene: &Table) -> usize {
    let by_number = scene.get("scene").and_then(|header| header.get("count")).and_then(Value::as_integer);
    by_number.and_then(|count| usize::try_from(count).ok()).unwrap_or_else(|| entries(scene, "peers").len())
}

/// Changes the number of peers: the last ones are left out, with all that names them, or others like the last one are added. Expectations of the
/// scene is left out, since it holds for the number that it was computed for.
pub(super) fn change(scene: &mut Table, wanted: usize) {
    scene.remove("expect");
    let header = scene.get_mut("scene").and_then(Value::as_table_mut);
    let left_out = match header.filter(|header| header.contains_key("count")) {
        Some(header) => {
            header.insert("count".to_owned(), Value::Integer(i64::try_from(wanted).unwrap_or(i64::MAX)));
            let number = |name: &str| name.strip_prefix("peer").and_then(|number| number.parse::<usize>().ok());
            let left_out: Vec<String> = names(scene).into_iter().filter(|name| number(name).is_some_and(|number| number > wanted)).collect();
            if let Some(Value::Array(peers)) = scene.get_mut("peers") {
                peers.retain(|peer| name(peer).is_none_or(|name| left_out.iter().all(|out| out != name)));
            }
            left_out
        }
        None => {
            let names = names(scene);
            if let Some(Value::Array(peers)) = scene.get_mut("peers") {
                peers.truncate(wanted);
                add_like_the_last(peers, wanted);
            }
            names.into_iter().skip(wanted).collect()
        }
    };
    for list in ["links", "timeline"] {
        if let Some(Value::Array(entries)) = scene.get_mut(list) {
            entries.retain(|entry| !mentions(entry, &left_out));
        }
    }
}

fn add_like_the_last(peers: &mut Vec<Value>, wanted: usize) {
    let Some(last) = peers.last().cloned() else { return };
    for number in peers.len() + 1..=wanted {
        let mut another = last.clone();
        if let Some(table) = another.as_table_mut() {
            table.insert("name".to_owned(), Value::String(format!("peer{number}")));
        }
        peers.push(another);
    }
}

/// Whether an entry is about one of these peers: names stand under `from`, `to` and `peer`.
fn mentions(entry: &Value, names: &[String]) -> bool {
    let is_one = |value: Option<&Value>| value.and_then(Value::as_str).is_some_and(|name| names.iter().any(|out| out == name));
    let ends = |value: &Value| is_one(value.get("from")) || is_one(value.get("to"));
    ends(entry) || is_one(entry.get("peer")) || entry.get("link").is_some_and(ends)
}

fn entries<'a>(scene: &'a Table, list: &str) -> &'a [Value] {
    scene.get(list).and_then(Value::as_array).map_or(&[], Vec::as_slice)
}

fn names(scene: &Table) -> Vec<String> {
    entries(scene, "peers").iter().filter_map(name).map(str::to_owned).collect()
}

fn name(peer: &Value) -> Option<&str> {
    peer.get("name").and_then(Value::as_str)
}
