//! Laws of the lines: delay, rate, order, room, ends.

use super::*;

#[test]
fn bytes_arrive_after_the_delay_to_the_nanosecond_and_answers_by_their_own_line() {
    let mut driver = Driver::new(config("delay=24ms", "delay=3ms"));
    let connection = driver.engine.open(at(5), 0);
    driver.engine.handle_bytes(at(5), connection, Side::Client, b"ask");
    driver.run(at(29));
    driver.engine.handle_bytes(at(29), connection, Side::Server, b"answer");
    driver.run(at(100));
    assert_eq!(driver.seen(connection, Side::Server), [Seen::Bytes(at(29), b"ask".to_vec())]);
    assert_eq!(driver.seen(connection, Side::Client), [Seen::Bytes(at(32), b"answer".to_vec())]);
    driver.check_balance();
}

/// 8 Mbit/s are 1 byte each microsecond: D(n) = max(a(n), D(n−1)) + S.
#[test]
fn pieces_leave_one_after_the_other_at_the_rate_and_connections_share_the_line() {
    let mut driver = Driver::new(config("rate=8Mbit delay=1ms", ""));
    let [one, two] = [0; 2].map(|_| driver.engine.open(at(0), 0));
    driver.engine.handle_bytes(at(0), one, Side::Client, &[1; 2000]);
    driver.engine.handle_bytes(at(0), two, Side::Client, &[2; 1000]);
    driver.run(at(50));
    driver.engine.handle_bytes(at(50), one, Side::Client, &[3; 100]);
    driver.run(at(100));
    let micros = |micros| Instant::ZERO + Duration::from_micros(micros);
    let expected = [Seen::Bytes(micros(2448), vec![1; 1448]), Seen::Bytes(micros(3000), vec![1; 552]), Seen::Bytes(micros(51_100), vec![3; 100])];
    assert_eq!(driver.seen(one, Side::Server), expected);
    assert_eq!(driver.seen(two, Side::Server), [Seen::Bytes(micros(4000), vec![2; 1000])]);
}

#[test]
fn a_sender_has_room_for_what_the_receiver_has_taken_and_for_all_of_the_relay() {
    let mut driver = Driver::new(StreamsConfig { most_bytes: Bytes::new(150), ..config("delay=10ms buffer=100B", "") });
    let [one, two] = [0; 2].map(|_| driver.engine.open(at(0), 0));
    assert_eq!(driver.engine.room(one, Side::Client), 100);
    driver.engine.handle_bytes(at(0), one, Side::Client, &[1; 80]);
    assert_eq!(driver.engine.room(one, Side::Client), 20);
    // The bound is 150 bytes for all connections, of which 80 are held.
    assert_eq!(driver.engine.room(two, Side::Client), 70);
    // The bytes have left the line, and the receiver takes 30 of them.
    driver.engine.handle_timeout(at(10));
    assert_eq!(driver.engine.poll_event(), Some(Event::Ready(one, Side::Server)));
    assert_eq!(driver.engine.writable(one, Side::Server).unwrap().len(), 80);
    driver.engine.wrote(at(10), one, Side::Server, 30);
    assert_eq!((driver.engine.room(one, Side::Client), driver.engine.room(two, Side::Client)), (50, 100));
    driver.check_balance();
}

#[test]
fn a_half_closed_connection_still_carries_answers_and_ends_after_both_ends() {
    let mut driver = Driver::new(config("delay=10ms", "delay=10ms"));
    let connection = driver.engine.open(at(0), 0);
    driver.engine.handle_bytes(at(0), connection, Side::Client, b"ask");
    driver.engine.handle_end(at(0), connection, Side::Client);
    driver.run(at(20));
    assert_eq!(driver.seen(connection, Side::Server), [Seen::Bytes(at(10), b"ask".to_vec()), Seen::Finish(at(10))]);
    driver.engine.handle_bytes(at(20), connection, Side::Server, b"answer");
    driver.engine.handle_end(at(21), connection, Side::Server);
    driver.run(at(60));
    let expected = [Seen::Bytes(at(30), b"answer".to_vec()), Seen::Finish(at(31)), Seen::Closed(at(31))];
    assert_eq!(driver.seen(connection, Side::Client), expected);
    assert_eq!((driver.engine.counts(0).unwrap().ended, driver.engine.open_connections()), (1, 0));
    driver.check_balance();
}

