//! The JSON of the library netem-trace: one key, the name of a configuration, and its fields.
//!
//! Read are `StaticBwConfig`, `RepeatedBwPatternConfig` and `TraceBwConfig`, and the static and repeated configurations of delay and loss. A rate is
//! `{"gbps": …, "bps": …}` or a text such as `"12Mbps"`, a time `{"secs": …, "nanos": …}` or a text such as `"1s"`. A pattern with the `count` 0 repeats for
//! ever. Configurations that draw random numbers (`NormalizedBwConfig`, `SawtoothBwConfig` with noise) are refused: the numbers are those of another library.
//!
//! The numbers of a loss are probabilities: the first one after a packet that arrived, the second one after one lost packet, and so on. A link remembers one
//! packet, so up to two numbers are read.

use std::time::Duration;

use serde_json::Value;

use super::json::parse;
use super::recording::{Key, Link, Recording, Turn, whole};
use super::{Program, ReaderError};

/// Most turns of a pattern, all repetitions included. The states of a modulator have a weight for each other state.
const MOST_TURNS: usize = 1_000;

/// Subject of a configuration.
#[derive(Clone, Copy, PartialEq, Eq)]
enum About {
    Rate,
    Delay,
    Loss,
}

/// Values of a configuration that hold one after the other, each for a span.
struct Turns {
    turns: Vec<Turn>,
    forever: bool,
}

/// Reads the JSON of a configuration.
pub(super) fn read(text: &str) -> Result<Recording, ReaderError> {
    recording(configuration(&parse(text)?, "", None)?)
}

/// Reads the list of a `TraceBwConfig` without its name.
pub(super) fn read_list(text: &str) -> Result<Recording, ReaderError> {
    recording(trace(&parse(text)?, "")?)
}

fn recording(Turns { turns, forever }: Turns) -> Result<Recording, ReaderError> {
    let mut notes = Vec::new();
    let Some(last) = turns.last() else {
        return Err(ReaderError::found("the configuration", "nothing that lasts", "at least one rate, delay or loss"));
    };
    let is_constant = turns.iter().all(|turn| turn.key == last.key);
    if !forever {
        notes.push("the pattern ends: its last turn holds for ever".to_owned());
    }
    let link = if is_constant { Link::Constant(vec![last.key.clone()]) } else { Link::Turns { turns, forever } };
    Ok(Recording { program: Program::NetemTrace, rate: None, walk: None, notes, link, spans: Vec::new() })
}

/// Reads a configuration at `path`. `about`: what the configurations of the same pattern are about.
fn configuration(value: &Value, path: &str, about: Option<About>) -> Result<Turns, ReaderError> {
    let expected = "a table with the name of one configuration, such as StaticBwConfig";
    let table = value.as_object().ok_or_else(|| found(path, value, expected))?;
    let (Some((name, fields)), 1) = (table.iter().next(), table.len()) else { return Err(found(path, value, expected)) };
    let inner = join(path, name);
    let this = match name.as_str() {
        "StaticBwConfig" | "RepeatedBwPatternConfig" | "TraceBwConfig" => About::Rate,
        "StaticDelayConfig" | "RepeatedDelayPatternConfig" => About::Delay,
        "StaticLossConfig" | "RepeatedLossPatternConfig" => About::Loss,
        "NormalizedBwConfig" | "SawtoothBwConfig" => {
            return Err(ReaderError::new(inner, "another library draws these rates: expected rates in the file, such as those of TraceBwConfig"));
        }
        other => return Err(ReaderError::found(path_or_beginning(path), format!("\"{other}\""), "a configuration of rate, delay or loss")),
    };
    if about.is_some_and(|about| about != this) {
        return Err(ReaderError::found(path_or_beginning(path), format!("\"{name}\""), "configurations of one kind in a pattern"));
    }
    match name.as_str() {
        "TraceBwConfig" => trace(fields, &inner),
        repeated if repeated.starts_with("Repeated") => pattern(fields, &inner, this),
        _ => fixed(fields, &inner, this),
    }
}

