//! Further peers elsewhere, at a joined peer: the pull of a silent peer elsewhere fades, as in a session.
//!
//! A session knows at once when another program falls silent. Behind the links of a scene a silence cannot be told from losses as early, so a joined peer waits
//! for [`SILENCE`] before the fade begins.

use cohaptic_harness::live::Fade;
use cohaptic_peer::coordination::BuiltInStrategy;
use cohaptic_peer::wire::{Extra, Sample};
use cohaptic_peer::{Age, Ages, Peer, ReceiveError, Reception};
use cohaptic_scene::{PeerKind, Scene};
use cohaptic_units::Instant;

use super::device::JoinedDevice;
use crate::client::SILENCE;

/// Peers of kind `udp` of the scene, without the joined peer.
#[derive(Debug)]
pub(super) struct Others {
    ages: Ages<3>,
    elsewhere: Vec<Elsewhere>,
}

/// A peer elsewhere.
#[derive(Debug)]
struct Elsewhere {
    /// Index of the peer in the scene.
    sender: u32,
    /// Index of the peer among the other peers, without the joined peer.
    other: usize,
    fade: Fade,
    /// Arrival of the newest sample; `None` before the first.
    heard: Option<Instant>,
    /// `true` before the first sample, and after a silence.
    is_silent: bool,
    /// Age applied last; `None` before the first.
    told: Option<Age>,
}

/// The joined peer.
type Own = Peer<3, JoinedDevice, BuiltInStrategy<3>>;

impl Others {
    /// Returns the peers elsewhere for the peer at `place`, before any sample.
    pub(super) fn of(scene: &Scene, place: usize) -> Self {
        let elsewhere = scene.peers.iter().enumerate().filter(|(peer, _)| *peer != place).enumerate().filter_map(|(other, (sender, peer))| {
            let PeerKind::Udp(silence) = peer.kind else { return None };
            let sender = u32::try_from(sender).expect("a scene has fewer than 2^32 peers");
            Some(Elsewhere { sender, other, fade: Fade::unheard(silence.fade), heard: None, is_silent: true, told: None })
        });
        Self { ages: Ages::default(), elsewhere: elsewhere.collect() }
    }

    /// Passes a sample received at `at` to the peer, at the tick at `now`. Both instants are in time since tick 0.
    pub(super) fn take_in(
        &mut self,
        now: Instant,
        at: Instant,
        (sample, extra): (&Sample<3>, &Extra<3>),
        own: &mut Own,
    ) -> Result<Reception, ReceiveError> {
        let found = self.elsewhere.iter_mut().find(|elsewhere| elsewhere.sender == sample.sender);
        if let Some(elsewhere) = &found
            && elsewhere.is_silent
        {
            self.ages.await_return(own, elsewhere.other, sample.sequence);
        }
        let received = self.ages.handle_extended(own, sample, extra)?;
        if let Some(elsewhere) = found {
            elsewhere.heard = Some(at);
            if self.ages.take_return(elsewhere.other) {
                elsewhere.is_silent = false;
                elsewhere.fade.moved(now);
                elsewhere.fade.rise(now);
            }
        }
        Ok(received)
    }

    /// Applies the ages of the peers elsewhere before the forces of the tick at `now`.
    pub(super) fn tell(&mut self, now: Instant, own: &mut Own) {
        for elsewhere in &mut self.elsewhere {
            if let Some(since) = elsewhere.heard.map(|heard| heard.saturating_add(SILENCE)).filter(|since| !elsewhere.is_silent && now >= *since) {
                elsewhere.is_silent = true;
                elsewhere.fade.fall(since);
            }
            let age = elsewhere.fade.age(now);
            // Most ages are constant between ticks, and only changes are applied.
            if elsewhere.told != Some(age) {
                elsewhere.told = Some(age);
                self.ages.set(own, elsewhere.other, age);
            }
        }
        self.ages.apply(own);
    }
}
