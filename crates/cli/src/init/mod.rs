//! `cohaptic init`: a scene to begin with.

mod peers;
mod shipped;
#[cfg(test)]
mod tests;
mod write;

use std::fmt::Write as _;
use std::path::Path;
use std::process::ExitCode;

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
    let own = peers::count(&scene);
    let wanted = peers.map_or(own, |peers| peers as usize);
    if wanted != own {
        peers::change(&mut scene, wanted);
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
        let title = scene.get("scene").and_then(|header| header.get("title")).and_then(toml::Value::as_str).unwrap_or_default();
        // Writing to a string does not fail.
        let _ = writeln!(list, "{name:<width$}  {title}");
    }
    Ok(list)
}

/// A scene that ships is TOML, which tests prove.
fn parsed(text: &str) -> Result<toml::Table, Failure> {
    text.parse().map_err(|error: toml::de::Error| Failure::System(format!("a scene within the program cannot be read: {error}")))
}

fn refuse_to_overwrite(file: &Path, force: bool) -> Result<(), Failure> {
    match file.symlink_metadata() {
        Ok(_) if !force => Err(Failure::Input(format!("{} is there already: expected another name, or --force to write over it", file.display()))),
        Ok(_) | Err(_) => Ok(()),
    }
}
