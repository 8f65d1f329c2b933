//! Any edit of a file is answered.

use cohaptic_tests_common::properties;
use proptest::prelude::*;
use serde_json::json;

use super::delays::irtt;
use super::links::{iperf3, rate_for, sum};
use super::*;

/// One file of each program.
fn samples() -> Vec<String> {
    vec![
        irtt(&[(json!("false"), 8_000_000, 7_000_001), (json!("true_up"), 0, 0), (json!(true), 0, 0)]).to_string(),
        "timestamp,rtt,uplink,downlink\n1705744800000000000,0,0,-1\n1705744800010000000,30.5,20.25,10.25\n".to_owned(),
        "timestamp,rtt\n1705744800.0918,91.8\n1705744800.102,100.0\n".to_owned(),
        "PING h\n[100.06] 64 bytes from h: icmp_seq=2 time=60.6 ms\n[100.1] 64 bytes from h: icmp_seq=9 time=50 ms\n\
         9 packets transmitted, time 70ms\n"
            .to_owned(),
        iperf3("UDP", &[sum(0.0, 1e6)]),
        iperf3("TCP", &[sum(0.0, 1e6)]),
        "0 30 0 1\n500 42 0\n1000 36 0\n".to_owned(),
        "0\n3\n9\n".to_owned(),
        json!({ "RepeatedBwPatternConfig": { "pattern": [rate_for(12_000_000, 1), rate_for(24_000_000, 2)], "count": 2 } }).to_string(),
        r#"{"StaticLossConfig":{"loss":[0.1,0.2],"duration":"1s 5ms"}}"#.to_owned(),
        "[[29.0,[2.0,4.0]]]".to_owned(),
    ]
}

/// Any letter, and often one that the formats use.
fn letters() -> impl Strategy<Value = char> {
    prop_oneof![any::<char>(), prop::sample::select("0159-.e,[]{}\":= \n".chars().collect::<Vec<_>>())]
}

properties! {
    /// Any edit of any file is answered. What is read has finite delays in the order of sending, and texts of links are TOML.
    #[test]
    fn edited_files_never_panic(
        which in any::<prop::sample::Index>(),
        edits in prop::collection::vec((any::<prop::sample::Index>(), letters()), 0..6),
    ) {
        let samples = samples();
        let mut text: Vec<char> = which.get(&samples).chars().collect();
        for (place, character) in edits {
            let place = place.index(text.len());
            text[place] = character;
        }
        let text: String = text.into_iter().collect();
        for direction in [None, Some(Direction::Up), Some(Direction::Down), Some(Direction::Rtt)] {
            match read(&text, direction) {
                Ok(Some(Content::Delays(delays))) => {
                    prop_assert!(Measurements::new(delays.measurements.packets().to_vec()).is_ok(), "{text}");
                }
                Ok(Some(Content::Link(link))) => prop_assert!(link.to_scene_toml("a.csv").parse::<toml::Table>().is_ok(), "{}", link.to_scene_toml("a.csv")),
                Ok(None) | Err(_) => {}
            }
        }
    }
}
