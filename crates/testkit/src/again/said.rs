//! Networks in the words of their tests, and the part of chance in such networks.

use std::collections::BTreeMap;

use cohaptic_wan::netem::{ChanceSpec, LossSpec, Netem, Percent, SlotGap};
use cohaptic_wan::{NodeId, Path};

use crate::link::ToLink;

/// Links of a test bed in words, as far as the test gave words.
#[derive(Clone, Debug, Default)]
pub(crate) struct Said {
    every: Words,
    links: BTreeMap<Path, Words>,
    /// Names of the links of the library that are the access lines of hosts.
    access: BTreeMap<NodeId, Words>,
    /// Line of a link file and call of the builder for each NAT and firewall, and for the interfaces of each host.
    devices: Vec<(String, String)>,
}

/// Link in the words of `tc-netem`, where an empty text is the ideal link; or a link without words.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) enum Words {
    Known(String),
    Model,
}

impl Default for Words {
    fn default() -> Self {
        Self::Known(String::new())
    }
}

impl Words {
    fn of(link: &impl ToLink) -> Self {
        link.words().map_or(Self::Model, Self::Known)
    }

    /// Returns the words for messages.
    fn shown(&self) -> &str {
        match self {
            Self::Known(words) => words,
            Self::Model => "a model without words",
        }
    }

    /// Returns the part of chance in the link, with the words without losses.
    pub(super) fn chance(&self) -> Chance {
        let Self::Known(words) = self else { return Chance::Other };
        if words.is_empty() {
            return Chance::Nothing;
        }
        // Words that `tc-netem` does not know name a link of the library, in which chance does more than lose packets.
        Netem::parse(words).map_or(Chance::Other, |netem| Chance::of(&netem))
    }
}

/// Part of chance in a link.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) enum Chance {
    Nothing,
    /// Only losses are random. Contains the words without the losses.
    Losses(String),
    Other,
}

impl Chance {
    fn of(netem: &Netem) -> Self {
        let happens = |chance: Option<&ChanceSpec>| chance.is_some_and(|chance| chance.percent > Percent::ZERO);
        // Every part with chance other than loss is looked for: only pure losses can be replaced by a list of lost packets.
        let jitters = netem.delay.as_ref().and_then(|delay| delay.jitter.as_ref()).is_some_and(|jitter| !jitter.time.is_zero());
        let slots = netem.slot.as_ref().is_some_and(|slot| !matches!(slot.gap, SlotGap::Range { max: None, .. }));
        let others = [netem.corrupt.as_ref(), netem.duplicate.as_ref(), netem.reorder.as_ref().map(|reorder| &reorder.chance)];
        // With `ecn` chance marks packets in place of losing them, so the list of lost packets is not the whole effect.
        if jitters || slots || netem.ecn || netem.cross.is_some() || others.into_iter().any(happens) {
            return Self::Other;
        }
        match &netem.loss {
            None => Self::Nothing,
            Some(LossSpec::Random(chance)) if !happens(Some(chance)) => Self::Nothing,
            Some(_) => Self::Losses(Netem { loss: None, ..netem.clone() }.to_string()),
        }
    }
}

impl Said {
    /// Sets the words of all links that are not set by themselves.
    pub(crate) fn set_every(&mut self, link: &impl ToLink) {
        self.every = Words::of(link);
    }

    pub(crate) fn set(&mut self, path: Path, link: &impl ToLink) {
        self.links.insert(path, Words::of(link));
    }

    /// Sets the name of a host's access lines; `None` if the access lines are models.
    pub(crate) fn set_access(&mut self, host: NodeId, name: Option<String>) {
        self.access.insert(host, name.map_or(Words::Model, Words::Known));
    }

    /// Sets all links to models, as a link file does. No host has access lines then.
    pub(crate) fn set_models(&mut self, every_is_ideal: bool, links: impl Iterator<Item = Path>) {
        self.every = if every_is_ideal { Words::default() } else { Words::Model };
        self.links = links.map(|path| (path, Words::Model)).collect();
        self.access.clear();
    }

