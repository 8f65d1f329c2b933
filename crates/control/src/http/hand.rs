//! The WebSocket of a page with a hand: positions of the hand and words of the page come in, pictures of the motion and news of the run go out.

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
use tokio::time::{Instant, MissedTickBehavior, interval, timeout};
use tokio_tungstenite::WebSocketStream;
use tokio_tungstenite::tungstenite::handshake::server::create_response_with_body;
use tokio_tungstenite::tungstenite::protocol::{Role as End, WebSocketConfig};
use tokio_tungstenite::tungstenite::{Error, Message};

use super::frames::Counted;
use super::guard::{Visitor, check_token};
use super::round_trips::RoundTrips;
use super::slots::Slot;
use super::{App, People, Refusal};
use crate::{Guests, Hands, Token};

/// Length of the longest accepted message \[byte\]. Three numbers with all digits take 75 bytes.
const LONGEST: usize = 128;
/// Length of the read buffer \[byte\], enough for several positions.
const READ_AT_ONCE: usize = 8 * LONGEST;
/// Shortest time between two pictures of the motion.
const EVERY: Duration = Duration::from_millis(16);
/// Longest time without a message. A page takes four seconds of silence for a lost connection, and between two trials of a study nothing moves.
const SILENCE: Duration = Duration::from_secs(1);
/// Time after which a page that accepts no picture counts as gone.
const PATIENCE: Duration = Duration::from_secs(5);

/// Position of a hand \[m\], or `None` for a hand that lets go.
type Place = Option<[f64; 3]>;

/// Parses a message of a page: a list of three finite numbers, or `null`. Returns `None` for any other text.
fn read(text: &str) -> Option<Place> {
    let place: Place = serde_json::from_str(text).ok()?;
    place.is_none_or(|place| place.iter().all(|x| x.is_finite())).then_some(place)
}

/// `GET /api/hand`: takes a hand for a page, and switches to a WebSocket. The query `hand=NUMBER` asks for a hand, `hand=none` only watches, and a missing
/// `hand` takes any free hand. In a study each person has a hand, by the token, and the experimenter has none.
pub(super) async fn connect(
    State(app): State<Arc<App>>,
    axum::Extension(visitor): axum::Extension<Visitor>,
    mut request: Request,
) -> Result<Response, Refusal> {
    let hands = app.hands()?;
    check_origin(request.headers())?;
    // A page that is told of no hand looks on from then on, which a page that is only too early must not.
    if !hands.has_begun() {
        return Err(Refusal::new(StatusCode::SERVICE_UNAVAILABLE, "the session has not begun: ask again"));
    }
    let wanted = match (&app.people, visitor) {
        (People::Study(_), Visitor::Guest(person)) => Wanted::One(person),
        (People::Study(_), Visitor::Host) => Wanted::None,
        (People::Stage(_) | People::Nobody, _) => wanted(request.uri())?,
    };
    let pass = Pass::of(&app.guests, visitor);
    // The tokens may have been replaced between the guard and the line above: the pass would be that of another person.
    if check_token(&app, request.uri(), request.headers())? != visitor {
        return Err(Refusal::new(StatusCode::CONFLICT, "the tokens of the guests have changed meanwhile: ask again"));
    }
    let slot = request.extensions().get::<Arc<Slot>>().cloned();
    // The answer is made first, so that a request without a WebSocket takes no hand.
    let answer = create_response_with_body(&request, Body::empty)
        .map_err(|error| Refusal::new(StatusCode::UPGRADE_REQUIRED, format!("expected a WebSocket: {error}")))?;
    let upgrade = hyper::upgrade::on(&mut request);
    let hand = match wanted {
        Wanted::None => Ok(None),
        Wanted::Any => hands.take_hand(None).map(Some),
        Wanted::One(hand) => hands.take_hand(Some(hand)).map(Some),
    };
    // The upgrade completes after the answer has been sent, so the conversation waits on a task of its own.
    tokio::spawn(talk(hands, hand, pass, upgrade, slot));
    Ok(answer.into_response())
}

