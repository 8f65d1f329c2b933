//! Words of hits: parsing and printing.

use std::fmt;
use std::ops::{Range, RangeInclusive};
use std::time::Duration;

#[cfg(feature = "tcp")]
use cohaptic_tcp::Flags;
use cohaptic_units::{parse, print};

use crate::fault::Fault;

/// Hit: an action, and the packets of a path to which the action applies.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Hit {
    pub(crate) action: Action,
    pub(crate) which: Which,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Action {
    Drop,
    Delay(Duration),
    Duplicate(Duration),
    Corrupt,
    Behind(u32),
}

#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) enum Which {
    Numbers(Vec<RangeInclusive<u64>>),
    /// Packets of a kind: all of them, or only the n-th, counted from 1.
    Nth {
        nth: Option<u64>,
        kind: Kind,
        /// Bytes that the packet must contain. Empty: no restriction.
        with: Vec<u8>,
    },
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Kind {
    Packet,
    #[cfg(feature = "tcp")]
    Segment,
    Retransmission,
    #[cfg(feature = "tcp")]
    Flag(Flags),
}

const KINDS: &[(&str, Kind)] = &[
    ("packet", Kind::Packet),
    #[cfg(feature = "tcp")]
    ("segment", Kind::Segment),
    ("retransmission", Kind::Retransmission),
    #[cfg(feature = "tcp")]
    ("SYN", Kind::Flag(Flags::SYN)),
    #[cfg(feature = "tcp")]
    ("FIN", Kind::Flag(Flags::FIN)),
    #[cfg(feature = "tcp")]
    ("RST", Kind::Flag(Flags::RST)),
];

/// List of the words of [`KINDS`] for messages.
const EXPECTED_KINDS: &str = if cfg!(feature = "tcp") {
    "packet, segment, retransmission, SYN, FIN or RST"
} else {
    "packet or retransmission (segment, SYN, FIN and RST need the feature `tcp` of cohaptic-testkit)"
};

impl Hit {
    /// Creates a hit that drops the packets with the given numbers, in ascending order.
    pub(crate) fn dropping(numbers: impl IntoIterator<Item = u64>) -> Self {
        let mut ranges = Vec::new();
        numbers.into_iter().for_each(|number| push_number(&mut ranges, number));
        Self { action: Action::Drop, which: Which::Numbers(ranges) }
    }

    /// Returns whether the fate of a hit packet is random.
    pub(crate) const fn draws(&self) -> bool {
        matches!(self.action, Action::Corrupt)
    }
}

/// Adds a number that is greater than all numbers of `ranges`.
pub(crate) fn push_number(ranges: &mut Vec<RangeInclusive<u64>>, number: u64) {
    match ranges.last_mut() {
        Some(last) if last.end() + 1 == number => *last = *last.start()..=number,
        _ => ranges.push(number..=number),
    }
}

/// Parses the hits in a part of a line: at least one hit, separated by semicolons.
pub(crate) fn parse(line: &str, part: Range<usize>) -> Result<Vec<Hit>, Fault> {
    // A missing word is marked right after the last word, not after blanks at the end.
    let end = part.start + line[part.clone()].trim_end().len();
    let mut reader = Reader { line, words: tokens(line, part)?, next: 0, end };
    let mut hits = Vec::new();
    loop {
        hits.push(reader.hit()?);
        match reader.take() {
            None => return Ok(hits),
            Some((";", _)) => {}
            Some((_, span)) => return Err((span, "expected `;` and the next hit, or the end".to_owned())),
        }
    }
}

