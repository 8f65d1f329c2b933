//! Faults of single connections.

use super::*;

/// Opens a connection, sends 10 bytes each millisecond for 20 ms from the client, and returns what the server sees until `end`, and the driver.
fn sent(forth: &str, end: u64) -> (Driver, ConnectionId) {
    let mut driver = Driver::new(config(forth, ""));
    let connection = driver.engine.open(at(0), 0);
    for ms in 0..20_u8 {
        driver.run(at(ms.into()));
        driver.engine.handle_bytes(at(ms.into()), connection, Side::Client, &[ms; 10]);
    }
    driver.run(at(end));
    driver.check_balance();
    (driver, connection)
}

fn lost(driver: &Driver) -> u64 {
    driver.engine.line(0).unwrap().0.lost
}

#[test]
fn close_after_ends_both_streams_and_the_bytes_on_their_way_are_lost() {
    let (driver, connection) = sent("delay=2ms close-after=10ms", 2000);
    // Bytes of 0 to 7 ms arrive before 10 ms. Bytes of 8 and 9 ms are still on the line, and later bytes reach nobody.
    assert_eq!(driver.bytes(connection, Side::Server), (0..=7).flat_map(|ms| [ms; 10]).collect::<Vec<u8>>());
    assert_eq!(driver.seen(connection, Side::Server).last(), Some(&Seen::Finish(at(10))));
    assert_eq!(driver.seen(connection, Side::Client), [Seen::Finish(at(10)), Seen::Closed(at(1010))]);
    assert_eq!((driver.engine.counts(0).unwrap().closed_after, lost(&driver)), (1, 120));
}

#[test]
fn reset_after_resets_both_ends() {
    let (driver, connection) = sent("reset-after=10ms", 100);
    assert_eq!(driver.bytes(connection, Side::Server).len(), 100);
    assert_eq!(driver.seen(connection, Side::Client), [Seen::Reset(at(10))]);
    assert_eq!(driver.engine.counts(0).unwrap().reset_after, 1);
}

#[test]
fn a_stall_holds_bytes_for_its_length_and_loses_none() {
    let (driver, connection) = sent("stall={after=\"4500us\",length=\"10ms\"}", 100);
    let seen = driver.seen(connection, Side::Server);
    let before = (0..=4).map(|ms| Seen::Bytes(at(ms), vec![ms as u8; 10]));
    let held = (5..=14).flat_map(|ms| [ms; 10]).collect();
    let resumed = std::iter::once(Seen::Bytes(Instant::ZERO + Duration::from_micros(14_500), held));
    let after = (15..20).map(|ms| Seen::Bytes(at(ms), vec![ms as u8; 10]));
    assert_eq!(seen, before.chain(resumed).chain(after).collect::<Vec<_>>());
}

#[test]
fn a_stall_without_a_length_holds_the_end_too() {
    let (mut driver, connection) = sent("stall=5500us buffer=100B", 100);
    assert_eq!(driver.bytes(connection, Side::Server).len(), 60);
    driver.engine.handle_end(at(100), connection, Side::Client);
    driver.run(at(10_000));
    assert!(driver.seen(connection, Side::Server).iter().all(|seen| matches!(seen, Seen::Bytes(..))));
}

/// Client and bytes can come in one reading of the sockets, at one instant.
#[test]
fn a_fault_at_the_age_zero_holds_for_the_first_byte() {
    for keys in ["stall=0s", "reset-after=0s", "close-after=0s"] {
        let mut driver = Driver::new(config(keys, ""));
        let connection = driver.engine.open(at(3), 0);
        driver.engine.handle_bytes(at(3), connection, Side::Client, b"never");
        driver.run(at(2000));
        assert_eq!(driver.bytes(connection, Side::Server), b"", "{keys}");
        driver.check_balance();
    }
}

