//! Replays of recorded sessions: the same bytes in virtual time, whatever the steps in which the driver of the session called.

use cohaptic_device::{Description, Device, GatedForce, Reading, Stopper};
use cohaptic_harness::live::{LiveScene, Transmit};
use cohaptic_tests_common::properties;
use cohaptic_units::Instant;
use proptest::collection::vec;
use proptest::option;
use proptest::prelude::*;
use std::time::Duration;

use crate::records::{Observing, again, drain, first_difference, session};
use crate::remote::sample;
use crate::scenes::{LINKS, Written, link, read, scene};

/// Input of a session, `after` microseconds after the input before.
#[derive(Clone, Debug)]
struct Event {
    after: u64,
    what: What,
}

#[derive(Clone, Debug)]
enum What {
    /// The next sample of a process.
    Sample {
        peer: usize,
        x: f64,
    },
    /// A process begins anew, counting from 0.
    Restart {
        peer: usize,
    },
    /// A datagram that is no sample of the peer.
    Junk {
        peer: usize,
    },
    Link {
        from: usize,
        step: usize,
        keys: &'static str,
    },
    /// The driver was busy for this time \[us\]: time passes before the inputs of the meantime are handed in.
    Busy(u64),
}

fn events() -> impl Strategy<Value = Vec<Event>> {
    let what = prop_oneof![
        12 => (0..4_usize, -0.02..0.02).prop_map(|(peer, x)| What::Sample { peer, x }),
        1 => (0..4_usize).prop_map(|peer| What::Restart { peer }),
        1 => (0..4_usize).prop_map(|peer| What::Junk { peer }),
        1 => (0..4_usize, 1..3_usize, link()).prop_map(|(from, step, keys)| What::Link { from, step, keys }),
        2 => (0..6_000_u64).prop_map(What::Busy),
    ];
    let after = prop_oneof![4 => 0..1_500_u64, 2 => Just(0_u64), 2 => Just(1000), 1 => 5_000..40_000_u64];
    vec((after, what).prop_map(|(after, what)| Event { after, what }), 1..80)
}

/// Device that moves, and that is gone from time to time.
struct Moving {
    gone: Option<u64>,
}

impl Device for Moving {
    fn description(&self) -> Description {
        Description { name: "moving".to_owned(), motions: 1, force: 20.0, period: Duration::from_millis(1) }
    }

    fn stopper(&self) -> Stopper {
        Stopper::default()
    }

    fn read(&mut self, now: Instant) -> Option<Reading> {
        let t = now.as_nanos() / 1_000_000;
        let there = self.gone.is_none_or(|gone| t < gone || t > gone + 14);
        let x = now.as_secs_f64().sin() / 7.0;
        there.then_some(Reading { position: [x, x * x, -x], velocity: [1.0 / 7.0, 0.0, f64::MIN_POSITIVE] })
    }

    fn hold(&mut self, _now: Instant, _span: Duration, _force: GatedForce) {}
}

