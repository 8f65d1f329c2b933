//! Server-sent events: the state, whenever a new one was published.

use core::convert::Infallible;
use core::time::Duration;
use std::sync::Arc;

use axum::extract::State;
use axum::response::sse::{Event, Sse};
use futures_util::Stream;
use futures_util::stream::unfold;
use tokio::time::{Interval, MissedTickBehavior, interval};

use super::App;
use crate::views;

/// How often it is looked whether there is something new.
const EVERY: Duration = Duration::from_millis(100);
/// After this number of looks without anything new a comment says that the server is still there: 1 s.
const QUIET: u32 = 10;

struct Listener {
    app: Arc<App>,
    ticks: Interval,
    sent: Option<u64>,
    quiet: u32,
}

/// The state at once, then each time that it was published anew, at most ten times a second.
pub(super) async fn events(State(app): State<Arc<App>>) -> Sse<impl Stream<Item = Result<Event, Infallible>>> {
    let mut ticks = interval(EVERY);
    // Whoever reads slowly gets less, not the past.
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let listener = Listener { app, ticks, sent: None, quiet: 0 };
    Sse::new(unfold(listener, |mut listener| async {
        let event = listener.next().await;
        Some((Ok(event), listener))
    }))
}

impl Listener {
    async fn next(&mut self) -> Event {
        loop {
            self.ticks.tick().await;
            let latest = self.app.board.latest();
            if self.sent != Some(latest.number) {
                self.sent = Some(latest.number);
                self.quiet = 0;
                let state = views::state(self.app.board.description(), &latest);
                return Event::default().event("state").id(latest.number.to_string()).data(state.to_string());
            }
            self.quiet += 1;
            if self.quiet >= QUIET {
                self.quiet = 0;
                return Event::default().comment("nothing new");
            }
        }
    }
}
