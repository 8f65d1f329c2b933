//! Link files in plain words: hosts and the links between them, an entry per line.
//!
//! ```text
//! # Lines that begin with # say nothing.
//! seed: 17
//! hosts: client server other
//! nat home udp-timeout 30s: client
//! all: delay 10ms
//! home -> server: delay 24ms loss 1%
//! server -> home: replay fates.csv
//! server <-> other:
//! hit client -> home: drop 2nd packet
//! ```
//!
//! After the colon follow words of `tc-netem` for an exact emulation, or nothing for the ideal link, or `replay` and the file of a fate log. `all` stands for
//! every link without a line of its own, wherever the line of `all` is in the file; without `all` such links are ideal. `hosts` names the hosts and their
//! order; without `hosts` the lines name the hosts, in the order of the lines. Blanks separate names from the arrow. `hit` and a path before the colon hit
//! [packets](crate::hit) of the path. `nat` or `firewall`, a name and the [words](crate::nat) of the behaviour put the hosts after the colon behind a NAT or a
//! firewall.

mod devices;

use std::collections::BTreeMap;
use std::ops::Range;
use std::str::FromStr;
use std::sync::Arc;

use cohaptic_wan::netem::Netem;
use cohaptic_wan::{FateLog, LinkModel, MOST_NODES};

pub(crate) use devices::DeviceLine;

use crate::fault::{Fault, WordsError, locate};
use crate::hit::{self, Hits, PathHit};
use crate::names::{Names, name_fault};

/// Content of a link file.
#[derive(Clone, PartialEq, Debug, Default)]
pub(crate) struct Words {
    /// Names of the hosts, at least one, then those of NATs, firewalls and interfaces.
    pub(crate) hosts: Vec<String>,
    /// NATs, firewalls and interfaces, in the order of their names.
    pub(crate) devices: Vec<DeviceLine>,
    /// Link of every path that is not in `links`.
    pub(crate) every: LinkModel,
    /// Links by indices of sender and receiver.
    pub(crate) links: BTreeMap<(usize, usize), LinkModel>,
    /// Hits on packets.
    pub(crate) hits: Vec<PathHit>,
    pub(crate) seed: Option<u64>,
}

/// Parses a text. `file` reads the file of a fate log, by the path in the text.
pub(crate) fn parse(text: &str, mut file: impl FnMut(&str) -> Result<String, String>) -> Result<Words, WordsError> {
    let mut reader = Reader::default();
    // An error about the whole text needs a line to mark, also in an empty text.
    let mut last = (1, "");
    // An editor may have put a byte order mark before the first line.
    for (number, line) in (1..).zip(text.trim_start_matches('\u{feff}').lines()) {
        reader.line(line, &mut file).map_err(|fault| locate(number, line, fault))?;
        last = (number, line);
    }
    let every = reader.every.unwrap_or_default();
    if reader.hosts.is_empty() {
        let end = last.1.len()..last.1.len();
        return Err(locate(last.0, last.1, (end, "no line names a host: expected a line such as `a -> b: delay 24ms` or `hosts: a b`".to_owned())));
    }
    let Reader { links, hits, seed, .. } = reader;
    // Lines name nodes in any order. Nodes that are no hosts go to the end.
    let is_device = |node: &usize| reader.devices.iter().any(|(first, line)| (*first..first + line.names()).contains(node));
    let mut order: Vec<usize> = (0..reader.hosts.len()).collect();
    order.sort_by_key(is_device);
    let place = |node: usize| order.iter().position(|other| *other == node).unwrap_or(node);
    let moved = |line: &DeviceLine| match line.clone() {
        DeviceLine::Middlebox { behaviour, translates, inside } => {
            DeviceLine::Middlebox { behaviour, translates, inside: inside.into_iter().map(place).collect() }
        }
        DeviceLine::Interfaces { host, count } => DeviceLine::Interfaces { host: place(host), count },
    };
    Ok(Words {
        hosts: order.iter().map(|node| reader.hosts[*node].clone()).collect(),
        devices: reader.devices.iter().map(|(_, line)| moved(line)).collect(),
        every,
        links: if reader.devices.is_empty() { links } else { links.into_iter().map(|((from, to), link)| ((place(from), place(to)), link)).collect() },
        hits,
        seed,
    })
}

impl FromStr for Hits {
    type Err = WordsError;

