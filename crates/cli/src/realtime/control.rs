//! Live control of a run in real time: the server of `--control`, changes of links by keys, and the conversion of counters of a run into a snapshot.
//! Without `--control` the same snapshot feeds the progress line of the terminal.

use std::fs::File;
use std::io::{self, IsTerminal as _, Read as _};
#[cfg(target_os = "linux")]
use std::path::PathBuf;
use std::sync::Arc;
#[cfg(target_os = "linux")]
use std::sync::mpsc::Sender;
use std::time::Duration;

use cohaptic_control::{Board, Description, LinkCounters, LinkEditor, Quantiles, ServeError, Server, ServerConfig, Snapshot, Token, serve};
use cohaptic_files::{LimitedFile, MOST_BYTES, open_to_others};
#[cfg(target_os = "linux")]
use cohaptic_linkfile::reading::FileReader;
use cohaptic_realtime::LatenessSummary;
#[cfg(target_os = "linux")]
use cohaptic_scene::LinkKeys;
#[cfg(target_os = "linux")]
use cohaptic_wan::LinkModel;
use cohaptic_wan::{DropCause, LinkStats};

#[cfg(target_os = "linux")]
use super::ControlFiles;
use super::{reached_from_elsewhere, say};
use crate::arguments::RealTimeArguments;
use crate::failure::Failure;
use crate::file;

/// Board for the snapshots of a run, and the server of the board if the user gave `--control`.
pub(crate) struct LiveControl {
    board: Arc<Board>,
    server: Option<Server>,
}

impl LiveControl {
    /// Creates the board, starts the server if `--control` is given, and prints the address of the server on standard error.
    pub(crate) fn open(arguments: &RealTimeArguments, description: Description, editor: Box<dyn LinkEditor>) -> Result<Self, Failure> {
        let board = Arc::new(Board::new(description));
        let Some(address) = arguments.control else { return Ok(Self { board, server: None }) };
        let config = ServerConfig { token: token_of(arguments)?, allow_remote: arguments.allow_remote, ..ServerConfig::new(address) };
        let server = serve(config, Arc::clone(&board), editor).map_err(|error| refused_server(&error))?;
        say(&format!("live control: {}", server.url()));
        // The address above names the loopback interface, which other machines cannot reach.
        let elsewhere = reached_from_elsewhere(server.address(), server.url());
        if elsewhere != server.url() {
            say(&format!("live control, from other machines: {elsewhere}"));
        }
        Ok(Self { board, server: Some(server) })
    }

    /// Returns the run's handle for publishing snapshots, or `None` if neither a server nor a terminal shows snapshots.
    pub(crate) fn look(&self) -> Option<Look> {
        // A snapshot takes time on the real-time thread, so that none is made that nobody sees.
        let is_looked_at = self.server.is_some() || io::stderr().is_terminal();
        is_looked_at.then(|| Look(Arc::clone(&self.board)))
    }

    /// Returns the last published snapshot.
    pub(crate) fn latest(&self) -> Arc<Snapshot> {
        self.board.latest().snapshot
    }
}

/// Reads the token of `--token-file`, or returns `None` without that option.
///
/// # Errors
///
/// [`Failure::File`] if the file cannot be read. [`Failure::Input`] if other users may access the file, or if the content is not a token.
pub(crate) fn token_of(arguments: &RealTimeArguments) -> Result<Option<Token>, Failure> {
    let Some(path) = &arguments.token_file else { return Ok(None) };
    let unreadable = |error| Failure::File { verb: "read", path: path.clone(), error };
    let file = File::open(path).map_err(unreadable)?;
    if let Some(mode) = open_to_others(&file).map_err(unreadable)? {
        let path = path.display();
        return Err(Failure::Input(format!(
            "the token file {path} can be opened by others than its owner (mode {mode:03o}); close it with: chmod 600 {path}"
        )));
    }
    let mut bytes = Vec::new();
    LimitedFile::of(file, MOST_BYTES).and_then(|mut file| file.read_to_end(&mut bytes)).map_err(unreadable)?;
    let text = file::text_of(bytes, path)?;
    text.trim().parse().map(Some).map_err(|error| Failure::Input(format!("{}: {error}", path.display())))
}

pub(crate) fn refused_server(error: &ServeError) -> Failure {
    let is_of_system = matches!(error, ServeError::Listen { .. } | ServeError::Thread(_));
    if is_of_system { Failure::System(error.to_string()) } else { Failure::Input(error.to_string()) }
}

/// Handle for publishing the snapshots of a run on a board.
pub(crate) struct Look(Arc<Board>);

impl Look {
    /// Creates a handle for `board`, for commands without [`LiveControl`].
    pub(crate) fn on(board: &Arc<Board>) -> Self {
        Self(Arc::clone(board))
    }

    /// Publishes `snapshot`, unless a reader holds the board at this moment: the calling thread has to be on time and must not wait, and the next snapshot
    /// follows soon.
    pub(crate) fn publish(&self, snapshot: Snapshot) {
        let _ = self.0.publish(Arc::new(snapshot));
    }
}

/// Change of one link, checked and ready to be applied.
#[cfg(target_os = "linux")]
#[derive(Debug)]
pub(crate) struct Edit {
    /// Index of the link in the description of the run.
    pub(crate) link: usize,
    pub(crate) keys: LinkKeys,
    pub(crate) model: LinkModel,
}

