//! Channels: links that lose and delay together, with the pattern of the fates of their samples.
//!
//! A sample is *due* in the first frame in which it can arrive. If its interval of delays reaches into the next frame, the sample may arrive in the next frame
//! instead (it is *put off*), but before the next sample, because the interval is shorter than a period of sending. So in one frame a link delivers at most two
//! samples, each at some tick: a sample that was put off in the frame before, and the sample that is due, unless that sample is lost or put off.
//!
//! Delays that lead to the same ticks are one *choice*. A symbol of the channel's [`Pattern`] is the deliveries in a frame on all links of the channel. A node
//! is the number of samples in a row that were just lost, or the deliveries that were put off.

use std::time::Duration;

use cohaptic_stability::frames::NodeClock;

use super::super::pattern::{Edge, Pattern, PatternError};

/// A link between two nodes, with the shortest delay of the link.
#[derive(Clone, Copy, Debug)]
pub(super) struct Way {
    pub from: usize,
    pub to: usize,
    pub delay: Duration,
}

/// Links that all lose the samples due in a frame, or all receive them with the same delay beyond their shortest delays.
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
    /// Number of frames from the frame in which a sample is sent to the frame in which the sample is due.
    pub age: usize,
    /// Number of frames from the frame in which a sample is sent to the last frame in which the sample may arrive.
    pub oldest: usize,
}

/// Ticks at which samples arrive, indexed by link of a channel and counted from the frame's first tick; `None`: no sample.
type Ticks = Vec<Option<usize>>;

/// The ticks of arrival of the samples due in a frame, for one range of delays.
#[derive(Clone, PartialEq, Eq, Debug)]
struct Choice {
    /// Longest delay of the range, beyond the shortest delay.
    extra: Duration,
    /// Arrivals in the frame of the due samples.
    now: Ticks,
    /// Arrivals in the next frame.
    later: Ticks,
}

/// The arrivals in a frame.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct Symbol {
    /// Arrivals of samples put off in the frame before.
    pub late: Ticks,
    /// Arrivals of samples due in this frame.
    pub now: Ticks,
}

/// The fate of the samples due in a frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Fate {
    Lost,
    /// Received with a delay above the shortest delay by at most this duration.
    Received(Duration),
}

impl Channel {
    /// Returns the channel of the links `ways` between nodes with the clocks `clocks`. Each clock ticks a whole number of times in a frame. At most `most`
    /// frames in a row lose the due samples. Delays exceed the shortest delays by at most `width`, less than a frame.
    ///
    /// # Errors
    ///
    /// [`PatternError`] if the pattern would be too large.
    pub(super) fn new(ways: &[Way], clocks: &[NodeClock], width: Duration, most: u32) -> Result<Self, PatternError> {
        let ticks = |way: &Way| usize::try_from(clocks[way.to].every).unwrap_or(usize::MAX);
        let arrival = |way: &Way, extra: Duration| clocks[way.from].arrival(&clocks[way.to], way.delay.saturating_add(extra));
        let due = |way: &Way| arrival(way, Duration::ZERO).0 / ticks(way);
        let mut choices = Vec::new();
        let mut extra = Duration::ZERO;
        // Each round adds one choice, and goes on with the shortest delay for a later arrival on some link.
        loop {
            let arrivals: Vec<(usize, Duration)> = ways.iter().map(|way| arrival(way, extra)).collect();
            // All delays up to `longest` give the same ticks, so the smallest `longest` of the links ends the range of this choice.
            let same = ways.iter().zip(&arrivals).map(|(way, (_, longest))| longest.saturating_sub(way.delay)).min().unwrap_or(width).min(width);
            let at = |late: usize| -> Ticks {
                let in_frame = |(way, (tick, _)): (&Way, &(usize, Duration))| (tick / ticks(way) == due(way) + late).then_some(tick % ticks(way));
                ways.iter().zip(&arrivals).map(in_frame).collect()
            };
            choices.push(Choice { extra: same, now: at(0), later: at(1) });
            if same >= width {
                break;
            }
            // Delays are whole nanoseconds, so the next range begins one nanosecond later.
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

    /// Returns the fate of the samples due in a frame, from the symbol of the frame and the symbol of the next frame.
    pub(super) fn fate(&self, symbol: usize, next: usize) -> Fate {
        let (now, later) = (&self.symbols[symbol].now, &self.symbols[next].late);
        let choice = self.choices.iter().find(|choice| choice.now == *now && choice.later == *later);
        choice.map_or(Fate::Lost, |choice| Fate::Received(choice.extra))
    }
}

/// Returns the pattern and the symbols of a channel. Nodes 0 to `most` count the losses in a row. Then follows one node for each set of arrivals that can
/// be put off.
fn pattern(choices: &[Choice], links: usize, most: u32) -> Result<(Pattern, Vec<Symbol>), PatternError> {
    let nothing: Ticks = vec![None; links];
    let mut put_off: Vec<&Ticks> = Vec::new();
    for choice in choices {
        if choice.later != nothing && !put_off.contains(&&choice.later) {
            put_off.push(&choice.later);
        }
    }
    let most = usize::try_from(most).unwrap_or(usize::MAX);
    // Refuses a pattern too large for the memory, before the edges are made.
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
        // Samples that were put off have arrived in the end, so the count of losses in a row begins anew.
        let lost = if from > most { 0 } else { from };
        if lost < most {
            add(&nothing, lost + 1);
        }
    }
    Ok((Pattern::of(most + 1 + put_off.len(), edges, symbols.len())?, symbols))
}
