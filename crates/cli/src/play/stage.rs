//! The stage of `cohaptic play`: answers the requests of the pages for hands, for another part, for a comparison, and for files of the last part.
//!
//! Threads of the control server call [`Hands`] and [`Stage`], and the thread of the session calls the inherent methods. Each changing field is atomic or has a lock of its
//! own.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::thread;
use std::time::{Duration, Instant as Clock};

use cohaptic_control::{Hands, LinkEditor, Role, Stage, StageFile};
use cohaptic_device::Device;
use cohaptic_live::PeerStatus;
use cohaptic_live::pointers::Pointer;
use cohaptic_peer::Coordination;
use cohaptic_scene::{PeerKind, Scene, TaskKind};
use serde_json::{Map, Value, json};

use super::compare::{Finished, compare};
use super::frames::Frames;
use super::scene::{Links, PEERS, PlayedScene, said};
use crate::live::onlookers::pairs;
use crate::realtime::{ControlFiles, KeyedLinks};

/// Longest time that a comparison waits for the present part to end and to be written.
const PATIENCE: Duration = Duration::from_secs(10);

/// Changes for the next part, asked for by a page. `None` keeps the value of the present part.
#[derive(Clone, Debug, Default)]
pub(super) struct Wish {
    strategy: Option<String>,
    peers: Option<usize>,
    /// `true` if the next part begins from the initial states of the scene, not from the states in which the present part ends.
    reset: bool,
}

impl Wish {
    /// Reads a wish from JSON. An unknown key, or a number of peers outside [`PEERS`], is an error for the page.
    fn read(value: &Value) -> Result<Self, String> {
        let keys = value.as_object().ok_or("expected a JSON object such as {\"strategy\": \"average-position\"} or {\"peers\": 4}")?;
        let mut wish = Self::default();
        for (key, value) in keys {
            match (key.as_str(), value) {
                ("strategy", Value::String(name)) => wish.strategy = Some(name.clone()),
                ("reset", Value::Bool(reset)) => wish.reset = *reset,
                ("peers", value) => {
                    let number = value.as_u64().and_then(|number| usize::try_from(number).ok()).filter(|number| PEERS.contains(number));
                    wish.peers = Some(number.ok_or_else(|| format!("peers: {value}: expected {} to {}", PEERS.start(), PEERS.end()))?);
                }
                _ => return Err(format!("{key}: expected strategy, peers or reset")),
            }
        }
        Ok(wish)
    }
}

/// The running part: the number, counted from 1, and the scene, as document and as parsed.
pub(super) struct Part {
    pub(super) number: usize,
    pub(super) played: PlayedScene,
    pub(super) scene: Scene,
}

/// The stage of `cohaptic play`.
pub(super) struct PlayStage {
    pub(super) frames: Frames,
    /// Scene of the first part, to which a reset returns.
    beginning: PlayedScene,
    /// `true` if the page shows the three guided steps. The steps describe the default scene only.
    is_guided: bool,
    /// Allowed files in changes of links.
    pub(super) files: ControlFiles,
    /// One pointer per possible peer, indexed by peer. The pointers outlive the parts, so that a hand keeps its position across a border.
    pointers: Vec<Pointer>,
    /// `true` if a page has taken the hand, indexed by peer.
    taken: Mutex<Vec<bool>>,
    part: Mutex<Option<Arc<Part>>>,
    links: Mutex<Option<KeyedLinks>>,
    wish: Mutex<Option<Wish>>,
    /// `true` if `wish` holds a wish. Written with the lock of `wish` held. An atomic, so that the real-time thread asks without a lock.
    is_wished: AtomicBool,
    finished: Mutex<Option<Arc<Finished>>>,
    /// Address for other people, known once the server listens.
    pub(super) join: OnceLock<String>,
}