    /// Parses lines of hits only: each line is a path, a colon, and the words.
    fn from_str(text: &str) -> Result<Self, WordsError> {
        let mut reader = Reader::default();
        for (number, line) in (1..).zip(text.lines()) {
            reader.hits_alone(line).map_err(|fault| locate(number, line, fault))?;
        }
        Ok(Self { all: reader.hits })
    }
}

/// Parses the words of hits on one path.
pub(crate) fn hits_on(words: &str) -> Result<Vec<hit::Hit>, WordsError> {
    hit::parse(words, 0..words.len()).map_err(|fault| locate(1, words, fault))
}

#[derive(Debug, Default)]
struct Reader {
    hosts: Names,
    /// `true` if a line has named the hosts. Other lines then cannot add hosts.
    is_closed: bool,
    every: Option<LinkModel>,
    links: BTreeMap<(usize, usize), LinkModel>,
    hits: Vec<PathHit>,
    /// NATs, firewalls and interfaces, with the index of their first name in `hosts`.
    devices: Vec<(usize, DeviceLine)>,
    seed: Option<u64>,
}

impl Reader {
    fn line(&mut self, line: &str, file: &mut impl FnMut(&str) -> Result<String, String>) -> Result<(), Fault> {
        let Some((begin, colon)) = colon(line, "a -> b: delay 24ms loss 1%")? else { return Ok(()) };
        let (subject, rest) = (tokens(line, begin..colon), tokens(line, colon + 1..line.len()));
        match subject.iter().map(|span| &line[span.clone()]).collect::<Vec<_>>()[..] {
            ["seed"] => self.seed(line, &subject[0], &rest),
            ["hosts"] => self.hosts(line, &subject[0], &rest),
            ["all"] => {
                let link = link(line, &rest, file)?;
                if self.every.replace(link).is_some() { Err(twice(&subject[0], "all")) } else { Ok(()) }
            }
            ["hit", _, arrow @ ("->" | "<->"), _] => {
                let (from, to) = self.pair(line, &subject[1..])?;
                let hits = hit::parse(line, colon + 1..line.len())?;
                self.hit(from, to, &hits);
                if arrow == "<->" {
                    self.hit(to, from, &hits);
                }
                Ok(())
            }
            [_, arrow @ ("->" | "<->"), _] => {
                let pair = self.pair(line, &subject)?;
                let whole = subject[0].start..subject[2].end;
                let link = link(line, &rest, file)?;
                let is_known =
                    // Both directions of `<->` are inserted, and either direction may be given twice.
                    self.links.insert(pair, link.clone()).is_some() || arrow == "<->" && self.links.insert((pair.1, pair.0), link).is_some();
                if is_known { Err(twice(&whole, "this link")) } else { Ok(()) }
            }
            ["interfaces", _] => self.interfaces(line, &subject[1], &rest),
            [noun @ ("nat" | "firewall"), _, ..] => self.middlebox(line, noun == "nat", &subject[1..], &rest),
            [noun @ ("nat" | "firewall")] => Err((subject[0].end..subject[0].end, format!("expected the name of the {noun}"))),
            _ => {
                let expected = "expected `a -> b`, `a <-> b`, `all`, `hosts`, `nat NAME`, `firewall NAME`, `interfaces HOST`, `hit a -> b` or `seed` before \
                                the colon";
                Err((begin..colon.max(begin + 1), expected.to_owned()))
            }
        }
    }

    fn hits_alone(&mut self, line: &str) -> Result<(), Fault> {
        let Some((begin, colon)) = colon(line, "a -> b: drop packet 3")? else { return Ok(()) };
        let subject = tokens(line, begin..colon);
        let [_, arrow, _] = &subject[..] else { return Err((begin..colon.max(begin + 1), "expected `a -> b` before the colon".to_owned())) };
        if &line[arrow.clone()] != "->" {
            return Err((arrow.clone(), "expected `->`".to_owned()));
        }
        let (from, to) = self.pair(line, &subject)?;
        let hits = hit::parse(line, colon + 1..line.len())?;
        self.hit(from, to, &hits);
        Ok(())
    }

    fn hit(&mut self, from: usize, to: usize, hits: &[hit::Hit]) {
        let [from, to] = [from, to].map(|host| &self.hosts[host]);
        self.hits.extend(hits.iter().map(|hit| PathHit { from: from.clone(), to: to.clone(), hit: hit.clone() }));
    }

