//! A hand of a page, over a WebSocket: places in, pictures of the motion out.

use core::pin::pin;
use core::time::Duration;
use std::sync::Arc;

use axum::body::Body;
use axum::extract::{Request, State};
use axum::http::{HeaderMap, StatusCode, Uri, header};
use axum::response::{IntoResponse as _, Response};
use futures_util::future::select;
use futures_util::{Sink, SinkExt as _, Stream as Incoming, StreamExt as _};
use hyper::upgrade::{OnUpgrade, Upgraded};
use hyper_util::rt::TokioIo;
use serde_json::json;
use tokio::time::{MissedTickBehavior, interval, timeout};
use tokio_tungstenite::WebSocketStream;
use tokio_tungstenite::tungstenite::handshake::server::create_response_with_body;
use tokio_tungstenite::tungstenite::protocol::{Role as End, WebSocketConfig};
use tokio_tungstenite::tungstenite::{Error, Message};

use super::frames::Counted;
use super::places::Seat;
use super::play::stage;
use super::{App, Refusal};
use crate::Stage;

/// A longer message is no place: three numbers with all their digits take 75 bytes.
const LONGEST: usize = 128;
/// Some places at once \[byte\].
const READ_AT_ONCE: usize = 8 * LONGEST;
/// A picture of the motion is sent so often at most.
const EVERY: Duration = Duration::from_millis(16);
/// A page that takes no picture for so long is gone.
const PATIENCE: Duration = Duration::from_secs(5);

/// A place, or `None` for a hand that lets go.
type Place = Option<[f64; 3]>;

/// Reads what a page says of its hand: a list of three finite numbers, or `null`.
fn read(text: &str) -> Option<Place> {
    let place: Place = serde_json::from_str(text).ok()?;
    place.is_none_or(|place| place.iter().all(|x| x.is_finite())).then_some(place)
}

/// Takes a hand for the page that asks, and goes on over a WebSocket. Without `hand=` in the query it is any that is free; `hand=none` only looks on.
pub(super) async fn connect(State(app): State<Arc<App>>, mut request: Request) -> Result<Response, Refusal> {
    let stage = stage(&app)?;
    check_origin(request.headers())?;
    let wanted = wanted(request.uri())?;
    let seat = request.extensions().get::<Arc<Seat>>().cloned();
    let answer = create_response_with_body(&request, Body::empty)
        .map_err(|error| Refusal::new(StatusCode::UPGRADE_REQUIRED, format!("expected a WebSocket: {error}")))?;
    let upgrade = hyper::upgrade::on(&mut request);
    let hand = match wanted {
        Wanted::None => Ok(None),
        Wanted::Any => stage.take_hand(None).map(Some),
        Wanted::One(hand) => stage.take_hand(Some(hand)).map(Some),
    };
    tokio::spawn(talk(stage, hand, upgrade, seat));
    Ok(answer.into_response())
}

/// A page of another site cannot know the token; a browser says besides where a page comes from.
fn check_origin(headers: &HeaderMap) -> Result<(), Refusal> {
    let text = |name| headers.get(name).and_then(|value: &axum::http::HeaderValue| value.to_str().ok());
    let foreign = text(header::ORIGIN).is_some_and(|origin| origin.strip_prefix("http://") != text(header::HOST));
    if foreign || (text(header::ORIGIN).is_none() && headers.contains_key(header::ORIGIN)) {
        return Err(Refusal::new(StatusCode::FORBIDDEN, "the page that asks is of another site"));
    }
    Ok(())
}

enum Wanted {
    Any,
    None,
    One(usize),
}

fn wanted(uri: &Uri) -> Result<Wanted, Refusal> {
    let said = uri.query().unwrap_or_default().split('&').find_map(|part| part.strip_prefix("hand="));
    match said {
        None => Ok(Wanted::Any),
        Some("none") => Ok(Wanted::None),
        Some(number) => {
            let number = number.parse().map_err(|_| Refusal::new(StatusCode::UNPROCESSABLE_ENTITY, "hand=: expected a number, or none"))?;
            Ok(Wanted::One(number))
        }
    }
}

/// A hand that is left when its page goes, however it goes.
struct Taken {
    stage: Arc<dyn Stage>,
    hand: usize,
}

impl Drop for Taken {
    fn drop(&mut self) {
        self.stage.leave_hand(self.hand);
    }
}

