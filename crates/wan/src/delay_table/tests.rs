use alloc::string::{String, ToString};
use alloc::vec::Vec;

use cohaptic_tests_common::properties;
use proptest::prelude::*;

use super::*;

/// Time since the first row and delay \[s\].
fn rows(text: &str) -> Result<Vec<(f64, Option<f64>)>, String> {
    let rows = read(text).map_err(|error| error.to_string())?;
    Ok(rows.iter().map(|row| (row.sent.seconds_since(rows[0].sent).unwrap(), row.delay.map(Attoseconds::seconds))).collect())
}

#[test]
fn both_forms_and_all_units_are_read() {
    let expected = Ok(vec![(0.0, Some(0.024)), (0.001, None), (0.002, Some(0.025))]);
    assert_eq!(rows("t,delay\n0,0.024\n0.001,\n0.002,0.025\n"), expected);
    assert_eq!(rows("\u{feff}T_ms, delay_us ,lost\r\n0,24000,0\r\n1,77,1\r\n2,25000,\r\n"), expected);
    let nanos =
        "id,arrived_ns,sent_ns\na,1700000000024000000,1700000000000000000\nb,,1700000000001000000\nc,1700000000027000000,1700000000002000000\n";
    assert_eq!(rows(nanos), expected);
    assert_eq!(rows("sent,arrived_s\n5,5.024\n5.001\n5.002,5.027\n"), expected);
    assert_eq!(rows("# of Monday\nt,note,delay\n\n0,\"a, \"\"b\"\"\",\"0.024\"\n0.001,,\n# later\n0.002,,0.025,more\n"), expected);
    // Clocks may be offset.
    assert_eq!(rows("sent,arrived\n5,4\n"), Ok(vec![(0.0, Some(-1.0))]));
}

#[test]
fn lost_packets_are_told_in_the_ways_of_programs() {
    for lost in ["", "NaN", "nan", "NA", "-1", "-1.0", "-1e0", "\"\"", " "] {
        let text = format!("t_ms,delay_ms\n0,24\n0,{lost}\n0,-0.5\n");
        assert_eq!(rows(&text), Ok(vec![(0.0, Some(0.024)), (0.0, None), (0.0, Some(-0.0005))]), "{lost}");
    }
    assert_eq!(rows("sent_ms,arrived_ms\n5,-1\n6,NaN\n"), Ok(vec![(0.0, None), (0.001, None)]));
}

#[test]
fn what_is_wrong_is_named() {
    let error = |text: &str| rows(text).unwrap_err();
    assert!(error("t,delays\n").starts_with("line 1: found the columns \"t,delays\", expected `t` or `sent` and either"));
    assert!(error("# x\nt,delay,arrived\n").starts_with("line 2: found the columns"));
    assert!(error("t,sent,delay\n").starts_with("line 1") && error("").starts_with("line 1"));
    let delay = "expected a decimal number, or for a lost packet nothing, NaN, NA or -1";
    assert_eq!(error("t,delay\n0,1\n1,soon\n"), format!("line 3, column delay: found \"soon\", {delay}"));
    assert_eq!(error("t_ms,delay\n,1\n"), "line 2, column t_ms: found \"\", expected a decimal number");
    assert_eq!(error("t_ms,delay\nNaN,1\n"), "line 2, column t_ms: found \"NaN\", expected a decimal number");
    assert_eq!(error("t,delay,lost\n0,1,yes\n"), "line 2, column lost: found \"yes\", expected 0 or 1");
    let back = "line 3: sent 0.5 s before the packet of the line before: expected rows in the order of sending";
    assert_eq!(error("t,delay\n2,1\n1.5,1\n"), back);
}

properties! {
    #[test]
    fn edited_files_never_panic(edits in prop::collection::vec((any::<prop::sample::Index>(), any::<char>()), 0..8)) {
        let mut text: Vec<char> = "sent_ms,arrived,lost\n0,0.024,0\n1,0.026,1\n2,,\n1e3,\"1.024\",0\n".chars().collect();
        for (place, character) in edits {
            let place = place.index(text.len());
            text[place] = character;
        }
        let _ = read(&text.into_iter().collect::<String>());
    }
}
