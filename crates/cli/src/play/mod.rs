//! `cohaptic play`: a session in which people move the hands of a scene from a web page.
//!
//! The session runs in parts. A part ends when a page asks for another strategy, another number of peers or a reset; the next part begins where the copies
//! stand. This module opens the server and runs one part after the other, `stage` answers the pages, and `scene` makes the scene of each part.

mod compare;
#[cfg(test)]
mod continuity;
mod desktop;
mod frames;
mod scene;
mod stage;

use std::io::Write as _;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::Instant as Clock;

use cohaptic_control::{Board, ServerConfig, serve_stage};
use cohaptic_files::{OwnFolder, write_whole};
use cohaptic_harness::Ending;
use cohaptic_harness::task::task_words;
use cohaptic_live::{Conductor, LinkChange, Motion, Recorded, Report, Session, SessionConfig, Status};
use cohaptic_scene::{PeerKind, link_keys_of_text, scene_content_of_text};

pub(crate) use self::frames::Frames;
use self::scene::{PEERS, PlayedScene};
pub(crate) use self::stage::scene_facts;
use self::stage::{Part, PartLinks, PlayStage};
use crate::arguments::PlayArguments;
use crate::failure::Failure;
use crate::live::onlookers;
use crate::realtime::{ControlFiles, Edit, KeyedLinks, Look, reached_from_elsewhere, refused_server, say, token_of};
use crate::{input, interrupt};

/// Text of the default scene: three users, average-position, a delay of 24 ms.
const USUAL: &str = include_str!("../../scenarios/live/play.toml");
const USUAL_NAME: &str = "play.toml";

