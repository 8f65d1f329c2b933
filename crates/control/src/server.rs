//! The server: a thread with its own single-threaded runtime.

use std::io;
use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;
use std::thread::JoinHandle;

use thiserror::Error;
use tokio::runtime::Builder;
use tokio::sync::{Mutex, Semaphore, oneshot};

use crate::http::{self, App, Pace, People, Shown};
use crate::token::Ticket;
use crate::{Board, Guests, LinkEditor, Stage, Study, Token, TokenError};

/// Address and admission rules of a server.
#[derive(Clone, Debug)]
pub struct ServerConfig {
    /// Address to listen on. Port 0 takes any free port.
    pub address: SocketAddr,
    /// Secret to be shown by every request; `None` for a random secret.
    pub token: Option<Token>,
    /// `true` if `address` may be reachable from other machines. The traffic is not encrypted, so anybody on the way can read the token.
    pub allow_remote: bool,
    /// Accepted names in the `Host` header, besides `localhost` and addresses, such as `"lab-pc.example"`. Requests for other names are refused, so that a
    /// page of another site cannot reach the server through a name pointing to this machine (DNS rebinding).
    pub hosts: Vec<String>,
}

impl ServerConfig {
    /// Returns a configuration with a random token and loopback addresses only.
    #[must_use]
    pub const fn new(address: SocketAddr) -> Self {
        Self { address, token: None, allow_remote: false, hosts: Vec::new() }
    }
}

/// Error of starting a server.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ServeError {
    /// The address is reachable from other machines, and remote access is not allowed.
    #[error(
        "live control would be open to other machines at {address}: listen on 127.0.0.1 or [::1] and reach it from elsewhere through `ssh -L`, or allow \
         remote access (--allow-remote); the traffic is not encrypted"
    )]
    NotLoopback {
        /// Address asked for.
        address: SocketAddr,
    },
    /// The system refused to listen on the address.
    #[error("live control cannot listen on {address}: {source}; port 0 takes any that is free")]
    Listen {
        /// Address asked for.
        address: SocketAddr,
        /// Error of the system.
        source: io::Error,
    },
    /// No token could be made.
    #[error(transparent)]
    Token(#[from] TokenError),
    /// The system refused a thread or a runtime.
    #[error("live control cannot start its thread: {0}")]
    Thread(io::Error),
}

