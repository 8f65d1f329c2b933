//! Words of NATs and firewalls: parsing and printing.

use std::fmt;
use std::ops::Range;
use std::time::Duration;

use cohaptic_units::parse;
use cohaptic_units::print::Span;

use super::{Behaviour, Dependence, KINDS, Ports, Timeouts};
use crate::fault::{Fault, WordsError, locate};

const DEPENDENCES: [(&str, Dependence); 3] = [
    ("endpoint-independent", Dependence::Endpoint),
    ("address-dependent", Dependence::Address),
    ("address-and-port-dependent", Dependence::AddressAndPort),
];

const PORTS: [(&str, Ports); 2] = [("kept", Ports::Kept), ("random", Ports::Random)];

const YES_NO: [(&str, bool); 2] = [("yes", true), ("no", false)];

/// Words of a firewall. A firewall translates nothing.
const OF_FIREWALLS: &str = "filter, udp-timeout, udp-unanswered-timeout, tcp-timeout or tcp-transitory-timeout";

/// Returns the possible words after the kind of a NAT.
fn expected(is_nat: bool) -> String {
    if is_nat { format!("mapping, ports, hairpin, {OF_FIREWALLS}") } else { OF_FIREWALLS.to_owned() }
}

/// Parses words without a file around them: see [`parse`].
pub(crate) fn parse_words(words: &str, base: Behaviour, is_nat: bool) -> Result<Behaviour, WordsError> {
    let mut spans = Vec::new();
    let mut end = 0;
    // The search for a word begins after the word before, so equal words have different spans.
    for word in words.split_whitespace() {
        let start = end + words[end..].find(word).unwrap_or(0);
        end = start + word.len();
        spans.push(start..end);
    }
    parse(words, &spans, base, is_nat).map_err(|fault| locate(1, words, fault))
}

/// Parses the words at `spans` of a line: a kind, if the first word is a kind, and columns of the table with values. All other columns are
/// as in `base`.
/// `is_nat` is false for a firewall: firewalls have neither kind nor mapping.
pub(crate) fn parse(line: &str, spans: &[Range<usize>], base: Behaviour, is_nat: bool) -> Result<Behaviour, Fault> {
    let mut behaviour = base;
    let mut words = spans.iter().map(|span| (&line[span.clone()], span.clone())).peekable();
    if let Some(kind) = words.peek().and_then(|(word, _)| KINDS.iter().position(|kind| is_nat && kind.name == *word)) {
        behaviour = Behaviour::of_kind(kind);
        words.next();
    }
    while let Some((word, span)) = words.next() {
        let value = words.next();
        let of = value.as_ref().map(|(text, span)| (*text, span.clone())).ok_or(span.end..span.end);
        match word {
            "mapping" if is_nat => behaviour.mapping = choice(of, &DEPENDENCES)?,
            "filter" => behaviour.filter = choice(of, &DEPENDENCES)?,
            "ports" if is_nat => behaviour.ports = choice(of, &PORTS)?,
            "hairpin" if is_nat => behaviour.hairpin = choice(of, &YES_NO)?,
            "udp-timeout" => {
                let Timeouts { udp, udp_unanswered, .. } = &mut behaviour.timeouts;
                *udp = time(of)?;
                // A mapping without an answer must not live longer than an answered mapping.
                *udp_unanswered = (*udp_unanswered).min(*udp);
            }
            "udp-unanswered-timeout" => behaviour.timeouts.udp_unanswered = time(of)?,
            "tcp-timeout" => behaviour.timeouts.tcp = time(of)?,
            "tcp-transitory-timeout" => behaviour.timeouts.tcp_transitory = time(of)?,
            _ => {
                let kinds = if is_nat { format!("{} as the first word, or ", KINDS.map(|kind| kind.name).join(", ")) } else { String::new() };
                return Err((span, format!("unknown word \"{word}\": expected {kinds}{}", expected(is_nat))));
            }
        }
    }
    Ok(behaviour)
}

/// Returns the value of a word. `of` is the word and the span, or the place of the missing word.
fn choice<T: Copy, const N: usize>(of: Result<(&str, Range<usize>), Range<usize>>, values: &[(&str, T); N]) -> Result<T, Fault> {
    let names = || values.map(|(name, _)| name).join(" or ");
    let (word, span) = of.map_err(|end| (end, format!("expected {}", names())))?;
    values.iter().find(|(name, _)| *name == word).map(|(_, value)| *value).ok_or_else(|| (span, format!("expected {}", names())))
}

fn time(of: Result<(&str, Range<usize>), Range<usize>>) -> Result<Duration, Fault> {
    let (word, span) = of.map_err(|end| (end, "expected a time such as 30s".to_owned()))?;
    let time = parse::duration(word).map_err(|error| (span.clone(), error.to_string()))?;
    if time.is_zero() { Err((span, "expected a time above zero such as 30s".to_owned())) } else { Ok(time) }
}