    /// Returns the hosts of a path. `subject` holds a name, an arrow, and a name.
    fn pair(&mut self, line: &str, subject: &[Range<usize>]) -> Result<(usize, usize), Fault> {
        let pair = (self.host(line, &subject[0])?, self.host(line, &subject[2])?);
        if pair.0 == pair.1 {
            return Err((subject[0].start..subject[2].end, "a host has no link to itself: expected two hosts".to_owned()));
        }
        Ok(pair)
    }

    fn seed(&mut self, line: &str, subject: &Range<usize>, rest: &[Range<usize>]) -> Result<(), Fault> {
        let [span] = rest else { return Err((rest_of(line, subject, rest), "expected one number as the seed".to_owned())) };
        let seed = crate::seed::number(&line[span.clone()]).ok_or_else(|| (span.clone(), format!("expected a number from 0 to {}", u64::MAX)))?;
        if self.seed.replace(seed).is_some() { Err(twice(subject, "seed")) } else { Ok(()) }
    }

    fn hosts(&mut self, line: &str, subject: &Range<usize>, rest: &[Range<usize>]) -> Result<(), Fault> {
        if self.is_closed {
            return Err(twice(subject, "hosts"));
        }
        if !self.hosts.is_empty() {
            return Err((subject.clone(), "a line above names hosts already: expected `hosts` before the lines of links".to_owned()));
        }
        if rest.is_empty() {
            return Err((rest_of(line, subject, rest), "expected the names of hosts, separated by spaces".to_owned()));
        }
        for span in rest {
            let name = &line[span.clone()];
            if self.hosts.find(name).is_some() {
                return Err((span.clone(), format!("host `{name}` is named twice: expected it once")));
            }
            self.host(line, span)?;
        }
        // From here on a misspelt name is an error, and not a further host.
        self.is_closed = true;
        Ok(())
    }

    /// Returns the index of a host. A name that is not known is added, unless the list of hosts is closed.
    fn host(&mut self, line: &str, span: &Range<usize>) -> Result<usize, Fault> {
        let name = &line[span.clone()];
        if let Some(host) = self.hosts.find(name) {
            return Ok(host.index());
        }
        if self.is_closed {
            return Err((span.clone(), format!("there is no host `{name}`: expected one of {}", self.hosts.join(", "))));
        }
        if let Some(fault) = name_fault(name) {
            return Err((span.clone(), fault));
        }
        if self.hosts.len() == MOST_NODES {
            return Err((span.clone(), format!("this is host {}: expected at most {MOST_NODES} hosts", MOST_NODES + 1)));
        }
        self.hosts.add(name.to_owned());
        Ok(self.hosts.len() - 1)
    }
}

/// Returns the beginning of a line and the position of its colon, or `None` for an empty line or a comment.
fn colon(line: &str, example: &str) -> Result<Option<(usize, usize)>, Fault> {
    let said = line.trim();
    if said.is_empty() || said.starts_with('#') {
        return Ok(None);
    }
    let begin = line.len() - line.trim_start().len();
    let colon = line.find(':').ok_or_else(|| (begin..begin + said.len(), format!("no colon: expected a line such as `{example}`")))?;
    Ok(Some((begin, colon)))
}

fn twice(span: &Range<usize>, what: &str) -> Fault {
    (span.clone(), format!("{what} is given twice: expected one line with {what}"))
}

/// Returns the span after the colon, or the end of the line if nothing follows.
fn rest_of(line: &str, subject: &Range<usize>, rest: &[Range<usize>]) -> Range<usize> {
    match (rest.first(), rest.last()) {
        (Some(first), Some(last)) => first.start..last.end,
        _ => {
            let end = line.trim_end().len().max(subject.end);
            end..end
        }
    }
}

/// Returns the spans of the words in a part of a line.
fn tokens(line: &str, part: Range<usize>) -> Vec<Range<usize>> {
    let mut tokens = Vec::new();
    let mut begin = None;
    // Places count from the beginning of the line, so that a fault marks its words in the line as written.
    for (place, c) in line[part.clone()].char_indices().map(|(place, c)| (part.start + place, c)) {
        if c.is_whitespace() {
            tokens.extend(begin.take().map(|begin| begin..place));
        } else {
            begin = begin.or(Some(place));
        }
    }
    tokens.extend(begin.map(|begin| begin..part.end));
    tokens
}

