//! The loop of `cohaptic live`.

use std::error::Error;
use std::net::SocketAddr;
use std::time::Duration;

use cohaptic_benches_realtime::machine;
use cohaptic_benches_realtime::scene::{scene, simulated_scene};
use cohaptic_benches_realtime::visitor::{Invitation, Visitor};
use cohaptic_harness::Ending;
use cohaptic_live::{Conductor, LinkChange, Session, SessionConfig, SessionKey, Status, SystemEntropy};
use cohaptic_realtime::{Pacing, Wishes};

use crate::Loop;

/// The peers of a session.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Members {
    Simulated,
    /// The last is in another program.
    OneOutside,
}

impl Members {
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Simulated => "simulated peers",
            Self::OneOutside => "peers with a program",
        }
    }
}

/// Runs a session of a number of peers to the end of its scene.
pub(crate) fn run(peers: usize, members: Members, pacing: Pacing, wishes: Wishes, span: Duration) -> Result<Loop, Box<dyn Error>> {
    let make = if members == Members::Simulated { simulated_scene } else { scene };
    let scene = make("The loop", 21, peers, span)?;
    let key = SessionKey::generate(&mut SystemEntropy)?;
    let listen = SocketAddr::from(([127, 0, 0, 1], 0));
    let config = SessionConfig { key: Some(key.clone()), pacing, wishes, ..SessionConfig::new(listen) };
    let session = Session::open(&scene, config, |_| None)?;
    let place = u32::try_from(peers - 1)?;
    // It stays to the end.
    let visit = |door| Visitor::start(Invitation { door, session: scene.seed, place, key: key.clone(), stay: span * 2, away: span });
    let visitor = session.address().map(visit);
    let thread = std::thread::spawn(move || {
        let before = machine::thread_time();
        session.run(&mut Nobody).map(|report| (report, machine::thread_time() - before))
    });
    let (report, processor) = thread.join().map_err(|_| "the session panicked")??;
    let visits = visitor.map(Visitor::end).transpose()?;
    let is_heard = visits.is_none_or(|visits| visits.newest > 0);
    if report.summary.ending != Ending::Complete || !is_heard {
        return Err(format!("the session of {peers} peers ended otherwise than was meant: {:?}, {visits:?}", report.summary.ending).into());
    }
    let refused = report.prepared.refused.iter().map(ToString::to_string).collect();
    let releases = visits.map(|_| report.releases);
    Ok(Loop { ticks: report.ticks, releases, processor, refused, late: report.late_ticks })
}

/// Nobody looks on, as in `cohaptic live` without live control.
pub(crate) struct Nobody;

impl Conductor for Nobody {
    fn keep_going(&mut self) -> bool {
        true
    }

    fn next_change(&mut self) -> Option<LinkChange> {
        None
    }

    fn show(&mut self, _status: Status) {}

    fn wants_status(&self) -> bool {
        false
    }
}
