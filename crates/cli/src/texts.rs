//! Texts for other programs: manual pages (`cohaptic man`), generated from the definitions of the arguments, and JSON Schemas of files (`cohaptic schema`).

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Command;
use clap_mangen::Man;
use cohaptic_linkfile::schema::json_schema;
use cohaptic_scene::schema::FileSchema;

use crate::arguments::{Arguments, FileKind, ManArguments, SchemaArguments};
use crate::failure::Failure;
use crate::file::{own_folder, write_file};
use crate::output;

/// Prints the JSON Schema of a kind of file.
pub(crate) fn schema(arguments: &SchemaArguments) -> Result<ExitCode, Failure> {
    let schema = match arguments.kind {
        FileKind::Scene => FileSchema::Scene.json(),
        FileKind::Relay => FileSchema::Relay.json(),
        FileKind::RelayTcp => FileSchema::RelayTcp.json(),
        FileKind::Router => FileSchema::Router.json(),
        FileKind::Exec => FileSchema::Exec.json(),
        FileKind::Study => json_schema(&cohaptic_study::ROOT, "cohaptic study file"),
    };
    output::raw(format!("{schema}\n").as_bytes())?;
    Ok(ExitCode::SUCCESS)
}

/// Prints the manual page of a command, or writes the manual pages of all commands into a folder.
pub(crate) fn man(arguments: &ManArguments) -> Result<ExitCode, Failure> {
    let mut program = Arguments::program().disable_help_subcommand(true);
    // `build` gives the subcommands their full names. Pages and file names need the full names.
    program.build();
    let Some(folder) = &arguments.out else {
        output::raw(&page(find(&program, &arguments.command)?)?)?;
        return Ok(ExitCode::SUCCESS);
    };
    let _own = own_folder(folder)?;
    let mut written: Vec<PathBuf> = Vec::new();
    let mut left = vec![&program];
    while let Some(command) = left.pop() {
        let path = folder.join(Man::new(command.clone()).get_filename());
        write_file(&path, page(command)?)?;
        written.push(path);
        left.extend(command.get_subcommands());
    }
    // Commands come from a stack, in an order of no use to readers.
    written.sort();
    output::wrote(&written);
    Ok(ExitCode::SUCCESS)
}

fn find<'a>(program: &'a Command, names: &[String]) -> Result<&'a Command, Failure> {
    names.iter().try_fold(program, |command, name| {
        command.find_subcommand(name).ok_or_else(|| {
            let there: Vec<&str> = command.get_subcommands().map(Command::get_name).collect();
            let expected = if there.is_empty() { "no further word".to_owned() } else { format!("one of {}", there.join(", ")) };
            Failure::Input(format!("there is no command {name:?} of {}: expected {expected}", command.get_name()))
        })
    })
}

fn page(command: &Command) -> Result<Vec<u8>, Failure> {
    let mut page = Vec::new();
    Man::new(command.clone()).render(&mut page).map_err(Failure::StandardOutput)?;
    Ok(page)
}
