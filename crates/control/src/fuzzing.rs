//! Live control without sockets, for the fuzz targets `http` and `websocket`. Compiled only with `--cfg fuzzing`.

use core::future::poll_fn;
use core::pin::{Pin, pin};
use core::task::{Context, Poll};
use std::io;
use std::sync::{Arc, Mutex, PoisonError};

use axum::Router;
use futures_util::future::select;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::runtime::{Builder, Runtime};
use tokio::sync::Semaphore;

use crate::http::{self, App, Pace, People, Shown, hand};
use crate::token::Ticket;
use crate::{Board, Guests, LinkEditor, Stage, Token};

/// Number of polls in a row without a moved byte, after which a connection counts as over.
const IDLE_POLLS: u32 = 16;

/// A server for connections whose bytes are given.
pub struct Site {
    router: Router,
    stage: Arc<dyn Stage>,
    runtime: Runtime,
}

impl core::fmt::Debug for Site {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("Site")
    }
}

impl Site {
    /// Creates a server like [`serve_stage`](crate::serve_stage), but without a token for guests.
    ///
    /// # Errors
    ///
    /// The system's error if no runtime can be created.
    pub fn new(token: Token, board: Arc<Board>, editor: Box<dyn LinkEditor>, stage: Arc<dyn Stage>) -> io::Result<Self> {
        let app = App {
            board,
            ticket: Arc::new(Ticket::default()),
            shown: Shown::default(),
            editor: Arc::new(tokio::sync::Mutex::new(editor)),
            token,
            guests: Guests::default(),
            hosts: Vec::new(),
            people: People::Stage(Arc::clone(&stage)),
            comparing: Semaphore::new(1),
            pace: Pace::default(),
            patience: http::PATIENCE,
        };
        let runtime = Builder::new_current_thread().enable_time().build()?;
        Ok(Self { router: http::router(app), stage, runtime })
    }

    /// Returns the server's answers to the bytes `sent` on a connection.
    #[must_use]
    pub fn answer(&self, sent: &[u8]) -> Vec<u8> {
        let shared = Arc::new(Mutex::new(Shared::default()));
        let bytes = Bytes { left: sent.to_vec(), place: 0, ends: false, shared: Arc::clone(&shared) };
        self.runtime.block_on(async {
            // Whichever comes first: the end of the answer, or a connection without movement.
            select(pin!(http::answer_bytes(bytes, self.router.clone())), pin!(rest(&shared))).await;
        });
        let answers = core::mem::take(&mut lock(&shared).answers);
        // Runs tasks in wait of an upgrade of the connection, until the tasks learn that the connection is over.
        self.runtime.block_on(rest(&shared));
        answers
    }

    /// Moves hand number `hand` by WebSocket frames.
    pub fn hear(&self, hand: usize, sent: &[u8]) {
        let bytes = Bytes { left: sent.to_vec(), place: 0, ends: true, shared: Arc::default() };
        self.runtime.block_on(hand::hear(Arc::clone(&self.stage) as _, hand, bytes));
    }
}

/// Returns when a connection has moved no byte for [`IDLE_POLLS`] polls.
async fn rest(shared: &Mutex<Shared>) {
    let (mut before, mut idle) = (0, 0);
    poll_fn(|context| {
        let moved = lock(shared).moved;
        idle = if moved == before { idle + 1 } else { 0 };
        before = moved;
        if idle > IDLE_POLLS {
            return Poll::Ready(());
        }
        // Polls again after the other tasks, since no event from outside will come.
        context.waker().wake_by_ref();
        Poll::Pending
    })
    .await;
}

fn lock(shared: &Mutex<Shared>) -> std::sync::MutexGuard<'_, Shared> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

#[derive(Default)]
struct Shared {
    answers: Vec<u8>,
    /// Bytes moved so far, both directions together.
    moved: usize,
}

/// Stream with given bytes to read, and a record of the bytes written.
struct Bytes {
    left: Vec<u8>,
    place: usize,
    /// `true` if reading ends after the last byte. Otherwise reading waits forever.
    ends: bool,
    shared: Arc<Mutex<Shared>>,
}

impl AsyncRead for Bytes {
    fn poll_read(mut self: Pin<&mut Self>, _: &mut Context<'_>, to: &mut ReadBuf<'_>) -> Poll<io::Result<()>> {
        let left = &self.left[self.place..];
        if left.is_empty() && !self.ends {
            // Without a waker nothing would end this wait, but `rest` ends the whole connection.
            return Poll::Pending;
        }
        let count = left.len().min(to.remaining());
        to.put_slice(&left[..count]);
        self.place += count;
        lock(&self.shared).moved += count;
        Poll::Ready(Ok(()))
    }
}

impl AsyncWrite for Bytes {
    fn poll_write(self: Pin<&mut Self>, _: &mut Context<'_>, from: &[u8]) -> Poll<io::Result<usize>> {
        let mut shared = lock(&self.shared);
        shared.answers.extend_from_slice(from);
        shared.moved += from.len();
        Poll::Ready(Ok(from.len()))
    }

    fn poll_flush(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<io::Result<()>> {
        Poll::Ready(Ok(()))
    }

    fn poll_shutdown(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<io::Result<()>> {
        Poll::Ready(Ok(()))
    }
}