/// Parses the words after the colon as a link.
fn link(line: &str, words: &[Range<usize>], file: &mut impl FnMut(&str) -> Result<String, String>) -> Result<LinkModel, Fault> {
    let (Some(first), Some(last)) = (words.first(), words.last()) else { return Ok(LinkModel::default()) };
    let whole = first.start..last.end;
    if &line[first.clone()] == "replay" {
        // The path of a log may contain blanks, so all words after `replay` are the path.
        let [_, _, ..] = words else { return Err((whole.end..whole.end, "expected the file of a fate log after `replay`".to_owned())) };
        let path = words[1].start..last.end;
        let log = file(&line[path.clone()]).and_then(|text| FateLog::parse(&text).map_err(|error| error.to_string()));
        return log.map(|log| LinkModel::Replay(Arc::new(log))).map_err(|message| (path, message));
    }
    if let Some(link) = crate::link::named(&line[whole.clone()]) {
        return link.map_err(|message| (whole, message));
    }
    let netem = Netem::parse(&line[whole.clone()]).map_err(|error| {
        // The parser of netem counts from the beginning of the words.
        let span = whole.start + error.span.start..whole.start + error.span.end;
        (span, error.to_string())
    })?;
    netem.to_link_config(&mut |_| None).map(LinkModel::from).map_err(|error| (whole, error.to_string()))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::link::ToLink;

    fn read(text: &str) -> Result<Words, String> {
        parse(text, |path| if path == "a log.csv" { Ok(FateLog::default().to_text()) } else { Err(format!("{path}: not there")) })
            .map_err(|error| error.to_string())
    }

    #[test]
    fn the_text_of_the_module_page_is_read() {
        let text = "# Lines that begin with # say nothing.\nseed: 0x11\n\nhosts: client server other\r\nall: delay 10ms\n  client -> server: delay 24ms loss 1%\n\
                    server -> client: replay a log.csv\nclient <-> other:";
        let words = read(text).unwrap();
        assert_eq!((words.seed, &words.hosts[..]), (Some(17), &["client", "server", "other"].map(String::from)[..]));
        assert_eq!(words.every, "delay 10ms".to_link());
        let replay = LinkModel::Replay(Arc::new(FateLog::default()));
        let links = [((0, 1), "delay 24ms loss 1%".to_link()), ((0, 2), "".to_link()), ((1, 0), replay), ((2, 0), "".to_link())];
        assert_eq!(words.links, BTreeMap::from(links));
    }

    #[test]
    fn hits_are_read_with_links() {
        let words = read("hosts: hit b\nhit hit -> b: drop first packet; corrupt packet 4\nhit -> b: loss 1%\nhit hit <-> b: drop packet 2").unwrap();
        let hits: Vec<String> = words.hits.iter().map(|PathHit { from, to, hit }| format!("{from} -> {to}: {hit}")).collect();
        let expected = ["hit -> b: drop first packet", "hit -> b: corrupt packet 4", "hit -> b: drop packet 2", "b -> hit: drop packet 2"];
        assert_eq!((hits, words.links.len()), (expected.map(String::from).to_vec(), 1));
    }

    #[test]
    fn nats_are_read_and_follow_the_hosts() {
        let words = read(
            "interfaces bob: wifi lte\nnat home-a: alice\nnat home-b strict udp-timeout 30s: wifi\nhome-a -> meet: loss 1%\n\
             firewall wall: home-b carl",
        )
        .unwrap();
        assert_eq!(words.hosts, ["bob", "alice", "meet", "carl", "wifi", "lte", "home-a", "home-b", "wall"]);
        let boxes: Vec<String> = words
            .devices
            .iter()
            .map(|line| match line {
                DeviceLine::Middlebox { behaviour, translates, inside } => format!("{translates} {behaviour} {inside:?}"),
                DeviceLine::Interfaces { host, count } => format!("{count} of {host}"),
            })
            .collect();
        assert_eq!(boxes, ["2 of 0", "true home [1]", "true strict udp-timeout 30s [4]", "false home [7, 3]"]);
        assert_eq!(words.links.keys().copied().collect::<Vec<_>>(), [(6, 2)]);
        // A host may have the name of a word.
        assert_eq!(read("nat -> b: delay 1ms").unwrap().hosts, ["nat", "b"]);
    }

    #[test]
    fn hosts_are_those_that_lines_name() {
        let words = read("b -> a: delay 1ms\na -> c: loss 1%").unwrap();
        assert_eq!(words.hosts, ["b", "a", "c"]);
        assert_eq!(words.links.keys().copied().collect::<Vec<_>>(), [(0, 1), (1, 2)]);
        assert_eq!(words.every, LinkModel::default());
    }

    #[test]
    fn what_makes_no_sense_is_shown_with_its_place() {
        assert_eq!(
            read("a -> b: delay 24ms\nb -> a: delay 24ms parsecs loss 1%").unwrap_err(),
            "2:20: unknown word \"parsecs\": expected limit, delay, distribution, loss, ecn, corrupt, duplicate, reorder, gap, rate, cross, slot, seed or the end\n\
             \u{20} |\n2 | b -> a: delay 24ms parsecs loss 1%\n  |                    ^^^^^^^"
        );
        for (text, expected) in [
            ("", "1:1: no line names a host"),
            ("all: delay 1ms", "1:15: no line names a host"),
            ("a -> b delay 1ms", "1:1: no colon"),
            ("a b: delay 1ms", "1:1: expected `a -> b`"),
            (": delay 1ms", "1:1: expected `a -> b`"),
            ("a->b: delay 1ms", "1:1: expected `a -> b`"),
            ("nat: a", "1:4: expected the name of the nat"),
            ("nat n:", "1:7: expected the names of the hosts inside"),
            ("nat n odd: a", "1:7: unknown word \"odd\""),
            ("firewall n strict: a", "1:12: unknown word \"strict\""),
            ("a -> b:\nnat a: c", "2:5: `a` is named already"),
            ("nat n: a\nnat m: a", "2:8: host `a` is behind a NAT or a firewall already"),
            ("interfaces a:", "1:14: expected the names of the interfaces"),
            ("nat n: a\ninterfaces a: w", "2:12: expected a host that is behind no NAT"),
            ("interfaces a: w\nnat n: a", "2:8: host `a` is behind a NAT or a firewall already, or has interfaces"),
            ("interfaces a: w w", "1:17: `w` is named already"),
            ("hosts: a\nnat n: b", "2:8: there is no host `b`"),
            ("é -> é: delay 1ms", "1:1: a host has no link to itself"),
            ("é -> b: delai 1ms", "1:9: unknown word \"delai\""),
            ("a -> b:\nb -> a:\n a -> b: loss 1%", "3:2: this link is given twice"),
            ("a -> b:\nb <-> a:", "2:1: this link is given twice"),
            ("all:\nall:", "2:1: all is given twice"),
            ("hosts: a b\na -> c:", "2:6: there is no host `c`: expected one of a, b"),
            ("hosts: a a", "1:10: host `a` is named twice"),
            ("hosts:  ", "1:7: expected the names of hosts"),
            ("a -> b:\nhosts: a", "2:1: a line above names hosts already"),
            ("hosts: a\nhosts: b", "2:1: hosts is given twice"),
            ("a -> [b]:", "1:6: `[b]` cannot be the name of a host"),
            ("10.0.0.1 -> b:", "1:1: `10.0.0.1` cannot be the name of a host"),
            ("hosts: a b\nhit a -> c: drop packet 1", "2:10: there is no host `c`: expected one of a, b"),
            ("hit a -> a: drop packet 1", "1:5: a host has no link to itself"),
            ("hit a -> b: drop packet", "1:24: expected numbers of packets"),
            ("seed: x", "1:7: expected a number"),
            ("seed: 1 2", "1:7: expected one number"),
            ("seed: 1\nseed: 1", "2:1: seed is given twice"),
            ("a -> b: replay", "1:15: expected the file of a fate log"),
            ("a -> b: replay x.csv", "1:16: x.csv: not there"),
            ("a -> b: delay 5ms 9ms distribution uniform", "1:9: delay: uniform jitter of 9ms around 5ms begins below zero"),
        ] {
            let error = read(text).expect_err(text);
            assert!(error.starts_with(expected), "{text}: {error}");
        }
    }

    proptest! {
        #[test]
        fn any_text_is_read_or_refused(text in "([a-c:>#<\t é-]|delay|loss|seed|hosts|all|replay|->|<->|1ms|5%|\r|\n){0,40}") {
            if let Err(error) = read(&text) {
                prop_assert!(!error.is_empty());
            }
        }
    }
}
