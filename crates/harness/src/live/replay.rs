//! A session again, in virtual time.

use std::collections::VecDeque;
use std::time::Duration;

use cohaptic_peer::State;
use cohaptic_scene::Scene;
use cohaptic_units::Instant;

use super::device::LiveDevice;
use super::inputs::{Inputs, Recorded};
use super::scene::LiveScene;
use crate::observer::Observer;
use crate::summary::Summary;

/// Runs a scene with the inputs of a recorded session, as fast as the processor goes: with the same fates and the same motion, to the bit.
///
/// What the network delivers to other processes goes nowhere.
///
/// # Errors
///
/// That of the observer.
///
/// # Panics
///
/// If the scene needs events and has more than 23,170 peers; see [`crate::too_large`].
pub fn replay<O: Observer>(scene: &Scene, inputs: &Inputs, observer: &mut O) -> Result<Summary, O::Error> {
    let mut live = LiveScene::new(scene, |place| Some(Box::new(Playback::of(inputs, place))));
    for (at, what) in &inputs.rows {
        match what {
            Recorded::Sample { peer, datagram } => {
                // Of a record that somebody has changed a sample may be refused, as it would have been in the session.
                let _refused_or_not = live.handle_sample(*at, *peer, datagram, observer)?;
            }
            Recorded::Link { from, to, keys, model } => {
                live.set_link(*at, (*from, *to), keys, model, observer)?;
            }
            // The device is asked for it.
            Recorded::Device { .. } => {}
            Recorded::End => live.stop(*at, observer)?,
        }
        while live.poll_transmit().is_some() {}
    }
    while let Some(at) = live.poll_timeout() {
        live.handle_timeout(at, observer)?;
        while live.poll_transmit().is_some() {}
    }
    Ok(live.summary())
}

/// A device that shows again what it showed.
struct Playback {
    readings: VecDeque<(Instant, State<3>)>,
}

impl Playback {
    fn of(inputs: &Inputs, place: usize) -> Self {
        let readings = inputs.rows.iter().filter_map(|(at, what)| match what {
            Recorded::Device { peer, state: Some(state) } if *peer == place => Some((*at, *state)),
            Recorded::Device { .. } | Recorded::Sample { .. } | Recorded::Link { .. } | Recorded::End => None,
        });
        Self { readings: readings.collect() }
    }
}

impl LiveDevice for Playback {
    fn read(&mut self, now: Instant) -> Option<State<3>> {
        while self.readings.front().is_some_and(|(at, _)| *at < now) {
            self.readings.pop_front();
        }
        let due = self.readings.front().is_some_and(|(at, _)| *at == now);
        due.then(|| self.readings.pop_front()).flatten().map(|(_, state)| state)
    }

    fn hold(&mut self, _now: Instant, _span: Duration, _coupling_force: [f64; 3]) {}
}