/// Limits of a WebSocket: sizes of messages and frames from a page.
fn limits() -> WebSocketConfig {
    WebSocketConfig::default().max_message_size(Some(LONGEST)).max_frame_size(Some(LONGEST)).read_buffer_size(READ_AT_ONCE)
}

/// `seat` is the place of the connection, which is taken for as long as this goes on.
async fn talk(stage: Arc<dyn Stage>, hand: Result<Option<usize>, String>, upgrade: OnUpgrade, seat: Option<Arc<Seat>>) {
    let greeting = match &hand {
        Ok(hand) => json!({ "hand": hand }),
        Err(reason) => json!({ "hand": null, "refused": reason }),
    };
    let taken = hand.ok().flatten().map(|hand| Taken { stage: Arc::clone(&stage), hand });
    let Ok(upgraded) = upgrade.await else { return };
    let stream = Counted::new(TokioIo::new(upgraded));
    let socket: WebSocketStream<Counted<TokioIo<Upgraded>>> = WebSocketStream::from_raw_socket(stream, End::Server, Some(limits())).await;
    let (mut out, incoming) = socket.split();
    if send(&mut out, greeting.to_string()).await {
        // Whichever ends first ends the other.
        select(pin!(listen(&taken, incoming)), pin!(show(&*stage, out))).await;
    }
    drop((taken, seat));
}

/// Moves the hand until the page goes, or says something that no page says.
async fn listen(taken: &Option<Taken>, mut incoming: impl Incoming<Item = Result<Message, Error>> + Unpin) {
    while let Some(Ok(message)) = incoming.next().await {
        let place = match message {
            Message::Text(text) => read(&text),
            Message::Ping(_) | Message::Pong(_) => continue,
            Message::Binary(_) | Message::Close(_) | Message::Frame(_) => None,
        };
        let Some(place) = place else { return };
        if let Some(Taken { stage, hand }) = taken
            && stage.move_hand(*hand, place).is_err()
        {
            return;
        }
    }
}

/// Moves a hand by the bytes of a page, until they end or say something that no page says.
#[cfg(fuzzing)]
pub(crate) async fn hear(stage: Arc<dyn Stage>, hand: usize, stream: impl tokio::io::AsyncRead + tokio::io::AsyncWrite + Unpin) {
    let (_, incoming) = WebSocketStream::from_raw_socket(Counted::new(stream), End::Server, Some(limits())).await.split();
    listen(&Some(Taken { stage, hand }), incoming).await;
}

/// Shows each new picture of the motion until the page takes no more.
async fn show(stage: &dyn Stage, mut out: impl Sink<Message> + Unpin) {
    let mut ticks = interval(EVERY);
    // A slow page gets fewer, not old ones.
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let mut shown = 0;
    loop {
        ticks.tick().await;
        let (number, frame) = stage.frame();
        if number != shown {
            shown = number;
            if !send(&mut out, frame.to_string()).await {
                return;
            }
        }
    }
}

/// Whether it was taken.
async fn send(out: &mut (impl Sink<Message> + Unpin), text: String) -> bool {
    matches!(timeout(PATIENCE, out.send(Message::text(text))).await, Ok(Ok(())))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_place_is_three_numbers_and_nothing_lets_go() {
        assert_eq!(read("[0.01, -2e-3, 0]"), Some(Some([0.01, -2e-3, 0.0])));
        assert_eq!(read("null"), Some(None));
        for wrong in ["", "[]", "[1,2]", "[1,2,3,4]", "[1,2,\"3\"]", "[1,2,null]", "[1e999,0,0]", "[NaN,0,0]", "{}", "1", "nul", "[1,2,3] x"] {
            assert_eq!(read(wrong), None, "{wrong}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

        /// Whatever comes: what is read is finite, and nothing breaks.
        #[test]
        fn whatever_comes_is_a_place_or_refused(text in prop_oneof![".*", r"[\[\], 0-9eE.+-]{0,64}", Just("[".repeat(100))]) {
            if let Some(Some(place)) = read(&text) {
                prop_assert!(place.iter().all(|x| x.is_finite()));
            }
        }

        #[test]
        fn every_place_is_read_back(place in prop::array::uniform3(-10.0..10.0_f64)) {
            let text = format!("[{:?},{:?},{:?}]", place[0], place[1], place[2]);
            prop_assert!(text.len() <= LONGEST);
            prop_assert_eq!(read(&text), Some(Some(place)));
        }
    }
}
