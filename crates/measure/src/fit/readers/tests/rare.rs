//! Rare files: older versions, other spellings, packets that overtake each other, and the ends of ranges.

use serde_json::{Value, json};

use super::delays::{irtt, packets};
use super::links::{iperf3, rate_for, sum};
use super::*;
use crate::fit::readers::ping::{continued, tick_of};

#[test]
fn irtt_sends_bursts_and_leaves_keys_of_lost_probes_out() {
    let mut report = irtt(&[(json!(false), 8_000_000, 7_000_000), (json!("true_up"), 0, 0), (json!(false), 9_000_000, 7_000_000)]);
    report["round_trips"][1].as_object_mut().unwrap().remove("delay");
    // A burst: the lost probe was sent at the instant of the first one.
    report["round_trips"][1]["timestamps"] = report["round_trips"][0]["timestamps"].clone();
    let round = packets(&delays(&report.to_string(), Some(Direction::Rtt)));
    assert_eq!(round, [(0.0, Some(15.0)), (0.0, None), (20.0, Some(16.0))]);
    // Without a wall clock the monotonic one counts.
    for (number, at) in (0..).zip([5_000_000, 6_000_000, 7_000_000]) {
        report["round_trips"][number]["timestamps"]["client"]["send"] = json!({ "monotonic": at });
    }
    let sent: Vec<f64> = packets(&delays(&report.to_string(), Some(Direction::Rtt))).iter().map(|packet| packet.0).collect();
    assert_eq!(sent, [0.0, 1.0, 2.0]);
}

#[test]
fn lens_has_comments_names_in_capitals_and_answers_that_overtake() {
    // The second answer came first: its packet was sent 80 ms before the first row and 71 ms after the other packet.
    let text = "\u{feff}# made by hand\nTimestamp,RTT\n1.5,20\n\n1.501,100.0\n";
    let found = delays(text, None);
    let [one, other] = found.measurements.packets() else { panic!("{found:?}") };
    assert_eq!((one.delay_s, other.delay_s), (Some(0.1), Some(0.02)));
    assert!((other.sent_s - one.sent_s - 0.079).abs() < 1e-9, "{found:?}");
    // Each delay keeps the tick of its own digits.
    assert_eq!([0, 1].map(|packet| found.measurements.ticks.of(packet)), [Some(1e-3), Some(1e-4)]);
}

/// Values that round to the next number of digits are printed with the digits of that one.
#[test]
fn digits_of_ping_change_where_it_rounds() {
    for (rtt_ms, tick) in [(0.999_4, 1e-6), (0.999_6, 1e-5), (9.994, 1e-5), (9.996, 1e-4), (99.94, 1e-4), (99.96, 1e-3)] {
        assert_eq!(tick_of(rtt_ms * 1e-3).to_bits(), f64::to_bits(tick), "{rtt_ms}");
    }
}

#[test]
fn the_nearest_number_of_a_packet_counts() {
    assert_eq!(continued(7, None), 7);
    assert_eq!(continued(32_767, Some(0)), 32_767);
    // As far ahead as behind: a packet that is late is likelier than one of which 32,767 before it were lost.
    assert_eq!(continued(32_768, Some(0)), -32_768);
    assert_eq!(continued(1, Some(65_535)), 65_537);
}

#[test]
fn ping_is_read_as_other_programs_print_it() {
    // BusyBox counts from 0 and says `seq`. A line of the shell stands before.
    let busybox = "$ ping h\nPING h (10.0.0.1): 56 data bytes\n64 bytes from 10.0.0.1: seq=0 ttl=64 time=0.1234 ms\n\
                   64 bytes from 10.0.0.1: seq=2 ttl=64 time=2 ms\n";
    let found = delays(busybox, None);
    assert_eq!(packets(&found), [(0.0, Some(0.1234)), (1_000.0, None), (2_000.0, Some(2.0))]);
    // Four digits are a tick of 0.1 µs.
    assert!((found.measurements.ticks.of(0).unwrap() / 1e-7 - 1.0).abs() < 1e-12);
    let without_beginning = busybox.split_once("bytes\n").unwrap().1;
    assert_eq!(packets(&delays(&format!("$ tail ping.txt\n{without_beginning}"), None)).len(), 3);
    // Copies are told by their number too.
    let twice = "PING h\n64 bytes from h: icmp_seq=1 time=5 ms\n64 bytes from h: icmp_seq=1 time=6 ms\n";
    let found = delays(twice, None);
    assert_eq!((packets(&found).len(), found.left_out.copies), (1, 1));
    // A single packet has no gap.
    let one =
        "PING h\n64 bytes from h: icmp_seq=1 time=5 ms\n--- h ping statistics ---\n1 packets transmitted, 1 received, 0% packet loss, time 0ms\n";
    assert_eq!(packets(&delays(one, None)), [(0.0, Some(5.0))]);
}

#[test]
fn ping_on_a_busy_computer_keeps_the_order_of_sending() {
    // The line of packet 2 was printed 30 ms late, so packet 3 seems to be sent before.
    let late = "PING h\n[1.005] 64 bytes from h: icmp_seq=1 time=5.0 ms\n[1.045] 64 bytes from h: icmp_seq=2 time=5.0 ms\n\
                [1.025] 64 bytes from h: icmp_seq=3 time=5.0 ms\n";
    let sent: Vec<f64> = delays(late, None).measurements.packets().iter().map(|packet| packet.sent_s).collect();
    assert!(sent.windows(2).all(|pair| pair[0] <= pair[1]), "{sent:?}");
    // A single line without a time takes the times from all packets, and packets are then a second apart.
    let torn = late.replace("[1.045] ", "");
    let found = delays(&torn, None);
    assert_eq!(packets(&found).iter().map(|packet| packet.0).collect::<Vec<_>>(), [0.0, 1_000.0, 2_000.0]);
    assert_eq!(found.notes.len(), 1);
}