/// Splits a part of a line into words. A text in quotes is a single word, and a semicolon is a word of its own.
fn tokens(line: &str, part: Range<usize>) -> Result<Vec<Range<usize>>, Fault> {
    let mut tokens: Vec<Range<usize>> = Vec::new();
    let mut rest = part.start;
    while rest < part.end {
        let text = &line[rest..part.end];
        let Some(first) = text.chars().next() else { break };
        let len = if first.is_whitespace() {
            rest += first.len_utf8();
            continue;
        } else if first == ';' {
            1
        } else if let Some(quoted) = text.strip_prefix('"') {
            quoted.find('"').map(|end| end + 2).ok_or_else(|| (rest..part.end, "expected a quotation mark at the end of the text".to_owned()))?
        } else {
            // A semicolon ends a word also without a blank before the semicolon.
            text.find(|c: char| c.is_whitespace() || c == ';').unwrap_or(text.len())
        };
        tokens.push(rest..rest + len);
        rest += len;
    }
    Ok(tokens)
}

struct Reader<'a> {
    line: &'a str,
    words: Vec<Range<usize>>,
    next: usize,
    end: usize,
}

impl<'a> Reader<'a> {
    fn peek(&self) -> Option<(&'a str, Range<usize>)> {
        let span = self.words.get(self.next)?.clone();
        Some((&self.line[span.clone()], span))
    }

    fn take(&mut self) -> Option<(&'a str, Range<usize>)> {
        let word = self.peek();
        self.next += usize::from(word.is_some());
        word
    }

    fn expect(&mut self, what: &str) -> Result<(&'a str, Range<usize>), Fault> {
        self.take().ok_or_else(|| (self.end..self.end, format!("expected {what}")))
    }

    fn hit(&mut self) -> Result<Hit, Fault> {
        const ACTIONS: &str = "drop, delay, duplicate, corrupt or behind";
        let (word, span) = self.expect(ACTIONS)?;
        let action = match word {
            "drop" => Action::Drop,
            "delay" => Action::Delay(self.time()?),
            // The time is optional: a word that is no time begins the packets.
            "duplicate" if self.peek().is_some_and(|(word, _)| parse::duration(word).is_ok()) => Action::Duplicate(self.time()?),
            "duplicate" => Action::Duplicate(Duration::ZERO),
            "corrupt" => Action::Corrupt,
            "behind" => {
                const COUNT: &str = "a number of packets from 1 on";
                let (word, span) = self.expect(COUNT)?;
                let count = word.parse().ok().filter(|count| *count > 0).ok_or_else(|| (span, format!("expected {COUNT}")))?;
                Action::Behind(count)
            }
            _ => return Err((span, format!("unknown word \"{word}\": expected {ACTIONS}"))),
        };
        Ok(Hit { action, which: self.which()? })
    }

    fn time(&mut self) -> Result<Duration, Fault> {
        let (word, span) = self.expect("a time such as 30ms")?;
        parse::duration(word).map_err(|error| (span, error.to_string()))
    }

    fn which(&mut self) -> Result<Which, Fault> {
        const WHICH: &str = "`packet 3`, `packets 3 8 12-15`, `first SYN`, `2nd packet with \"text\"`, `every retransmission` or the like";
        let (word, span) = self.expect(WHICH)?;
        let nth = match word {
            "packet" | "packets" => return self.numbers(),
            "every" => None,
            "first" => Some(1),
            _ => Some(ordinal(word).ok_or_else(|| (span, format!("unknown word \"{word}\": expected {WHICH}")))?),
        };
        let (word, span) = self.expect(EXPECTED_KINDS)?;
        // `syn` is as clear as `SYN`.
        let kind = KINDS.iter().find(|(name, _)| name.eq_ignore_ascii_case(word));
        let &(_, kind) = kind.ok_or_else(|| (span, format!("unknown word \"{word}\": expected {EXPECTED_KINDS}")))?;
        let mut with = Vec::new();
        if self.peek().is_some_and(|(word, _)| word == "with") {
            self.next += 1;
            const BYTES: &str = "a text in quotes, or bytes such as 0x1603";
            let (word, span) = self.expect(BYTES)?;
            with = bytes(word).filter(|bytes| !bytes.is_empty()).ok_or_else(|| (span, format!("expected {BYTES}")))?;
        }
        Ok(Which::Nth { nth, kind, with })
    }