/// Reads a static configuration. Missing fields have the library's defaults: 12 Mbit/s, 10 ms, one second.
fn fixed(fields: &Value, path: &str, about: About) -> Result<Turns, ReaderError> {
    let field = |name: &str| fields.get(name).filter(|value| !value.is_null()).map(|value| (value, join(path, name)));
    if !fields.is_object() {
        return Err(found(path, fields, "a table"));
    }
    let key = match about {
        About::Rate => Key::Rate(field("bw").map_or(Ok(12_000_000), |(value, path)| rate(value, &path))?),
        About::Delay => Key::Delay(field("delay").map_or(Ok(Duration::from_millis(10)), |(value, path)| time(value, &path))?),
        About::Loss => field("loss").map_or(Ok(Key::LossInRuns([0.1, 0.2])), |(value, path)| loss(value, &path))?,
    };
    let lasts = field("duration").map_or(Ok(Duration::from_secs(1)), |(value, path)| time(value, &path))?;
    // The library passes over what lasts no time.
    Ok(Turns { turns: if lasts.is_zero() { Vec::new() } else { vec![Turn { key, lasts }] }, forever: false })
}

/// Reads a repeated pattern.
fn pattern(fields: &Value, path: &str, about: About) -> Result<Turns, ReaderError> {
    let places = join(path, "pattern");
    let list =
        fields.get("pattern").and_then(Value::as_array).ok_or_else(|| found(&places, fields.get("pattern").unwrap_or(&Value::Null), "a list"))?;
    let count = match fields.get("count") {
        None => 0,
        Some(count) => count.as_u64().ok_or_else(|| found(&join(path, "count"), count, "a whole number, 0 for ever"))?,
    };
    let mut once = Vec::new();
    for (number, entry) in list.iter().enumerate() {
        let place = format!("{places}[{number}]");
        let Turns { turns, forever } = configuration(entry, &place, Some(about))?;
        once.extend(turns);
        if forever {
            // Nothing follows what repeats for ever. Before that, the list holds for one time only, which no modulator of one cycle can say.
            if number > 0 {
                return Err(ReaderError::new(place, "a pattern that repeats for ever after another one: expected a count, or the pattern alone"));
            }
            return Ok(Turns { turns: once, forever: true });
        }
        limited(once.len(), &places)?;
    }
    let repeats = usize::try_from(count.max(1)).unwrap_or(usize::MAX);
    let is_constant = once.windows(2).all(|pair| pair[0].key == pair[1].key);
    if is_constant {
        return Ok(Turns { turns: once, forever: count == 0 });
    }
    // Patterns inside patterns multiply. The product saturates, because a wrapped product could pass the limit.
    limited(once.len().saturating_mul(repeats), &places)?;
    let length = once.len();
    let turns = once.into_iter().cycle().take(length * repeats).collect();
    Ok(Turns { turns, forever: count == 0 })
}

/// Reads a trace of rates: a list of pairs of a time \[ms\] and the rates that hold for that time each \[Mbit/s\].
fn trace(value: &Value, path: &str) -> Result<Turns, ReaderError> {
    const EXPECTED: &str = "pairs of milliseconds and a list of Mbit/s, such as [[29.0, [2.2, 4.1]]]";
    let value = value.get("pattern").unwrap_or(value);
    let mut turns: Vec<Turn> = Vec::new();
    for (number, pair) in value.as_array().ok_or_else(|| found(path, value, EXPECTED))?.iter().enumerate() {
        let place = format!("{path}[{number}]");
        let (Some(millis), Some(rates), 2) =
            (pair.get(0).and_then(Value::as_f64), pair.get(1).and_then(Value::as_array), pair.as_array().map_or(0, Vec::len))
        else {
            return Err(found(&place, pair, EXPECTED));
        };
        let lasts = Duration::try_from_secs_f64(millis / 1e3).map_err(|_| found(&place, pair, "a time from 0 ms"))?;
        for (place_in_list, value) in rates.iter().enumerate() {
            let bps = value.as_f64().filter(|mbps| (0.0..=1e9).contains(mbps)).map(|mbps| whole(mbps * 1e6));
            let bps = bps
                .filter(|bps| *bps > 0)
                .ok_or_else(|| found(&format!("{place}[1][{place_in_list}]"), value, "a rate above 0, at most 10^9 Mbit/s"))?;
            // A turn without length is passed over only here, after the checks, so that a wrong rate is refused in any case.
            if !lasts.is_zero() {
                turns.push(Turn { key: Key::Rate(bps), lasts });
                limited(turns.len(), path)?;
            }
        }
    }
    Ok(Turns { turns, forever: false })
}

