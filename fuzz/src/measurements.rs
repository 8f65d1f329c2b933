//! Files of measurements: tables of delays, and files of IRTT, LENS, ping, iperf3, CellReplay and netem-trace.

use cohaptic_measure::fit::readers::{Content, Direction, Recording, read};
use cohaptic_measure::fit::{Measurements, fit};

/// Any text is answered. Delays are finite and in the order of sending, and a link is TOML.
pub fn run(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    let _ = Measurements::from_csv(text);
    for direction in [None, Some(Direction::Up), Some(Direction::Down), Some(Direction::Rtt)] {
        match read(text, direction) {
            Ok(Some(Content::Delays(delays))) => {
                let packets = delays.measurements.packets();
                assert!(Measurements::new(packets.to_vec()).is_ok());
                assert!(direction.is_none_or(|direction| direction == delays.direction));
                // An estimate of many packets takes too long for a target.
                if packets.len() < 1_000 {
                    let _ = fit(&delays.measurements);
                }
                assert!(delays.measurements.share_of_round_trip(0.5).is_ok());
            }
            Ok(Some(Content::Link(recording))) => {
                let is_link = |recording: &Recording| {
                    let scene: toml::Table = recording.to_scene_toml("beside.csv").parse().unwrap();
                    scene.contains_key("link")
                };
                assert!(is_link(&recording));
                // A walk of the rate is a link, or is refused in words.
                assert!(recording.clone().with_rate_walk().map_or_else(|error| !error.to_string().is_empty(), |walk| is_link(&walk)));
                assert!(recording.with_bytes(1_504).as_ref().map_or_else(|error| !error.to_string().is_empty(), is_link));
            }
            Ok(None) => {}
            Err(error) => assert!(!error.to_string().is_empty()),
        }
    }
}
