//! Words of the faults of a stream, beside the words or keys of its link: `stall 2s 5s for 10%`.

use super::keys::FAULTS;

/// Spec of a stream, split by [`split_faults`].
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct FaultWords {
    /// Words or keys of the link, in their order.
    pub link: Vec<String>,
    /// Keys of the faults with their values as TOML, in the order of the words.
    pub faults: Vec<(String, String)>,
}

/// Splits the spec of a stream into the spec of the link and the faults. A fault is written in words, with its values in any order and its share of the
/// connections after the word `for`, or as one key of the table of a stream, `stall=2s`.
///
/// # Errors
///
/// A message that names the word at fault and says what was expected.
pub fn split_faults(spec: &[String]) -> Result<FaultWords, String> {
    let mut split = FaultWords { link: Vec::new(), faults: Vec::new() };
    let mut words = spec.iter().flat_map(|word| if word.contains('=') { vec![word.as_str()] } else { word.split_whitespace().collect() }).peekable();
    while let Some(word) = words.next() {
        if let Some((key, value)) = word.split_once('=').filter(|(key, _)| is_fault(key.trim())) {
            split.add(key.trim(), value.trim().to_owned())?;
            continue;
        }
        if !is_fault(word) {
            if word == "for" {
                return Err(format!(
                    "for {}: expected a fault such as stall before it; delay and rate are those of every connection",
                    words.next().unwrap_or("")
                ));
            }
            split.link.push(word.to_owned());
            continue;
        }
        let mut values = Vec::new();
        while let Some(value) = words.next_if(|word| word.starts_with(|first: char| first.is_ascii_digit())) {
            values.push(value);
        }
        let share = if words.next_if_eq(&"for").is_some() {
            let percent = words.next().filter(|share| share.ends_with('%'));
            Some(percent.ok_or_else(|| format!("{word} … for: expected a share of the connections, such as 10%"))?)
        } else {
            None
        };
        let next = words.peek().copied();
        split.add(word, value_of(word, &values, share, next)?)?;
    }
    Ok(split)
}

impl FaultWords {
    fn add(&mut self, key: &str, value: String) -> Result<(), String> {
        if self.faults.iter().any(|(given, _)| given == key) {
            return Err(format!("{key} is given twice: expected it once"));
        }
        self.faults.push((key.to_owned(), value));
        Ok(())
    }
}

/// Returns the name of the first fault in a spec, written as a word or as a key. Serves messages about specs of packets, which have none of these faults.
#[must_use]
pub fn first_fault(spec: &[String]) -> Option<&'static str> {
    let words = spec.iter().flat_map(|text| text.split_whitespace());
    // A key ends at the equals sign. The value of a key never is the name of a fault.
    let mut names = words.map(|word| word.split_once('=').map_or(word, |(key, _)| key));
    names.find_map(|name| FAULTS.iter().find(|key| key.name == name)).map(|key| key.name)
}

fn is_fault(word: &str) -> bool {
    FAULTS.iter().any(|key| key.name == word)
}

/// Returns the value of a fault as TOML. `next` is the word after the values and the share, for messages.
fn value_of(word: &str, values: &[&str], share: Option<&str>, next: Option<&str>) -> Result<String, String> {
    // Names of the values that are sizes, and names of the values that are times. Units tell sizes from times, so a size and a time can be in any order.
    let (sizes, times): (&[&str], &[&str]) = match word {
        "stall" => (&[], &["after", "length"]),
        "slice" => (&["size", "variation"], &["gap"]),
        "cut-after" => (&["size"], &[]),
        "slow-close" => (&[], &["time"]),
        "buffer" => (&["size"], &[]),
        _ => (&[], &["after"]),
    };
    let expected = || {
        let usage = match word {
            "stall" => "stall AFTER [LENGTH]",
            "slice" => "slice SIZE [VARIATION] [GAP]",
            "cut-after" => "cut-after SIZE",
            "buffer" => "buffer SIZE",
            "slow-close" => "slow-close TIME",
            "reset-after" => "reset-after TIME",
            _ => "close-after TIME",
        };
        let values = if values.is_empty() { next.unwrap_or("no value").to_owned() } else { values.join(" ") };
        let share = if word == "buffer" { "" } else { ", and then for SHARE if only some connections have it" };
        format!("{word}: found {values}: expected {usage}{share}, such as 10ms or 100B")
    };
    let (mut sizes, mut times) = (sizes.iter(), times.iter());
    let mut named = Vec::new();
    for value in values {
        // Letters tell a size from a time: all units of size end in B, and no unit of time does.
        let name = if value.ends_with('B') { sizes.next() } else { times.next() };
        named.push((*name.ok_or_else(expected)?, *value));
    }
    let first = match word {
        "cut-after" | "slice" | "buffer" => "size",
        "slow-close" => "time",
        _ => "after",
    };
    if !named.iter().any(|(name, _)| *name == first) {
        return Err(expected());
    }
    if word == "buffer" {
        return if share.is_none() { Ok(format!("\"{}\"", values[0])) } else { Err(expected()) };
    }
    let named = named.into_iter().chain(share.map(|share| ("for", share))).map(|(name, value)| format!("{name} = \"{value}\""));
    Ok(format!("{{ {} }}", named.collect::<Vec<_>>().join(", ")))
}

