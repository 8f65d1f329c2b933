//! The JSON of `irtt client -o FILE`.
//!
//! Each entry of `round_trips` is a probe: `lost` is a boolean, or one of the texts `"false"`, `"true"`, `"true_up"` and `"true_down"`; `delay.send`,
//! `delay.receive` and `delay.rtt` are in nanoseconds; `timestamps.client.send.wall` is the instant of sending in nanoseconds since 1970. `true_up` and
//! `true_down` need `--stats=both`; `true` is a loss on a way that the program does not know.

use std::fmt;

use cohaptic_wan::delay_table::Attoseconds;
use serde::Deserialize;
use serde::de::{Deserializer, Error, Visitor};

use super::json::{needed, parse};
use super::probes::{self, Outcome, Places, Probe};
use super::{Delays, Direction, Program, ReaderError};

#[derive(Deserialize)]
struct Report {
    round_trips: Vec<RoundTrip>,
}

#[derive(Deserialize)]
struct RoundTrip {
    lost: Lost,
    timestamps: Timestamps,
    #[serde(default)]
    delay: Delay,
}

#[derive(Deserialize)]
struct Timestamps {
    client: Client,
}

#[derive(Deserialize)]
struct Client {
    send: Clocks,
}

/// Instants \[ns\]. A clock that `--clock` leaves out is missing.
#[derive(Deserialize)]
struct Clocks {
    wall: Option<i64>,
    monotonic: Option<i64>,
}

/// Delays \[ns\], missing where the probe was lost or the server sent no timestamps.
#[derive(Default, Deserialize)]
struct Delay {
    send: Option<i64>,
    receive: Option<i64>,
    rtt: Option<i64>,
}

/// The key `lost`.
#[derive(Clone, Copy)]
enum Lost {
    No,
    Up,
    Down,
    EitherWay,
}

impl<'de> Deserialize<'de> for Lost {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Words;
        impl Visitor<'_> for Words {
            type Value = Lost;

            fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                formatter.write_str("true, false, or one of \"false\", \"true\", \"true_up\", \"true_down\"")
            }

            fn visit_bool<E: Error>(self, lost: bool) -> Result<Lost, E> {
                Ok(if lost { Lost::EitherWay } else { Lost::No })
            }

            fn visit_str<E: Error>(self, word: &str) -> Result<Lost, E> {
                match word {
                    "false" => Ok(Lost::No),
                    "true" => Ok(Lost::EitherWay),
                    "true_up" => Ok(Lost::Up),
                    "true_down" => Ok(Lost::Down),
                    other => Err(E::invalid_value(serde::de::Unexpected::Str(other), &self)),
                }
            }
        }
        deserializer.deserialize_any(Words)
    }
}

/// Places in the JSON.
struct Paths;

impl Places for Paths {
    fn sent(&self, probe: usize) -> String {
        format!("round_trips[{probe}].timestamps.client.send.wall")
    }

    fn delay(&self, probe: usize, direction: Direction) -> String {
        let key = match direction {
            Direction::Up => "send",
            Direction::Down => "receive",
            Direction::Rtt => "rtt",
        };
        format!("round_trips[{probe}].delay.{key}")
    }
}

/// Reads the JSON.
pub(super) fn read(text: &str, direction: Option<Direction>) -> Result<Delays, ReaderError> {
    let report: Report = parse(text)?;
    // 64 bits of nanoseconds are far inside the range of attoseconds.
    let time = |nanos: i64| Attoseconds::new(i128::from(nanos) * 1_000_000_000);
    let mut probes = Vec::with_capacity(report.round_trips.len());
    for (number, trip) in report.round_trips.iter().enumerate() {
        let clocks = &trip.timestamps.client.send;
        // Instants are only compared with each other, so the monotonic clock serves where `--clock` left the wall clock out.
        let sent = needed(clocks.wall.or(clocks.monotonic), Paths.sent(number), "nanoseconds since 1970, or monotonic ones beside")?;
        let outcome = match trip.lost {
            Lost::Up => Outcome::LostUp,
            Lost::Down => Outcome::LostDown,
            Lost::EitherWay => Outcome::Lost,
            Lost::No => Outcome::Answered { up: trip.delay.send.map(time), down: trip.delay.receive.map(time), rtt: trip.delay.rtt.map(time) },
        };
        probes.push(Probe { sent: time(sent), outcome });
    }
    probes::take(Program::Irtt, &probes, direction, &Paths)
}
