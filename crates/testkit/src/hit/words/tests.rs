use proptest::prelude::*;

use super::*;

fn read(text: &str) -> Result<Vec<Hit>, Fault> {
    parse(text, 0..text.len())
}

fn said(text: &str) -> Vec<String> {
    read(text).unwrap().iter().map(ToString::to_string).collect()
}

#[test]
fn words_are_read_and_printed() {
    for text in [
        "drop packet 3",
        "drop packets 3 8 12-15",
        "delay 30ms first packet",
        "duplicate 2nd packet with \"GET / ; x\"",
        "duplicate 1.5s 3rd segment",
        "corrupt every packet with 0x1603ff",
        "behind 3 11th SYN",
        "drop every retransmission",
        "drop 21st FIN",
        "drop 102nd RST with \"0x\"",
    ] {
        assert_eq!(said(text), [text]);
    }
    assert_eq!(said(" drop 1st syn;behind 2 packet 0-0 ; corrupt packet 1 "), ["drop first SYN", "behind 2 packet 0", "corrupt packet 1"]);
    // Bytes that are no text are printed in digits.
    assert_eq!(said("drop first packet with 0x22"), ["drop first packet with 0x22"]);
    assert_eq!(said("drop first packet with 0x6162"), ["drop first packet with \"ab\""]);
}

#[test]
fn what_makes_no_sense_is_refused_at_its_place() {
    for (text, span, expected) in [
        ("", 0..0, "expected drop, delay"),
        ("lose packet 3", 0..4, "unknown word \"lose\": expected drop, delay"),
        ("drop", 4..4, "expected `packet 3`"),
        ("drop third SYN", 5..10, "unknown word \"third\""),
        ("drop 2th SYN", 5..8, "unknown word \"2th\""),
        ("drop 0th SYN", 5..8, "unknown word \"0th\""),
        ("drop 11st SYN", 5..9, "unknown word \"11st\""),
        ("drop first ACK", 11..14, "unknown word \"ACK\": expected packet, segment"),
        ("drop first", 10..10, "expected packet, segment"),
        ("drop packet", 11..11, "expected numbers of packets"),
        ("drop packet ; drop packet 1", 12..13, "expected numbers of packets"),
        ("drop packets 3 8-4", 15..18, "expected numbers of packets"),
        ("drop packets 3 -1", 15..17, "expected numbers of packets"),
        ("drop first packet with", 22..22, "expected a text in quotes"),
        ("drop first packet with GET", 23..26, "expected a text in quotes"),
        ("drop first packet with \"\"", 23..25, "expected a text in quotes"),
        ("drop first packet with 0x123", 23..28, "expected a text in quotes"),
        ("drop first packet with \"GET", 23..27, "expected a quotation mark"),
        ("drop first SYN loss 1%", 15..19, "expected `;`"),
        ("drop first SYN;", 15..15, "expected drop, delay"),
        ("delay packet 3", 6..12, "\"packet\""),
        ("behind 0 packet 3", 7..8, "expected a number of packets"),
    ] {
        let (place, message) = read(text).expect_err(text);
        assert_eq!(place, span, "{text}: {message}");
        assert!(message.contains(expected), "{text}: {message}");
    }
}

proptest! {
    #[test]
    fn any_text_is_read_or_refused_within_it(text in "(drop|delay|30ms|duplicate|corrupt|behind|packets?|first|2nd|every|SYN|with|\"é\"|0xff|3|4-9|;|\"|[ é\t])( ?(drop|packet|first|SYN|with|\"a b\"|0x1|3|;|\"))( [a-z0-9]{1,4}){0,3}") {
        match read(&text) {
            Ok(hits) => {
                let again: Vec<String> = hits.iter().map(ToString::to_string).collect();
                prop_assert_eq!(read(&again.join("; ")), Ok(hits));
            }
            Err((span, _)) => prop_assert!(text.get(span).is_some()),
        }
    }
}