fn limited(turns: usize, path: &str) -> Result<(), ReaderError> {
    if turns > MOST_TURNS {
        return Err(ReaderError::found(path_or_beginning(path), format!("{turns} turns or more"), format!("at most {MOST_TURNS}")));
    }
    Ok(())
}

/// Reads a rate \[bit/s\].
fn rate(value: &Value, path: &str) -> Result<u64, ReaderError> {
    const EXPECTED: &str = "a rate above 0 such as {\"gbps\": 0, \"bps\": 12000000} or \"12Mbps\"";
    let of_table = || {
        let part = |name: &str| value.get(name).map_or(Some(0), Value::as_u64);
        // Without this line a text would count as a table without parts, of the rate 0, and `of_text` would not be tried.
        value.as_object()?;
        part("gbps")?.checked_mul(1_000_000_000)?.checked_add(part("bps")?)
    };
    let of_text = || {
        // The library writes several units in a row for a rate that is no whole number of one: "1Gbps 200Mbps".
        let words = value.as_str()?.split_whitespace();
        words.map(rate_of_word).try_fold(0_u64, |sum, bps| sum.checked_add(bps?))
    };
    of_table().or_else(of_text).filter(|bps| *bps > 0).ok_or_else(|| found(path, value, EXPECTED))
}

fn rate_of_word(word: &str) -> Option<u64> {
    const UNITS: [(&str, f64); 4] = [("gbps", 1e9), ("mbps", 1e6), ("kbps", 1e3), ("bps", 1.0)];
    let word = word.to_ascii_lowercase();
    let (number, unit) = UNITS.iter().find_map(|(name, unit)| Some((word.strip_suffix(name)?, unit)))?;
    number.parse::<f64>().ok().map(|number| number * unit).filter(|bps| (0.0..=1e15).contains(bps)).map(whole)
}

/// Reads a time.
fn time(value: &Value, path: &str) -> Result<Duration, ReaderError> {
    const EXPECTED: &str = "a time such as {\"secs\": 1, \"nanos\": 0} or \"1s\", below 292 years";
    let of_table = || {
        value.as_object()?;
        // From 10^9 nanoseconds on, `Duration::new` carries into the seconds, and panics if the seconds overflow.
        let nanos =
            value.get("nanos").map_or(Some(0), Value::as_u64).and_then(|nanos| u32::try_from(nanos).ok()).filter(|nanos| *nanos < 1_000_000_000)?;
        Some(Duration::new(value.get("secs").map_or(Some(0), Value::as_u64)?, nanos))
    };
    let of_text = || {
        let words = value.as_str()?.split_whitespace();
        words.map(|word| cohaptic_units::parse::duration(word).ok()).try_fold(Duration::ZERO, |sum, time| sum.checked_add(time?))
    };
    of_table().or_else(of_text).filter(|time| time.as_nanos() <= i64::MAX.unsigned_abs().into()).ok_or_else(|| found(path, value, EXPECTED))
}

/// Reads the probabilities of a loss.
fn loss(value: &Value, path: &str) -> Result<Key, ReaderError> {
    const EXPECTED: &str = "a list of one or two probabilities: after a packet that arrived, and after a lost one";
    let probability = |value: &Value| value.as_f64().filter(|probability| (0.0..=1.0).contains(probability));
    let numbers: Option<Vec<f64>> = value.as_array().and_then(|list| list.iter().map(probability).collect());
    match numbers.as_deref() {
        Some([]) => Ok(Key::Loss(0.0)),
        Some([loss]) => Ok(Key::Loss(*loss)),
        Some([loss, again]) if loss.total_cmp(again).is_eq() => Ok(Key::Loss(*loss)),
        Some([loss, again]) => Ok(Key::LossInRuns([*loss, *again])),
        Some(_) | None => Err(found(path, value, EXPECTED)),
    }
}

fn join(path: &str, name: &str) -> String {
    if path.is_empty() { name.to_owned() } else { format!("{path}.{name}") }
}

fn path_or_beginning(path: &str) -> &str {
    if path.is_empty() { "the configuration" } else { path }
}

fn found(path: &str, value: &Value, expected: &str) -> ReaderError {
    ReaderError::found(path_or_beginning(path), value, expected)
}
