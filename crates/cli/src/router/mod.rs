//! `cohaptic router`.

mod conduct;
mod document;
mod status;
mod words;

use std::path::Path;
use std::process::ExitCode;
use std::sync::mpsc::channel;

use cohaptic_linkfile::router::{RouterFile, Side};
use cohaptic_router::Router;
use cohaptic_units::Instant;

use crate::arguments::RouterArguments;
use crate::document_schema::DocumentSchema;
use crate::failure::{Failure, INTERRUPTED};
use crate::realtime::{KeyedLinks, LiveControl, say, some_length};
use crate::{input, interrupt, output};
use conduct::{Ending, RouterRun};
use document::RouterDocument;

/// Puts the emulator between two devices, and says what it did.
pub(crate) fn router(arguments: &RouterArguments) -> Result<ExitCode, Failure> {
    let until = some_length(arguments.length)?.map(|length| Instant::ZERO.saturating_add(length));
    let file = input::with(&arguments.file, |text, file| RouterFile::parse(text, file, &arguments.set))?;
    let real_time = &arguments.real_time;
    let router = Router::open(&file, real_time.pacing()).map_err(|error| Failure::System(error.to_string()))?;
    say(&format!("between {} and {}", attached(&file, Side::Left), attached(&file, Side::Right)));
    let (changes, wanted) = channel();
    // Each direction has keys of its own: it can be changed by itself.
    let keys = file.links.iter().flat_map(|link| [link.keys.clone(), link.keys.clone()]).collect();
    let folder = arguments.file.parent().map(Path::to_path_buf).unwrap_or_default();
    let control = LiveControl::open(real_time, status::description(&file), Box::new(KeyedLinks { keys, folder, changes }))?;
    let ran = conduct::conduct(router, &file, arguments, until, &control, wanted)?;
    if arguments.json {
        output::json(DocumentSchema::ROUTER, &RouterDocument::new(&file, &ran))?;
    } else {
        output::text(&words::describe(&file, &ran))?;
    }
    match ran {
        RouterRun { ending: Ending::Failed(error), .. } => Err(Failure::System(error.to_string())),
        RouterRun { ending: Ending::Complete | Ending::Interrupted, .. } => {
            Ok(if interrupt::requested() { ExitCode::from(INTERRUPTED) } else { ExitCode::SUCCESS })
        }
    }
}

/// `left (tun left0 in the namespace lab)`.
fn attached(file: &RouterFile, side: Side) -> String {
    use cohaptic_linkfile::router::Attachment;
    let attachment = match side {
        Side::Left => &file.left,
        Side::Right => &file.right,
    };
    let kind = match attachment {
        Attachment::Tun(_) => "tun",
        Attachment::Interface(_) => "interface",
    };
    let within = attachment.namespace().map_or_else(String::new, |namespace| format!(" in the namespace {namespace}"));
    format!("{} ({kind} {}{within})", side.name(), attachment.device())
}
