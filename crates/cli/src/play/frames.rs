//! Passes the motion of a part from the session's real-time thread to the pages, as JSON text.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use cohaptic_harness::live::Presence;
use cohaptic_harness::task::TaskView;
use cohaptic_live::{EndedPacket, Motion, PeerStatus};

/// The newest motion. The motion is written as text when a page asks, on the page's thread, so that the real-time thread does not spend the time.
#[derive(Default)]
pub(crate) struct Frames(Mutex<Newest>);

#[derive(Default)]
struct Newest {
    /// Number of motions published so far, over all parts.
    number: u64,
    /// Number of the present part, counted from 1.
    part: usize,
    axes: usize,
    /// Peer whose motion alone is told to the page of a hand, indexed by hand. The page of a hand without an entry is told of all peers.
    own: Vec<usize>,
    motion: Option<Arc<Motion>>,
    /// Last written texts with the numbers of their motions, indexed by the only peer in the text. Several pages share a text of all peers, `None`.
    texts: BTreeMap<Option<usize>, (u64, Arc<str>)>,
}

impl Frames {
    /// Begins a part whose scene has `axes` axes. The motion of the part before is dropped. `own`: the only peer that the page of a hand is told of, indexed by
    /// hand; the page of a hand without an entry is told of all peers.
    pub(crate) fn begin(&self, part: usize, axes: usize, own: Vec<usize>) {
        let mut newest = self.newest();
        // A page must not show the motion of the part before as the motion of this part.
        (newest.part, newest.axes, newest.own, newest.motion) = (part, axes, own, None);
    }

    /// Stores a motion as the newest. Readers hold the lock only while they clone a reference, so that the real-time thread does not wait long.
    pub(crate) fn publish(&self, motion: Motion) {
        let mut newest = self.newest();
        newest.number += 1;
        newest.motion = Some(Arc::new(motion));
    }

    /// Returns the last motion of the present part, or `None` before the first.
    pub(super) fn last(&self) -> Option<Arc<Motion>> {
        self.newest().motion.clone()
    }

    /// Returns the number and the JSON text of the newest motion, for the page of `hand`, or for a page that only watches. The text is `{}` before the first
    /// motion.
    ///
    /// Between [`begin`](Self::begin) and the first motion of the part, an already written text of the part before is returned again.
    pub(crate) fn text(&self, hand: Option<usize>) -> (u64, Arc<str>) {
        let (number, part, axes, only, motion) = {
            let newest = self.newest();
            let only = hand.and_then(|hand| newest.own.get(hand).copied());
            // Several pages ask for the same motion, and the text is written once.
            if let Some((number, text)) = newest.texts.get(&only)
                && *number == newest.number
            {
                return (*number, Arc::clone(text));
            }
            (newest.number, newest.part, newest.axes, only, newest.motion.clone())
        };
        // The lock is not held while the text is written, so that `publish` does not wait for the formatting.
        let text: Arc<str> = motion.map_or_else(|| "{}".to_owned(), |motion| written(part, axes, only, &motion)).into();
        let mut newest = self.newest();
        // A text of an older motion is not stored.
        if newest.number == number {
            newest.texts.insert(only, (number, Arc::clone(&text)));
        }
        (number, text)
    }

