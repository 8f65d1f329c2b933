//! `cohaptic join`: one peer of a live session at another computer, with its device here.

mod answer;
mod joined;

use std::ops::ControlFlow;
use std::path::Path;
use std::process::ExitCode;
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use cohaptic_device::Device;
use cohaptic_harness::live::RecordedScene;
use cohaptic_live::join::{Join, JoinConfig, JoinError, JoinReport, JoinedConfig, JoinedStatus, SeatTaken};
use cohaptic_live::{Label, stale_after};
use cohaptic_scene::{PeerKind, Scene};
use cohaptic_units::print::Span;

use crate::arguments::{JoinArguments, JoinDevice};
use crate::document_schema::DocumentSchema;
use crate::failure::{Failure, INTERRUPTED};
use crate::file::own_folder;
use crate::live::exchanges::DeviceFacts;
use crate::live::{devices, exchanges};
use crate::progress::Progress;
use crate::realtime::{say, session_key, some_length};
use crate::{input, interrupt, output};
use joined::Joined;

/// Joins a session with one peer, and prints a report at the end.
pub(crate) fn join(arguments: &JoinArguments) -> Result<ExitCode, Failure> {
    let path = arguments.scene.as_path();
    let set = arguments.overrides.set.as_slice();
    let length = some_length(arguments.length)?;
    let theirs = input::with(path, |text, file| Scene::parse_live(text, file, set))?;
    let place = place(&theirs, path, &arguments.peer)?;
    let scene = input::with(path, |text, file| Scene::parse_live(text, file, &here(arguments)))?;
    let identity = RecordedScene::fingerprint_of(&theirs);
    let key = session_key(arguments.key_file.as_deref())?;
    let is_keyed = key.is_some();
    let stale_after = stale_after(&theirs).expect("the peer itself is of kind udp");
    let _own = arguments.out.as_deref().map(own_folder).transpose()?;
    let config = JoinConfig {
        session: arguments.session,
        joined: JoinedConfig { key, scene: identity.get(), label: label(arguments.device), stale_after },
        allow_remote: arguments.allow_remote,
        pacing: arguments.pace.pacing(),
        wishes: arguments.pace.wishes(),
        tolerance: arguments.pace.tolerance(),
        out: arguments.out.clone(),
        length,
    };
    let joined = Joined { scene: &theirs, place, session: arguments.session, device: arguments.device, identity, is_keyed };
    // The scene is checked before the device is opened, so that nobody homes a device for a scene that is then refused.
    Join::check(&scene, place, &config).map_err(|error| refused(error, &joined))?;
    let Some((device, facts)) = open_device(arguments, &scene, place)? else { return Ok(ExitCode::from(INTERRUPTED)) };
    let join = Join::open(&scene, place, config, device).map_err(|error| refused(error, &joined))?;
    say(&format!("asking {} to be {} at place {place}: session {}, scene {identity}", arguments.session, arguments.peer, theirs.seed));
    let mut report = conduct(join, &joined)?;
    // The peer has dropped its device, so that the facts are whole.
    let devices = facts.reports(&scene);
    report.validity = exchanges::judge(report.validity, &devices);
    if report.status.age.is_none() && report.status.is_seat_taken {
        return Err(Failure::System(format!("{}. {}", joined.taken(), joined.ways_out())));
    }
    if !joined.was_heard(&report.status) && !interrupt::requested() {
        return Err(Failure::System(joined.reasons(&report.status)));
    }
    let is_interrupted = interrupt::requested();
    let document = answer::of(&joined, &report, &devices, is_interrupted);
    output::answer(arguments.json, DocumentSchema::JOIN, &document, || answer::describe(&joined, &report, &devices), &report.files)?;
    Ok(if is_interrupted { ExitCode::from(INTERRUPTED) } else { ExitCode::SUCCESS })
}

/// Returns the overrides of the scene at this computer. In the scene of the session the peer is elsewhere; here the peer has the kind of its device, and the
/// rules of that kind check the keys.
fn here(arguments: &JoinArguments) -> Vec<String> {
    let kind = format!("peers.{}.kind={}", arguments.peer, arguments.device.kind());
    arguments.overrides.set.iter().cloned().chain([kind]).collect()
}

/// Returns the index of the peer, which must be of kind `udp`.
fn place(scene: &Scene, path: &Path, name: &str) -> Result<usize, Failure> {
    let file = input::named(path).display();
    let Some(place) = scene.peers.iter().position(|peer| peer.name == name) else {
        let names: Vec<&str> = scene.peers.iter().filter(|peer| matches!(peer.kind, PeerKind::Udp(_))).map(|peer| peer.name.as_str()).collect();
        let expected = if names.is_empty() { "a peer with kind = \"udp\", which it does not have".to_owned() } else { names.join(" or ") };
        return Err(Failure::Input(format!("--peer {name}: {file} has no such peer: expected {expected}")));
    };
    let kind = &scene.peers[place].kind;
    if !matches!(kind, PeerKind::Udp(_)) {
        let kind = kind.name();
        return Err(Failure::Input(format!(
            "--peer {name}: in {file} its kind is \"{kind}\", so the session itself computes it: expected kind = \"udp\", here and in the session"
        )));
    }
    Ok(place)
}

/// Returns the label that the page of the session shows.
fn label(device: JoinDevice) -> Label {
    let text = match device {
        JoinDevice::Falcon => "falcon",
        JoinDevice::Inverse3 => "inverse3",
        // A label has at most eight characters.
        JoinDevice::Simulated => "sim",
    };
    Label::new(text).expect("short and printable")
}

