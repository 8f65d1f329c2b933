//! Output of `ping` and `ping -D`.
//!
//! A line with `icmp_seq=` (or `seq=`) and `time=` is an answer. The number of a packet has 16 bits, so it begins anew after 65535. A number without an answer
//! is a lost packet. A line with `DUP!`, or a second answer to a number, is a copy. With `-D` a line begins with the instant of the answer, `[1700182800.41]`.
//! `time=` has three digits at most: 0.001 ms below 1 ms, 0.01 ms below 10 ms, 0.1 ms below 100 ms, 1 ms above.

use cohaptic_wan::delay_table::Attoseconds;

use super::{Delays, Direction, LeftOut, MOST_PACKETS, Program, ReaderError};
use crate::fit::{Measurement, Measurements};
use crate::series::count;

/// An answer.
struct Answer {
    /// Line of the file, counted from 1.
    line: usize,
    /// Number of the packet, counted on after 65535.
    number: i64,
    /// Instant of the answer; `None` without `-D`.
    at: Option<Attoseconds>,
    rtt_s: f64,
    /// Tick of `rtt_s` \[s\]: the last digit that was printed.
    tick_s: f64,
}

/// Gap between packets that `ping` leaves without `-i` \[s\].
const USUAL_GAP_S: f64 = 1.0;

/// Returns the tick of a round trip of iputils \[s\].
pub(super) const fn tick_of(rtt_s: f64) -> f64 {
    // The last value that is printed with more digits is below each bound by half of a tick.
    match rtt_s {
        from if from >= 0.099_95 => 1e-3,
        from if from >= 0.009_995 => 1e-4,
        from if from >= 0.000_999_5 => 1e-5,
        _ => 1e-6,
    }
}

/// Returns whether a text is what `ping` prints.
pub(super) fn is_ping(text: &str) -> bool {
    text.lines().take(1_000).any(|line| line.starts_with("PING ") || (number_in(line).is_some() && line.contains("time=")))
}

/// Returns the text after `key` up to the next space; `None` without the key.
fn value<'a>(line: &'a str, key: &str) -> Option<&'a str> {
    line.split_once(key).and_then(|(_, rest)| rest.split([' ', ':', ')']).next())
}

/// Returns the text of the number of a packet.
fn number_in(line: &str) -> Option<&str> {
    value(line, "icmp_seq=").or_else(|| value(line, " seq="))
}

/// Reads what `ping` printed.
pub(super) fn read(text: &str) -> Result<Delays, ReaderError> {
    let mut left_out = LeftOut::default();
    let mut answers: Vec<Answer> = Vec::new();
    let (mut has_beginning, mut end) = (false, End::default());
    // The greatest number so far.
    let mut latest: Option<i64> = None;
    for (line, text) in (1..).zip(text.lines()) {
        has_beginning |= text.starts_with("PING ");
        end.read(text);
        let (Some(number), true) = (number_in(text), text.contains("time=")) else { continue };
        let answer = answer(line, text, number, latest)?;
        latest = latest.max(Some(answer.number));
        if text.contains("DUP!") { left_out.copies += 1 } else { answers.push(answer) }
    }
    answers.sort_by_key(|answer| answer.number);
    let before = answers.len();
    answers.dedup_by_key(|answer| answer.number);
    left_out.copies += before - answers.len();
    let (Some(least), Some(most)) = (answers.first(), answers.last()) else {
        return Err(ReaderError::found("the text", "no answer", "lines of ping such as: 64 bytes from 10.0.0.1: icmp_seq=1 ttl=63 time=60.6 ms"));
    };
    // Programs number from 1, some from 0. Without the first line the text may be a part, and nobody knows what came before.
    let first = if has_beginning { least.number.min(1) } else { least.number };
    let last = end.sent.map_or(most.number, |sent| most.number.max(first.saturating_add(sent).saturating_sub(1)));
    let packets = usize::try_from(last - first + 1).unwrap_or(usize::MAX);
    if packets > MOST_PACKETS {
        let found = format!("{packets} packets of which {} were answered", answers.len());
        return Err(ReaderError::found(format!("line {}", most.line), found, format!("at most {MOST_PACKETS} packets")));
    }
    let (measurements, notes) = measured(&answers, first, last, &end);
    Ok(Delays { program: Program::Ping, direction: Direction::Rtt, measurements, left_out, offset_s: None, notes })
}