/// Refuses pages of other sites by the `Origin` header, which browsers always send with a WebSocket. Such a page could not know the token either; this is a
/// second barrier.
fn check_origin(headers: &HeaderMap) -> Result<(), Refusal> {
    let text = |name| headers.get(name).and_then(|value: &axum::http::HeaderValue| value.to_str().ok());
    let foreign = text(header::ORIGIN).is_some_and(|origin| origin.strip_prefix("http://") != text(header::HOST));
    // An origin that is not text cannot be this site.
    if foreign || (text(header::ORIGIN).is_none() && headers.contains_key(header::ORIGIN)) {
        return Err(Refusal::new(StatusCode::FORBIDDEN, "the page that asks is of another site"));
    }
    Ok(())
}

/// Hand asked for in a query.
enum Wanted {
    Any,
    None,
    One(usize),
}

/// Parses the query of a request for a hand.
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

/// Right of a connection to go on: the token of a guest, as long as the run has not replaced the token. A program in place of a page could otherwise keep the
/// hand of the next person.
struct Pass {
    guests: Guests,
    /// Token of the guest; `None` for the host, whose token is never replaced.
    token: Option<Token>,
}

impl Pass {
    fn of(guests: &Guests, visitor: Visitor) -> Self {
        let token = match visitor {
            Visitor::Host => None,
            Visitor::Guest(number) => guests.tokens().into_iter().nth(number),
        };
        Self { guests: guests.clone(), token }
    }

    fn is_valid(&self) -> bool {
        self.token.as_ref().is_none_or(|token| self.guests.find(token.secret().as_bytes()).is_some())
    }
}

/// A taken hand. Dropping the value gives the hand back, however the connection ends.
struct Taken {
    hands: Arc<dyn Hands>,
    hand: usize,
    /// Round trips of the page; `None` if nobody wants round trips.
    trips: Option<RoundTrips>,
}

impl Taken {
    fn new(hands: Arc<dyn Hands>, hand: usize) -> Self {
        let trips = hands.measures_round_trips().map(|every| RoundTrips::new(every, Instant::now()));
        Self { hands, hand, trips }
    }
}

impl Drop for Taken {
    fn drop(&mut self) {
        self.hands.leave_hand(self.hand);
    }
}

/// Returns the limits of messages and frames from a page.
fn limits() -> WebSocketConfig {
    WebSocketConfig::default().max_message_size(Some(LONGEST)).max_frame_size(Some(LONGEST)).read_buffer_size(READ_AT_ONCE)
}

/// Serves the WebSocket of a page until its end. Holds the slot of the connection until then.
async fn talk(hands: Arc<dyn Hands>, hand: Result<Option<usize>, String>, pass: Pass, upgrade: OnUpgrade, slot: Option<Arc<Slot>>) {
    // A refused hand is told to the page, which may still watch.
    let greeting = match &hand {
        Ok(hand) => json!({ "hand": hand }),
        Err(reason) => json!({ "hand": null, "refused": reason }),
    };
    let taken = hand.ok().flatten().map(|hand| Taken::new(Arc::clone(&hands), hand));
    let Ok(upgraded) = upgrade.await else { return };
    let stream = Counted::new(TokioIo::new(upgraded));
    let socket: WebSocketStream<Counted<TokioIo<Upgraded>>> = WebSocketStream::from_raw_socket(stream, End::Server, Some(limits())).await;
    let (mut out, incoming) = socket.split();
    if send(&mut out, Message::text(greeting.to_string())).await {
        // Whichever future ends first ends both.
        select(pin!(listen(&taken, incoming)), pin!(show(&*hands, &taken, &pass, out))).await;
    }
    // The hand and the place are free only after the end of both directions.
    drop((taken, slot));
}