/// A running server. Dropping the value stops the server.
#[derive(Debug)]
pub struct Server {
    address: SocketAddr,
    token: Token,
    guests: Guests,
    ticket: Arc<Ticket>,
    stop: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

/// Starts a server on a thread of its own. Connections are accepted from the return of this function on.
///
/// # Errors
///
/// [`ServeError`] if the address is not allowed, or if the system refuses a socket, a thread or random numbers.
pub fn serve(config: ServerConfig, board: Arc<Board>, editor: Box<dyn LinkEditor>) -> Result<Server, ServeError> {
    start(config, board, editor, Guests::default(), People::Nobody)
}

/// Starts the server of a run in which people take part from a page. Links for guests contain a token of their own, which allows no changes except of a hand.
///
/// # Errors
///
/// The errors of [`serve()`].
pub fn serve_stage(config: ServerConfig, board: Arc<Board>, editor: Box<dyn LinkEditor>, stage: Arc<dyn Stage>) -> Result<Server, ServeError> {
    // A second token, so that the host can hand out links without giving away the right to change the run.
    let guests = Guests::default();
    guests.set(vec![Token::random()?]);
    start(config, board, editor, guests, People::Stage(stage))
}

/// Starts the server of a study. The token of the server is that of the experimenter, and `guests` has one token per person, which the study may replace.
/// Links and counters are shown to the experimenter alone, so that no page of a person tells the condition.
///
/// # Errors
///
/// The errors of [`serve()`].
pub fn serve_study(
    config: ServerConfig,
    board: Arc<Board>,
    editor: Box<dyn LinkEditor>,
    guests: Guests,
    study: Arc<dyn Study>,
) -> Result<Server, ServeError> {
    start(config, board, editor, guests, People::Study(study))
}

fn start(config: ServerConfig, board: Arc<Board>, editor: Box<dyn LinkEditor>, guests: Guests, people: People) -> Result<Server, ServeError> {
    let address = config.address;
    // An IPv4 loopback address may come mapped into IPv6, which only the canonical form shows.
    if !address.ip().to_canonical().is_loopback() && !config.allow_remote {
        return Err(ServeError::NotLoopback { address });
    }
    let token = match config.token {
        Some(token) => token,
        None => Token::random()?,
    };
    let listen = |source| ServeError::Listen { address, source };
    // Bound here and not on the thread, so that the caller gets the error, and the port chosen for port 0.
    let listener = TcpListener::bind(address).map_err(listen)?;
    listener.set_nonblocking(true).map_err(listen)?;
    let address = listener.local_addr().map_err(listen)?;
    let ticket = Arc::new(Ticket::default());
    let app = App {
        board,
        ticket: Arc::clone(&ticket),
        shown: Shown::default(),
        editor: Arc::new(Mutex::new(editor)),
        token: token.clone(),
        guests: guests.clone(),
        hosts: config.hosts,
        people,
        comparing: Semaphore::new(1),
        pace: Pace::default(),
        patience: http::PATIENCE,
    };
    let runtime = Builder::new_current_thread().enable_io().enable_time().build().map_err(ServeError::Thread)?;
    // The conversion registers the socket with the runtime, which must be entered for this.
    let listener = {
        let _inside = runtime.enter();
        tokio::net::TcpListener::from_std(listener).map_err(listen)?
    };
    let (stop, stopped) = oneshot::channel();
    let run = move || {
        runtime.block_on(async {
            tokio::spawn(http::answer_all(listener, http::router(app)));
            // An error means that the sender was dropped with the server, which asks for the same end.
            let _: Result<(), oneshot::error::RecvError> = stopped.await;
        });
        // Ends open answers, such as streams of events, without waiting for their readers.
        runtime.shutdown_background();
    };
    let thread = std::thread::Builder::new().name("live-control".to_owned()).spawn(run).map_err(ServeError::Thread)?;
    Ok(Server { address, token, guests, ticket, stop: Some(stop), thread: Some(thread) })
}

impl Server {
    /// Returns the address listened on, with the real port.
    #[must_use]
    pub const fn address(&self) -> SocketAddr {
        self.address
    }

    /// Returns the address of the page, including the token. The address is a secret.
    #[must_use]
    pub fn url(&self) -> String {
        format!("http://{}/?token={}", self.reachable(), self.token.secret())
    }

    /// Returns an address of the page for a program that opens a browser. The address works once, and only the newest address works. The token is not part
    /// of the address, because other users of the machine can see the arguments of programs. Without random numbers from the system, returns
    /// [`Server::url`] instead.
    #[must_use]
    pub fn open_url(&self) -> String {
        self.ticket.issue().map_or_else(|_| self.url(), |ticket| format!("http://{}/open?ticket={}", self.reachable(), ticket.secret()))
    }

    /// Returns the link for guests, with the guests' token; `None` if the run has no part for people.
    #[must_use]
    pub fn join_url(&self) -> Option<String> {
        self.join_urls().into_iter().next()
    }

    /// Returns a link for each guest, in the order of the guests' tokens.
    #[must_use]
    pub fn join_urls(&self) -> Vec<String> {
        self.guests.tokens().iter().map(|token| format!("http://{}/join?token={}", self.reachable(), token.secret())).collect()
    }

    /// Returns the secret to be shown by requests.
    #[must_use]
    pub const fn token(&self) -> &Token {
        &self.token
    }

    /// Stops the server and all its connections. Returns when the thread has ended.
    pub fn stop(self) {
        drop(self);
    }

    /// Returns an address to connect to. An unspecified address such as 0.0.0.0 is for listening only, so loopback takes its place.
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
            // Fails if the thread has ended by itself, which is harmless.
            let _: Result<(), ()> = stop.send(());
        }
        if let Some(thread) = self.thread.take() {
            // A panic of the thread was already reported by the panic hook.
            let _: std::thread::Result<()> = thread.join();
        }
    }
}
