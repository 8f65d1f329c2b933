//! A hand over a WebSocket: the frames of a page, and the places in them.

use std::sync::{Arc, Mutex, OnceLock};

use cohaptic_control::fuzzing::Site;
use cohaptic_control::{Board, Description, Hands, Kind, LinkEditor, Role, Stage, StageFile};
use serde_json::Value;

use crate::Input;

const HAND: usize = 3;

/// Calls that the hand received.
#[derive(Default)]
struct Told {
    moves: Vec<Option<[f64; 3]>>,
    left: usize,
}

/// Writes down what it is told.
struct Recorder(Arc<Mutex<Told>>);

impl Hands for Recorder {
    fn frame(&self, _: Option<usize>) -> (u64, Arc<str>) {
        (0, "".into())
    }

    fn take_hand(&self, _: Option<usize>) -> Result<usize, String> {
        Err("it is taken".to_owned())
    }

    fn move_hand(&self, hand: usize, position: Option<[f64; 3]>) -> Result<(), String> {
        assert_eq!(hand, HAND);
        self.0.lock().unwrap().moves.push(position);
        Ok(())
    }

    fn leave_hand(&self, hand: usize) {
        assert_eq!(hand, HAND);
        self.0.lock().unwrap().left += 1;
    }
}

impl Stage for Recorder {
    fn facts(&self, _: Role) -> Value {
        Value::Null
    }

    fn begin_anew(&self, _: &Value) -> Result<(), String> {
        Ok(())
    }

    fn compare(&self) -> Result<Value, String> {
        Ok(Value::Null)
    }

    fn file(&self, _: &str) -> Option<StageFile> {
        None
    }
}

struct NoLinks;

impl LinkEditor for NoLinks {
    fn keys(&self, _: usize) -> Vec<(String, String)> {
        Vec::new()
    }

    fn change(&mut self, _: &[usize], _: &[(String, String)]) -> Result<(), String> {
        Ok(())
    }
}

fn site() -> &'static (Site, Arc<Mutex<Told>>) {
    static SITE: OnceLock<(Site, Arc<Mutex<Told>>)> = OnceLock::new();
    SITE.get_or_init(|| {
        let description =
            Description { kind: Kind::Live, title: String::new(), links: vec![], peers: vec![], clocks: vec![], measures: vec![], body: None };
        let told = Arc::default();
        let stage = Arc::new(Recorder(Arc::clone(&told)));
        let token = "a-token-of-more-than-22-characters".parse().unwrap();
        (Site::new(token, Arc::new(Board::new(description)), Box::new(NoLinks), stage).unwrap(), told)
    })
}

/// The first byte says whether the rest are frames, or lines that are sent as one message each.
pub fn run(data: &[u8]) {
    let mut input = Input::new(data);
    let is_framed = input.byte() & 1 == 1;
    let rest = input.rest();
    let lines = || rest.split(|byte| *byte == b'\n');
    let sent = if is_framed { rest.to_vec() } else { lines().flat_map(frame).collect() };
    let (site, told) = site();
    site.hear(HAND, &sent);
    let Told { moves, left } = std::mem::take(&mut *told.lock().unwrap());
    assert_eq!(left, 1, "the hand is left when its page goes");
    assert!(moves.iter().flatten().flatten().all(|number| number.is_finite()));
    // A frame takes six bytes, and a place at least four more.
    assert!(moves.len() * 10 <= sent.len());
    if !is_framed {
        let place = |line: &[u8]| (line.len() <= 128).then(|| serde_json::from_slice::<Option<[f64; 3]>>(line).ok()).flatten();
        let expected: Vec<_> = lines().map_while(place).take(360).collect();
        assert_eq!(moves, expected);
    }
}

/// A text in one frame, masked with zeros (RFC 6455, section 5.2).
fn frame(text: &[u8]) -> Vec<u8> {
    let mut frame = vec![0x81];
    match u16::try_from(text.len()) {
        Ok(length @ 0..126) => frame.push(0x80 | length.to_le_bytes()[0]),
        Ok(length) => {
            frame.push(0x80 | 126);
            frame.extend(length.to_be_bytes());
        }
        Err(_) => {
            frame.push(0x80 | 127);
            frame.extend((text.len() as u64).to_be_bytes());
        }
    }
    frame.extend([0; 4]);
    frame.extend(text);
    frame
}