    fn newest(&self) -> MutexGuard<'_, Newest> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Returns the motion as `{"part":1,"t":0.5,"peers":[…],"packets":[[from,to,ms,lost],…]}`, with `task` for a scene with a task. Positions are in m with six
/// decimals, forces in N with three. With `only`, all other peers are `null`.
fn written(part: usize, axes: usize, only: Option<usize>, motion: &Motion) -> String {
    let mut text = format!("{{\"part\":{part},\"t\":{:.4},\"peers\":[", motion.elapsed.as_secs_f64());
    for (place, peer) in motion.peers.iter().enumerate() {
        text.push_str(if place == 0 { "" } else { "," });
        if only.is_none_or(|only| only == place) {
            write_peer(&mut text, axes, peer);
        } else {
            text.push_str("null");
        }
    }
    text.push_str("],\"packets\":[");
    for (place, EndedPacket { from, to, after, is_lost }) in motion.packets.iter().enumerate() {
        let comma = if place == 0 { "" } else { "," };
        let _ = write!(text, "{comma}[{from},{to},{:.1},{}]", after.as_secs_f64() * 1e3, u8::from(*is_lost));
    }
    text.push(']');
    if let Some(task) = &motion.task {
        write_task(&mut text, axes, task);
    }
    text.push('}');
    text
}

/// Appends the task: target, radius \[m\], number of reached and of all targets, part of the dwell time, time until the start and time left \[s\], and outcome.
fn write_task(text: &mut String, axes: usize, task: &TaskView) {
    text.push_str(",\"task\":{\"at\":");
    write_numbers(text, &task.target.position[..axes], 6);
    if let Some(orientation) = task.target.orientation {
        text.push_str(",\"turned\":");
        write_numbers(text, &orientation, 4);
    }
    if let Some(radius) = task.radius {
        let _ = write!(text, ",\"radius\":{radius:.6}");
    }
    let (until, left) = (task.until_start.as_secs_f64(), task.left.as_secs_f64());
    let _ = write!(
        text,
        ",\"reached\":{},\"targets\":{},\"dwelt\":{:.3},\"until\":{until:.2},\"left\":{left:.2}",
        task.reached, task.targets, task.dwelt
    );
    if let Some(outcome) = task.outcome {
        let _ = write!(text, ",\"outcome\":\"{}\"", outcome.name());
    }
    text.push('}');
}

/// Appends the state of one peer, with vectors cut to the scene's axes.
fn write_peer(text: &mut String, axes: usize, peer: &PeerStatus) {
    let state = &peer.state;
    let hand = match state.presence {
        Presence::Here => "here",
        Presence::Absent => "absent",
        Presence::Present => "present",
        Presence::Stale(_) => "stale",
    };
    let _ = write!(text, "{{\"hand\":\"{hand}\",\"at\":");
    write_numbers(text, &state.object.position[..axes], 6);
    text.push_str(",\"force\":");
    write_numbers(text, &peer.force[..axes], 3);
    if let Some(device) = state.device {
        text.push_str(",\"device\":");
        write_numbers(text, &device.position[..axes], 6);
    }
    if let Some(turn) = state.turn {
        text.push_str(",\"turned\":");
        write_numbers(text, &turn.object.orientation, 4);
    }
    text.push('}');
}

/// Appends an array of numbers. A number that is not finite becomes `null`, because JSON has no such number and a scene may diverge.
fn write_numbers(text: &mut String, numbers: &[f64], digits: usize) {
    for (place, number) in numbers.iter().enumerate() {
        text.push(if place == 0 { '[' } else { ',' });
        let _ = if number.is_finite() { write!(text, "{number:.digits$}") } else { write!(text, "null") };
    }
    text.push(']');
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use cohaptic_harness::live::PeerState;
    use cohaptic_peer::State;
    use cohaptic_scene::{Target, TaskOutcome};

    use super::*;

    #[test]
    fn a_frame_is_json_with_what_moves() {
        let state = |x: f64| State { position: [x, f64::NAN, 9.0], velocity: [0.0; 3] };
        let seen = PeerState { presence: Presence::Present, heard: None, device: Some(state(0.02)), object: state(0.0123456789), turn: None };
        let packet = EndedPacket { from: 0, to: 2, after: Duration::from_micros(24_040), is_lost: true };
        let motion = Motion {
            elapsed: Duration::from_millis(1500),
            peers: vec![PeerStatus { state: seen, force: [1.0, -0.5, 7.0], seat: None, connection: None }],
            task: Some(TaskView {
                target: Target { position: [0.1, 0.0, 7.0], orientation: Some([1.0, 0.0, 0.0, 0.0]) },
                radius: Some(0.005),
                reached: 1,
                targets: 2,
                dwelt: 0.5,
                until_start: Duration::ZERO,
                left: Duration::from_millis(2500),
                outcome: Some(TaskOutcome::Done),
            }),
            packets: vec![packet],
        };
        let frames = Frames::default();
        assert_eq!(&*frames.text(None).1, "{}");
        frames.begin(3, 2, vec![1]);
        frames.publish(motion);
        let value = |hand: Option<usize>| {
            let (number, text) = frames.text(hand);
            assert_eq!(number, 1);
            serde_json::from_str::<serde_json::Value>(&text).unwrap()
        };
        let expected = serde_json::json!({
            "part": 3, "t": 1.5,
            "peers": [{ "hand": "present", "at": [0.012346, null], "force": [1.0, -0.5], "device": [0.02, null] }],
            "packets": [[0, 2, 24.0, 1]],
            "task": {
                "at": [0.1, 0.0], "turned": [1.0, 0.0, 0.0, 0.0], "radius": 0.005,
                "reached": 1, "targets": 2, "dwelt": 0.5, "until": 0.0, "left": 2.5, "outcome": "done",
            },
        });
        // A page without an own peer is told of all, and the page of the first hand of no peer but the second.
        assert_eq!((value(None), value(Some(1))), (expected.clone(), expected));
        assert_eq!(value(Some(0))["peers"], serde_json::json!([null]));
    }
}
