//! The path: a recording looked through from its begin, and delays drawn from their law, alone or from a Gaussian chain.

use std::sync::LazyLock;

use cohaptic_tests_common::properties;
use cohaptic_wan::random::Purpose;
use cohaptic_wan::{Between, Correlation, Delay, Distribution, DropCause, LinkConfig, Order, PathTrace, standard_normal};
use proptest::prelude::*;

use super::{Act, Said, Script, delivered, draws, dropped, said, script, sorted};
use crate::any_link::{JITTERS, any_delay};
use crate::random_links::cases;

/// Rows of (microsecond, delay \[µs\] or lost, loss in quarters).
#[derive(Clone, Debug)]
struct Recording {
    rows: Vec<(u64, Option<u64>, u64)>,
    lines: bool,
    repeats: bool,
}

impl Recording {
    fn trace(&self) -> PathTrace {
        let mut text = String::from("t,delay,loss\n");
        for (at, delay, loss) in &self.rows {
            let delay = delay.map_or(String::new(), |delay| format!("0.{delay:06}"));
            text += &format!("0.{at:06},{delay},{}\n", *loss as f64 / 4.0);
        }
        PathTrace::parse(&text, if self.lines { Between::Lines } else { Between::Steps }, self.repeats).unwrap()
    }

    /// The delay \[ns\] and the loss at an instant \[ns\].
    fn at(&self, mut now: u64) -> (u64, f64) {
        // A lost row has the delay of the one above.
        let mut rows: Vec<(u64, u64, f64)> = Vec::new();
        for (at, delay, loss) in &self.rows {
            let above = rows.last().map_or(0, |row| row.1);
            rows.push((at * 1_000, delay.map_or(above, |delay| delay * 1_000), if delay.is_some() { *loss as f64 / 4.0 } else { 1.0 }));
        }
        if self.repeats {
            now %= rows.last().unwrap().0;
        }
        let before = rows.iter().rev().find(|row| row.0 <= now);
        let after = rows.iter().find(|row| row.0 > now);
        let delay = match (before, after) {
            (Some(before), Some(after)) if self.lines => {
                // On the line, rounded towards the earlier row.
                let part = (i128::from(after.1) - i128::from(before.1)) * i128::from(now - before.0) / i128::from(after.0 - before.0);
                u64::try_from(i128::from(before.1) + part).unwrap()
            }
            (Some(before), _) => before.1,
            (None, _) => rows[0].1,
        };
        (delay, before.unwrap_or(&rows[0]).2)
    }
}

fn recording() -> BoxedStrategy<Recording> {
    let row = (1..30u64, proptest::option::weighted(0.8, 0..20u64), 0..5u64);
    (proptest::collection::vec(row, 1..6), any::<bool>(), any::<bool>())
        .prop_map(|(gaps, lines, repeats)| {
            let mut at = 0;
            let rows = gaps
                .into_iter()
                .map(|(gap, delay, loss)| {
                    at += gap;
                    (at, delay, loss)
                })
                .collect();
            Recording { rows, lines, repeats }
        })
        .boxed()
}

/// Correlation φ of the underlying normal numbers, indexed as [`JITTERS`]; 0 for a delay without correlation by packet. Computed once, because each takes
/// milliseconds.
static PHIS: LazyLock<Vec<f64>> = LazyLock::new(|| {
    let phi = |delay: &Delay| match delay.jitter().map(|jitter| jitter.correlation) {
        Some(Correlation::PerPacket(rho)) => delay.law().unwrap().gaussian_correlation(rho).unwrap(),
        _ => 0.0,
    };
    JITTERS.iter().map(phi).collect()
});

type Config = (Option<Recording>, Delay, bool);

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "microseconds")]
fn jitter(delay: &Delay, chain: &mut Option<(f64, u64)>, now: u64, number: u64) -> u64 {
    let (Some(jitter), Some(law)) = (delay.jitter(), delay.law()) else { return u64::try_from(delay.mean().as_nanos()).unwrap() };
    let mut draws = draws(number, 0).draws(Purpose::Jitter);
    let word = draws.next_word();
    let nanos = match jitter.correlation {
        Correlation::None if jitter.distribution == Distribution::Normal => {
            let z = standard_normal(word, || draws.next_word());
            (delay.mean().as_nanos() as f64 + jitter.sd.as_nanos() as f64 * z).max(jitter.floor.as_nanos() as f64)
        }
        Correlation::None => law.draw(word, || draws.next_word()),
        memory => {
            let fresh = standard_normal(word, || draws.next_word());
            let z = match *chain {
                None => fresh,
                Some((before, then)) => {
                    let phi = match memory {
                        Correlation::PerPacket(_) => PHIS[JITTERS.iter().position(|other| other == delay).unwrap()],
                        Correlation::InTime(time) | Correlation::PartlyInTime { time, .. } => (-((now - then) as f64) / time.as_nanos() as f64).exp(),
                        _ => 0.0,
                    };
                    phi * before + (1.0 - phi * phi).sqrt() * fresh
                }
            };
            *chain = Some((z, now));
            law.at_normal(match memory {
                Correlation::PartlyInTime { share, .. } => {
                    let word = draws.next_word();
                    share.sqrt() * z + (1.0 - share).sqrt() * standard_normal(word, || draws.next_word())
                }
                _ => z,
            })
        }
    };
    nanos.round_ties_even() as u64
}

fn model(script: &Script<Config>) -> Vec<Said> {
    let mut config: Option<Config> = None;
    let (mut chain, mut latest, mut said) = (None, 0, Vec::new());
    for (now, act) in script {
        match (act, &config) {
            (Act::Change(new), _) => {
                // Without correlation in between, the chain begins anew.
                if new.1.jitter().is_none_or(|jitter| jitter.correlation == Correlation::None) {
                    chain = None;
                }
                config = Some(new.clone());
            }
            (Act::Offer(packet), Some((recording, delay, in_order))) => {
                let (recorded, loss) = recording.as_ref().map_or((0, 0.0), |recording| recording.at(*now));
                if draws(packet.number, 0).draws(Purpose::TraceLoss).next_unit() < loss {
                    said.push(dropped(*packet, *now, DropCause::Loss, false));
                    continue;
                }
                let wanted = now + jitter(delay, &mut chain, *now, packet.number) + recorded;
                latest = wanted.max(latest);
                said.push(delivered(*packet, if *in_order { latest } else { wanted }, false));
            }
            (Act::Offer(_), None) => unreachable!("a script begins with a configuration"),
        }
    }
    sorted(said)
}

/// Delays of successive packets are sums of numbers that libraries round differently in the last digit: a nanosecond is granted.
fn alike(subject: &[Said], model: &[Said]) -> bool {
    let near = |a: &Said, b: &Said| {
        let apart = a.2.as_nanos().abs_diff(b.2.as_nanos());
        (a.0, a.1, a.4, a.3.name()) == (b.0, b.1, b.4, b.3.name()) && apart <= 1
    };
    subject.len() == model.len() && subject.iter().zip(model).all(|(a, b)| near(a, b))
}

properties! {
    #![proptest_config(cases(240))]

    #[test]
    fn recordings_laws_and_their_correlation(script in script((proptest::option::of(recording()), any_delay(), any::<bool>()).boxed())) {
        let link = |(recording, delay, in_order): Config| LinkConfig {
            trace: recording.map(|recording| recording.trace()),
            delay,
            order: if in_order { Order::InOrder } else { Order::AllowReordering },
            ..LinkConfig::default()
        };
        let (subject, model) = (said(&script, link), model(&script));
        prop_assert!(alike(&subject, &model), "{:?}\n{:?}", subject, model);
    }
}