#[test]
fn cut_after_gives_the_receiver_so_many_bytes_and_ends_both_streams() {
    let (driver, connection) = sent("cut-after=55B", 100);
    assert_eq!(driver.bytes(connection, Side::Server).len(), 55);
    assert_eq!(driver.seen(connection, Side::Server).last(), Some(&Seen::Finish(at(5))));
    assert_eq!((driver.engine.counts(0).unwrap().cut_after, lost(&driver)), (1, 145));
}

#[test]
fn slices_are_written_one_at_a_time_with_gaps() {
    let mut driver = Driver::new(config("slice={size=\"100B\",gap=\"3ms\"}", ""));
    let connection = driver.engine.open(at(0), 0);
    driver.engine.handle_bytes(at(0), connection, Side::Client, &[1; 250]);
    driver.engine.handle_end(at(0), connection, Side::Client);
    driver.run(at(100));
    let pieces = [(0, 100), (3, 100), (6, 50)].map(|(ms, size)| Seen::Bytes(at(ms), vec![1; size]));
    assert_eq!(driver.seen(connection, Side::Server), pieces.into_iter().chain([Seen::Finish(at(6))]).collect::<Vec<_>>());
}

/// The sizes 80 to 120 are equally probable, so that 400 pieces have a mean of 100 with a standard deviation of 0.6.
#[test]
fn the_sizes_of_slices_vary_as_asked() {
    let mut driver = Driver::new(config("slice={size=\"100B\",variation=\"20B\"}", ""));
    let connection = driver.engine.open(at(0), 0);
    driver.engine.handle_bytes(at(0), connection, Side::Client, &[1; 40_000]);
    driver.run(at(1));
    let sizes: Vec<usize> =
        driver.seen(connection, Side::Server).iter().map(|seen| if let Seen::Bytes(_, bytes) = seen { bytes.len() } else { 0 }).collect();
    let (last, whole) = sizes.split_last().unwrap();
    assert!(whole.iter().all(|size| (80..=120).contains(size)) && *last <= 120);
    assert!(whole.contains(&80) && whole.contains(&120));
    assert!((397..=403).contains(&whole.len()), "{}", whole.len());
}

#[test]
fn slow_close_makes_the_end_late_and_no_byte() {
    let mut driver = Driver::new(config("delay=2ms slow-close=30ms", ""));
    let connection = driver.engine.open(at(0), 0);
    driver.engine.handle_bytes(at(0), connection, Side::Client, b"all");
    driver.engine.handle_end(at(1), connection, Side::Client);
    driver.run(at(100));
    assert_eq!(driver.seen(connection, Side::Server), [Seen::Bytes(at(2), b"all".to_vec()), Seen::Finish(at(33))]);
}

/// Returns which of 2000 connections are reset at once.
fn reset(seed: u64, share: &str) -> Vec<bool> {
    let keys = format!("reset-after={{after=\"0s\",for=\"{share}\"}}");
    let mut driver = Driver::new(StreamsConfig { seed, ..config(&keys, &keys) });
    (0..2000)
        .map(|_| {
            let connection = driver.engine.open(at(0), 0);
            driver.run(at(0));
            !driver.seen(connection, Side::Client).is_empty()
        })
        .collect()
}

#[test]
fn the_seed_chooses_the_share_of_connections_with_a_fault() {
    let chosen = reset(1, "10%");
    // 200 ± 13.4, by the binomial law; four standard deviations.
    let count = chosen.iter().filter(|hit| **hit).count();
    assert!((146..=254).contains(&count), "{count}");
    // A fault of both directions has the same connections, and so has a second run.
    assert_eq!(chosen, reset(1, "10%"));
    assert_ne!(chosen, reset(2, "10%"));
    // Every connection that is hit with a smaller probability is hit with a larger probability too.
    assert!(chosen.iter().zip(reset(1, "30%")).all(|(small, large)| large || !small));
    assert!(reset(1, "100%").iter().all(|hit| *hit) && !reset(1, "0%").contains(&true));
}
