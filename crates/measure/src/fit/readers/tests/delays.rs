//! Delays of IRTT, LENS and ping.

use std::fmt::Write as _;

use serde_json::{Value, json};

use super::*;
use crate::fit::fit;

/// Returns instants of sending [ms] and delays [ms], rounded to picoseconds.
pub(super) fn packets(delays: &Delays) -> Vec<(f64, Option<f64>)> {
    let millis = |seconds: f64| (seconds * 1e12).round() / 1e9;
    delays.measurements.packets().iter().map(|packet| (millis(packet.sent_s), packet.delay_s.map(millis))).collect()
}

/// Returns the JSON of irtt with a probe every 10 ms: `lost`, and the delays up and down [ns] on a server whose clock is ahead by 3 s.
pub(super) fn irtt(probes: &[(Value, i64, i64)]) -> Value {
    const AHEAD: i64 = 3_000_000_000;
    let trips: Vec<Value> = (0..)
        .zip(probes)
        .map(|(number, (lost, up, down))| {
            let delay = if *lost == json!(false) || *lost == json!("false") {
                json!({ "receive": down - AHEAD, "rtt": up + down, "send": up + AHEAD })
            } else {
                json!({})
            };
            json!({
                "seqno": number,
                "lost": lost,
                "timestamps": { "client": { "send": { "wall": 1_700_000_000_000_000_000_i64 + 10_000_000 * number, "monotonic": 5 } } },
                "delay": delay,
                "ipdv": {},
            })
        })
        .collect();
    json!({ "version": { "irtt": "0.9.1" }, "config": {}, "stats": {}, "round_trips": trips })
}

#[test]
fn irtt_has_three_ways() {
    let words = irtt(&[
        (json!("false"), 8_000_000, 7_000_001),
        (json!("true_up"), 0, 0),
        (json!("true_down"), 0, 0),
        (json!("true"), 0, 0),
        (json!("false"), 9_500_000, 7_000_003),
    ])
    .to_string();
    // The least delays are 8 and 7.000001 ms, so the offset is 3.0004999995 s, and with it both are 7.5000005 ms.
    let up = delays(&words, Some(Direction::Up));
    assert_eq!((up.program, up.direction, up.left_out), (Program::Irtt, Direction::Up, LeftOut { either_way: 1, other_way: 1, copies: 0 }));
    assert!((up.offset_s.unwrap() - 3.000_499_999_5).abs() < 1e-12);
    assert_eq!(packets(&up), [(0.0, Some(7.500_000_5)), (10.0, None), (40.0, Some(9.000_000_5))]);
    let down = delays(&words, Some(Direction::Down));
    assert_eq!(packets(&down), [(0.0, Some(7.500_000_5)), (20.0, None), (40.0, Some(7.500_002_5))]);
    let round = delays(&words, Some(Direction::Rtt));
    assert_eq!(packets(&round), [(0.0, Some(15.000_001)), (10.0, None), (20.0, None), (30.0, None), (40.0, Some(16.500_003))]);
    assert_eq!((round.offset_s, round.left_out), (None, LeftOut::default()));
    // Older versions write booleans, and tell no way.
    let booleans = irtt(&[(json!(false), 8_000_000, 7_000_000), (json!(true), 0, 0)]).to_string();
    let up = delays(&booleans, Some(Direction::Up));
    assert_eq!((up.measurements.packets().len(), up.left_out.either_way), (1, 1));
}

/// The first five probes of the README of LENS, whose offset of 10.48 s the design computes: the least delay is 7.730617 ms each way.
#[test]
fn the_offset_of_irtt_is_half_the_difference_of_the_least_delays() {
    let sends = [10_488_213_200_i64, 10_487_722_034, 10_486_437_967, 10_487_235_754, 10_486_830_087];
    let receives = [-10_470_921_269_i64, -10_470_851_192, -10_470_373_417, -10_470_976_733, -10_470_232_546];
    let probes: Vec<(Value, i64, i64)> =
        sends.iter().zip(receives).map(|(send, receive)| (json!("false"), send - 3_000_000_000, receive + 3_000_000_000)).collect();
    let text = irtt(&probes).to_string();
    for direction in [Direction::Up, Direction::Down] {
        let found = delays(&text, Some(direction));
        assert!((found.measurements.least_s().unwrap() - 7.730_617e-3).abs() < 1e-12, "{found:?}");
        assert!((found.offset_s.unwrap() - 10.478_707_35).abs() < 1e-9);
    }
}

