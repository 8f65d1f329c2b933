//! The server: a thread with a runtime of its own.

use std::io;
use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;
use std::thread::JoinHandle;

use thiserror::Error;
use tokio::runtime::Builder;
use tokio::sync::{Mutex, Semaphore, oneshot};

use crate::http::{self, App, Pace, Shown};
use crate::ticket::Ticket;
use crate::{Board, LinkEditor, Stage, Token, TokenError};

/// Where to listen, and which requests to let in.
#[derive(Clone, Debug)]
pub struct ServerConfig {
    /// Where to listen. Port 0: any free one.
    pub address: SocketAddr,
    /// The secret that every request must show; `None`: a random one.
    pub token: Option<Token>,
    /// Whether an address may be given that other machines reach. All traffic, the token too, can then be read on the way.
    pub allow_remote: bool,
    /// Names by which the server may be asked for, besides `localhost` and addresses, such as `"lab-pc.example"`. Other names are refused, so that
    /// no page of another site reaches the server by a name that it points here (DNS rebinding).
    pub hosts: Vec<String>,
}

impl ServerConfig {
    /// A random token, nothing but loopback.
    #[must_use]
    pub const fn new(address: SocketAddr) -> Self {
        Self { address, token: None, allow_remote: false, hosts: Vec::new() }
    }
}

/// Why there is no server.
#[derive(Debug, Error)]
pub enum ServeError {
    /// Other machines would reach it.
    #[error(
        "live control would be open to other machines at {address}: listen on 127.0.0.1 or [::1] and reach it from elsewhere through `ssh -L`, or allow \
         remote access (--allow-remote); it is not encrypted"
    )]
    NotLoopback {
        /// The address.
        address: SocketAddr,
    },
    /// The system gives no such socket.
    #[error("live control cannot listen on {address}: {source}; port 0 takes any that is free")]
    Listen {
        /// The address.
        address: SocketAddr,
        /// What the system says.
        source: io::Error,
    },
    /// There is no token.
    #[error(transparent)]
    Token(#[from] TokenError),
    /// The system gives no thread, or no events.
    #[error("live control cannot start its thread: {0}")]
    Thread(io::Error),
}

/// A server that runs until it is stopped or dropped.
#[derive(Debug)]
pub struct Server {
    address: SocketAddr,
    token: Token,
    guests: Option<Token>,
    ticket: Arc<Ticket>,
    stop: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

/// Starts a server on a thread of its own.
///
/// # Errors
///
/// [`ServeError`] if it may not or cannot listen there. When this returns `Ok`, connections are taken.
pub fn serve(config: ServerConfig, board: Arc<Board>, editor: Box<dyn LinkEditor>) -> Result<Server, ServeError> {
    start(config, board, editor, None)
}

/// Starts a server of a run in which people take part from a page; links to hand out have a token of their own, with which nothing can be changed.
///
/// # Errors
///
/// As [`serve()`].
pub fn serve_stage(config: ServerConfig, board: Arc<Board>, editor: Box<dyn LinkEditor>, stage: Arc<dyn Stage>) -> Result<Server, ServeError> {
    start(config, board, editor, Some(stage))
}

fn start(config: ServerConfig, board: Arc<Board>, editor: Box<dyn LinkEditor>, stage: Option<Arc<dyn Stage>>) -> Result<Server, ServeError> {
    let address = config.address;
    if !address.ip().to_canonical().is_loopback() && !config.allow_remote {
        return Err(ServeError::NotLoopback { address });
    }
    let token = match config.token {
        Some(token) => token,
        None => Token::random()?,
    };
    let listen = |source| ServeError::Listen { address, source };
    let listener = TcpListener::bind(address).map_err(listen)?;
    listener.set_nonblocking(true).map_err(listen)?;
    let address = listener.local_addr().map_err(listen)?;
    let guests = if stage.is_some() { Some(Token::random()?) } else { None };
    let ticket = Arc::new(Ticket::default());
    let app = App {
        board,
        ticket: Arc::clone(&ticket),
        shown: Shown::default(),
        editor: Arc::new(Mutex::new(editor)),
        token: token.clone(),
        guests: guests.clone(),
        hosts: config.hosts,
        stage,
        comparing: Semaphore::new(1),
        pace: Pace::default(),
        patience: http::PATIENCE,
    };
    let runtime = Builder::new_current_thread().enable_io().enable_time().build().map_err(ServeError::Thread)?;
    let listener = {
        let _inside = runtime.enter();
        tokio::net::TcpListener::from_std(listener).map_err(listen)?
    };
    let (stop, stopped) = oneshot::channel();
    let run = move || {
        runtime.block_on(async {
            tokio::spawn(http::answer_all(listener, http::router(app)));
            // An error means that the server was dropped, which is the same.
            let _: Result<(), oneshot::error::RecvError> = stopped.await;
        });
        // Open answers, such as events, end with the runtime.
        runtime.shutdown_background();
    };
    let thread = std::thread::Builder::new().name("live-control".to_owned()).spawn(run).map_err(ServeError::Thread)?;
    Ok(Server { address, token, guests, ticket, stop: Some(stop), thread: Some(thread) })
}

impl Server {
    /// Where it listens.
    #[must_use]
    pub const fn address(&self) -> SocketAddr {
        self.address
    }

    /// The address of the page, with the token: a secret.
    #[must_use]
    pub fn url(&self) -> String {
        format!("http://{}/?token={}", self.reachable(), self.token.secret())
    }

    /// An address that leads to the page once, for a program that opens browsers: other users of the machine see the arguments of its programs, and the
    /// token is not among them. The last address given is the one that leads there. If the system has no random numbers, it is [`Server::url`].
    #[must_use]
    pub fn open_url(&self) -> String {
        self.ticket.issue().map_or_else(|_| self.url(), |ticket| format!("http://{}/open?ticket={}", self.reachable(), ticket.secret()))
    }

    /// The link to hand out to those who are to take part, with a token of their own; `None` if nobody takes part from a page.
    #[must_use]
    pub fn join_url(&self) -> Option<String> {
        self.guests.as_ref().map(|guests| format!("http://{}/join?token={}", self.reachable(), guests.secret()))
    }

    /// The secret that requests must show.
    #[must_use]
    pub const fn token(&self) -> &Token {
        &self.token
    }

    /// Ends it, and every connection with it. Returns when its thread has ended.
    pub fn stop(self) {
        drop(self);
    }

    /// An unspecified address is where one listens, not where one calls.
    fn reachable(&self) -> SocketAddr {
        let mut address = self.address;
        if address.ip().is_unspecified() {
            address.set_ip(match address {
                SocketAddr::V4(_) => core::net::Ipv4Addr::LOCALHOST.into(),
                SocketAddr::V6(_) => core::net::Ipv6Addr::LOCALHOST.into(),
            });
        }
        address
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        if let Some(stop) = self.stop.take() {
            // Gone already if the thread ended by itself.
            let _: Result<(), ()> = stop.send(());
        }
        if let Some(thread) = self.thread.take() {
            // A panic in there was reported when it happened.
            let _: std::thread::Result<()> = thread.join();
        }
    }
}