#[cfg(test)]
mod tests {
    use core::num::NonZeroU64;
    use core::time::Duration;
    use std::path::Path;

    use cohaptic_units::{Bytes, Probability};

    use super::super::{Faults, Hit, Slice, Stall, stream_of_keys};
    use super::*;
    use crate::LinkKeys;
    use crate::reading::FileReader;

    fn split(spec: &str) -> Result<FaultWords, String> {
        split_faults(&spec.split(' ').map(str::to_owned).collect::<Vec<_>>())
    }

    fn faults(spec: &str) -> Faults {
        let split = split(spec).unwrap();
        let keys = split.faults.iter().fold(LinkKeys::default(), |keys, (key, value)| keys.with(key, value));
        stream_of_keys(&keys, Path::new(""), FileReader(&|_| unreachable!("no key names a file"))).unwrap().faults
    }

    #[test]
    fn words_and_keys_of_faults_stand_among_those_of_the_link() {
        let said = split("delay 20ms 5ms stall 2s 5s for 10% rate 1mbit slice 10ms 100B 20B cut-after 10kB").unwrap();
        assert_eq!(said.link, ["delay", "20ms", "5ms", "rate", "1mbit"]);
        let ms = Duration::from_millis;
        let share = Probability::new(0.1).unwrap();
        let expected = Faults {
            stall: Some(Hit { fault: Stall { after: ms(2000), length: Some(ms(5000)) }, share }),
            slice: Some(Hit { fault: Slice { size: NonZeroU64::new(100).unwrap(), variation: 20, gap: ms(10) }, share: Probability::ONE }),
            cut_after: Some(Hit { fault: Bytes::new(10_000), share: Probability::ONE }),
            ..Faults::default()
        };
        assert_eq!(faults("stall 2s 5s for 10% slice 10ms 100B 20B cut-after 10kB"), expected);
        let after = |after| Some(Hit { fault: ms(after), share });
        let expected = Faults { close_after: after(1000), reset_after: after(0), slow_close: after(7), ..Faults::default() };
        assert_eq!(faults("close-after 1s for 10% reset-after 0s for 10% slow-close 7ms for 10%"), expected);
        let said = split("delay=20ms stall=2s").unwrap();
        assert_eq!((said.link, said.faults), (vec!["delay=20ms".to_owned()], vec![("stall".to_owned(), "2s".to_owned())]));
        assert_eq!(faults("stall=none"), Faults::default());
    }

    #[test]
    fn a_wrong_word_is_told_with_what_was_expected() {
        for (spec, part) in [
            ("stall", "stall: found no value: expected stall AFTER [LENGTH]"),
            ("stall x", "stall: found x: expected stall AFTER [LENGTH]"),
            ("stall delay 20ms", "stall: found delay: expected stall AFTER [LENGTH]"),
            ("stall 100B", "expected stall AFTER [LENGTH]"),
            ("slice 10ms", "expected slice SIZE [VARIATION] [GAP]"),
            ("close-after 1s 2s", "expected close-after TIME"),
            ("buffer 1kB for 10%", "expected buffer SIZE"),
            ("delay 20ms for 10%", "expected a fault such as stall before it"),
            ("stall 2s for ten", "expected a share of the connections"),
            ("stall 2s stall=3s", "given twice"),
        ] {
            let error = split(spec).unwrap_err();
            assert!(error.contains(part), "{spec}: {error}");
        }
    }

    #[test]
    fn a_fault_is_found_among_words_and_keys() {
        let found = |spec: &[&str]| first_fault(&spec.iter().map(|text| (*text).to_owned()).collect::<Vec<_>>());
        assert_eq!(found(&["delay", "1ms", "stall", "2s", "slice", "10B"]), Some("stall"));
        assert_eq!(found(&["delay 1ms slice 10B"]), Some("slice"));
        assert_eq!(found(&["delay=1ms", "reset-after=2s"]), Some("reset-after"));
        assert_eq!(found(&["delay", "1ms", "jitter={ sd = \"2ms\" }"]), None);
    }

    #[test]
    fn faults_out_of_range_and_parts_for_packets_are_refused_at_their_key() {
        for (key, value, part) in [
            ("slice", "{ size = \"10B\", variation = \"10B\" }", "less than the size of a piece"),
            ("slice", "0B", "at least \"1B\""),
            ("buffer", "0B", "at least \"1B\""),
            ("stall", "{ length = \"2s\" }", "missing key"),
            ("stall", "{ after = \"2s\", fr = \"2%\" }", "unknown key"),
            ("cut-after", "{ size = \"2B\", for = \"200%\" }", "200%"),
            ("loss", "1%", "cohaptic exec"),
            ("netem", "delay 2ms loss 1%", "cohaptic exec"),
            ("stal", "2s", "unknown key"),
        ] {
            let keys = LinkKeys::default().with(key, value);
            let error = stream_of_keys(&keys, Path::new(""), FileReader(&|_| unreachable!("no key names a file"))).unwrap_err();
            assert!(error.to_string().contains(part), "{key}={value}: {error}");
            assert!(error.diagnostic().unwrap().override_text().unwrap().starts_with(&format!("link.{key}=")), "{error}");
        }
    }
}
