//! Printed tests that repeat a failure: the network of the failed run, with chance replaced by the lost packets or repeated by the seed, and the program.

mod program;
mod said;

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::panic::Location;
use std::sync::Arc;

use cohaptic_wan::{NodeId, Path};

pub(crate) use said::Said;
use said::{Chance, Words};

use crate::hit::{Hit, Laws};
use crate::names::Names;
use crate::seed::Seed;
use crate::trace::PacketName;

/// Parts of a test bed for a printed test that repeats a run.
#[derive(Clone, Debug)]
pub(crate) struct Again {
    pub(crate) names: Arc<Names>,
    /// Number of hosts. Further names are those of NATs, firewalls and interfaces.
    pub(crate) hosts: usize,
    pub(crate) said: Arc<Said>,
    pub(crate) laws: Laws,
    pub(crate) seed: Seed,
    /// Further calls of the builder, one per line.
    pub(crate) others: Vec<String>,
    /// Place of the call of the run.
    pub(crate) place: &'static Location<'static>,
}

/// Effects of chance in a run, as far as a printed test can repeat the effects.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub(crate) struct Drawn {
    /// Packets that links have lost by chance; only the first [`MOST_LOST`] packets.
    pub(crate) lost: Vec<PacketName>,
    /// `true` if programs or connections of TCP have drawn random numbers, or links were changed during the run.
    pub(crate) has_drawn: bool,
}

/// Maximum number of packets that a printed test names. With more packets the seed is shorter.
pub(crate) const MOST_LOST: usize = 64;

impl Again {
    /// Returns the calls of the builder for the network, one per line. Chance is repeated by the seed, or replaced by hits on the packets lost by chance: the
    /// shorter text is returned.
    pub(crate) fn network(&self, drawn: &Drawn) -> Vec<String> {
        let seeded = self.lines(None, self.needs_seed(drawn));
        let Some(lost) = self.lost(drawn) else { return seeded };
        let hit = self.lines(Some(&lost), false);
        let len = |lines: &[String]| lines.iter().map(|line| line.len() + 1).sum::<usize>();
        if len(&hit) < len(&seeded) { hit } else { seeded }
    }

    /// Returns the whole test, with the program copied from its source. `has_failed` tells whether the run itself has failed; otherwise the test has failed
    /// afterwards.
    pub(crate) fn test(&self, drawn: &Drawn, has_failed: bool) -> String {
        let call = program::call(self.place);
        let (method, program) = match &call {
            Some(program::Call { method, program }) => (&**method, program.clone()),
            None => ("run", format!("/* the program of the call at {} */", self.place)),
        };
        // Outside of the test harness the test is named by file, line and column, with characters that a name of a function must not have.
        let last = self.seed.test.rsplit("::").next().unwrap_or_default();
        let name: String = last.chars().map(|c| if c.is_alphanumeric() { c } else { '_' }).collect();
        // Writing to a `String` cannot fail.
        let mut text = format!("#[test]\nfn {name}_again() {{\n    ");
        if !has_failed {
            text.push_str("let outcome = ");
        }
        let devices: Vec<&str> = self.said.devices().map(|(_, call)| call).collect();
        let hosts = &self.names[..self.hosts];
        let _ = write!(text, "Testbed::new([{}])", hosts.iter().map(|name| format!("{name:?}")).collect::<Vec<_>>().join(", "));
        for line in devices.into_iter().map(str::to_owned).chain(self.network(drawn)) {
            let _ = write!(text, "\n        {line}");
        }
        for line in &self.others {
            let _ = write!(text, "\n        {line}");
        }
        let _ = write!(text, "\n        .{method}({program});\n");
        if !has_failed {
            text.push_str("    // Write here what the test expects of the outcome: this expectation failed.\n");
        }
        text.push_str("}\n");
        text
    }

    fn words(&self) -> impl Iterator<Item = &Words> {
        let links = self.said.links().map(|(_, words)| words);
        std::iter::once(self.said.every()).chain(links).chain(self.said.access().map(|(_, words)| words))
    }

    /// Returns whether anything other than losses depends on the seed.
    fn has_other_chance(&self, drawn: &Drawn) -> bool {
        // A law that is not given in words may draw, and so may a hit that flips a bit.
        let draws = self.laws.iter().any(|law| law.words().is_none_or(Hit::draws));
        drawn.has_drawn || draws || self.words().any(|words| words.chance() == Chance::Other)
    }

    /// Returns whether any link draws random numbers.
    pub(crate) fn has_chance(&self) -> bool {
        self.words().any(|words| words.chance() != Chance::Nothing)
    }

    fn needs_seed(&self, drawn: &Drawn) -> bool {
        self.has_other_chance(drawn) || self.has_chance()
    }

    /// Returns the numbers of the lost packets by path, if chance has had no other effect.
    fn lost(&self, drawn: &Drawn) -> Option<BTreeMap<Path, Vec<u64>>> {
        // A full list may lack later losses. Other chance, such as jitter, cannot be replaced by hits.
        let is_known = drawn.lost.len() < MOST_LOST && !self.has_other_chance(drawn) && self.needs_seed(drawn);
        is_known.then(|| {
            let mut lost: BTreeMap<Path, Vec<u64>> = BTreeMap::new();
            drawn.lost.iter().for_each(|packet| lost.entry(packet.path).or_default().push(packet.sequence));
            lost
        })
    }

    /// Returns the calls of the builder. If `lost` is given, hits on these packets replace chance.
    fn lines(&self, lost: Option<&BTreeMap<Path, Vec<u64>>>, with_seed: bool) -> Vec<String> {
        let shown = |words: &Words| match (words, words.chance()) {
            (Words::Model, _) => None,
            (_, Chance::Losses(rest)) if lost.is_some() => Some(rest),
            (Words::Known(words), _) => Some(words.clone()),
        };
        let name = |host: NodeId| self.names.get(host.index()).map_or("?", |name| name);
        let mut lines = Vec::new();
        let every = shown(self.said.every());
        match &every {
            None => lines.push("// .links(…): a model without words; copy the call from the test.".to_owned()),
            Some(words) if !words.is_empty() => lines.push(format!(".links({words:?})")),
            Some(_) => {}
        }
        for (path, words) in self.said.links() {
            let (from, to) = (name(path.from), name(path.to));
            match shown(words) {
                None => lines.push(format!("// .link({from:?}, {to:?}, …): a model without words; copy the call from the test.")),
                // `.links` has set this link already.
                words if words == every => {}
                Some(words) => lines.push(format!(".link({from:?}, {to:?}, {words:?})")),
            }
        }
        for (host, words) in self.said.access() {
            let host = name(host);
            lines.push(match words {
                Words::Known(words) => format!(".access({host:?}, {words:?})"),
                Words::Model => format!("// The access lines of {host} are models without words; copy the call from the test."),
            });
        }
        // Losses precede the other laws, because the first verdict counts, and another law could delay a lost packet.
        for (path, numbers) in lost.into_iter().flatten() {
            lines.push(format!(".hit({:?}, {:?}, {:?})", name(path.from), name(path.to), Hit::dropping(numbers.iter().copied()).to_string()));
        }
        for law in self.laws.iter() {
            let (from, to) = (name(law.path.from), name(law.path.to));
            match law.words() {
                Some(words) => lines.push(format!(".hit({from:?}, {to:?}, {:?})", words.to_string())),
                None => lines.push(format!("// {} of {from} -> {to} has no words; copy the call from the test.", law.name)),
            }
        }
        if with_seed {
            lines.push(format!(".seed({})", self.seed.value));
        }
        lines
    }
}
