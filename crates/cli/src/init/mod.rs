//! `cohaptic init`: writes a shipped scene as a commented file, the beginning of a user's own scene.
//!
//! `shipped` holds the texts of the scenes, this module changes the number of peers, and `write` writes the text with comments.

mod shipped;
#[cfg(test)]
mod tests;
mod write;

pub(crate) use shipped::names as shipped_names;

use std::fmt::Write as _;
use std::path::Path;
use std::process::ExitCode;

use toml::{Table, Value};

use crate::arguments::InitArguments;
use crate::failure::Failure;
use crate::file::write_file;
use crate::{input, output};

/// Writes the scene of `--from` with a comment for every key, or lists the names of the shipped scenes.
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

/// Returns the text of a shipped scene for `peers` peers, or for the scene's own number if `peers` is `None`, with a comment for every key.
fn commented(name: &str, text: &str, peers: Option<u32>) -> Result<String, Failure> {
    let mut scene = parsed(text)?;
    let own = peer_count(&scene);
    let wanted = peers.map_or(own, |peers| peers as usize);
    if wanted != own {
        change_peers(&mut scene, wanted);
    }
    // The text says so if the number of peers was changed, because the expectations of the scene are then left out.
    Ok(write::scene(&scene, name, (wanted != own).then_some(own)))
}

/// Returns a line per name of a shipped scene: the name and the scene's title.
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

/// Parses the text of a shipped scene. Tests parse every shipped scene, so that the failure does not occur in a released program.
fn parsed(text: &str) -> Result<Table, Failure> {
    text.parse().map_err(|error: toml::de::Error| Failure::System(format!("a scene within the program cannot be read: {error}")))
}

fn refuse_to_overwrite(file: &Path, force: bool) -> Result<(), Failure> {
    match file.symlink_metadata() {
        Ok(_) if !force => Err(Failure::Input(format!("{} exists already: expected another name, or --force to overwrite it", file.display()))),
        // An error mostly means that no file has this name. Writing the file reports every other obstacle.
        Ok(_) | Err(_) => Ok(()),
    }
}

/// Returns the number of peers: the scene's `count`, or the number of `[[peers]]` entries if the scene has no `count`.
fn peer_count(scene: &Table) -> usize {
    let by_number = scene.get("scene").and_then(|header| header.get("count")).and_then(Value::as_integer);
    by_number.and_then(|count| usize::try_from(count).ok()).unwrap_or_else(|| entries(scene, "peers").len())
}

/// Changes the number of peers to `wanted`. Removes the last peers with every entry that names a removed peer, or adds copies of the last peer.
///
/// The expectations of the scene are removed, because they hold only for the number of peers for which they were computed.
fn change_peers(scene: &mut Table, wanted: usize) {
    scene.remove("expect");
    let header = scene.get_mut("scene").and_then(Value::as_table_mut);
    // Peers of a scene with `count` are called peer1, peer2, … and need no entry: an entry only overrides keys of the named peer.
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
    // An entry of a removed peer would make the scene invalid.
    for list in ["links", "timeline"] {
        if let Some(Value::Array(entries)) = scene.get_mut(list) {
            entries.retain(|entry| !mentions(entry, &left_out));
        }
    }
    fit_ring(scene, wanted);
}

/// Reduces the number of neighbours on a ring to the largest even number below `peers`, if the scene has more.
///
/// For two peers the ring is removed: two peers hear each other on every topology.
fn fit_ring(scene: &mut Table, peers: usize) {
    // A ring needs an even number of neighbours (the same number on both sides), fewer than the number of peers.
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

/// Appends copies of the last peer, named after their place in the list, until the list has `wanted` entries.
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

/// Returns whether an entry of `links` or `timeline` names a peer of `names`: under `from`, `to` or `peer`, or under `from` or `to` of the entry's `link`.
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
