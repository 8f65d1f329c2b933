//! `cohaptic live`: runs a scene by the wall clock, with peers attached by network or as Falcons.

pub(crate) mod answer;
pub(crate) mod devices;
pub(crate) mod exchanges;
pub(crate) mod onlookers;
mod page;

use std::fmt::Write as _;
use std::net::SocketAddr;
use std::path::Path;
use std::process::ExitCode;
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::Duration;

use cohaptic_harness::Model;
use cohaptic_harness::live::RecordedScene;
use cohaptic_live::{OtherScene, Report, Session, SessionConfig, SessionError, SessionKey, SystemEntropy};
use cohaptic_scene::{Fingerprint, KeysOfLinks, PeerKind, Scene, SceneContent, link_key_changes_of_text, link_keys_of_text, scene_content_of_text};
use cohaptic_units::Instant;
use cohaptic_units::print::{Counted, Span};

use crate::arguments::LiveArguments;
use crate::document_schema::DocumentSchema;
use crate::failure::{self, Failure, INTERRUPTED};
use crate::file::{own_folder, write_file};
use crate::progress::Progress;
use crate::realtime::{ControlFiles, KeyedLinks, LiveControl, own_address, say, session_key};
use crate::run::page::edits;
use crate::{input, interrupt, output};
use exchanges::DeviceFacts;
use onlookers::SessionConductor;
use onlookers::{Elapsed, Planned, TimedLinks};
use page::Played;

/// Runs a scene by the wall clock with the attached peers and prints the report; or writes a new session key (`--new-key`).
pub(crate) fn live(arguments: &LiveArguments) -> Result<ExitCode, Failure> {
    let (path, new_key) = (arguments.scene.as_deref(), arguments.new_key.as_deref());
    match (path, new_key) {
        (_, Some(file)) => make_key(file),
        (Some(path), None) => run(arguments, path),
        (None, None) => {
            Err(Failure::Input("no scene was given: expected a file, such as cohaptic live scene.toml, or - for standard input".to_owned()))
        }
    }
}

fn make_key(file: &Path) -> Result<ExitCode, Failure> {
    SessionKey::generate_to(file, &mut SystemEntropy).map_err(|error| Failure::System(error.to_string()))?;
    output::text("this is a new session key. Only you can read its file; anybody who has the key can take part\n")?;
    output::wrote([file]);
    Ok(ExitCode::SUCCESS)
}

fn run(arguments: &LiveArguments, path: &Path) -> Result<ExitCode, Failure> {
    let mut overrides = arguments.overrides.set.clone();
    if let Some(length) = arguments.length {
        // Expectations are about the whole scene, which may be longer than this session. A session does not check expectations, so the override removes them.
        overrides.extend([format!("scene.duration={}", Span(length)), "expect={}".to_owned()]);
    }
    let overrides = overrides.as_slice();
    // The text is read before the session, which may last long, so that the page shows the scene of the session.
    let text = input::text(path)?;
    let scene = input::with(path, |text, file| Scene::parse_live(text, file, overrides))?;
    // The scene without the length of this session, which other computers need not know.
    let identity = RecordedScene::fingerprint_of(&input::with(path, |text, file| Scene::parse_live(text, file, &arguments.overrides.set))?);
    if scene.topology.is_some() {
        let message = "in a live session every peer sends to every other: expected a scene without [topology], or kind = \"full\"";
        return Err(Failure::Input(format!("{}: topology: {message}", input::named(path).display())));
    }
    if let Some(error) = failure::too_large(&scene, overrides, Model::Least, true) {
        return Err(error.into());
    }
    if let Some(error) = devices::undriven(&scene, overrides) {
        return Err(error.into());
    }
    let pairs = onlookers::pairs(&scene);
    let number = |pair| pairs.iter().position(|known| *known == pair).expect("a pair of peers is a link");
    let numbered = |links: KeysOfLinks| links.into_iter().map(|(pair, keys)| (number(pair), keys)).collect();
    let planned: Planned = input::with(path, |text, file| link_key_changes_of_text(text, file, overrides))?
        .into_iter()
        .map(|(at, links)| (at, numbered(links)))
        .collect();
    // The keys are ordered by sender, then by receiver, as `pairs` is. A link therefore has the same index in both.
    let keys = input::with(path, |text, file| link_keys_of_text(text, file, overrides))?.into_values().collect();
    let folder = path.parent().map(Path::to_path_buf).unwrap_or_default();
    let (changes, wanted) = channel();
    let elapsed = Elapsed::default();
    let editor =
        TimedLinks { links: KeyedLinks { keys, folder, files: ControlFiles::of(&arguments.files)?, changes }, planned, elapsed: elapsed.clone() };
    let content = input::with(path, |text, file| scene_content_of_text(text, file, overrides))?;
    let timeline = edits(&content.keys);
    let _own = arguments.out.as_deref().map(own_folder).transpose()?;
    let session = open(arguments, &scene, content, identity)?;
    let Some((session, facts)) = session else { return Ok(ExitCode::from(INTERRUPTED)) };
    announce(&scene, session.address(), arguments.key_file.is_some().then_some(identity));
    let control = LiveControl::open(&arguments.real_time, onlookers::description(&scene, &pairs), Box::new(editor))?;
    let (others, strangers) = channel();
    let host = SessionConductor::new(control.look(), wanted, pairs, elapsed, scene.axes.count(), others);
    let mut report = conduct(&scene, session, host, &control, &strangers)?;
    // The session has dropped its devices, so that their facts are whole.
    let devices = facts.reports(&scene);
    report.validity = exchanges::judge(report.validity, &devices);
    if let Some(folder) = &arguments.out {
        let file = folder.join("live.html");
        write_file(&file, page::html(arguments, path, &Played { scene: &scene, text: &text, overrides, timeline: &timeline }, &report))?;
        report.files.push(file);
    }
    if arguments.json {
        output::json(DocumentSchema::LIVE, &answer::of(&scene, &report, &devices))?;
    } else {
        let mut text = answer::describe(&scene, &report, &devices);
        if let Some(folder) = &arguments.out {
            let set: String = overrides.iter().map(|key| format!(" --set '{key}'")).collect();
            let _ = writeln!(text, "  replay: cohaptic run {}{set} --inputs {}", path.display(), folder.join("inputs.csv").display());
        }
        output::text(&text)?;
        output::wrote(&report.files);
    }
    Ok(if interrupt::requested() { ExitCode::from(INTERRUPTED) } else { ExitCode::SUCCESS })
}

