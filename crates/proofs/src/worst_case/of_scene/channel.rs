//! Links that share their fate, what can become of their samples, and in which order.
//!
//! A sample is *due* in the first frame in which it can arrive. If its delay has an interval that reaches into the next frame, it may as well arrive there,
//! before the next one does: the interval is shorter than a period of sending. So on one link a frame brings, at some tick each, a sample that was put off
//! in the frame before, if one was, and the one that is due in this, unless it is lost or put off in its turn.
//!
//! Delays that lead to the same ticks are one *choice*. A symbol of the channel's [`Pattern`] is what happens in a frame on all its links; a node is how
//! many samples in a row were lost just now, or what was put off.

use std::time::Duration;

use cohaptic_stability::frames::NodeClock;

use super::super::pattern::{Edge, Pattern, PatternError};

/// A link between two nodes, and the least delay on it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Way {
    pub from: usize,
    pub to: usize,
    pub delay: Duration,
}

/// Links of which all or none lose the samples due in a frame, and which delay it by as much more than their least delays.
#[derive(Clone, Debug)]
pub(super) struct Channel {
    pub links: Vec<Link>,
    choices: Vec<Choice>,
    pub pattern: Pattern,
    pub symbols: Vec<Symbol>,
}

/// A link of a channel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Link {
    pub from: usize,
    pub to: usize,
    /// How many frames after the one in which it was sent a sample is due.
    pub age: usize,
    /// The same of the last frame in which it may arrive.
    pub oldest: usize,
}

/// The ticks at which samples arrive on the links of a channel, counted from a frame's first; `None`: no sample.
type Ticks = Vec<Option<usize>>;

/// What can become of the samples that are due in a frame, but for being lost.
#[derive(Clone, PartialEq, Eq, Debug)]
struct Choice {
    /// The longest delay beyond the least one that leads here.
    extra: Duration,
    now: Ticks,
    /// In the frame after.
    later: Ticks,
}

/// What happens in a frame.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct Symbol {
    /// What was put off in the frame before.
    pub late: Ticks,
    pub now: Ticks,
}

/// What became of the samples that were due in a frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Fate {
    Lost,
    /// Received with a delay that exceeds the least one by at most this.
    Received(Duration),
}

impl Channel {
    /// The links of a channel between nodes with those clocks, which tick a whole number of times in a frame. At most `most` frames in a row lose the samples due
    /// in them; delays are up to `width` beyond the least ones, less than a frame.
    pub(super) fn new(ways: &[Way], clocks: &[NodeClock], width: Duration, most: u32) -> Result<Self, PatternError> {
        let ticks = |way: &Way| usize::try_from(clocks[way.to].every).unwrap_or(usize::MAX);
        let arrival = |way: &Way, extra: Duration| clocks[way.from].arrival(&clocks[way.to], way.delay.saturating_add(extra));
        let due = |way: &Way| arrival(way, Duration::ZERO).0 / ticks(way);
        let mut choices = Vec::new();
        let mut extra = Duration::ZERO;
        loop {
            let arrivals: Vec<(usize, Duration)> = ways.iter().map(|way| arrival(way, extra)).collect();
            let same = ways.iter().zip(&arrivals).map(|(way, (_, longest))| longest.saturating_sub(way.delay)).min().unwrap_or(width).min(width);
            let at = |late: usize| -> Ticks {
                let in_frame = |(way, (tick, _)): (&Way, &(usize, Duration))| (tick / ticks(way) == due(way) + late).then_some(tick % ticks(way));
                ways.iter().zip(&arrivals).map(in_frame).collect()
            };
            choices.push(Choice { extra: same, now: at(0), later: at(1) });
            if same >= width {
                break;
            }
            extra = same.saturating_add(Duration::from_nanos(1));
        }
        let link = |(place, way): (usize, &Way)| {
            let put_off = choices.iter().any(|choice| choice.later[place].is_some());
            Link { from: way.from, to: way.to, age: due(way), oldest: due(way) + usize::from(put_off) }
        };
        let links = ways.iter().enumerate().map(link).collect();
        let (pattern, symbols) = pattern(&choices, ways.len(), most)?;
        Ok(Self { links, choices, pattern, symbols })
    }

    /// What became of what was due in a frame, given its symbol and that of the frame after.
    pub(super) fn fate(&self, symbol: usize, next: usize) -> Fate {
        let (now, later) = (&self.symbols[symbol].now, &self.symbols[next].late);
        let choice = self.choices.iter().find(|choice| choice.now == *now && choice.later == *later);
        choice.map_or(Fate::Lost, |choice| Fate::Received(choice.extra))
    }
}

/// Which symbols can follow each other. Nodes 0 to `most` count the losses in a row; a node for each way of being put off follows.
fn pattern(choices: &[Choice], links: usize, most: u32) -> Result<(Pattern, Vec<Symbol>), PatternError> {
    let nothing: Ticks = vec![None; links];
    let mut put_off: Vec<&Ticks> = Vec::new();
    for choice in choices {
        if choice.later != nothing && !put_off.contains(&&choice.later) {
            put_off.push(&choice.later);
        }
    }
    let most = usize::try_from(most).unwrap_or(usize::MAX);
    // Also refuses what would not fit into memory below.
    Pattern::runs(choices.len() + 1, choices.len(), u32::try_from(most).unwrap_or(u32::MAX))?;
    let node = |later: &Ticks| put_off.iter().position(|other| *other == later).map_or(0, |place| most + 1 + place);
    let mut symbols: Vec<Symbol> = Vec::new();
    let mut edges = Vec::new();
    for from in 0..=most + put_off.len() {
        let late = if from > most { put_off[from - most - 1] } else { &nothing };
        let mut add = |now: &Ticks, to: usize| {
            let symbol = Symbol { late: late.clone(), now: now.clone() };
            let place = symbols.iter().position(|other| *other == symbol).unwrap_or(symbols.len());
            if place == symbols.len() {
                symbols.push(symbol);
            }
            edges.push(Edge { from, to, symbol: place });
        };
        for choice in choices {
            add(&choice.now, node(&choice.later));
        }
        let lost = if from > most { 0 } else { from };
        if lost < most {
            add(&nothing, lost + 1);
        }
    }
    Ok((Pattern::of(most + 1 + put_off.len(), edges, symbols.len())?, symbols))
}