#[test]
fn iperf3_weighs_by_time_and_counts_at_the_receiver() {
    let mut short = sum(1.0, 9e6);
    short["end"] = json!(1.25);
    // A file without `start`, as of an older program: (8·1 + 9·0.25)/1.25 Mbit/s.
    let old = json!({ "intervals": [{ "sum": sum(0.0, 8e6) }, { "sum": short }] }).to_string();
    assert!((recording(&old).rate.unwrap().mean_bps - 8.2e6).abs() < 1.0);
    let counted = |lost: i64, packets: u64| {
        let mut sum = sum(0.0, 8e6);
        sum["lost_packets"] = json!(lost);
        sum["packets"] = json!(packets);
        sum
    };
    let udp = |lost: i64, packets: u64| iperf3("UDP", &[counted(lost, packets)]);
    // No key for no loss.
    assert_eq!(recording(&udp(0, 500)).to_scene_toml(""), "[link]\nrate = \"8000000bit\"\n");
    assert_eq!(recording(&udp(500, 500)).rate.unwrap().loss, Some(1.0));
    assert_eq!(refused(&udp(501, 500)), "intervals: found 501 packets lost of 500, expected at most as many as were sent");
    // Packets say that it was UDP where the program does not.
    let unnamed = json!({ "intervals": [{ "sum": counted(5, 500) }] }).to_string();
    assert_eq!((recording(&unnamed).rate.unwrap().is_lower_bound, recording(&unnamed).rate.unwrap().loss), (false, Some(0.01)));
}

#[test]
fn cellreplay_has_lines_of_windows_and_long_recordings() {
    assert_eq!(recording("0\r\n3\r\n9\r\n").beside(), Some(("line", "0\n3\n9\n")));
    assert_eq!(recording("0\n1000000000000\n").beside(), Some(("line", "0\n1000000000000\n")));
    assert!(refused("0\n1000000000001\n").starts_with("line 2, time: found \"1000000000001\""));
}

#[test]
fn netem_trace_has_defaults_and_limits() {
    let scene = |value: Value| recording(&value.to_string()).to_scene_toml("");
    let fixed = |name: &str, fields: Value| scene(json!({ name: fields }));
    // The defaults of the library: 12 Mbit/s, 10 ms, and losses of 0.1 after a packet that arrived and 0.2 after one that was lost.
    assert_eq!(fixed("StaticBwConfig", json!({})), "[link]\nrate = \"12000000bit\"\n");
    assert_eq!(fixed("StaticDelayConfig", json!({})), "[link]\ndelay = \"10ms\"\n");
    assert_eq!(fixed("StaticLossConfig", json!({})), "[link]\nloss = { gilbert-elliott = { p = 0.1, r = 0.8 } }\n");
    assert_eq!(fixed("StaticLossConfig", json!({ "loss": [0.3, 0.3] })), "[link]\nloss = 0.3\n");
    assert_eq!(fixed("StaticLossConfig", json!({ "loss": [] })), "[link]\nloss = 0.0\n");
    assert_eq!(fixed("StaticBwConfig", json!({ "bw": "1Gbps 250kbps 5bps" })), "[link]\nrate = \"1000250005bit\"\n");
    // An entry that lasts no time is passed over, also in a trace, and a pattern without a count repeats for ever.
    let with_nothing = json!({ "RepeatedBwPatternConfig": { "pattern": [rate_for(5, 0), rate_for(6, 1)] } }).to_string();
    assert_eq!((recording(&with_nothing).to_scene_toml(""), &recording(&with_nothing).notes[..]), ("[link]\nrate = \"6bit\"\n".to_owned(), &[][..]));
    assert_eq!(scene(json!({ "TraceBwConfig": [[0.0, [2.0]], [5.0, [3.0]]] })), "[link]\nrate = \"3000000bit\"\n");
    let once = recording(&json!({ "RepeatedBwPatternConfig": { "pattern": [rate_for(5, 1), rate_for(6, 1)], "count": 1 } }).to_string());
    assert_eq!(once.notes, ["the pattern ends: its last turn holds for ever"]);
    assert!(once.to_scene_toml("").ends_with("{ name = \"turn-2\" },\n]\n"), "{}", once.to_scene_toml(""));
    let nanos = |nanos: u64| json!({ "StaticDelayConfig": { "delay": { "secs": 0, "nanos": nanos } } });
    assert_eq!(scene(nanos(999_999_999)), "[link]\ndelay = \"999.999999ms\"\n");
    assert!(refused(&nanos(1_000_000_000).to_string()).starts_with("StaticDelayConfig.delay: found "));
    let turns = |count: u64| json!({ "RepeatedBwPatternConfig": { "pattern": [rate_for(5, 1), rate_for(6, 1)], "count": count } }).to_string();
    assert!(recording(&turns(500)).to_scene_toml("").contains("turn-1000"));
    assert!(refused(&turns(501)).ends_with("found 1002 turns or more, expected at most 1000"), "{}", refused(&turns(501)));
}