/// Locks the mutex, also if another thread panicked while it held the lock.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl PlayStage {
    pub(super) fn new(beginning: PlayedScene, is_guided: bool, files: ControlFiles) -> Self {
        Self {
            frames: Frames::default(),
            beginning,
            is_guided,
            files,
            // A later part may have more peers than this part, so there is a pointer for the greatest number.
            pointers: (0..*PEERS.end()).map(|_| Pointer::default()).collect(),
            taken: Mutex::new(vec![false; *PEERS.end()]),
            part: Mutex::new(None),
            links: Mutex::new(None),
            wish: Mutex::new(None),
            is_wished: AtomicBool::new(false),
            finished: Mutex::new(None),
            join: OnceLock::new(),
        }
    }

    /// Makes `part` the running part with the links `links`.
    pub(super) fn begin(&self, part: Part, links: KeyedLinks) -> Arc<Part> {
        self.frames.begin(part.number, part.scene.axes.count(), Vec::new());
        let part = Arc::new(part);
        *lock(&self.part) = Some(Arc::clone(&part));
        *lock(&self.links) = Some(links);
        part
    }

    /// Returns the device of the pointer of peer `place`; `None` if `place` is not below the largest number of peers.
    pub(super) fn device(&self, place: usize) -> Option<Box<dyn Device>> {
        self.pointers.get(place).map(Pointer::device)
    }

    /// Returns whether a page wants another part. Called on the real-time thread.
    pub(super) fn is_wished(&self) -> bool {
        // The flag carries no data: `finish` takes the wish itself under the lock, so that no ordering is needed here.
        self.is_wished.load(Ordering::Relaxed)
    }

    /// Ends `part` with the recorded inputs `inputs`, and returns the scene of the next part.
    ///
    /// `fell_apart`: whether the part diverged. The next part then begins from the initial states, as after a reset.
    pub(super) fn finish(&self, part: &Part, inputs: PathBuf, fell_apart: bool) -> PlayedScene {
        let mut wished = lock(&self.wish);
        // The flag changes under the lock of the wish. A wish told between two unlocked steps would keep its value and lose its flag, and wait for the end of
        // another part.
        self.is_wished.store(false, Ordering::Relaxed);
        let wish = wished.take().unwrap_or_default();
        drop(wished);
        let next = self.next(part, &Wish { reset: wish.reset || fell_apart, ..wish });
        *lock(&self.finished) = Some(Arc::new(Finished { number: part.number, scene: part.played.clone(), inputs }));
        next
    }

    /// Returns the scene of the next part after `part` by `wish`. Links of removed peers are left out.
    fn next(&self, part: &Part, wish: &Wish) -> PlayedScene {
        let peers: Vec<PeerStatus> = self.frames.last().map(|motion| motion.peers.clone()).unwrap_or_default();
        // A key that the wish leaves out keeps the value of the present part, and not the value of the scene file.
        let number = wish.peers.unwrap_or(part.scene.peers.len());
        let stood = if wish.reset { self.beginning.clone() } else { part.played.clone().standing(&peers, &part.scene) };
        let strategy = wish.strategy.as_deref().unwrap_or_else(|| part.scene.coordination.strategy.name());
        let changed = lock(&self.links).as_ref().map(|links| links.keys.clone()).unwrap_or_default();
        // `changed` has the order of `pairs`, so that each link keeps the keys of the last change.
        let links: Links = pairs(&part.scene).into_iter().zip(changed).filter(|((from, to), _)| *from < number && *to < number).collect();
        stood.with_strategy(strategy).with_peers(number).with_links(&links)
    }

    fn running(&self) -> Result<Arc<Part>, String> {
        lock(&self.part).clone().ok_or_else(|| "the session has not begun".to_owned())
    }

    /// Returns the last finished part, or `None` during the first part.
    fn last_finished(&self) -> Option<Arc<Finished>> {
        lock(&self.finished).clone()
    }
}

impl Hands for PlayStage {
    fn frame(&self, hand: Option<usize>) -> (u64, Arc<str>) {
        self.frames.text(hand)
    }

    fn has_begun(&self) -> bool {
        self.running().is_ok()
    }

    fn take_hand(&self, wanted: Option<usize>) -> Result<usize, String> {
        let part = self.running()?;
        let mut taken = lock(&self.taken);
        // Only pointers can be moved from a page.
        let is_free = |place: usize, peer: &cohaptic_scene::PeerSpec| matches!(peer.kind, PeerKind::Pointer(..)) && !taken[place];
        let free = part.scene.peers.iter().enumerate().find(|(place, peer)| wanted.is_none_or(|wanted| wanted == *place) && is_free(*place, peer));
        let (place, _) = free.ok_or_else(|| match wanted {
            Some(_) => "somebody has that hand, or nobody can: choose another one".to_owned(),
            None => "every hand is taken: the person who started the session can add a peer".to_owned(),
        })?;
        // The lock is held since the search, so that no two pages get the same hand.
        taken[place] = true;
        Ok(place)
    }

    fn move_hand(&self, hand: usize, position: Option<[f64; 3]>) -> Result<(), String> {
        let pointer = self.pointers.get(hand).ok_or("there is no such hand")?;
        pointer.tell(position).map_err(|error| error.to_string())
    }

    fn leave_hand(&self, hand: usize) {
        if let Some(pointer) = self.pointers.get(hand) {
            // Letting go has no position to refuse, so that the result is always `Ok`.
            let _ = pointer.tell(None);
            lock(&self.taken)[hand] = false;
        }
    }
}