/// Returns the name of a value.
fn name_of<T: Copy + PartialEq, const N: usize>(value: T, values: &[(&'static str, T); N]) -> &'static str {
    values.iter().find(|(_, other)| *other == value).map_or("?", |(name, _)| name)
}

impl Behaviour {
    /// Returns the words of a firewall with this behaviour.
    pub(crate) fn of_firewall(&self) -> String {
        self.columns().filter(|(name, _)| OF_FIREWALLS.contains(name)).map(|(name, value)| format!("{name} {value}")).collect::<Vec<_>>().join(" ")
    }

    /// Returns the columns with other values than the kind's, and the values.
    fn columns(&self) -> impl Iterator<Item = (&'static str, String)> {
        let kind = Self::of_kind(self.kind);
        let Timeouts { udp, udp_unanswered, tcp, tcp_transitory } = self.timeouts;
        let columns = |of: &Self| {
            [
                ("mapping", name_of(of.mapping, &DEPENDENCES).to_owned()),
                ("filter", name_of(of.filter, &DEPENDENCES).to_owned()),
                ("ports", name_of(of.ports, &PORTS).to_owned()),
                ("hairpin", name_of(of.hairpin, &YES_NO).to_owned()),
            ]
        };
        let times = [
            ("udp-timeout", udp, kind.timeouts.udp),
            ("udp-unanswered-timeout", udp_unanswered, kind.timeouts.udp_unanswered.min(udp)),
            ("tcp-timeout", tcp, kind.timeouts.tcp),
            ("tcp-transitory-timeout", tcp_transitory, kind.timeouts.tcp_transitory),
        ];
        let names = columns(self).into_iter().zip(columns(&kind)).filter(|(own, of_kind)| own != of_kind).map(|(own, _)| own);
        let times = times.into_iter().filter(|(_, own, of_kind)| own != of_kind).map(|(name, own, _)| (name, Span(own).to_string()));
        names.chain(times)
    }
}

impl fmt::Display for Behaviour {
    /// Writes the words of a NAT: the kind, and the changed columns.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(KINDS[self.kind].name)?;
        self.columns().try_for_each(|(name, value)| write!(f, " {name} {value}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(words: &str) -> Result<Behaviour, String> {
        parse_words(words, Behaviour::default(), true).map_err(|error| error.to_string())
    }

    #[test]
    fn words_come_back_as_they_were() {
        for (words, printed) in [
            ("", "home"),
            ("home", "home"),
            ("open udp-timeout 20s", "open udp-timeout 20s"),
            ("udp-timeout 10s", "home udp-timeout 10s"),
            ("strict mapping address-dependent hairpin yes", "strict mapping address-dependent hairpin yes"),
            ("address ports random filter endpoint-independent", "address filter endpoint-independent ports random"),
            ("cgnat tcp-timeout 2h tcp-transitory-timeout 1min", "cgnat tcp-timeout 7200s tcp-transitory-timeout 60s"),
            ("udp-unanswered-timeout 5s", "home udp-unanswered-timeout 5s"),
        ] {
            let behaviour = read(words).unwrap();
            assert_eq!(behaviour.to_string(), printed);
            assert_eq!(read(printed).unwrap(), behaviour, "{words}");
        }
        assert_eq!(read("udp-timeout 10s").unwrap().timeouts.udp_unanswered, Duration::from_secs(10));
        let firewall = parse_words("filter address-dependent udp-timeout 1min", Behaviour::default(), false).unwrap();
        assert_eq!(firewall.of_firewall(), "filter address-dependent udp-timeout 60s");
    }

    #[test]
    fn words_that_make_no_sense_are_shown_with_their_place() {
        for (words, expected) in [
            (
                "closed",
                "1:1: unknown word \"closed\": expected home, open, address, strict, cgnat as the first word, or mapping, ports, hairpin, filter",
            ),
            ("hairpin yes strict", "1:13: unknown word \"strict\""),
            ("hairpin", "1:8: expected yes or no"),
            ("mapping symmetric", "1:9: expected endpoint-independent or address-dependent or address-and-port-dependent"),
            ("udp-timeout 10", "1:13: no unit in \"10\""),
            ("udp-timeout 0s", "1:13: expected a time above zero"),
            ("tcp-timeout", "1:12: expected a time such as 30s"),
        ] {
            assert!(read(words).unwrap_err().starts_with(expected), "{}", read(words).unwrap_err());
        }
        let refused = parse_words("strict", Behaviour::default(), false).unwrap_err().to_string();
        assert!(refused.starts_with("1:1: unknown word \"strict\": expected filter, udp-timeout"), "{refused}");
    }
}
