//! `cohaptic fit` of captures and clocks as people have them. Captures are written octet by octet, as draft-ietf-opsawg-pcap says.

use std::fmt::Write as _;

use serde_json::{Value, json};

use crate::integration::desk::Desk;

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is not a number"))
}

/// A pcap of raw IPv4 with UDP to port 5000: (microseconds, number of the packet), the number being identification and payload.
fn pcap(frames: impl IntoIterator<Item = (u32, u16)>) -> Vec<u8> {
    let mut file = [0xA1B2_C3D4_u32, 0x0002_0004, 0, 0, 65_535, 101].map(u32::to_be_bytes).concat();
    for (micros, packet) in frames {
        let [high, low] = packet.to_be_bytes();
        file.extend([micros / 1_000_000, micros % 1_000_000, 30, 30].map(u32::to_be_bytes).concat());
        file.extend([0x45, 0, 0, 30, high, low, 0, 0, 64, 17, 0, 0, 10, 0, 0, 1, 10, 0, 0, 2]);
        file.extend([0, 9, 0x13, 0x88, 0, 10, 0, 0, high, low]);
    }
    file
}

/// The part of a delay that differs from packet to packet \[µs\], below 5 ms: its mean is 2.5 ms.
fn jitter(packet: u16) -> u32 {
    u32::from(packet) * 7_919 % 5_003
}

/// 2000 packets, one each 10 ms, begun at 1000 s.
fn sent(packet: u16) -> (u32, u16) {
    (1_000_000_000 + 10_000 * u32::from(packet), packet)
}

/// Returns the arrival of a packet, 20 ms and the jitter after its sending, on a receiver's clock that is ahead by `ahead` \[µs\].
fn arrived(packet: u16, ahead: i64) -> (u32, u16) {
    let micros = i64::from(sent(packet).0 + 20_000 + jitter(packet)) + ahead;
    (u32::try_from(micros).unwrap(), packet)
}

fn desk(received: impl IntoIterator<Item = (u32, u16)>) -> Desk {
    let desk = Desk::new();
    desk.write("s.pcap", pcap((0..2_000).map(sent)));
    desk.write("r.pcap", pcap(received));
    desk
}

/// 5 % of the packets are lost; the receiver's capture misses the first 300 and the last 200.
#[test]
fn what_a_capture_could_not_show_is_no_loss() {
    let desk = desk((300..1_800).filter(|packet| packet % 20 != 7).map(|packet| arrived(packet, 0)));
    let document = desk.json("fit s.pcap r.pcap --json");
    assert_eq!(document["matched"]["left_out"], json!([300, 200]));
    assert_eq!((&document["goodness"]["packets"], &document["matched"]["unmatched_sent"]), (&json!(1_500), &json!(75)));
    assert!((number(&document["link"]["delay_s"]) - 0.0225).abs() < 1e-4, "{document:#}");
    let text = desk.text("fit s.pcap r.pcap");
    for part in
        ["sender: 2000 frames: UDP 2000\n", "receiver: 1425 frames: UDP 1425\n", "the first 300 packets and the last 200 packets of the sender"]
    {
        assert!(text.contains(part), "no {part:?} in:\n{text}");
    }
}

#[test]
fn a_file_that_was_cut_off_is_read_with_a_warning() {
    let desk = desk([]);
    let whole = pcap((0..2_000).map(|packet| arrived(packet, 0)));
    desk.write("r.pcap", &whole[..whole.len() - 5]);
    let text = desk.text("fit s.pcap r.pcap");
    assert!(text.contains("receiver: 1999 frames: UDP 1999; the file ends within a block, and was read up to there\n"), "{text}");
    desk.write("r.pcap", &whole[..24]);
    desk.cohaptic("fit s.pcap r.pcap").assert_refused(2, &["the capture of the receiver holds no frame: expected UDP datagrams of the link"]);
    desk.cohaptic("fit s.pcap s.pcap --port 53").assert_refused(
        2,
        &["the capture of the sender has no UDP datagrams to port 53 that can be read", "found 2000 frames: UDP to other ports 2000"],
    );
}