impl Stage for PlayStage {
    fn facts(&self, role: Role) -> Value {
        let Ok(part) = self.running() else { return json!({ "part": 0 }) };
        let Part { number, scene, .. } = &*part;
        let is_host = role == Role::Host;
        let of_session = json!({
            "part": number,
            "title": scene.title,
            "strategy": scene.coordination.strategy.name(),
            "strategies": Coordination::ALL.iter().map(|strategy| strategy.name()).collect::<Vec<_>>(),
            "fewest_peers": PEERS.start(),
            "most_peers": PEERS.end(),
            "guided": self.is_guided,
            "host": is_host,
            // The address holds the token of guests, so that only the host hands out the address.
            "join": self.join.get().filter(|_| is_host),
            "recorded": self.last_finished().map(|finished| finished.number),
        });
        let mut facts = scene_facts(scene);
        for (place, (peer, taken)) in scene.peers.iter().zip(lock(&self.taken).iter()).enumerate() {
            let is_pointer = matches!(peer.kind, PeerKind::Pointer(..));
            let own = &mut facts["peers"][place];
            (own["kind"], own["hand"], own["taken"]) = (peer.kind.name().into(), is_pointer.into(), (*taken).into());
        }
        facts.extend(of_session.as_object().into_iter().flatten().map(|(key, value)| (key.clone(), value.clone())));
        facts.into()
    }

    fn begin_anew(&self, wish: &Value) -> Result<(), String> {
        let wish = Wish::read(wish)?;
        let part = self.running()?;
        // A refused scene must be refused here: after the present part has ended, the session could not go on.
        self.next(&part, &wish).scene().map_err(|error| said(&error))?;
        let mut wished = lock(&self.wish);
        *wished = Some(wish);
        // The flag ends the present part. `finish` then takes wish and flag under the lock.
        self.is_wished.store(true, Ordering::Relaxed);
        drop(wished);
        Ok(())
    }

    fn compare(&self) -> Result<Value, String> {
        let part = self.running()?;
        let began = Clock::now();
        // An empty wish ends the part, and so completes the record, but changes nothing.
        self.begin_anew(&json!({}))?;
        let finished = loop {
            if let Some(finished) = self.last_finished().filter(|finished| finished.number >= part.number) {
                break finished;
            }
            if began.elapsed() > PATIENCE {
                return Err("the session does not end its part: it hangs, or it has ended".to_owned());
            }
            // `finish` notifies nobody, so that this thread looks again until the part has ended.
            thread::sleep(Duration::from_millis(5));
        };
        compare(&finished)
    }

    fn file(&self, name: &str) -> Option<StageFile> {
        let finished = self.last_finished()?;
        match name {
            "scene.toml" => Some(StageFile { kind: "application/toml", bytes: finished.scene.text().into_bytes() }),
            "inputs.csv" => Some(StageFile { kind: "text/csv", bytes: read(&finished.inputs)? }),
            _ => None,
        }
    }
}

/// Returns what a page needs of a scene to draw the scene's motion.
pub(crate) fn scene_facts(scene: &Scene) -> Map<String, Value> {
    let grasp = |place: usize| scene.rotation.as_ref().map(|rotation| rotation.peers[place].grasp);
    let peers = scene.peers.iter().enumerate().map(|(place, peer)| json!({ "name": peer.name, "grasp": grasp(place) }));
    let facts = [
        ("axes", json!(scene.axes.count())),
        ("peers", peers.collect()),
        ("edges", json!(scene.rotation.as_ref().and_then(|_| scene.even_box()))),
        ("walls", json!(scene.object.enclosure.map(|walls| [walls.min, walls.max]))),
        ("task", json!(scene.task.as_ref().map(|task| task.kind.name()))),
        ("path", json!(scene.task.as_ref().and_then(|task| if let TaskKind::Path(path) = &task.kind { Some(&path.points) } else { None }))),
    ];
    facts.into_iter().map(|(key, value)| (key.to_owned(), value)).collect()
}

fn read(path: &Path) -> Option<Vec<u8>> {
    std::fs::read(path).ok()
}

/// Editor of the links of the running part. The server keeps one editor for all parts.
pub(super) struct PartLinks(pub(super) Arc<PlayStage>);

impl LinkEditor for PartLinks {
    fn keys(&self, link: usize) -> Vec<(String, String)> {
        lock(&self.0.links).as_ref().map_or_else(Vec::new, |links| links.keys(link))
    }

    fn change(&mut self, links: &[usize], keys: &[(String, String)]) -> Result<(), String> {
        lock(&self.0.links).as_mut().ok_or("the session has not begun")?.change(links, keys)
    }
}