/// Opens the key, the devices and the sockets before the time of the session begins. Returns `None` if the user asked for the end while waiting.
fn open(arguments: &LiveArguments, scene: &Scene, content: SceneContent, identity: Fingerprint) -> Result<Option<(Session, DeviceFacts)>, Failure> {
    let real_time = &arguments.real_time;
    // The key is read first: a wrong file is refused before devices are homed.
    let key = session_key(arguments.key_file.as_deref())?;
    let config = SessionConfig {
        allow_remote: real_time.allow_remote,
        key,
        pacing: real_time.pace.pacing(),
        wishes: real_time.pace.wishes(),
        tolerance: real_time.pace.tolerance(),
        out: arguments.out.clone(),
        content,
        identity: Some(identity),
        ..SessionConfig::new(arguments.listen)
    };
    // Simulated devices take time to home. The sockets are opened afterwards, so that peers find a session that is about to begin.
    let Some((mut devices, facts)) = devices::ready(scene, arguments.firmware.as_deref(), real_time.pace.wishes())? else { return Ok(None) };
    Session::open(scene, config, |peer| devices[peer].take()).map(|session| Some((session, facts))).map_err(refused)
}

fn conduct(
    scene: &Scene,
    session: Session,
    mut host: SessionConductor,
    control: &LiveControl,
    strangers: &Receiver<OtherScene>,
) -> Result<Report, Failure> {
    // From the first sample on, the session has a record worth keeping, and the session asks the conductor 50 times per second whether to go on. A signal
    // therefore ends the session in order.
    interrupt::has_results();
    let progress = Progress::through_scene(&scene.title, scene.duration);
    let report = thread::scope(|scope| {
        let running = thread::Builder::new().name("live".to_owned()).spawn_scoped(scope, move || session.run(&mut host));
        let running = running.map_err(|error| Failure::System(format!("the system gives the session no thread: {error}")))?;
        while !running.is_finished() {
            // The session runs on a thread of its own, so that this sleep delays no tick.
            thread::sleep(Duration::from_millis(50));
            let latest = control.latest();
            progress.reach(Instant::ZERO.saturating_add(latest.elapsed));
            progress.note(onlookers::note(scene, &latest));
            strangers.try_iter().for_each(|other| say(&answer::other_scene(scene, &other)));
        }
        running.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)).map_err(refused)
    });
    progress.clear();
    report
}

pub(crate) fn refused(error: SessionError) -> Failure {
    if let SessionError::Record(error) = error {
        return error.into();
    }
    let is_of_system = matches!(error, SessionError::Bind(_) | SessionError::System(_));
    if is_of_system { Failure::System(error.to_string()) } else { Failure::Input(error.to_string()) }
}

/// Prints the address for the datagrams of remote peers, if the scene has remote peers. `key`: fingerprint of the scene, in a session with a key.
fn announce(scene: &Scene, address: Option<SocketAddr>, key: Option<Fingerprint>) {
    let Some(address) = address else { return };
    let peers = scene.peers.iter().enumerate().filter(|(_, peer)| matches!(peer.kind, PeerKind::Udp(_)));
    let peers: Vec<String> = peers.map(|(place, peer)| format!("{} at place {place}", peer.name)).collect();
    // Only a peer with the key is asked for its scene.
    let key = key.map_or_else(|| "without a key".to_owned(), |identity| format!("with its key, scene {identity}"));
    say(&format!("listening on {address} for {}: session {}, {}, {key}", peers.join(", "), scene.seed, Counted(scene.axes.count(), "axis")));
    if let Some(own) = own_address(address) {
        say(&format!("programs on other machines send to {own}"));
    }
}