/// Moves the hand by the messages of a page, and passes on other words, until the page goes or sends a message no page sends.
async fn listen(taken: &Option<Taken>, mut incoming: impl Incoming<Item = Result<Message, Error>> + Unpin) {
    while let Some(Ok(message)) = incoming.next().await {
        match (message, taken) {
            (Message::Text(text), Some(Taken { hands, hand, .. })) => {
                // A position is tried first: positions are nearly all messages, and no word of a page is a list of numbers or null.
                let understood = match read(&text) {
                    Some(place) => hands.move_hand(*hand, place),
                    None => hands.hear(*hand, &text),
                };
                if understood.is_err() {
                    return;
                }
            }
            // A page that only watches moves nothing, and says nothing else.
            (Message::Text(text), None) if read(&text).is_some() => {}
            (Message::Pong(echo), Some(Taken { hands, hand, trips: Some(trips) })) => {
                if let Some(took) = trips.end(&echo, Instant::now()) {
                    hands.round_trip(*hand, took);
                }
            }
            // The WebSocket library answers pings.
            (Message::Ping(_) | Message::Pong(_), _) => {}
            (Message::Text(_) | Message::Binary(_) | Message::Close(_) | Message::Frame(_), _) => return,
        }
    }
}

/// Moves a hand by the bytes of a page, until the bytes end or contain a message no page sends.
#[cfg(fuzzing)]
pub(crate) async fn hear(hands: Arc<dyn Hands>, hand: usize, stream: impl tokio::io::AsyncRead + tokio::io::AsyncWrite + Unpin) {
    let (_, incoming) = WebSocketStream::from_raw_socket(Counted::new(stream), End::Server, Some(limits())).await.split();
    listen(&Some(Taken::new(hands, hand)), incoming).await;
}

/// Sends each new picture of the motion, and news for the page's hand, until the page accepts no more or answers no pings, or the pass has ended.
async fn show(hands: &dyn Hands, taken: &Option<Taken>, pass: &Pass, mut out: impl Sink<Message> + Unpin) {
    let mut ticks = interval(EVERY);
    // A slow page gets fewer pictures, not old pictures.
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let (mut shown, mut told, mut last) = (0, 0, Instant::now());
    loop {
        ticks.tick().await;
        // The pass is checked at each tick and not only once, because a study replaces the tokens while old pages are still connected.
        if !pass.is_valid() {
            return;
        }
        let now = Instant::now();
        let mut messages = Vec::new();
        if let Some(Taken { hand, trips, .. }) = taken {
            // News come before the picture, because the page needs the facts of a run for the run's pictures.
            if let Some((number, news)) = hands.news(*hand, told) {
                told = number;
                messages.push(Message::text(news));
            }
            if let Some(trips) = trips {
                if trips.is_silent(now) {
                    return;
                }
                messages.extend(trips.begin(now).map(Message::Ping));
            }
        }
        let (number, frame) = hands.frame(taken.as_ref().map(|taken| taken.hand));
        if number != shown {
            shown = number;
            messages.push(Message::text(frame.to_string()));
        }
        // Only text ends a silence, because browsers do not show pings to the page.
        if messages.iter().any(Message::is_text) {
            last = now;
        } else if now > last + SILENCE {
            last = now;
            messages.push(Message::text("{}"));
        }
        for message in messages {
            if !send(&mut out, message).await {
                return;
            }
        }
    }
}

/// Sends a message. Returns whether the page accepted the message in time.
async fn send(out: &mut (impl Sink<Message> + Unpin), message: Message) -> bool {
    // Without this bound a page that stops reading would keep its hand for as long as the connection stays open.
    matches!(timeout(PATIENCE, out.send(message)).await, Ok(Ok(())))
}

#[cfg(test)]
mod tests {
    use cohaptic_tests_common::properties;
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

    properties! {
        #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

        /// Any text is refused or gives finite numbers, and no text panics.
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
