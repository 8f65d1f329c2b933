//! Flags and codepoints of single segments.

use cohaptic_tcp::{Connection, Ecn, Flags, Segment, TcpConfig};
use cohaptic_units::Instant;

use crate::world::millis;

/// Returns two ends after their handshake, which ends after 30 ms.
fn pair(config: &TcpConfig) -> (Connection, Connection) {
    let (us, them) = ("10.0.0.1:1".parse().unwrap(), "10.0.0.2:2".parse().unwrap());
    let mut a = Connection::connect(Instant::ZERO, config.clone(), us, them, 1).unwrap();
    let mut b = Connection::accept(millis(10), config.clone(), &a.poll_transmit(Instant::ZERO).unwrap(), 2).unwrap();
    a.handle_segment(millis(20), &b.poll_transmit(millis(10)).unwrap());
    b.handle_segment(millis(30), &a.poll_transmit(millis(20)).unwrap());
    (a, b)
}

/// Returns the segments that leave at the instant.
fn leaving(end: &mut Connection, at: Instant) -> Vec<Segment<'static>> {
    std::iter::from_fn(|| end.poll_transmit(at)).collect()
}

/// PSH ends the data of a write, also in a repeated segment. A FIN without data has neither PSH nor a codepoint (RFC 3168, section 6.1.4).
#[test]
fn the_end_of_a_write_is_pushed_and_a_fin_alone_is_bare() {
    let (mut a, mut b) = pair(&TcpConfig { ecn: true, ..TcpConfig::default() });
    a.write(&[7; 1448 * 3]).unwrap();
    let data = leaving(&mut a, millis(40));
    assert!(data.len() == 3 && data.iter().all(|segment| segment.ecn == Ecn::Capable0));
    assert!(data[2].flags.has(Flags::PSH));
    data[..2].iter().for_each(|segment| b.handle_segment(millis(50), segment));
    leaving(&mut b, millis(50)).iter().for_each(|answer| a.handle_segment(millis(60), answer));
    let again_at = a.poll_timeout().unwrap();
    a.handle_timeout(again_at);
    let again = leaving(&mut a, again_at);
    let seen: Vec<_> = again.iter().map(|segment| (segment.sequence, segment.flags, segment.ecn)).collect();
    assert_eq!(seen, [(data[2].sequence, Flags::ACK | Flags::PSH, Ecn::NotCapable)]);
    a.close(again_at);
    let seen: Vec<_> = leaving(&mut a, again_at).iter().map(|segment| (segment.payload.len(), segment.flags, segment.ecn)).collect();
    assert_eq!(seen, [(0, Flags::ACK | Flags::FIN, Ecn::NotCapable)]);
}

/// The first segment arrives after its repetition was sent. By then all data is acknowledged, and the report of the duplicate takes the reduction back.
#[test]
fn a_duplicate_reported_after_the_end_takes_the_reduction_back() {
    let (mut a, mut b) = pair(&TcpConfig { timestamps: false, tail_loss_probe: false, ..TcpConfig::default() });
    a.write(&[7; 1460 * 8]).unwrap();
    let data = leaving(&mut a, millis(40));
    let window = a.info().congestion_window;
    let arrives = |a: &mut Connection, b: &mut Connection, segments: &[Segment<'static>], at: u64| {
        for segment in segments {
            b.handle_segment(millis(at), segment);
            leaving(b, millis(at)).iter().for_each(|answer| a.handle_segment(millis(at + 10), answer));
        }
    };
    arrives(&mut a, &mut b, &data[1..], 50);
    let again = leaving(&mut a, millis(60));
    assert_eq!(again.iter().map(|segment| segment.sequence).collect::<Vec<_>>(), [data[0].sequence]);
    arrives(&mut a, &mut b, &data[..1], 70);
    assert!(a.info().congestion_window < window && a.info().undone == 0);
    arrives(&mut a, &mut b, &again, 90);
    assert!(a.info().congestion_window >= window && a.info().undone == 1);
}