/// Runs the session until Ctrl-C or the end of `--for`, part by part, and prints the addresses of the page.
pub(crate) fn play(arguments: &PlayArguments) -> Result<ExitCode, Failure> {
    let overrides = &arguments.overrides.set;
    let beginning = match &arguments.scene {
        Some(path) => input::with(path, |text, file| PlayedScene::read(text, file, overrides))?,
        None => PlayedScene::read(USUAL, Path::new(USUAL_NAME), overrides)?,
    };
    check(&beginning)?;
    let (beginning, lent) = lend_hand(beginning)?;
    let records = Records::create(arguments.out.as_deref())?;
    let stage = Arc::new(PlayStage::new(beginning.clone(), arguments.scene.is_none(), ControlFiles::of(&arguments.files)?));
    let scene = beginning.scene()?;
    let board = Arc::new(Board::new(onlookers::description(&scene, &onlookers::pairs(&scene))));
    let address = arguments.real_time.control.unwrap_or_else(|| SocketAddr::from(([127, 0, 0, 1], 0)));
    let config =
        ServerConfig { token: token_of(&arguments.real_time)?, allow_remote: arguments.real_time.allow_remote, ..ServerConfig::new(address) };
    let server = serve_stage(config, Arc::clone(&board), Box::new(PartLinks(Arc::clone(&stage))), Arc::clone(&stage) as _);
    let server = server.map_err(|error| refused_server(&error))?;
    let join = reached_from_elsewhere(server.address(), server.join_url().unwrap_or_default());
    // The stage is new, so that the address is set only once.
    let _first = stage.join.set(join.clone());
    let announce = || {
        say(&format!("open {}", server.url()));
        say(&format!("for others: {join}"));
        if let Some(name) = &lent {
            say(&format!("the pointer of the page has the hand of {name}, which the scene simulates"));
        }
        if !arguments.no_open && desktop::is_there() {
            desktop::open(&server.open_url());
        }
    };
    let begun = Clock::now();
    let mut next = beginning;
    for number in 1.. {
        let (part, session, conductor) = prepare(arguments, &stage, &board, number, next, &records, begun)?;
        // The addresses are printed once the first part is ready, so that a page opened at once finds a scene.
        if number == 1 {
            announce();
        }
        let report = run_part(session, conductor)?;
        // A part also ends by a wish of a page. Only a signal or the time of `--for` ends the session.
        let is_over = interrupt::requested() || arguments.length.is_some_and(|length| begun.elapsed() >= length);
        let fell_apart = matches!(report.summary.ending, Ending::Diverged(_));
        // A diverged part has no finite state for a next part, so that the next part begins anew.
        next = stage.finish(&part, records.inputs(number), fell_apart);
        let task = report.task.as_ref().map(|task| format!(", task: {}", task_words(task, &part.scene))).unwrap_or_default();
        say(&format!("part {number}: {}, the run is {}{task}", part.scene.coordination.strategy.name(), report.validity));
        if is_over {
            break;
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// Refuses scenes that cannot be played: with a topology, with a timeline, with too few or too many peers, or with peers on other devices.
fn check(played: &PlayedScene) -> Result<(), Failure> {
    let scene = played.scene()?;
    let refuse = |message: String| Err(Failure::Input(format!("{}: {message}", played.file().display())));
    if scene.topology.is_some() {
        return refuse("topology: in a session every peer sends to every other: expected a scene without [topology], or kind = \"full\"".to_owned());
    }
    if played.has_timeline() {
        return refuse("timeline: a session that begins anew has no timeline: expected a scene without one".to_owned());
    }
    if !PEERS.contains(&scene.peers.len()) {
        return refuse(format!("peers: {} of them: expected {} to {}", scene.peers.len(), PEERS.start(), PEERS.end()));
    }
    if let Some(peer) = scene.peers.iter().find(|peer| matches!(peer.kind, PeerKind::Udp(_) | PeerKind::Falcon(..) | PeerKind::Inverse3(..))) {
        let kind = peer.kind.name();
        let name = &peer.name;
        return refuse(format!(
            "peers.{name}.kind: {kind}: expected simulated or pointer, as after --set peers.{name}.kind=pointer; `cohaptic live` takes the others"
        ));
    }
    Ok(())
}

/// Makes sure that the scene has a pointer for the visitor. Also returns the name of the new pointer, if the scene itself has no pointer.
fn lend_hand(played: PlayedScene) -> Result<(PlayedScene, Option<String>), Failure> {
    let file = played.file().display().to_string();
    played.with_hand()?.ok_or_else(|| {
        Failure::Input(format!("{file}: peers: every device turns, and a pointer turns nothing: expected a peer whose device has no inertia"))
    })
}

/// Opens the session of part `number`, and publishes the part to the pages. `begun` is the beginning of the first part.
fn prepare(
    arguments: &PlayArguments,
    stage: &Arc<PlayStage>,
    board: &Arc<Board>,
    number: usize,
    played: PlayedScene,
    records: &Records,
    begun: Clock,
) -> Result<(Arc<Part>, Session, PartConductor), Failure> {
    let real_time = &arguments.real_time;
    let (text, scene) = (played.text(), played.scene()?);
    let pairs = onlookers::pairs(&scene);
    let keys = link_keys_of_text(&text, played.file(), &[])?.into_values().collect();
    let content = scene_content_of_text(&text, played.file(), &[])?;
    let folder = played.file().parent().map(Path::to_path_buf).unwrap_or_default();
    let (changes, wanted) = channel();
    let config = SessionConfig {
        pacing: real_time.pace.pacing(),
        wishes: real_time.pace.wishes(),
        tolerance: real_time.pace.tolerance(),
        out: Some(records.begin(number, &text)?),
        recorded: Recorded::Inputs,
        content,
        ..SessionConfig::new(SocketAddr::from(([127, 0, 0, 1], 0)))
    };
    // The session is opened before the pages learn of the part, so that a refused scene never appears on a page.
    let session = Session::open(&scene, config, |place| stage.device(place)).map_err(crate::live::refused)?;
    board.begin(onlookers::description(&scene, &pairs));
    let axes = scene.axes.count();
    let part = stage.begin(Part { number, played, scene }, KeyedLinks { keys, folder, files: stage.files.clone(), changes });
    let end = arguments.length.map(|length| begun + length);
    Ok((part, session, PartConductor { stage: Arc::clone(stage), look: Look::on(board), wanted, pairs, axes, end }))
}

/// Runs a part until its conductor ends the part, and returns the session's report.
fn run_part(session: Session, mut conductor: PartConductor) -> Result<Report, Failure> {
    // The part is recorded from its first sample on, and the session asks the conductor 50 times a second.
    interrupt::has_results();
    let running = thread::Builder::new().name("play".to_owned()).spawn(move || session.run(&mut conductor));
    let running = running.map_err(|error| Failure::System(format!("the system gives the session no thread: {error}")))?;
    running.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)).map_err(crate::live::refused)
}

/// Conductor of one part: publishes status and motion to the pages, and passes the pages' changes of links to the session.
struct PartConductor {
    stage: Arc<PlayStage>,
    look: Look,
    /// Changes of links by the pages.
    wanted: Receiver<Edit>,
    /// Sender and receiver of each link, in the order of the board.
    pairs: Vec<(usize, usize)>,
    axes: usize,
    /// End of the session by `--for`.
    end: Option<Clock>,
}

impl Conductor for PartConductor {
    fn keep_going(&mut self) -> bool {
        !interrupt::requested() && !self.stage.is_wished() && self.end.is_none_or(|end| Clock::now() < end)
    }

    fn next_change(&mut self) -> Option<LinkChange> {
        onlookers::change(&self.wanted, &self.pairs)
    }

    fn show(&mut self, status: Status) {
        self.look.publish(onlookers::snapshot(&status, self.axes));
    }

    fn show_motion(&mut self, motion: Motion) {
        self.stage.frames.publish(motion);
    }

    fn wants_motion(&self) -> bool {
        true
    }
}

/// Folder of the records, with one folder per part: the folder of `--out`, or a temporary folder that is removed at the end.
struct Records {
    folder: PathBuf,
    /// Ownership of the folder of `--out`; `None` for a temporary folder.
    own: Option<OwnFolder>,
}

impl Records {
    fn create(out: Option<&Path>) -> Result<Self, Failure> {
        let refused = |folder: &Path, error: &std::io::Error| Failure::System(format!("{}: {error}", folder.display()));
        if let Some(folder) = out {
            let own = OwnFolder::take(folder).map_err(|error| refused(folder, &error))?;
            return Ok(Self { folder: folder.to_path_buf(), own: Some(own) });
        }
        let folder = std::env::temp_dir().join(format!("cohaptic-play-{}", std::process::id()));
        // Creating fails if the folder exists: in the shared temporary folder another user could have prepared a folder of this name.
        std::fs::create_dir(&folder).map_err(|error| refused(&folder, &error))?;
        Ok(Self { folder, own: None })
    }

    /// Creates the folder of a part, writes the part's scene as `scene.toml`, and returns the path of the folder.
    fn begin(&self, number: usize, scene: &str) -> Result<PathBuf, Failure> {
        let folder = self.part(number);
        let file = folder.join("scene.toml");
        let written = std::fs::create_dir_all(&folder).and_then(|()| write_whole(&file, |file| file.write_all(scene.as_bytes())));
        written.map_err(|error| Failure::System(format!("{}: {error}", file.display())))?;
        Ok(folder)
    }

    fn part(&self, number: usize) -> PathBuf {
        self.folder.join(format!("part-{number}"))
    }

    fn inputs(&self, number: usize) -> PathBuf {
        self.part(number).join("inputs.csv")
    }
}

impl Drop for Records {
    fn drop(&mut self) {
        if self.own.is_none() {
            // Files that cannot be removed now remain until the system cleans its temporary folder.
            let _ = std::fs::remove_dir_all(&self.folder);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use cohaptic_peer::Contact;

    use super::*;

    /// Shipped scenes by their path in `scenarios`, each with the reason for which the scene is refused, if so.
    fn shipped() -> BTreeMap<String, Result<PlayedScene, String>> {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios");
        let folders = std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).filter(|path| path.is_dir());
        let files = folders.flat_map(|folder| std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()));
        let scenes = files.filter(|path| path.extension().is_some_and(|extension| extension == "toml"));
        scenes
            .map(|path| {
                let text = std::fs::read_to_string(&path).unwrap();
                let played = PlayedScene::read(&text, &path, &[]).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
                let lent = check(&played).and_then(|()| lend_hand(played)).map(|(played, _)| played);
                let name = path.strip_prefix(&folder).unwrap().display().to_string();
                (name, lent.map_err(|failure| format!("{failure:?}")))
            })
            .collect()
    }

    #[test]
    fn every_shipped_scene_has_a_hand_for_the_visitor_or_says_why_not() {
        let refused = [
            ("coordination/n50.toml", "50 of them"),
            ("coordination/topology-graph.toml", "topology"),
            ("coordination/topology-ring.toml", "topology"),
            ("coordination/topology-star.toml", "topology"),
            ("counterexamples/wave-held.toml", "timeline"),
            ("live/three-falcons.toml", "kind=pointer"),
            ("live/two-inverse3s.toml", "kind=pointer"),
            ("live/two-and-a-program.toml", "kind=pointer"),
            ("network/push-contact.toml", "timeline"),
            ("network/timeline.toml", "timeline"),
            ("tasks/reach.toml", "timeline"),
        ];
        let refused = BTreeMap::from(refused);
        let scenes = shipped();
        assert!(scenes.len() > 80, "{}", scenes.len());
        for (name, played) in &scenes {
            match (played, refused.get(name.as_str())) {
                (Ok(played), None) => {
                    let scene = played.scene().unwrap();
                    let held = scene.peers.iter().filter(|peer| matches!(peer.kind, PeerKind::Pointer(..)) && peer.contact != Contact::None);
                    assert!(held.count() >= 1, "{name}");
                    // Every peer stands in the scene's text, since the next part sets the peers' positions there.
                    assert_eq!(played.clone().with_peers(scene.peers.len()).scene().unwrap(), scene, "{name}");
                }
                (Err(message), Some(word)) => assert!(message.contains(word), "{name}: {message}"),
                (Ok(_), Some(word)) => panic!("{name} is played: {word}"),
                (Err(message), None) => panic!("{name}: {message}"),
            }
        }
        assert!(refused.keys().all(|name| scenes.contains_key(*name)), "{refused:?}");
    }
}
