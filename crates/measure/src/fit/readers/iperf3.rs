//! The JSON of `iperf3 -J`.
//!
//! Each entry of `intervals` has a `sum` with `start` and `end` \[s\], `bits_per_second` and `omitted`; of UDP at the receiver also `lost_packets` and
//! `packets`. The rate of TCP is a lower bound of the rate of the link. The rate of a sender of UDP is what it sent, and says nothing about the link.

use serde::Deserialize;

use super::json::parse;
use super::recording::{Key, Link, Rate, RateSpan, Recording, whole};
use super::{Program, ReaderError};
use crate::series::count_u64;

#[derive(Deserialize)]
struct Report {
    #[serde(default)]
    start: Start,
    intervals: Vec<Interval>,
    error: Option<String>,
}

#[derive(Default, Deserialize)]
struct Start {
    #[serde(default)]
    test_start: TestStart,
}

#[derive(Default, Deserialize)]
struct TestStart {
    protocol: Option<String>,
}

#[derive(Deserialize)]
struct Interval {
    sum: Sum,
}

#[derive(Deserialize)]
struct Sum {
    start: f64,
    end: f64,
    bits_per_second: f64,
    #[serde(default)]
    omitted: bool,
    lost_packets: Option<i64>,
    packets: Option<u64>,
}

/// Reads the JSON.
pub(super) fn read(text: &str) -> Result<Recording, ReaderError> {
    let report: Report = parse(text)?;
    // A failed test can have intervals too, and would pass for a shorter test.
    if let Some(error) = report.error {
        return Err(ReaderError::found("error", format!("\"{error}\""), "a test that ended without an error"));
    }
    // A UDP test counts packets, and older programs do not name the protocol.
    let is_udp = match report.start.test_start.protocol.as_deref() {
        Some("TCP") => false,
        Some("UDP") => true,
        Some(other) => return Err(ReaderError::found("start.test_start.protocol", format!("\"{other}\""), "\"TCP\" or \"UDP\"")),
        None => report.intervals.iter().any(|interval| interval.sum.packets.is_some()),
    };
    let (mut seconds, mut bits, mut rates, mut spans, mut lost, mut packets) = (0.0, 0.0, Vec::new(), Vec::new(), 0_u64, 0_u64);
    // Omitted intervals (`-O`) are the slow start of TCP. Intervals are numbered before the filter, because errors name the index in the file.
    for (number, Interval { sum }) in report.intervals.iter().enumerate().filter(|(_, interval)| !interval.sum.omitted) {
        let place = |key: &str| format!("intervals[{number}].sum.{key}");
        if !(sum.end - sum.start > 0.0 && sum.end - sum.start < 1e9) {
            return Err(ReaderError::found(place("end"), sum.end, format!("a time after the start, {}", sum.start)));
        }
        if !(0.0..=1e15).contains(&sum.bits_per_second) {
            return Err(ReaderError::found(place("bits_per_second"), sum.bits_per_second, "a rate from 0 to 10^15"));
        }
        if is_udp {
            let expected = "the count of the receiver: run iperf3 with -u -R, or take the JSON of the server";
            let lost_here = sum.lost_packets.ok_or_else(|| ReaderError::found(place("lost_packets"), "nothing", expected))?;
            // A packet that comes later than its interval is counted back there, so a number below zero is possible. Their sum is not.
            lost = lost.saturating_add_signed(lost_here);
            packets = packets.saturating_add(sum.packets.ok_or_else(|| ReaderError::found(place("packets"), "nothing", expected))?);
        }
        seconds += sum.end - sum.start;
        // Rates are weighted by time, because the last interval can be shorter than the others.
        bits += sum.bits_per_second * (sum.end - sum.start);
        rates.push(sum.bits_per_second);
        spans.push(RateSpan { start_s: sum.start, end_s: sum.end, bps: sum.bits_per_second });
    }
    if rates.is_empty() {
        return Err(ReaderError::found("intervals", "none that is not omitted", "at least one"));
    }
    if lost > packets {
        return Err(ReaderError::found("intervals", format!("{lost} packets lost of {packets}"), "at most as many as were sent"));
    }
    rates.sort_by(f64::total_cmp);
    let intervals = rates.len();
    // Number ⌈share·n/10⌉ of n, counted from 1. At least one rate is left here, so the index is valid.
    let rank = |share: usize| rates[(share * intervals).div_ceil(10).max(1) - 1];
    let loss = (packets > 0).then(|| count_u64(lost) / count_u64(packets));
    let rate = Rate { intervals, seconds, mean_bps: bits / seconds, between_bps: [rank(1), rank(9)], is_lower_bound: !is_udp, loss };
    if rate.mean_bps < 1.0 {
        return Err(ReaderError::found("intervals", "a mean rate of 0", "a rate of at least 1 bit/s"));
    }
    let mut keys = vec![Key::Rate(whole(rate.mean_bps))];
    keys.extend(loss.filter(|loss| *loss > 0.0).map(Key::Loss));
    let mut notes = vec!["the queue and the delay of the link are not in the file".to_owned()];
    if rate.is_lower_bound {
        notes.push("the rate of TCP is a lower bound of the rate of the link".to_owned());
    } else {
        notes.push("if packets were lost because more was sent than the line takes, a queue loses them: leave the key loss out then".to_owned());
    }
    Ok(Recording { program: Program::Iperf3, rate: Some(rate), walk: None, notes, link: Link::Constant(keys), spans })
}