/// The clock of the receiver is behind by 50 ms, so that delays are negative.
#[test]
fn an_offset_of_the_clocks_can_be_given() {
    let desk = desk((0..2_000).map(|packet| arrived(packet, -50_000)));
    desk.cohaptic("fit s.pcap r.pcap").assert_refused(
        2,
        &["expected none below zero", "--offset TIME adds a time to the clock of the receiver", "--least TIME says what the least delay is"],
    );
    for (option, added) in [("--offset 50ms", 0.05), ("--least 20ms", 0.05), ("--offset=40ms", 0.04), ("--least 35ms", 0.065)] {
        let document = desk.json(&format!("fit s.pcap r.pcap {option} --json"));
        assert!((number(&document["clocks"]["added_s"]) - added).abs() < 1e-9, "{option} {document:#}");
        assert!((number(&document["goodness"]["mean_s"]) - (0.0225 - 0.05 + added)).abs() < 1e-5, "{option} {document:#}");
    }
    assert!(desk.text("fit s.pcap r.pcap --least 20ms").contains("\n50.00000 ms was added to every delay\n"));
    // A clock that is ahead: a negative offset.
    desk.write("r.pcap", pcap((0..2_000).map(|packet| arrived(packet, 50_000))));
    let document = desk.json("fit s.pcap r.pcap --offset -50ms --json");
    assert!((number(&document["goodness"]["least_s"]) - 0.02).abs() < 1e-9, "{document:#}");
    desk.cohaptic("fit s.pcap r.pcap --offset 1s --least 1s").assert_refused(2, &["cannot be used with"]);
    desk.cohaptic("fit s.pcap r.pcap --offset soon").assert_refused(2, &["expected a duration such as 1.5s, -20ms or 2h"]);
}

#[test]
fn a_mean_delay_of_two_hours_is_questioned() {
    let desk = desk((0..2_000).map(|packet| arrived(packet, 7_200_000_000 - 4_000_000_000)));
    // 3200 s.
    let question =
        ["the mean delay is 3200.02", "are the two clocks apart? --offset TIME adds", "--least TIME says", "with --offset 0s the delays are taken"];
    desk.cohaptic("fit s.pcap r.pcap").assert_refused(2, &question);
    assert!((number(&desk.json("fit s.pcap r.pcap --offset 0s --json")["link"]["delay_s"]) - 3_200.022_5).abs() < 1e-3);
    assert!((number(&desk.json("fit s.pcap r.pcap --least 20ms --json")["link"]["delay_s"]) - 0.0225).abs() < 1e-4);
    // A log has one clock: its delays are those of the link.
    desk.text("link delay=90s --packets 100 --fates f.csv");
    desk.cohaptic("fit f.csv").assert_refused(2, &["all 100 delays are 90 s"]);
}

/// NTP sets the clock of the receiver back by 40 ms before packet 700.
#[test]
fn a_clock_that_is_set_is_found_and_not_fitted_across() {
    let desk = desk((0..2_000).map(|packet| arrived(packet, if packet < 700 { 40_000 } else { 0 })));
    let document = desk.json("fit s.pcap r.pcap --json");
    let step = &document["clocks"]["steps"][0];
    assert_eq!((document["clocks"]["steps"].as_array().unwrap().len(), &step["packet"]), (1, &json!(700)), "{document:#}");
    assert!((number(&step["by_s"]) + 0.04).abs() < 1e-3 && (number(&step["at_s"]) - 7.0).abs() < 1e-6, "{document:#}");
    assert_eq!(document["clocks"]["fitted"], json!({ "first": 700, "packets": 1_300 }));
    assert!((number(&document["link"]["delay_s"]) - 0.0225).abs() < 1e-4, "{document:#}");
    let text = desk.text("fit s.pcap r.pcap");
    for part in
        ["the least delay changes by -", " ms at 7.000 s and stays so: a clock was set, or the path changed\n", "packets 701 to 2000 of 2000\n"]
    {
        assert!(text.contains(part), "no {part:?} in:\n{text}");
    }
}

/// Five packets at one instant each 10 ms, of which one in ten is lost, whichever it is.
#[test]
fn bursts_of_one_instant_are_a_schedule() {
    let desk = Desk::new();
    let mut csv = "t_us,delay_us\n".to_owned();
    for packet in 0..5_000_u32 {
        let draw = packet.wrapping_mul(2_654_435_761);
        let delay = if draw >> 8 & 0xFFFF < 6_553 { String::new() } else { (20_000 + (draw >> 4) % 5_003).to_string() };
        let _ = writeln!(csv, "{},{delay}", packet / 5 * 10_000);
    }
    desk.write("m.csv", csv);
    let document = desk.json("fit m.csv --json");
    assert_eq!(document["goodness"]["evenly_spaced"], false);
    assert!((number(&document["goodness"]["spacing_s"]) - 0.01).abs() < 1e-9, "{document:#}");
    assert!((number(&document["goodness"]["mean_s"]) - 0.0225).abs() < 2e-4, "{document:#}");
    // √(0.1·0.9/5000) = 0.0042.
    assert!((number(&document["link"]["loss"]["independent"]["probability"]) - 0.1).abs() < 4.5 * 0.0042, "{document:#}");
    assert!(desk.text("fit m.csv").contains("5000 packets in 1000 bursts, "));
    // A single burst is no schedule.
    desk.write("one.csv", format!("t,delay\n{}", (0..60).fold(String::new(), |rows, packet| rows + &format!("5,0.0{}\n", 20 + packet))));
    desk.cohaptic("fit one.csv").assert_refused(2, &["all packets were sent at one instant, 0 s"]);
}
