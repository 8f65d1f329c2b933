//! `cohaptic init`: a scene to begin with.

mod shipped;
#[cfg(test)]
mod tests;
mod write;

use std::fmt::Write as _;
use std::path::Path;
use std::process::ExitCode;

use toml::{Table, Value};

use crate::arguments::InitArguments;
use crate::failure::Failure;
use crate::file::write_file;
use crate::{input, output};

/// Writes a scene in which every key is explained.
pub(crate) fn init(arguments: &InitArguments) -> Result<ExitCode, Failure> {
    if arguments.list {
        output::text(&list()?)?;
        return Ok(ExitCode::SUCCESS);
    }
    let Some((name, text)) = shipped::find(&arguments.from) else {
        return Err(Failure::Input(format!(
            "--from {}: there is no such scene: expected one of those that cohaptic init --list names",
            arguments.from
        )));
    };
    let scene = commented(name, text, arguments.peers)?;
    if input::is_standard_input(&arguments.file) {
        output::raw(scene.as_bytes())?;
        return Ok(ExitCode::SUCCESS);
    }
    refuse_to_overwrite(&arguments.file, arguments.force)?;
    write_file(&arguments.file, scene)?;
    output::wrote([&arguments.file]);
    Ok(ExitCode::SUCCESS)
}

/// A shipped scene for a number of peers, with every key explained.
fn commented(name: &str, text: &str, peers: Option<u32>) -> Result<String, Failure> {
    let mut scene = parsed(text)?;
    let own = peer_count(&scene);
    let wanted = peers.map_or(own, |peers| peers as usize);
    if wanted != own {
        change_peers(&mut scene, wanted);
    }
    Ok(write::scene(&scene, name, (wanted != own).then_some(own)))
}

/// Every name with the title of its scene.
fn list() -> Result<String, Failure> {
    let width = shipped::names().map(str::len).max().unwrap_or(0);
    let mut list = String::new();
    for name in shipped::names() {
        let (_, text) = shipped::find(name).unwrap_or_default();
        let scene = parsed(text)?;
        let title = scene.get("scene").and_then(|header| header.get("title")).and_then(Value::as_str).unwrap_or_default();
        // Writing to a string does not fail.
        let _ = writeln!(list, "{name:<width$}  {title}");
    }
    Ok(list)
}

/// A scene that ships is TOML, which tests prove.
fn parsed(text: &str) -> Result<Table, Failure> {
    text.parse().map_err(|error: toml::de::Error| Failure::System(format!("a scene within the program cannot be read: {error}")))
}

fn refuse_to_overwrite(file: &Path, force: bool) -> Result<(), Failure> {
    match file.symlink_metadata() {
        Ok(_) if !force => Err(Failure::Input(format!("{} is there already: expected another name, or --force to write over it", file.display()))),
        Ok(_) | Err(_) => Ok(()),
    }
}

fn peer_count(scene: &Table) -> usize {
    let by_number = scene.get("scene").and_then(|header| header.get("count")).and_then(Value::as_integer);
    by_number.and_then(|count| usize::try_from(count).ok()).unwrap_or_else(|| entries(scene, "peers").len())
}

/// Changes the number of peers: the last ones are left out, with all that names them, or others like the last one are added. Expectations of the
/// scene is left out, since it holds for the number that it was computed for.
fn change_peers(scene: &mut Table, wanted: usize) {
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
    fit_ring(scene, wanted);
}

/// A ring has an even number of neighbours, fewer than there are peers: as many of those it had as there are places for. Two peers hear each other on any topology, and need none.
fn fit_ring(scene: &mut Table, peers: usize) {
    let most = i64::try_from(peers.saturating_sub(1) / 2 * 2).unwrap_or(i64::MAX);
    let ring =
        scene.get_mut("topology").and_then(Value::as_table_mut).filter(|topology| topology.get("kind").and_then(Value::as_str) == Some("ring"));
    match ring {
        Some(_) if most == 0 => {
            scene.remove("topology");
        }
        Some(topology) if topology.get("neighbours").and_then(Value::as_integer).is_some_and(|neighbours| neighbours > most) => {
            topology.insert("neighbours".to_owned(), Value::Integer(most));
        }
        Some(_) | None => {}
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
