use alloc::vec;

use super::*;

fn segment(sequence: u32, flags: Flags, octets: &[u8]) -> Segment<'static> {
    Segment { sequence, flags, payload: octets.to_vec().into(), ..Run::blank().segment }
}

/// Appends a run of segments of 100 octets, of which the last one has 40, from the sequence number 2³² − 150 on. Every third segment has PSH.
fn append_run(flight: &mut Flight, count: u32) -> Vec<Segment<'static>> {
    let octets: Vec<u8> = (0..=255).cycle().take(100 * count as usize).collect();
    let first = u32::MAX - 149;
    let flags = |k: u32| Flags::ACK.with_if(Flags::PSH, k.is_multiple_of(3));
    let expected = (0..count).map(|k| {
        let (start, size) = (100 * k, if k + 1 == count { 40 } else { 100 });
        segment(first.wrapping_add(start), flags(k), &octets[start as usize..][..size])
    });
    let expected: Vec<_> = expected.collect();
    let run = flight.begin();
    (run.segment.sequence, run.segment.flags) = (first, flags(0));
    run.segment.payload = Payload::first_of(octets.into(), expected[0].payload.len());
    run.begin();
    for next in &expected[1..] {
        assert!(run.may_append(next.sequence, next.payload.len()));
        run.append(next.payload.len(), next.flags.has(Flags::PSH));
    }
    expected
}

#[test]
fn segments_come_out_as_they_went_in() {
    let mut flight = Flight::default();
    for count in [1, 2, 7, Run::MOST] {
        let mut expected = vec![segment(1, Flags::SYN, b""), segment(2, Flags::ACK | Flags::PSH, b"alone")];
        expected.iter().for_each(|segment| flight.push(segment.clone()));
        expected.extend(append_run(&mut flight, count));
        flight.push(segment(3, Flags::ACK | Flags::FIN, b""));
        expected.push(segment(3, Flags::ACK | Flags::FIN, b""));
        assert_eq!(flight.used, 4);
        for (taken, next) in expected.iter().enumerate() {
            let left = &expected[taken..];
            assert_eq!((flight.len(), flight.packet_lengths()), (left.len(), left.iter().map(Segment::packet_length).sum()), "{taken} of {count}");
            assert_eq!(flight.pop_front().as_ref(), Some(next));
        }
        assert!(flight.is_empty() && flight.pop_front().is_none() && flight.last().is_none());
        flight.clear();
        assert!(
            (flight.is_empty(), flight.len(), flight.capacity()) == (true, 0, Flight::FIRST)
                && flight.runs.iter().all(|run| run.segment.payload.memory_length() == 0)
        );
    }
}

#[test]
fn a_run_has_neighbours_in_one_piece_of_memory() {
    let mut flight = Flight::default();
    let run = flight.begin();
    run.segment.payload = Payload::first_of(vec![0; 1000].into(), 100);
    run.begin();
    // Overlap, gap, longer than the first segment, and no data.
    for (sequence, size) in [(99, 100), (101, 100), (100, 101), (100, 0)] {
        assert!(!run.may_append(sequence, size), "{sequence} {size}");
    }
    (1..9).for_each(|_| run.append(100, false));
    // The memory ends after a thousand octets.
    assert_eq!([(900, 100), (900, 50), (1000, 100)].map(|(sequence, size)| run.may_append(sequence, size)), [true, true, false]);
    run.append(50, false);
    // The last segment was short.
    assert!(!run.may_append(950, 50));
    let run = flight.begin();
    run.segment.payload = Payload::first_of(vec![0; 1000].into(), 10);
    run.begin();
    (1..Run::MOST).for_each(|_| run.append(10, false));
    assert!(!run.may_append(10 * Run::MOST, 10));
}
