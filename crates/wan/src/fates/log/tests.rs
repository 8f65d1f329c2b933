use cohaptic_tests_common::properties;
use proptest::prelude::*;

use super::*;
use crate::fates::fate::DropCause;
use cohaptic_units::{Bytes, Instant};

const HEADER: &str = "sequence,copy,offered_ns,size,at_ns,fate,marked,damaged";

fn parse(rows: &[&str]) -> Result<FateLog, FateLogError> {
    FateLog::parse(&alloc::format!("{HEADER}\n{}", rows.join("\n")))
}

fn refusal(rows: &[&str]) -> String {
    parse(rows).unwrap_err().to_string()
}

#[test]
fn the_log_of_the_module_page_is_read_and_written() {
    let rows =
        ["0,0,0,64,24,delivered,0,0", "1,0,1,64,1,loss,0,0", "2,0,2,64,2,duplicated,0,0", "2,0,2,64,27,delivered,1,0", "2,1,2,64,26,delivered,0,1"];
    let log = parse(&rows).unwrap();
    assert_eq!(log.packets(), 3);
    assert_eq!(log.of_packet(1)[0].fate, Fate::Dropped(DropCause::Loss));
    assert_eq!(
        log.of_packet(2).iter().map(|record| (record.copy, record.fate.name())).collect::<Vec<_>>(),
        [(0, "duplicated"), (0, "delivered"), (1, "delivered")]
    );
    assert_eq!(log.of_packet(3), []);
    assert_eq!(log.of_packet(u64::MAX), []);
    assert_eq!(log.to_text(), alloc::format!("{HEADER}\n{}\n", rows.join("\n")));
}

#[test]
fn rows_may_stand_in_any_order_and_lines_may_end_as_on_windows() {
    let log = FateLog::parse(&alloc::format!("\u{feff}{HEADER}\r\n1,0,1,64,1,loss,0,0\r\n0,0,0,64,24,delivered,0,0\r\n")).unwrap();
    assert_eq!(log.records().iter().map(|record| record.sequence).collect::<Vec<_>>(), [0, 1]);
}

#[test]
fn a_log_without_packets_is_a_log() {
    assert_eq!(FateLog::parse(HEADER).unwrap(), FateLog::default());
}

#[test]
fn what_cannot_be_read_is_named_with_line_and_column() {
    let good = "0,0,0,64,24,delivered,0,0";
    assert_eq!(refusal(&["0,0,0,64,24,delivered,0"]), alloc::format!("line 2: found 7 cells, expected 8 ({HEADER})"));
    assert_eq!(refusal(&[good, "", good]), alloc::format!("line 3: found 1 cells, expected 8 ({HEADER})"));
    assert_eq!(refusal(&[good, "x,0,1,64,24,delivered,0,0"]), "line 3, column sequence: found \"x\", expected a whole number from 0 to 2^64 - 1");
    assert_eq!(refusal(&["0,256,1,64,24,loss,0,0"]), "line 2, column copy: found \"256\", expected a number from 0 to 255");
    assert_eq!(refusal(&["0,0,-1,64,24,loss,0,0"]), "line 2, column offered_ns: found \"-1\", expected a whole number from 0 to 2^64 - 1");
    assert_eq!(refusal(&["0,0,0,64,24,delivered,yes,0"]), "line 2, column marked: found \"yes\", expected 0 or 1");
    assert!(refusal(&["0,0,0,64,24,eaten,0,0"]).starts_with("line 2, column fate: found \"eaten\", expected delivered, duplicated, filter"));
    assert!(FateLog::parse("").unwrap_err().to_string().starts_with("line 1: found \"\", expected the header"));
    assert!(matches!(FateLog::parse("a,b\n"), Err(FateLogError::Header { .. })));
}