#[test]
fn irtt_is_refused_at_its_place() {
    let good = || irtt(&[(json!(false), 8_000_000, 7_000_000), (json!(false), 8_000_000, 7_000_000)]);
    assert_eq!(refused(&good().to_string()), "direction: the file has both ways: expected up, down, or rtt for the round trip");
    let edited = |edit: fn(&mut Value)| {
        let mut edited = good();
        edit(&mut edited);
        serde_json::to_string_pretty(&edited).unwrap()
    };
    let up = |edit: fn(&mut Value)| refused_way(&edited(edit), Direction::Up);
    assert!(up(|json| json["round_trips"][1]["lost"] = json!("maybe")).contains(", column "));
    assert!(up(|json| json["round_trips"][1]["lost"] = json!("maybe")).contains("expected true, false, or one of \"false\", \"true\", \"true_up\""));
    assert!(up(|json| json["round_trips"][1]["delay"]["send"] = json!("soon")).contains("invalid type: string \"soon\", expected i64"));
    let missing = up(|json| json["round_trips"][1]["delay"] = json!({ "rtt": 5 }));
    assert_eq!(missing, "round_trips[1].delay.send: found nothing, expected the delay of an answered probe, or that the probe was lost");
    let back = up(|json| json["round_trips"][1]["timestamps"]["client"]["send"]["wall"] = json!(5));
    assert!(back.starts_with("round_trips[1].timestamps.client.send.wall: found an instant before that of the probe before"), "{back}");
    let none = up(|json| json["round_trips"][0]["timestamps"]["client"]["send"] = json!({}));
    assert!(none.starts_with("round_trips[0].timestamps.client.send.wall: found nothing"), "{none}");
    assert!(refused("{\"round_trips\": [").starts_with("line 1, column 17: EOF"), "{}", refused("{\"round_trips\": ["));
    assert!(refused("{\"a\": 1, \"b\": 2}").starts_with("line 1: found the keys a, b, expected the JSON of irtt"));
}

#[test]
fn lens_marks_the_way_of_a_loss() {
    let text = "timestamp,rtt,uplink,downlink\n\
                1705744800000000000,0,0,-1\n\
                1705744800010000000,30.5,20.25,10.25\n\
                1705744800020000000,0,-1,0\n\
                1705744800030000000,-1,0,0\n\
                1705744800040000000,NaN,,NA\n\
                1705744800050000000,31,20.75,10.25\n";
    let up = delays(text, Some(Direction::Up));
    // The offset is (20.25 − 10.25)/2 = 5 ms.
    assert_eq!(packets(&up), [(10.0, Some(15.25)), (20.0, None), (50.0, Some(15.75))]);
    assert_eq!((up.offset_s, up.left_out), (Some(0.005), LeftOut { either_way: 2, other_way: 1, copies: 0 }));
    assert_eq!(packets(&delays(text, Some(Direction::Down))), [(0.0, None), (10.0, Some(15.25)), (50.0, Some(15.25))]);
    let round = packets(&delays(text, Some(Direction::Rtt)));
    assert_eq!(round, [(0.0, None), (10.0, Some(30.5)), (20.0, None), (30.0, None), (40.0, None), (50.0, Some(31.0))]);
}