/// Hands the events to a session. Between events, time passes in steps of `step` \[ns\]. With `punctual` the driver is never busy.
fn drive(written: &Written, events: &[Event], step: u64, punctual: bool, live: &mut LiveScene, observer: &mut Observing, out: &mut Vec<Transmit>) {
    let peers = written.scene.peers.len();
    let mut sequences = vec![0; peers];
    let mut keys = written.keys.clone();
    let (mut now, mut handled) = (0, 0);
    for Event { after, what } in events {
        now += after * 1000;
        while handled + step < now {
            handled += step;
            live.handle_timeout(Instant::from_nanos(handled), observer).unwrap();
            drain(live, out);
        }
        let at = Instant::from_nanos(now);
        match what {
            What::Sample { peer, x } => {
                let peer = peer % peers;
                let datagram = sample(&written.scene, peer, sequences[peer], *x, x * 10.0);
                sequences[peer] += 1;
                let _taken_or_not = live.handle_sample(at, peer, &datagram, observer).unwrap();
            }
            What::Restart { peer } => sequences[peer % peers] = 0,
            What::Junk { peer } => {
                let peer = peer % peers;
                let mut datagram = sample(&written.scene, (peer + 1) % peers, 1 << 40, 9.0, 9.0);
                datagram.truncate(60 + (after % 5) as usize);
                assert!(live.handle_sample(at, peer, &datagram, observer).unwrap().is_err());
            }
            What::Link { from, step, keys: text } => {
                let (from, to) = (from % peers, (from + step) % peers);
                for line in text.lines() {
                    let (key, value) = line.split_once(" = ").unwrap();
                    keys = if key == "netem" { Default::default() } else { keys.with("netem", "none") }.with(key, value);
                }
                let model = keys.model("".as_ref()).unwrap();
                live.set_link(at, (from, to), &keys, &model, observer).unwrap();
            }
            What::Busy(micros) if !punctual => {
                handled = handled.max(now + micros * 1000);
                live.handle_timeout(Instant::from_nanos(handled), observer).unwrap();
            }
            What::Busy(_) => {}
        }
    }
    live.handle_timeout(Instant::from_nanos(now), observer).unwrap();
}

fn devices(gone: Option<u64>) -> impl FnMut(usize) -> Option<Box<dyn Device>> {
    move |_| Some(Box::new(Moving { gone }) as Box<dyn Device>)
}

/// Returns a summary as text. Undetected flipped bits make some runs diverge, and a NaN in a summary is not equal to itself.
fn written_out(summary: &cohaptic_harness::Summary) -> String {
    format!("{summary:?}")
}

properties! {
    #![proptest_config(crate::cases(120))]

    /// Scenes with jitter, loss, queues, damage, changes of links in the timeline and by hand, rejoining, busy drivers, and devices that come and go.
    #[test]
    #[ignore = ".ci/nightly runs it: it takes long"]
    fn a_session_is_the_same_again(
        text in scene(&["simulated", "udp", "falcon"]), events in events(), step in 1..5_000_000_u64, gone in option::of(0..40_u64), stops in any::<bool>(),
    ) {
        let written = read(text);
        let live = session(&written.scene, devices(gone), |live, observer, out| {
            drive(&written, &events, step, false, live, observer, out);
            if stops {
                live.stop(live.open(), observer).unwrap();
            }
        });
        let (files, summary) = again(&written, &live);
        let difference = first_difference(&live.files, &files);
        prop_assert!(difference.is_none(), "{difference:?}\n{}", written.text);
        prop_assert_eq!(written_out(&summary), written_out(&live.summary));
    }

    /// A session has the same results for every driver that is never late, however often the driver calls.
    #[test]
    #[ignore = ".ci/nightly runs it: it takes long"]
    fn the_steps_of_a_punctual_driver_do_not_show(
        text in scene(&["simulated", "udp", "udp", "falcon"]), events in events(), steps in (1..300_000_u64, 1..80_000_000_u64), gone in option::of(0..40_u64),
    ) {
        let written = read(text);
        let [fine, coarse] = [steps.0.max(10_000), steps.1].map(|step| {
            session(&written.scene, devices(gone), |live, observer, out| drive(&written, &events, step, true, live, observer, out))
        });
        let difference = first_difference(&fine.files, &coarse.files);
        prop_assert!(difference.is_none(), "{difference:?}\n{}", written.text);
        prop_assert_eq!(fine.transmits, coarse.transmits);
        prop_assert_eq!(written_out(&fine.summary), written_out(&coarse.summary));
    }
}

/// Each link of these tests has an effect: the fates of packets differ from the fates on a link without impairments.
#[test]
fn the_links_of_these_tests_do_something() {
    for keys in &LINKS[1..] {
        let model = keys.lines().fold(cohaptic_scene::LinkKeys::default(), |link, line| {
            let (key, value) = line.split_once(" = ").unwrap();
            link.with(key, value)
        });
        assert_ne!(model.model("".as_ref()).unwrap(), cohaptic_wan::LinkModel::default(), "{keys}");
    }
}
