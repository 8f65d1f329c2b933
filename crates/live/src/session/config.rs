//! Configuration of a session, and the errors of a session that cannot begin or go on.

use std::io;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

use cohaptic_harness::record::RecordError;
use cohaptic_realtime::udp::BindError;
use cohaptic_realtime::{Pacing, Tolerance, Wishes};
use cohaptic_scene::{Fingerprint, SceneContent};

use crate::{AdmissionConfigError, SessionKey};

/// Configuration of a session: socket, pace and record. Peers, links and duration come from the scene.
#[derive(Clone, Debug)]
pub struct SessionConfig {
    /// Local address of the socket for peers of kind `udp`. Not used in a scene without such peers.
    pub listen: SocketAddr,
    /// `true` if a session without a key may listen at an address within reach of other machines.
    pub allow_remote: bool,
    /// Session key. If set, every datagram must carry a tag made with the key. `None`: datagrams carry no tags.
    pub key: Option<SessionKey>,
    /// Way of waiting for deadlines: sleeping or spinning.
    pub pacing: Pacing,
    /// Requests to the system for the thread of the session, such as priority and processor.
    pub wishes: Wishes,
    /// Largest lateness of ticks and releases in a valid session.
    pub tolerance: Tolerance,
    /// Folder of the record. `None`: nothing is recorded.
    pub out: Option<PathBuf>,
    /// Extent of the record. Not used without `out`.
    pub recorded: Recorded,
    /// Keys and files of the scene, from [`cohaptic_scene::scene_content`], kept in the record. A replay with another scene names the differing keys and files.
    /// With empty content, a replay can only say that the scenes differ.
    pub content: SceneContent,
    /// Fingerprint that hellos must have: a hello with another fingerprint is not answered. `None`: the fingerprint of the scene. A session that was
    /// made shorter or longer than the scene says has the fingerprint of the scene as written here, so that peers need not know the length of the session.
    pub identity: Option<Fingerprint>,
}

impl SessionConfig {
    /// Returns a configuration that sleeps until deadlines, asks the system for the default wishes, tolerates a lateness of 1 ms, and has no key and no record.
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
            identity: None,
        }
    }
}

/// Files of a session's record.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Recorded {
    /// All files: `inputs.csv`, motions, packets and lateness.
    #[default]
    All,
    /// `inputs.csv` alone. A replay of this file computes motions and packets again; the lateness of the session is lost.
    Inputs,
}

/// Reason why a session cannot begin or had to end.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SessionError {
    /// The session would listen without a key at an address within reach of other machines, and [`SessionConfig::allow_remote`] is not set.
    #[error(
        "anybody who reaches {address} could take part: expected an address of this computer such as 127.0.0.1:7400, or a session key (--key-file), or \
         --allow-remote if all of them may"
    )]
    NotLoopback {
        /// Address in [`SessionConfig::listen`].
        address: SocketAddr,
    },
    /// The socket cannot be bound.
    #[error(transparent)]
    Bind(#[from] BindError),
    /// The admission control cannot be made from the scene, or the system has no random bytes.
    #[error("the session can accept nobody: {0}")]
    AdmissionControl(#[from] AdmissionConfigError),
    /// The record cannot be created or written.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// The system does not let the loop wait, or refuses to receive.
    #[error("the session cannot go on: {0}")]
    System(#[from] io::Error),
}