#[test]
fn lens_of_ping_has_the_instants_of_the_answers() {
    let found = delays("timestamp,rtt\n1705744800.0918,91.8\n1705744800.102,100.0\n1705744800.2,-1\n", None);
    assert_eq!((found.program, found.direction), (Program::Lens, Direction::Rtt));
    assert_eq!(packets(&found).iter().map(|packet| packet.1).collect::<Vec<_>>(), [Some(91.8), Some(100.0), None]);
    // Sent 91.8 ms before the first answer, and 100 ms before the second, which came 10.2 ms after the first.
    assert!((found.measurements.packets()[1].sent_s - found.measurements.packets()[0].sent_s - 2e-3).abs() < 1e-9, "{found:?}");
    assert_eq!(found.measurements.ticks.of(0), Some(1e-4));
    assert_eq!(found.measurements.ticks.of(1), Some(1e-3));
}

#[test]
fn lens_is_refused_at_its_place() {
    let both = "timestamp,rtt,uplink,downlink\n";
    assert_eq!(
        refused_way(&format!("{both}5,1,1,soon\n"), Direction::Up),
        "line 2, column downlink: found \"soon\", expected a decimal number, or for a lost packet nothing, NaN, NA or -1"
    );
    assert_eq!(refused_way(&format!("{both}\nx,1,1,1\n"), Direction::Up), "line 3, column timestamp: found \"x\", expected a decimal number");
    assert!(refused_way(&format!("{both}5,1,1,1\n4,1,1,1\n"), Direction::Up).starts_with("line 3, column timestamp: found an instant before"));
    assert!(refused("timestamp,rtt,uplink\n").starts_with("line 1: found the columns timestamp,rtt,uplink, expected timestamp,rtt, or"));
    assert!(refused_way("timestamp,rtt\n5,1\n", Direction::Up).starts_with("direction: expected a file with both ways"));
    // Other tables are left to the reader of tables.
    assert_eq!(read("t,delay\n0,1\n", None), Ok(None));
}

#[test]
fn ping_counts_gaps_as_losses() {
    let text = "PING 10.0.0.1 (10.0.0.1) 56(84) bytes of data.\n\
                [100.0606] 64 bytes from 10.0.0.1: icmp_seq=2 ttl=63 time=60.6 ms\n\
                [100.11] 64 bytes from 10.0.0.1: icmp_seq=5 ttl=63 time=50.0 ms\n\
                [100.07] 64 bytes from 10.0.0.1: icmp_seq=3 ttl=63 time=50.0 ms\n\
                [100.08] 64 bytes from 10.0.0.1: icmp_seq=3 ttl=63 time=60.0 ms (DUP!)\n\
                [100.125] 64 bytes from 10.0.0.1: icmp_seq=6 ttl=63 time=55 ms\n\
                From 10.0.0.9 icmp_seq=7 Destination Host Unreachable\n\
                \n--- 10.0.0.1 ping statistics ---\n\
                8 packets transmitted, 4 received, +1 duplicates, 50% packet loss, time 70ms\n";
    let found = delays(text, None);
    // Sent at 100, 100.02, 100.06 and 100.07 s, the first answer being at 100.0606 s: packet 1 one gap of 17.5 ms before, packet 4 between.
    let sent: Vec<f64> = packets(&found).iter().map(|packet| ((packet.0 + 60.6) * 1e6).round() / 1e6).collect();
    assert_eq!(sent, [-17.5, 0.0, 20.0, 40.0, 60.0, 70.0, 87.5, 105.0]);
    let rtts: Vec<_> = packets(&found).iter().map(|packet| packet.1).collect();
    assert_eq!(rtts, [None, Some(60.6), Some(50.0), None, Some(50.0), Some(55.0), None, None]);
    assert_eq!((found.left_out.copies, found.direction, &found.notes[..]), (1, Direction::Rtt, &[][..]));
    assert_eq!([1, 5].map(|packet| found.measurements.ticks.of(packet)), [Some(1e-4), Some(1e-3)]);
}