    /// Adds a NAT, a firewall, or the interfaces of a host: the line of a link file, and the call of the builder.
    pub(crate) fn add_device(&mut self, line: String, call: String) {
        self.devices.push((line, call));
    }

    /// Returns the line of a link file and the call of the builder for each NAT and firewall, and for the interfaces of each host.
    pub(crate) fn devices(&self) -> impl Iterator<Item = (&str, &str)> {
        self.devices.iter().map(|(line, call)| (&**line, &**call))
    }

    pub(super) const fn every(&self) -> &Words {
        &self.every
    }

    /// Returns the links that differ from the link for all others, sorted by hosts.
    pub(super) fn links(&self) -> impl Iterator<Item = (Path, &Words)> {
        self.links.iter().map(|(path, words)| (*path, words)).filter(|(_, words)| **words != self.every)
    }

    /// Returns the access lines, sorted by host.
    pub(super) fn access(&self) -> impl Iterator<Item = (NodeId, &Words)> {
        self.access.iter().map(|(host, words)| (*host, words))
    }

    /// Returns a line for each device, for each link that is not ideal, for all links that are not named, and for the access lines of each host.
    pub(crate) fn lines(&self, hosts: &[String]) -> Vec<String> {
        let name = |host: NodeId| hosts.get(host.index()).map_or("?", |name| name);
        let links = self.links().map(|(path, words)| {
            let shown = if words.shown().is_empty() { "ideal" } else { words.shown() };
            format!("{} -> {}: {shown}", name(path.from), name(path.to))
        });
        let every = (self.every != Words::default()).then(|| format!("all: {}", self.every.shown()));
        let access = self.access().map(|(host, words)| format!("access of {}: {}", name(host), words.shown()));
        let devices = self.devices().map(|(line, _)| line.to_owned());
        devices.chain(every).chain(links).chain(access).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chance_is_told_from_what_is_certain() {
        let chance = |words: &str| Words::Known(words.to_owned()).chance();
        for words in ["", "delay 20ms", "rate 1mbit limit 10", "loss 0%", "delay 5ms 0ms", "slot 5ms", "delay 1ms duplicate 0%"] {
            assert_eq!(chance(words), Chance::Nothing, "{words}");
        }
        assert_eq!(chance("loss 3%"), Chance::Losses(String::new()));
        assert_eq!(chance("delay 20ms loss gemodel 1% 10% rate 1mbit"), Chance::Losses("delay 20ms rate 1mbit".to_owned()));
        for words in ["delay 5ms 1ms", "loss 3% ecn", "loss 3% corrupt 1%", "duplicate 1%", "delay 5ms reorder 10%", "slot 5ms 9ms"] {
            assert_eq!(chance(words), Chance::Other, "{words}");
        }
        assert_eq!(Words::Model.chance(), Chance::Other);
    }

    #[test]
    fn a_network_is_told_link_by_link() {
        let path = |from, to| Path { from: NodeId::new(from), to: NodeId::new(to) };
        let hosts = ["a", "b"].map(String::from);
        let mut said = Said::default();
        said.set(path(0, 1), &"");
        assert_eq!(said.lines(&hosts), [""; 0]);
        said.set_every(&" delay 1ms ");
        said.set(path(1, 0), &"loss 1%".to_owned());
        assert_eq!(said.lines(&hosts), ["all: delay 1ms", "a -> b: ideal", "b -> a: loss 1%"]);
        said.set(path(0, 1), &"delay 1ms");
        said.set(path(1, 0), &cohaptic_wan::LinkModel::default());
        said.set_access(NodeId(1), Some("starlink@1".to_owned()));
        assert_eq!(said.lines(&hosts), ["all: delay 1ms", "b -> a: a model without words", "access of b: starlink@1"]);
    }
}
