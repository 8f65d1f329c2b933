use alloc::vec;

use cohaptic_tests_common::properties;
use proptest::prelude::*;

use super::*;

properties! {
    #[test]
    fn pieces_in_any_order_make_the_text(starts in prop::collection::vec((0usize..200, 1usize..60), 0..80)) {
        let text: Vec<u8> = (0..=255).collect();
        let (mut assembler, mut next, mut covered) = (Assembler::default(), 1000, [false; 256]);
        for (start, length) in starts {
            let end = (start + length).min(256);
            assembler.insert(&mut next, 1000 + start as u64, Bytes::copy_from_slice(&text[start..end]));
            covered[start..end].fill(true);
            let expected = covered.iter().position(|is_there| !is_there).unwrap_or(256);
            prop_assert_eq!((next, assembler.unread()), (1000 + expected as u64, expected));
            for (from, to) in assembler.blocks() {
                let span = usize::try_from(from - 1000).unwrap()..usize::try_from(to - 1000).unwrap();
                prop_assert!(span.start > expected && covered[span].iter().all(|is_there| *is_there));
            }
            prop_assert_eq!(assembler.has_gaps(), covered[expected..].contains(&true));
            prop_assert_eq!(assembler.held(), assembler.unread() + assembler.pieces.values().map(Bytes::len).sum::<usize>());
        }
        let memory = |octets: usize| memory::of_received(octets).0;
        prop_assert_eq!(assembler.waiting_memory, assembler.pieces.values().map(|piece| memory(piece.len())).sum::<usize>());
        prop_assert_eq!(assembler.ready_memory, assembler.ready.iter().map(|piece| piece.last_cost).sum::<usize>());
        prop_assert_eq!(assembler.unread(), assembler.ready.iter().map(|piece| piece.unread).sum::<usize>());
        let mut read = vec![0; 300];
        let count = assembler.read(&mut read);
        prop_assert_eq!(&read[..count], &text[..count]);
        prop_assert_eq!(assembler.ready_memory, 0);
    }
}

properties! {
    /// Segments whose data follows each other in memory are read as others, and take the same memory in Linux.
    #[test]
    fn neighbours_in_memory_are_like_others(
        flights in prop::collection::vec((1usize..2000, 1usize..8, 0usize..2000, 0usize..20_000, any::<bool>()), 1..20),
    ) {
        let (mut together, mut alone, mut next) = (Assembler::default(), Assembler::default(), 1000);
        for (size, count, rest, read, is_cut) in flights {
            let octets: Vec<u8> = (0..=255u8).cycle().take(size * count + rest % size).collect();
            let mut data = Payload::from(octets.clone());
            let sizes = octets.chunks(size).map(<[u8]>::len);
            for (k, length) in sizes.enumerate() {
                if k == 0 { data = Payload::first_of(octets.clone().into(), length) } else { data.advance(length) }
                if is_cut && k == 1 {
                    // A copy follows nowhere.
                    together.append(&mut Payload::from(&data[..]));
                } else {
                    together.append(&mut data);
                }
                let at = next;
                alone.insert(&mut next, at, Bytes::copy_from_slice(&octets[k * size..][..length]));
                prop_assert_eq!((together.unread(), together.memory()), (alone.unread(), alone.memory()));
            }
            let [mut one, mut other] = [vec![0; read], vec![0; read]];
            prop_assert_eq!((together.read(&mut one), one), (alone.read(&mut other), other));
            prop_assert_eq!((together.unread(), together.memory()), (alone.unread(), alone.memory()));
        }
    }
}

/// Full segments of a flight make one piece, which takes no memory of the queue.
#[test]
fn full_segments_are_one_piece() {
    let mut assembler = Assembler::default();
    let mut data = Payload::first_of(vec![7; 10_000].into(), 1448);
    for k in 0..6 {
        assembler.append(&mut data);
        data.advance(if k < 5 { 1448 } else { 1312 });
        assert_eq!((assembler.ready.len(), assembler.memory()), (1, (k + 1) * 2304));
    }
    // The last segment is shorter.
    assembler.append(&mut data);
    assert_eq!((assembler.ready.len(), assembler.unread()), (2, 10_000));
    let seen = [1447, 1, 2 * 1448 + 1, 1447, 1448 + 10].map(|octets| (assembler.read(&mut vec![0; octets]), assembler.memory() / 2304).1);
    assert_eq!(seen, [7, 6, 4, 3, 2]);
}

/// A segment of 1448 octets takes 2304 octets of memory until its last octet is read. A segment of 50 octets takes 832, which have room for 147 octets more.
#[test]
fn memory_is_free_when_the_last_octet_of_a_segment_is_read() {
    let (mut assembler, mut next) = (Assembler::default(), 0);
    let insert = |assembler: &mut Assembler, next: &mut u64, octets: usize| {
        assembler.insert(next, *next, vec![0; octets].into());
        assembler.memory()
    };
    assert_eq!([1448, 1448].map(|octets| insert(&mut assembler, &mut next, octets)), [2304, 4608]);
    assert_eq!([1000, 447, 1, 1448].map(|octets| (assembler.read(&mut vec![0; octets]), assembler.memory()).1), [4608, 4608, 2304, 0]);
    assert_eq!([50, 147, 1].map(|octets| insert(&mut assembler, &mut next, octets)), [832, 832, 1664]);
    let gap = next + 10;
    assembler.insert(&mut next, gap, Bytes::from_static(&[0; 10]));
    assert_eq!(assembler.memory(), 2496);
    assembler.forget_gaps();
    assert_eq!(assembler.memory(), 1664);
}

/// The queue begins with the room that the last flight has needed. A reader that is always behind has no longer queue in a longer transfer.
#[test]
fn the_room_for_a_flight_is_that_of_the_queue_and_not_of_the_transfer() {
    let (mut assembler, mut next) = (Assembler::default(), 0);
    let mut insert = |assembler: &mut Assembler, pieces: usize| {
        for _ in 0..pieces {
            let at = next;
            assembler.insert(&mut next, at, Bytes::from_static(&[0; 1448]));
        }
    };
    insert(&mut assembler, 100);
    for _ in 0..10_000 {
        assembler.read(&mut [0; 1448]);
        insert(&mut assembler, 1);
    }
    let read_all = |assembler: &mut Assembler| {
        assembler.read(&mut vec![0; assembler.unread()]);
        assembler.ready.capacity()
    };
    assert_eq!(read_all(&mut assembler), 0);
    for (pieces, room) in [(1, 100..200), (20, 1..100)] {
        insert(&mut assembler, pieces);
        assert!(room.contains(&assembler.ready.capacity()), "{pieces}");
        read_all(&mut assembler);
    }
}

#[test]
fn the_block_that_changed_last_comes_first() {
    let (mut assembler, mut next) = (Assembler::default(), 0);
    for start in [10, 30, 50, 70, 90, 31] {
        assembler.insert(&mut next, start, Bytes::from_static(&[0; 5]));
    }
    let blocks: Vec<_> = assembler.blocks().collect();
    assert_eq!(blocks, [(30, 36), (90, 95), (70, 75), (50, 55)]);
}