/// Editor of the links of a run. Checks each change of keys and sends valid changes to the run.
#[cfg(target_os = "linux")]
#[derive(Debug)]
pub(crate) struct KeyedLinks {
    pub(crate) keys: Vec<LinkKeys>,
    /// Base folder of file names in keys.
    pub(crate) folder: PathBuf,
    /// Allowed files in changes.
    pub(crate) files: ControlFiles,
    pub(crate) changes: Sender<Edit>,
}

#[cfg(target_os = "linux")]
impl LinkEditor for KeyedLinks {
    fn keys(&self, link: usize) -> Vec<(String, String)> {
        self.keys.get(link).map_or_else(Vec::new, |keys| keys.iter().map(|(key, value)| (key.to_owned(), value.to_owned())).collect())
    }

    fn change(&mut self, links: &[usize], keys: &[(String, String)]) -> Result<(), String> {
        // All edits are checked before the first edit is applied, so that a change of several links applies to all links or to no link.
        let edits = links.iter().map(|link| {
            let old = self.keys.get(*link).ok_or_else(|| format!("there is no link {link}"))?;
            let new = keys.iter().fold(old.clone(), |laid, (key, value)| laid.with(key, value));
            let read = |path: &std::path::Path| self.files.read(old, &self.folder, path);
            let model = new.model_with(&self.folder, FileReader(&read)).map_err(|error| {
                // The bare message has no excerpt: the person at the page may name a file but must not see the content of the file.
                let said = error.bare_message();
                let at = error.diagnostic().map_or("", |diagnostic| diagnostic.override_text().unwrap_or_else(|| diagnostic.key()));
                let at = at.strip_prefix("link.").unwrap_or(at);
                if at.is_empty() { said } else { format!("{at}: {said}") }
            })?;
            Ok(Edit { link: *link, keys: new, model })
        });
        let edits: Vec<Edit> = edits.collect::<Result<_, String>>()?;
        for edit in edits {
            // The index is valid, because `get` found keys for each link of `edits` above.
            self.keys[edit.link] = edit.keys.clone();
            self.changes.send(edit).map_err(|_| "the run has ended".to_owned())?;
        }
        Ok(())
    }
}

/// Converts the statistics of a link into counters. Fields known only to some commands keep default values.
pub(crate) fn counters(stats: &LinkStats) -> LinkCounters {
    LinkCounters {
        offered: stats.offered(),
        duplicated: stats.duplicated(),
        delivered: stats.delivered(),
        dropped: DropCause::ALL.into_iter().map(|cause| (cause.name(), stats.dropped(cause))).collect(),
        marked: stats.marked(),
        damaged: stats.damaged(),
        in_flight: stats.in_flight(),
        mean_delay: stats.mean_delay(),
        ..LinkCounters::default()
    }
}

/// Converts a summary of lateness into quantiles.
pub(crate) fn quantiles(summary: &LatenessSummary) -> Quantiles {
    let LatenessSummary { count, sum, p50, p99, p999, max } = *summary;
    Quantiles { count, sum, p50, p99, p999, max }
}

/// Computes the quantiles of `spans`, which need not be sorted. All quantiles are zero if `spans` is empty.
pub(crate) fn quantiles_of(spans: &[Duration]) -> Quantiles {
    let mut sorted = spans.to_vec();
    sorted.sort_unstable();
    // Nearest rank: the smallest span such that at least `thousandths` per thousand of all spans are not longer. Ranks count from 1, indices from 0.
    let at = |thousandths: usize| sorted.get((sorted.len() * thousandths).div_ceil(1000).saturating_sub(1)).copied().unwrap_or_default();
    Quantiles {
        count: sorted.len() as u64,
        sum: sorted.iter().sum(),
        p50: at(500),
        p99: at(990),
        p999: at(999),
        max: sorted.last().copied().unwrap_or_default(),
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use std::sync::mpsc::channel;

    use super::*;

    #[test]
    fn a_change_of_several_links_is_made_whole_or_not_at_all() {
        let (changes, made) = channel();
        let keys = vec![LinkKeys::default().with("delay", "\"8ms\""), LinkKeys::default().with("netem", "\"delay 3ms\"")];
        let mut links = KeyedLinks { keys, folder: PathBuf::new(), files: ControlFiles::default(), changes };
        let loss = |value: &str| vec![("loss".to_owned(), value.to_owned())];
        // The keys of the second link are words of tc-netem. No other key may stand beside words.
        let error = links.change(&[0, 1], &loss("\"1%\"")).unwrap_err();
        assert!(error.contains("netem"), "{error}");
        assert_eq!(links.keys(0), [("delay".to_owned(), "\"8ms\"".to_owned())]);
        assert!(made.try_recv().is_err());
        links.change(&[0], &loss("\"1%\"")).unwrap();
        let edit = made.try_recv().unwrap();
        assert_eq!((edit.link, edit.keys.to_string().as_str()), (0, "{ delay = \"8ms\", loss = \"1%\" }"));
        assert_eq!(edit.model, edit.keys.model(std::path::Path::new("")).unwrap());
        let error = links.change(&[0], &loss("\"1.5\"")).unwrap_err();
        assert!(error.starts_with("loss=") && error.contains("expected"), "{error}");
        assert!(links.change(&[7], &loss("0.1")).is_err());
    }
}
