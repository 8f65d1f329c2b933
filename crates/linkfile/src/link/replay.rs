//! `replay`: a link that does what a log says.

use std::sync::Arc;

use cohaptic_wan::{FateLog, FateLogError};

use crate::document::Node;
use crate::reading::Context;
use crate::reading::named_file::{Fault, file_path, read_file};

pub(super) fn read_replay(node: &Node, context: Context<'_>) -> Option<Arc<FateLog>> {
    let path = file_path(node, context, "the name of a log of fates, relative to the folder of the scene")?;
    read_file(node, context, &path, "fates", |text| FateLog::parse(text).map(Arc::new).map_err(|error| fault(text, &error)))
}

fn fault(text: &str, error: &FateLogError) -> Fault {
    let line = match error {
        FateLogError::Header { .. } => Some(1),
        FateLogError::Cells { line, .. }
        | FateLogError::Cell { line, .. }
        | FateLogError::UnknownFate { line, .. }
        | FateLogError::Missing { line, .. }
        | FateLogError::OfferedBefore { line, .. }
        | FateLogError::ImpossibleTime { line, .. }
        | FateLogError::Contradiction { line, .. }
        | FateLogError::TwoEnds { line, .. } => Some(*line),
        FateLogError::NoEnd { .. } | FateLogError::CopyFromNowhere { .. } => None,
    };
    Fault::in_line(text, line.and_then(|line| usize::try_from(line).ok()), error)
}