#[test]
fn a_reset_reaches_the_other_end_after_the_delay_and_so_does_no_byte_after() {
    let mut driver = Driver::new(config("delay=10ms", "delay=10ms"));
    let connection = driver.engine.open(at(0), 0);
    driver.engine.handle_bytes(at(0), connection, Side::Client, b"last");
    driver.engine.handle_reset(at(0), connection, Side::Client);
    driver.engine.handle_bytes(at(1), connection, Side::Server, b"lost");
    driver.run(at(60));
    assert_eq!(driver.seen(connection, Side::Server), [Seen::Bytes(at(10), b"last".to_vec())]);
    assert_eq!(driver.seen(connection, Side::Client), [Seen::Reset(at(10))]);
    let counts = driver.engine.line(1).unwrap().0;
    assert_eq!((counts.received, counts.sent, counts.lost), (4, 0, 4));
    assert_eq!(driver.engine.counts(0).unwrap().reset, 1);
}

/// A late driver passes bytes at an instant at which earlier bytes have already left the line.
#[test]
fn bytes_that_left_the_line_before_a_late_input_are_told() {
    for keys in ["delay=10ms", "delay=10ms rate=8Mbit"] {
        let mut driver = Driver::new(config(keys, ""));
        let connection = driver.engine.open(at(0), 0);
        driver.engine.handle_bytes(at(0), connection, Side::Client, b"early");
        driver.engine.handle_bytes(at(30), connection, Side::Client, b"late");
        assert_eq!(driver.engine.poll_timeout(), Some(at(30)));
        driver.engine.handle_timeout(at(30));
        assert_eq!(driver.engine.poll_event(), Some(Event::Ready(connection, Side::Server)));
        assert_eq!(driver.engine.writable(connection, Side::Server), Some(&b"early"[..]));
    }
}

#[test]
fn a_refused_client_is_reset_and_its_place_is_used_again_under_another_name() {
    let mut driver = Driver::new(config("delay=10ms", ""));
    let refused = driver.engine.open(at(0), 0);
    driver.engine.handle_bytes(at(0), refused, Side::Client, b"lost");
    driver.engine.handle_refused(at(1), refused);
    driver.run(at(1));
    let next = driver.engine.open(at(2), 0);
    assert!(next.slot() == refused.slot() && next != refused);
    driver.run(at(60));
    // The bytes of the first connection, still on the line, reach nobody.
    assert_eq!(driver.seen(refused, Side::Client), [Seen::Reset(at(1))]);
    assert_eq!(driver.bytes(next, Side::Server), b"");
    assert_eq!((driver.engine.counts(0).unwrap().refused, driver.engine.line(0).unwrap().0.lost), (1, 4));
    driver.check_balance();
}

#[test]
fn a_change_holds_for_bytes_to_come() {
    let mut driver = Driver::new(config("delay=10ms", ""));
    let connection = driver.engine.open(at(0), 0);
    driver.engine.handle_bytes(at(0), connection, Side::Client, b"old");
    driver.engine.set_stream(at(1), 0, stream("delay=2ms close-after=5ms")).unwrap();
    // In order: the new bytes do not overtake.
    driver.engine.handle_bytes(at(1), connection, Side::Client, b"new");
    let later = driver.engine.open(at(2), 0);
    driver.run(at(60));
    assert_eq!(driver.seen(connection, Side::Server), [Seen::Bytes(at(10), b"oldnew".to_vec())]);
    assert_eq!(driver.seen(later, Side::Server), [Seen::Finish(at(7))]);
    driver.engine.set_stream(at(60), 0, stream("buffer=9B")).unwrap();
    assert_eq!(driver.engine.room(connection, Side::Client), 9);
    assert!(driver.engine.set_stream(at(60), 2, stream("")).is_err());
}