#[test]
fn ping_begins_anew_after_65535_and_needs_no_times() {
    let answer = |number: u32, millis: &str| format!("64 bytes from h: icmp_seq={number} ttl=63 time={millis} ms\n");
    let text = [answer(65_534, "0.045"), answer(65_535, "1.25"), answer(1, "12.5"), answer(0, "125")].concat();
    let found = delays(&text, None);
    assert_eq!(packets(&found), [(0.0, Some(0.045)), (1_000.0, Some(1.25)), (2_000.0, Some(125.0)), (3_000.0, Some(12.5))]);
    assert_eq!([0, 1, 2, 3].map(|packet| found.measurements.ticks.of(packet).unwrap()), [1e-6, 1e-5, 1e-3, 1e-4]);
    assert!(found.notes[0].starts_with("one packet every 1000 ms: assumed"), "{:?}", found.notes);
    let timed = format!("{text}--- h ping statistics ---\n4 packets transmitted, 4 received, 0% packet loss, time 30ms\n");
    let found = delays(&timed, None);
    assert_eq!(packets(&found).iter().map(|packet| packet.0).collect::<Vec<_>>(), [0.0, 10.0, 20.0, 30.0]);
    assert_eq!(found.notes, ["one packet every 10 ms: the line at its end says"]);
}

#[test]
fn ping_is_refused_at_its_place() {
    let line = |rest: &str| refused(&format!("PING h\n64 bytes from h: {rest}\n"));
    assert_eq!(line("icmp_seq=1 ttl=63 time=soon ms"), "line 2, time: found \"soon\", expected a round trip in milliseconds, such as time=60.6 ms");
    assert_eq!(line("icmp_seq=1 ttl=63 time=-3 ms").split(':').next(), Some("line 2, time"));
    assert_eq!(line("icmp_seq=1 ttl=63 time=3 us").split(':').next(), Some("line 2, time"));
    assert_eq!(line("icmp_seq=65536 time=1 ms"), "line 2, icmp_seq: found \"65536\", expected a whole number from 0 to 65535");
    assert!(refused("PING h\n[now] 64 bytes from h: icmp_seq=1 time=1 ms\n").starts_with("line 2, [time]: found \"now\""));
    assert!(refused("PING h\n").starts_with("the text: found no answer"));
    // A few lines that name more packets than memory holds.
    let mut far = String::new();
    for number in 0..1_200_u32 {
        let _ = writeln!(far, "x: icmp_seq={} time=1 ms", number * 32_767 % 65_536);
    }
    assert!(refused(&far).ends_with("expected at most 16777216 packets"), "{}", refused(&far));
}

/// Half of a round trip in half of the ticks, whichever the digits: a law that is 9 to 11 ms wide is found as it was made.
#[test]
fn printed_digits_are_intervals() {
    let mut rng = crate::tests::TestRng::new(3);
    let mut text = String::new();
    for number in 1..=4_000 {
        // 9 ms + uniform up to 2 ms, with three significant digits of each, as ping prints.
        let millis = 9.0 + 2.0 * rng.unit();
        let shown = if millis < 9.995 { format!("{millis:.2}") } else { format!("{millis:.1}") };
        let _ = writeln!(text, "[{:.6}] 64 bytes from h: icmp_seq={number} ttl=63 time={shown} ms", f64::from(number) * 0.01 + millis * 1e-3);
    }
    let fitted = fit(&delays(&text, None).measurements.share_of_round_trip(0.5).unwrap()).unwrap();
    // Mean 5 ms, deviation 1 ms/√12, both to five standard errors.
    assert!((fitted.link.delay_s - 5e-3).abs() < 5.0 * 0.289e-3 / 4_000_f64.sqrt(), "{:?}", fitted.link);
    assert!((fitted.link.jitter.sd_s - 0.2887e-3).abs() < 5.0 * 0.289e-3 * (0.2_f64 / 4_000.0).sqrt(), "{:?}", fitted.link);
    let best = &fitted.goodness.laws[0];
    assert!(best.fits && best.distribution == crate::fit::DelayLaw::Uniform, "{:#?}", fitted.goodness.laws);
    assert!((fitted.goodness.resolution_s - 5e-5).abs() < 1e-12 || (fitted.goodness.resolution_s - 5e-6).abs() < 1e-12);
}
