//! `cohaptic live`.

mod conductor;
mod document;
mod prepare;
mod status;
mod timeline;
mod words;

use std::fmt::Write as _;
use std::path::Path;
use std::process::ExitCode;
use std::sync::mpsc::channel;
use std::thread;
use std::time::Duration;

use cohaptic_live::{Report, Session, SessionConfig, SessionError, SessionKey, SystemEntropy};
use cohaptic_scene::{KeysOfLinks, Scene, SceneContent, link_key_changes_of_text, link_keys_of_text, scene_content_of_text};
use cohaptic_units::Instant;
use cohaptic_units::print::Span;

use crate::arguments::LiveArguments;
use crate::document_schema::DocumentSchema;
use crate::failure::{Failure, INTERRUPTED};
use crate::progress::Progress;
use crate::realtime::{KeyedLinks, LiveControl};
use crate::{failure, input, interrupt, output};
use conductor::SessionConductor;
use document::LiveDocument;
use prepare::ready_falcons;
use timeline::{Elapsed, Planned, TimedLinks};

/// Runs a scene by the wall clock with whoever is attached, and says how it went.
pub(crate) fn live(arguments: &LiveArguments) -> Result<ExitCode, Failure> {
    let (path, new_key) = (arguments.scene.as_deref(), arguments.new_key.as_deref());
    match (path, new_key) {
        (_, Some(file)) => make_key(file),
        (Some(path), None) => run(arguments, path),
        (None, None) => Err(Failure::Input("no scene was given".to_owned())),
    }
}

fn make_key(file: &Path) -> Result<ExitCode, Failure> {
    SessionKey::generate_to(file, &mut SystemEntropy).map_err(|error| Failure::System(error.to_string()))?;
    output::text("a new session key; only its owner can read it. Whoever has it can take part\n")?;
    output::wrote([file]);
    Ok(ExitCode::SUCCESS)
}

fn run(arguments: &LiveArguments, path: &Path) -> Result<ExitCode, Failure> {
    let mut overrides = arguments.overrides.set.clone();
    if let Some(length) = arguments.length {
        // Expectations of the whole scene, which may be longer, are not looked at in a session anyway.
        overrides.extend([format!("scene.duration={}", Span(length)), "expect={}".to_owned()]);
    }
    let overrides = overrides.as_slice();
    let scene = input::with(path, |text, file| Scene::parse_live(text, file, overrides))?;
    if let Some(error) = failure::too_large(&scene, overrides) {
        return Err(error.into());
    }
    let pairs = status::pairs(&scene);
    let number = |pair| pairs.iter().position(|known| *known == pair).expect("a pair of peers is a link");
    let numbered = |links: KeysOfLinks| links.into_iter().map(|(pair, keys)| (number(pair), keys)).collect();
    let planned: Planned = input::with(path, |text, file| link_key_changes_of_text(text, file, overrides))?
        .into_iter()
        .map(|(at, links)| (at, numbered(links)))
        .collect();
    let keys = input::with(path, |text, file| link_keys_of_text(text, file, overrides))?.into_values().collect();
    let folder = path.parent().map(Path::to_path_buf).unwrap_or_default();
    let (changes, wanted) = channel();
    let elapsed = Elapsed::default();
    let editor = TimedLinks { links: KeyedLinks { keys, folder, changes }, planned, elapsed: elapsed.clone() };
    let content = input::with(path, |text, file| scene_content_of_text(text, file, overrides))?;
    let session = open(arguments, &scene, content)?;
    let Some(session) = session else { return Ok(ExitCode::from(INTERRUPTED)) };
    prepare::announce(&scene, session.address(), arguments.key_file.is_some());
    let control = LiveControl::open(&arguments.real_time, status::description(&scene, &pairs), Box::new(editor))?;
    let host = SessionConductor::new(control.look(), wanted, pairs, elapsed, scene.axes.count());
    let report = conduct(&scene, session, host, &control)?;
    if arguments.json {
        output::json(DocumentSchema::LIVE, &LiveDocument::new(&scene, &report))?;
    } else {
        let mut text = words::describe(&scene, &report);
        if let Some(folder) = &arguments.out {
            let set: String = overrides.iter().map(|key| format!(" --set '{key}'")).collect();
            let _ = writeln!(text, "  replay: cohaptic run {}{set} --inputs {}", path.display(), folder.join("inputs.csv").display());
        }
        output::text(&text)?;
        output::wrote(&report.files);
    }
    Ok(if interrupt::requested() { ExitCode::from(INTERRUPTED) } else { ExitCode::SUCCESS })
}

/// Everything that must be had before time begins; `None` if the user did not want to wait for it.
fn open(arguments: &LiveArguments, scene: &Scene, content: SceneContent) -> Result<Option<Session>, Failure> {
    let real_time = &arguments.real_time;
    let key = match &arguments.key_file {
        None => None,
        Some(file) => Some(SessionKey::read_from(file).map_err(|error| Failure::Input(error.to_string()))?),
    };
    let config = SessionConfig {
        allow_remote: real_time.allow_remote,
        key,
        pacing: real_time.pacing(),
        wishes: real_time.wishes(),
        tolerance: real_time.tolerance(),
        out: arguments.out.clone(),
        content,
        ..SessionConfig::new(arguments.listen)
    };
    let Some(mut falcons) = ready_falcons(scene, arguments.firmware.as_deref(), real_time.wishes())? else { return Ok(None) };
    Session::open(scene, config, |peer| falcons.take(peer)).map(Some).map_err(refused)
}

fn conduct(scene: &Scene, session: Session, mut host: SessionConductor, control: &LiveControl) -> Result<Report, Failure> {
    let progress = Progress::through_scene(&scene.title, scene.duration);
    let report = thread::scope(|scope| {
        let running = thread::Builder::new().name("live".to_owned()).spawn_scoped(scope, move || session.run(&mut host));
        let running = running.map_err(|error| Failure::System(format!("the session gets no thread: {error}")))?;
        while !running.is_finished() {
            // Not the thread that has to be on time.
            thread::sleep(Duration::from_millis(50));
            let latest = control.latest();
            progress.reach(Instant::ZERO.saturating_add(latest.elapsed));
            progress.note(status::note(scene, &latest));
        }
        running.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)).map_err(refused)
    });
    progress.clear();
    report
}

fn refused(error: SessionError) -> Failure {
    if let SessionError::Record(error) = error {
        return error.into();
    }
    let is_of_system = matches!(error, SessionError::Bind(_) | SessionError::System(_));
    if is_of_system { Failure::System(error.to_string()) } else { Failure::Input(error.to_string()) }
}
