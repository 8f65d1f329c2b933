//! Live control, if it is asked for, and what the terminal shows meanwhile.

use std::io::{self, IsTerminal as _, Write as _};
use std::sync::Arc;

use cohaptic_control::{Board, Description, LinkEditor, ServeError, Server, ServerConfig, Snapshot, serve};

use crate::arguments::RealTimeArguments;
use crate::failure::Failure;
use crate::file;

/// The board of a run, with a server before it if somebody asked for one.
pub(crate) struct LiveControl {
    board: Arc<Board>,
    server: Option<Server>,
}

impl LiveControl {
    /// Opens the server, if it is asked for, and says on standard error where.
    pub(crate) fn open(arguments: &RealTimeArguments, description: Description, editor: Box<dyn LinkEditor>) -> Result<Self, Failure> {
        let board = Arc::new(Board::new(description));
        let Some(address) = arguments.control else { return Ok(Self { board, server: None }) };
        let token = match &arguments.token_file {
            None => None,
            Some(path) => {
                let text = file::read_text(path)?;
                Some(text.trim().parse().map_err(|error| Failure::Input(format!("{}: {error}", path.display())))?)
            }
        };
        let config = ServerConfig { token, allow_remote: arguments.allow_remote, ..ServerConfig::new(address) };
        let server = serve(config, Arc::clone(&board), editor).map_err(|error| {
            let is_of_system = matches!(error, ServeError::Listen { .. } | ServeError::Thread(_));
            if is_of_system { Failure::System(error.to_string()) } else { Failure::Input(error.to_string()) }
        })?;
        // What cannot be said does not keep the run from beginning.
        let _ = writeln!(io::stderr(), "live control: {}", server.url());
        Ok(Self { board, server: Some(server) })
    }

    /// What the run publishes on, if anybody looks: a browser or a terminal.
    pub(crate) fn look(&self) -> Option<Look> {
        let is_looked_at = self.server.is_some() || io::stderr().is_terminal();
        is_looked_at.then(|| Look(Arc::clone(&self.board)))
    }

    /// What was published last.
    pub(crate) fn latest(&self) -> Arc<Snapshot> {
        self.board.latest().snapshot
    }
}

/// Where a run publishes.
pub(crate) struct Look(Arc<Board>);

impl Look {
    /// Puts it up unless somebody is reading at this very moment; the next one comes soon.
    pub(crate) fn publish(&self, snapshot: Snapshot) {
        let _ = self.0.publish(Arc::new(snapshot));
    }
}