    fn numbers(&mut self) -> Result<Which, Fault> {
        const NUMBERS: &str = "numbers of packets from 0 on, such as 3 or 12-15";
        let mut numbers = Vec::new();
        while let Some((word, span)) = self.peek().filter(|(word, _)| *word != ";") {
            numbers.push(range(word).ok_or_else(|| (span, format!("expected {NUMBERS}")))?);
            self.next += 1;
        }
        if numbers.is_empty() {
            Err((self.peek().map_or(self.end..self.end, |(_, span)| span), format!("expected {NUMBERS}")))
        } else {
            Ok(Which::Numbers(numbers))
        }
    }
}

/// Parses a number or a range, such as `12` or `12-15`.
fn range(word: &str) -> Option<RangeInclusive<u64>> {
    let (first, last) = word.split_once('-').unwrap_or((word, word));
    let range = first.parse().ok()?..=last.parse().ok()?;
    (!range.is_empty()).then_some(range)
}

/// Parses an ordinal number, such as `1st`, `2nd`, `3rd` or `11th`.
fn ordinal(word: &str) -> Option<u64> {
    let digits = word.trim_end_matches(|c: char| c.is_ascii_alphabetic());
    let number: u64 = digits.parse().ok().filter(|number| *number > 0)?;
    // The whole word is compared, so that `2st` and `02nd` are refused.
    (word == format!("{number}{}", suffix(number))).then_some(number)
}

const fn suffix(number: u64) -> &'static str {
    match (number % 10, number % 100) {
        (_, 11..=13) => "th",
        (1, _) => "st",
        (2, _) => "nd",
        (3, _) => "rd",
        _ => "th",
    }
}

/// Parses the bytes in quotes, or after `0x`.
fn bytes(word: &str) -> Option<Vec<u8>> {
    if let Some(text) = word.strip_prefix('"') {
        return text.strip_suffix('"').map(|text| text.as_bytes().to_vec());
    }
    // Only ASCII can be cut into pairs of bytes without a cut within a character.
    let digits = word.strip_prefix("0x").filter(|digits| digits.is_ascii() && digits.len() % 2 == 0)?;
    digits.as_bytes().chunks(2).map(|pair| u8::from_str_radix(str::from_utf8(pair).ok()?, 16).ok()).collect()
}

impl fmt::Display for Hit {
    /// Writes the words from which the hit can be parsed.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.action {
            Action::Drop => f.write_str("drop"),
            Action::Delay(time) => write!(f, "delay {}", print::Span(time)),
            Action::Duplicate(Duration::ZERO) => f.write_str("duplicate"),
            Action::Duplicate(time) => write!(f, "duplicate {}", print::Span(time)),
            Action::Corrupt => f.write_str("corrupt"),
            Action::Behind(count) => write!(f, "behind {count}"),
        }?;
        match &self.which {
            Which::Numbers(numbers) => {
                let is_one = matches!(&numbers[..], [one] if one.start() == one.end());
                f.write_str(if is_one { " packet" } else { " packets" })?;
                numbers.iter().try_for_each(|range| {
                    if range.start() == range.end() { write!(f, " {}", range.start()) } else { write!(f, " {}-{}", range.start(), range.end()) }
                })
            }
            Which::Nth { nth, kind, with } => {
                match nth {
                    None => f.write_str(" every")?,
                    Some(1) => f.write_str(" first")?,
                    Some(nth) => write!(f, " {nth}{}", suffix(*nth))?,
                }
                let name = KINDS.iter().find(|(_, known)| known == kind).map_or("packet", |(name, _)| name);
                write!(f, " {name}")?;
                match str::from_utf8(with) {
                    _ if with.is_empty() => Ok(()),
                    // A text in quotes has no escapes, and hits of a link file stand on one line. Other bytes are written in hexadecimal.
                    Ok(text) if !text.contains(['"', '\n', '\r']) => write!(f, " with \"{text}\""),
                    Ok(_) | Err(_) => {
                        f.write_str(" with 0x")?;
                        with.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests;
