//! Replay of a recorded session in virtual time.

use std::collections::VecDeque;
use std::time::Duration;

use cohaptic_device::{Description, Device, GatedForce, Reading, Stopper};
use cohaptic_scene::Scene;
use cohaptic_units::Instant;

use super::inputs::{Inputs, Recorded};
use super::scene::LiveScene;
use crate::observer::Observer;
use crate::simulation::questions_of;
use crate::summary::Summary;

/// Runs a scene with the inputs of a recorded session, as fast as possible. Fates and motion are those of the session, to the bit.
///
/// Datagrams for other processes are discarded.
///
/// # Errors
///
/// The error of the observer.
///
/// # Panics
///
/// If the scene needs events and has more than 23,170 peers; see [`crate::too_large`].
pub fn replay<O: Observer>(scene: &Scene, inputs: &Inputs, observer: &mut O) -> Result<Summary, O::Error> {
    let mut live = LiveScene::new(scene, |place| Some(Box::new(Playback::of(inputs, place))));
    let mut questions = Questions { between: questions_of(scene), left: questions_of(scene) };
    for (at, what) in &inputs.rows {
        // Instants up to the row pass one by one: the observer can end a long span without rows too.
        while live.poll_timeout().is_some_and(|due| due < *at) {
            next_instant(&mut live, observer)?;
            if questions.end(&mut live, observer)? {
                return Ok(live.summary());
            }
        }
        match what {
            Recorded::Sample { peer, datagram } => {
                // A sample in an edited record may be refused, as in a session.
                let _refused_or_not = live.handle_sample(*at, *peer, datagram, observer)?;
            }
            Recorded::Link { from, to, keys, model } => {
                live.set_link(*at, (*from, *to), keys, model, observer)?;
            }
            // `Playback` returns the readings when the world reads the device.
            Recorded::Device { .. } => {}
            Recorded::End => live.stop(*at, observer)?,
        }
        while live.poll_transmit().is_some() {}
    }
    while live.poll_timeout().is_some() {
        next_instant(&mut live, observer)?;
        if questions.end(&mut live, observer)? {
            break;
        }
    }
    Ok(live.summary())
}

/// Computes the next instant and discards datagrams for other processes.
fn next_instant<O: Observer>(live: &mut LiveScene, observer: &mut O) -> Result<(), O::Error> {
    if let Some(due) = live.poll_timeout() {
        live.handle_timeout(due, observer)?;
        while live.poll_transmit().is_some() {}
    }
    Ok(())
}

/// Counts instants between two calls of [`Observer::keep_going`].
struct Questions {
    /// Instants between two calls.
    between: u32,
    /// Instants until the next call, at least 1.
    left: u32,
}

impl Questions {
    /// Counts an instant. Asks the observer when the count is complete, and stops the scene on refusal. Returns whether the scene has stopped.
    fn end<O: Observer>(&mut self, live: &mut LiveScene, observer: &mut O) -> Result<bool, O::Error> {
        self.left -= 1;
        if self.left > 0 {
            return Ok(false);
        }
        self.left = self.between;
        // The last instant that has happened.
        let Some(now) = live.open().as_nanos().checked_sub(1).map(Instant::from_nanos) else { return Ok(false) };
        if observer.keep_going(now) {
            return Ok(false);
        }
        live.stop(now, observer)?;
        Ok(true)
    }
}

/// A device with recorded readings.
struct Playback {
    /// Readings still to come with their instants, in the order of time.
    readings: VecDeque<(Instant, Reading)>,
}

impl Playback {
    fn of(inputs: &Inputs, place: usize) -> Self {
        let readings = inputs.rows.iter().filter_map(|(at, what)| match what {
            Recorded::Device { peer, state: Some(state) } if *peer == place => {
                Some((*at, Reading { position: state.position, velocity: state.velocity }))
            }
            Recorded::Device { .. } | Recorded::Sample { .. } | Recorded::Link { .. } | Recorded::End => None,
        });
        Self { readings: readings.collect() }
    }
}

impl Device for Playback {
    fn description(&self) -> Description {
        Description { name: "playback".to_owned(), motions: 0, force: 0.0, period: Duration::ZERO }
    }

    fn stopper(&self) -> Stopper {
        Stopper::default()
    }

    fn read(&mut self, now: Instant) -> Option<Reading> {
        // Earlier readings were never due at a tick, as in a replay with a different scene, and are skipped.
        while self.readings.front().is_some_and(|(at, _)| *at < now) {
            self.readings.pop_front();
        }
        let due = self.readings.front().is_some_and(|(at, _)| *at == now);
        due.then(|| self.readings.pop_front()).flatten().map(|(_, reading)| reading)
    }

    fn hold(&mut self, _now: Instant, _span: Duration, _force: GatedForce) {}
}