/// Reads the line of an answer.
fn answer(line: usize, text: &str, number: &str, latest: Option<i64>) -> Result<Answer, ReaderError> {
    let place = |key: &str| format!("line {line}, {key}");
    let shown: u16 = number.parse().map_err(|_| ReaderError::found(place("icmp_seq"), format!("\"{number}\""), "a whole number from 0 to 65535"))?;
    let time = value(text, "time=").unwrap_or("");
    let expected = "a round trip in milliseconds, such as time=60.6 ms";
    let rtt = Attoseconds::parse(time, -3)
        .filter(|rtt| rtt.get() >= 0)
        .ok_or_else(|| ReaderError::found(place("time"), format!("\"{time}\""), expected))?;
    if !text.split_once("time=").is_some_and(|(_, rest)| rest[time.len()..].trim_start().starts_with("ms")) {
        return Err(ReaderError::found(place("time"), format!("\"{time}\" without ms"), expected));
    }
    let digits = time.split_once('.').map_or(0, |(_, digits)| digits.len()).min(6);
    let at = match text.trim_start().strip_prefix('[') {
        Some(rest) => {
            let at = rest.split(']').next().unwrap_or("");
            Some(
                Attoseconds::parse(at, 0)
                    .ok_or_else(|| ReaderError::found(place("[time]"), format!("\"{at}\""), "seconds since 1970, as of ping -D"))?,
            )
        }
        None => None,
    };
    Ok(Answer { line, number: continued(shown, latest), at, rtt_s: rtt.seconds(), tick_s: 10_f64.powi(-3 - i32::try_from(digits).unwrap_or(6)) })
}

/// Returns the number of a packet, counted on after 65535: of all numbers with these 16 bits the nearest to the latest.
pub(super) fn continued(shown: u16, latest: Option<i64>) -> i64 {
    let Some(latest) = latest else { return i64::from(shown) };
    // Both differences are below 2^16, so they fit.
    let ahead = (i64::from(shown) - latest).rem_euclid(1 << 16);
    latest + if ahead < 1 << 15 { ahead } else { ahead - (1 << 16) }
}

/// The summary at the end.
#[derive(Default)]
struct End {
    /// Packets sent.
    sent: Option<i64>,
    /// Time from the first to the last packet \[s\].
    time_s: Option<f64>,
}

impl End {
    fn read(&mut self, line: &str) {
        let Some((sent, rest)) = line.split_once(" packets transmitted") else { return };
        self.sent = sent.trim().parse().ok().filter(|sent| (0..=i64::from(u32::MAX)).contains(sent));
        let millis: Option<u32> = rest.rsplit_once("time ").and_then(|(_, time)| time.trim_end().strip_suffix("ms")?.parse().ok());
        self.time_s = millis.map(|millis| f64::from(millis) * 1e-3);
    }
}

/// Makes measurements of sorted answers: `first` and `last` are the numbers of the first and the last packet.
fn measured(answers: &[Answer], first: i64, last: i64, end: &End) -> (Measurements, Vec<String>) {
    let mut notes = Vec::new();
    let origin = answers.iter().find_map(|answer| answer.at);
    let stamped = answers.iter().all(|answer| answer.at.is_some());
    let as_count = |packets: i64| count(usize::try_from(packets).unwrap_or(0));
    let gap_s = match end.time_s.filter(|_| last > first) {
        Some(time_s) => time_s / as_count(last - first),
        None => USUAL_GAP_S,
    };
    if !stamped {
        let from = if end.time_s.is_some() { "the line at its end says" } else { "assumed, since the text has no times: ping -D prints them" };
        notes.push(format!("one packet every {} ms: {from}", gap_s * 1e3));
    }
    // Instant of sending of an answered packet: the answer came one round trip later.
    let sent_s = |answer: &Answer| match answer.at.zip(origin).filter(|_| stamped) {
        Some((at, origin)) => at.seconds_since(origin).unwrap_or(0.0) - answer.rtt_s,
        None => as_count(answer.number - first) * gap_s,
    };
    let gap_s = match answers {
        // With times, packets before the first answer and after the last one have the mean gap between.
        [one, .., other] if stamped => ((sent_s(other) - sent_s(one)) / as_count(other.number - one.number)).max(0.0),
        _ => gap_s,
    };
    let (mut packets, mut ticks): (Vec<Measurement>, Vec<f64>) = (Vec::new(), Vec::new());
    let mut next = first;
    let mut latest_s = f64::NEG_INFINITY;
    let mut push = |sent_s: f64, answer: Option<&Answer>| {
        // The instant is that of the print, which a busy computer makes late, so packets could seem to be sent in another order.
        latest_s = sent_s.max(latest_s);
        packets.push(Measurement { sent_s: latest_s, delay_s: answer.map(|answer| answer.rtt_s) });
        ticks.push(answer.map_or(1e-6, |answer| answer.tick_s));
    };
    let mut before: Option<(i64, f64)> = None;
    for answer in answers {
        let at_s = sent_s(answer);
        // Lost packets lie evenly between the answered ones.
        let (from, from_s, step_s) = match before {
            Some((number, sent_s)) => (number, sent_s, (at_s - sent_s) / as_count(answer.number - number)),
            None => (answer.number, at_s, gap_s),
        };
        while next < answer.number {
            let steps = if before.is_some() { as_count(next - from) } else { -as_count(from - next) };
            push(from_s + steps * step_s, None);
            next += 1;
        }
        push(at_s, Some(answer));
        (next, before) = (answer.number + 1, Some((answer.number, at_s)));
    }
    while next <= last {
        let (number, sent_s) = before.unwrap_or((first, 0.0));
        push(sent_s + as_count(next - number) * gap_s, None);
        next += 1;
    }
    (Measurements::in_order(packets).rounded_each(ticks), notes)
}
