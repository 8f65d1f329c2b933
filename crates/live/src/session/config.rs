//! What a session is told when it is made.

use std::io;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

use cohaptic_harness::record::RecordError;
use cohaptic_realtime::udp::BindError;
use cohaptic_realtime::{Pacing, Tolerance, Wishes};
use cohaptic_scene::SceneContent;

use crate::{AdmissionConfigError, SessionKey};

/// How a session runs. What runs is the scene's business.
#[derive(Clone, Debug)]
pub struct SessionConfig {
    /// Where the peers of kind `udp` send to; not used in a scene that has none.
    pub listen: SocketAddr,
    /// Whether `listen` may be an address that other machines reach though there is no key.
    pub allow_remote: bool,
    /// With a key every datagram must carry a tag made with it.
    pub key: Option<SessionKey>,
    /// How to wait for deadlines.
    pub pacing: Pacing,
    /// What to ask of the system.
    pub wishes: Wishes,
    /// How late things may be.
    pub tolerance: Tolerance,
    /// Where to record; `None`: nowhere.
    pub out: Option<PathBuf>,
    /// Which files are recorded.
    pub recorded: Recorded,
    /// The keys and files of the scene, from [`cohaptic_scene::scene_content`], which the record keeps: a replay with another scene says what differs.
    /// Without them it says only that something does.
    pub content: SceneContent,
}

impl SessionConfig {
    /// Sleeping, with the usual wishes, a tolerance of a millisecond, no key and no record.
    #[must_use]
    pub fn new(listen: SocketAddr) -> Self {
        Self {
            listen,
            allow_remote: false,
            key: None,
            pacing: Pacing::Sleep,
            wishes: Wishes::default(),
            tolerance: Tolerance { limit: Duration::from_millis(1) },
            out: None,
            recorded: Recorded::All,
            content: SceneContent::default(),
        }
    }
}

/// Which files of a session are recorded.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Recorded {
    /// Every motion and every packet too.
    #[default]
    All,
    /// `inputs.csv` alone, from which all others can be made again.
    Inputs,
}

/// Why a session cannot begin, or had to end.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// Strangers could join.
    #[error(
        "anybody who reaches {address} could take part: expected an address of this computer such as 127.0.0.1:7400, or a session key (--key-file), or \
         --allow-remote if everybody there may"
    )]
    NotLoopback {
        /// The address.
        address: SocketAddr,
    },
    /// The socket.
    #[error(transparent)]
    Bind(#[from] BindError),
    /// The admission of peers in other programs.
    #[error("nobody can be let in: {0}")]
    AdmissionControl(#[from] AdmissionConfigError),
    /// The record.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// The system does not let the loop wait or receive.
    #[error("the session had to end: {0}")]
    System(#[from] io::Error),
}