#[test]
fn what_cannot_have_happened_is_refused() {
    let refused = |rows: &[&str]| parse(rows).unwrap_err();
    assert!(matches!(refused(&["1,0,0,64,24,loss,0,0"]), FateLogError::Missing { sequence: 0, line: 2, later: 1 }));
    assert!(matches!(refused(&["1,0,5,64,24,loss,0,0", "0,0,6,64,24,loss,0,0"]), FateLogError::OfferedBefore { line: 2, earlier_line: 3, .. }));
    assert!(matches!(refused(&["0,0,5,64,4,loss,0,0"]), FateLogError::ImpossibleTime { line: 2, .. }));
    assert!(matches!(refused(&["0,0,5,64,6,loss,0,0", "0,0,5,64,7,delivered,0,0"]), FateLogError::TwoEnds { sequence: 0, copy: 0, line: 3 }));
    assert!(matches!(refused(&["0,0,5,64,5,duplicated,0,0"]), FateLogError::NoEnd { sequence: 0, copy: 0 }));
    assert!(matches!(refused(&["0,0,5,64,5,duplicated,0,0", "0,0,5,64,6,loss,0,0"]), FateLogError::NoEnd { sequence: 0, copy: 1 }));
    assert!(matches!(refused(&["0,0,5,64,6,loss,0,0", "0,2,5,64,6,loss,0,0"]), FateLogError::NoEnd { sequence: 0, copy: 1 }));
    assert!(matches!(refused(&["0,0,5,64,6,loss,0,0", "0,1,5,64,6,loss,0,0"]), FateLogError::CopyFromNowhere { sequence: 0, copies: 1, made: 0 }));
    assert!(matches!(
        refused(&["0,0,5,64,5,duplicated,0,0", "0,0,5,64,6,loss,0,0", "0,1,5,65,6,loss,0,0"]),
        FateLogError::Contradiction { sequence: 0, line: 4, other_line: 2 }
    ));
    let at = Instant::from_nanos;
    let twice = PacketRecord {
        path: (),
        sequence: 0,
        copy: 0,
        offered: at(0),
        at: at(1),
        size: Bytes::ZERO,
        fate: Fate::Delivered(at(2)),
        marked: false,
        damaged: false,
    };
    assert!(matches!(FateLog::new([twice]), Err(FateLogError::ImpossibleTime { line: 2, .. })));
}

/// Returns the rows of one packet offered `offered` \[ns\] after the start: the packet itself and up to two copies.
fn packet(sequence: u64, offered: u64, size: u64, ends: &[(u64, u8, bool, bool)]) -> Vec<PacketRecord> {
    let at = |span: u64| Instant::from_nanos(offered.saturating_add(span));
    let row = |copy, at, fate, marked, damaged| PacketRecord {
        path: (),
        sequence,
        copy,
        offered: Instant::from_nanos(offered),
        at,
        size: Bytes::new(size),
        fate,
        marked,
        damaged,
    };
    let mut rows: Vec<_> = (1..ends.len()).map(|_| row(0, at(0), Fate::Duplicated, false, false)).collect();
    for (copy, &(span, what, marked, damaged)) in (0..).zip(ends) {
        let fate = DropCause::ALL.get(usize::from(what)).map_or_else(|| Fate::Delivered(at(span)), |&cause| Fate::Dropped(cause));
        rows.push(row(copy, at(span), fate, marked, damaged));
    }
    rows
}

prop_compose! {
    fn logs()(packets in prop::collection::vec(
        (0..2_000_000_u64, any::<u64>(), prop::collection::vec((any::<u64>(), 0..12_u8, any::<bool>(), any::<bool>()), 1..=3)), 0..12
    )) -> Vec<PacketRecord> {
        let mut offered = 0;
        let mut records = Vec::new();
        for (sequence, (gap, size, ends)) in (0..).zip(packets) {
            offered += gap;
            records.extend(packet(sequence, offered, size, &ends));
        }
        records
    }
}

properties! {
    #[test]
    fn a_log_comes_back_exactly_from_its_text(records in logs(), turn in 0..40_usize) {
        let log = FateLog::new(records.iter().copied()).unwrap();
        prop_assert_eq!(&FateLog::parse(&log.to_text()).unwrap(), &log);
        // The order of the rows must not matter.
        let mut turned = records;
        let by = turn % turned.len().max(1);
        turned.rotate_left(by);
        prop_assert_eq!(FateLog::new(turned).unwrap(), log);
    }

    #[test]
    fn edited_logs_never_panic(records in logs(), edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..6)) {
        let mut bytes = FateLog::new(records).unwrap().to_text().into_bytes();
        for (place, byte) in edits {
            let place = place.index(bytes.len());
            match byte % 4 {
                0 => { bytes.remove(place); }
                1 => bytes.insert(place, b"0,\n9\r-x"[usize::from(byte) % 7]),
                _ => bytes[place] = byte,
            }
            if bytes.is_empty() { break; }
        }
        if let Ok(log) = FateLog::parse(&String::from_utf8_lossy(&bytes)) {
            prop_assert_eq!(FateLog::parse(&log.to_text()).unwrap(), log);
        }
    }

    #[test]
    fn any_text_is_answered(text in "\\PC*") {
        let _ = FateLog::parse(&text);
    }
}