/// Device in a hand; `None` for a device that the peer simulates.
type Opened = Option<Box<dyn Device>>;

/// Opens the device of the peer, and waits until a simulated hand has made a simulated device ready. Returns the device with handles to facts about the device,
/// or `None` if the user asked for the end while waiting.
fn open_device(arguments: &JoinArguments, scene: &Scene, place: usize) -> Result<Option<(Opened, DeviceFacts)>, Failure> {
    match arguments.device {
        JoinDevice::Simulated => Ok(Some((None, DeviceFacts::default()))),
        JoinDevice::Falcon | JoinDevice::Inverse3 => {
            // The devices of the other peers are elsewhere.
            let mut own = scene.clone();
            own.peers.iter_mut().enumerate().filter(|(peer, _)| *peer != place).for_each(|(_, peer)| peer.kind = PeerKind::Simulated);
            if let Some(error) = devices::undriven(&own, &here(arguments)) {
                return Err(error.into());
            }
            let Some((mut devices, facts)) = devices::ready(&own, arguments.firmware.as_deref(), arguments.pace.wishes())? else { return Ok(None) };
            // Without this check a kind without a driver would be simulated, and the hand would feel nothing.
            let device =
                devices[place].take().ok_or_else(|| Failure::System(format!("--device {}: no driver opened it", arguments.device.kind())))?;
            Ok(Some((Some(device), facts)))
        }
    }
}

/// Runs the peer on a separate thread, and prints changes of session and device meanwhile.
fn conduct(join: Join, joined: &Joined<'_>) -> Result<JoinReport, Failure> {
    // From the first tick on there is a report worth printing, and the peer asks 50 times per second whether to go on.
    interrupt::has_results();
    let latest: Mutex<Option<JoinedStatus>> = Mutex::new(None);
    let progress = Progress::of_traffic(&joined.scene.peers[joined.place].name);
    let mut told = Told::default();
    let report = thread::scope(|scope| {
        let latest = &latest;
        let look = move |status: &JoinedStatus| {
            // The thread of the peer must not wait: a status that is being read is left as it is, and the next look comes soon.
            if let Ok(mut latest) = latest.try_lock() {
                *latest = Some(*status);
            }
            if interrupt::requested() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let running = thread::Builder::new().name("join".to_owned()).spawn_scoped(scope, move || join.run(look));
        let running = running.map_err(|error| Failure::System(format!("the system gives the peer no thread: {error}")))?;
        let mut rounds = 0_u32;
        while !running.is_finished() {
            thread::sleep(ROUND);
            rounds += 1;
            let status = *latest.lock().unwrap_or_else(PoisonError::into_inner);
            let Some(status) = status else { continue };
            told.tell(joined, &status, ROUND * rounds);
            if rounds.is_multiple_of(ROUNDS_A_SECOND) {
                progress.note(joined.line(&status));
            }
        }
        running.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)).map_err(|error| refused(error, joined))
    });
    progress.clear();
    report
}

/// Time between two looks of the thread that prints.
const ROUND: Duration = Duration::from_millis(50);
const ROUNDS_A_SECOND: u32 = 20;
/// Time without a welcome after which the possible reasons are listed.
const NO_WELCOME: Duration = Duration::from_secs(2);

/// Events told so far, so that each change is told once.
#[derive(Default)]
struct Told {
    reasons: bool,
    taken: bool,
    takes_part: bool,
    session_away: bool,
    device_away: bool,
}

impl Told {
    /// Prints the changes since the last call. `waited`: time since the beginning.
    fn tell(&mut self, joined: &Joined<'_>, status: &JoinedStatus, waited: Duration) {
        let name = &joined.scene.peers[joined.place].name;
        if status.is_seat_taken {
            if !std::mem::replace(&mut self.taken, true) {
                say(&format!("{}; waiting, because that program may have ended without a word", joined.taken()));
            }
            // A program without the seat hears nothing from the session: the silence has this cause.
            return;
        }
        self.taken = false;
        if !joined.was_heard(status) && waited >= NO_WELCOME && !std::mem::replace(&mut self.reasons, true) {
            say(&joined.reasons(status));
        }
        if joined.takes_part(status) && !std::mem::replace(&mut self.takes_part, true) {
            say(&format!("the session at {} takes part with {name}", joined.session));
        }
        if self.takes_part && std::mem::replace(&mut self.session_away, !status.is_session_there) == status.is_session_there {
            say(if status.is_session_there {
                "the session is back: the force rises again"
            } else {
                "nothing new from the session for 1 s: no force, and a new hello every 250 ms. If the session does not come back, it has ended, was started \
                 again with another scene or key, or the network between the two computers fails"
            });
        }
        if self.takes_part && std::mem::replace(&mut self.device_away, !status.is_device_there) == status.is_device_there {
            say(&if status.is_device_there {
                format!("the device is there: {name} is in the session")
            } else {
                format!("the device is not there, or not ready: the session lets {name} fade")
            });
        }
    }
}

fn refused(error: JoinError, joined: &Joined<'_>) -> Failure {
    if let JoinError::Record(error) = error {
        return error.into();
    }
    if let JoinError::SeatTaken(SeatTaken { patience, .. }) = error {
        return Failure::System(format!("{}, for {} now. {}", joined.taken(), Span(patience), joined.ways_out()));
    }
    let is_of_system = matches!(error, JoinError::Bind(_) | JoinError::System(_) | JoinError::Entropy(_));
    if is_of_system { Failure::System(error.to_string()) } else { Failure::Input(format!("{}: {error}", joined.scene.peers[joined.place].name)) }
}
