//! Builds the operator of [`Events`] from the timetable, the nodes and the links of a scene.

use std::time::Duration;

use super::arrivals::{Hazards, Outcome};
use super::bursts::Bursts;
use super::events::{Arrive, Events, Step};
use super::held::staying;
use super::law::LossChain;
use super::tracked::Tracked;
use crate::lifted::Lifted;
use crate::lifted::node::Scale;
use crate::timetable::{Event, Instants};
use crate::{Radius, Watch};

/// Link of the scene whose samples change a state of the operator.
#[derive(Clone, Debug)]
pub(crate) struct Line {
    pub(crate) from: usize,
    pub(crate) to: usize,
    /// Hazards, and chain of losses if losses depend on each other. `None` for a link without randomness, whose deliveries are in the timetable.
    pub(crate) chance: Option<(Hazards, Option<LossChain>)>,
}

/// Builds the frame of the nodes over `lines`. A pair of nodes without a line exchanges no samples.
#[cfg(test)]
pub(crate) fn events(lifted: &Lifted<'_>, lines: &[Line], instants: &Instants) -> Events {
    events_watched(lifted, lines, instants, &crate::Unwatched).unwrap_or_default()
}

/// Number of events between two questions to the watcher.
const LOOK: usize = 1024;

/// Builds the frame of the nodes over `lines`; `None` if the watcher ends the computation. A pair of nodes without a line exchanges no samples.
pub(crate) fn events_watched(lifted: &Lifted<'_>, lines: &[Line], instants: &Instants, watch: &dyn Watch) -> Option<Events> {
    let nodes = lifted.nodes.len();
    let scale = Scale { time: lifted.time, compliance: lifted.nodes[0].compliance(lifted.time) };
    let frame = nanoseconds(lifted.timetable.frame);
    let mut depth = lifted.timetable.depth.clone();
    // The timetable knows only the samples of deliveries that are certain. A random link may take in older samples, so the sender keeps more of them.
    for line in lines {
        if let Some((hazards, _)) = &line.chance {
            depth[line.from] = depth[line.from].max(hazards.depth());
        }
    }
    // Order of the rows: states of all nodes, then samples of each node (of earlier frames, then of this frame), then the held sample of each line.
    let mut first = Vec::with_capacity(nodes);
    let mut count = 0;
    let mut made = Events::default();
    let mut moved = Vec::new();
    let numbers = lifted.sampling.channels();
    let translation = |number: usize| lifted.sampling.translation(number, lifted.time);
    for node in lifted.nodes {
        let rows = node.rows(count);
        first.push(count);
        for row in count..count + node.states() {
            made.kept.push((row, row));
            moved.push(node.displacement(rows, row, lifted.time));
        }
        count += node.states();
    }
    let mut first_sample = Vec::with_capacity(nodes);
    for (depth, sent) in depth.iter().zip(&lifted.timetable.sent) {
        // At the end of the frame the samples of this frame become samples of an earlier frame: the rows move by the number of samples sent per frame.
        for place in 0..depth * numbers {
            made.kept.push((count + place + sent * numbers, count + place));
            moved.push(translation(place % numbers));
        }
        first_sample.push(count + depth * numbers);
        count += (depth + sent) * numbers;
    }
    let held_row = |line: usize| count + line * numbers;
    for place in 0..lines.len() * numbers {
        made.kept.push((count + place, count + place));
        moved.push(translation(place % numbers));
    }
    made.rows = count + lines.len() * numbers;
    made.chains = lines.iter().map(chain_states).collect();
    // Without a tie to the ground a common translation grows or stays for ever. Positions relative to the first copy remove this direction, and with the
    // direction the state of the first copy's position: the relative position is always zero.
    if !lifted.tied {
        let reference = lifted.nodes[0].rows(0).object;
        let place = made.kept.iter().position(|(row, _)| *row == reference).unwrap_or(0);
        made.kept.remove(place);
        moved.remove(place);
        made.reference = Some((reference, moved));
    }
    // Samples of earlier frames have negative numbers and lie before `first_sample`. `depth` rows are reserved there, so the index is never negative.
    let row_of = |node: usize, sample: i64| {
        let signed = |number: usize| i64::try_from(number).unwrap_or(i64::MAX);
        usize::try_from(signed(first_sample[node]) + signed(numbers) * sample).unwrap_or(0)
    };
    // Rows of the positions of all samples, sent and held, if the law uses the ages of samples. Each position is then extrapolated to the present at every
    // tick, which spares the operator a state for the age.
    let extrapolates = lifted.nodes.iter().any(|node| node.law.horizon.is_some());
    let of_samples = first_sample.iter().zip(depth.iter().zip(&lifted.timetable.sent));
    let samples = of_samples.flat_map(|(first, (depth, sent))| (first - depth * numbers..first + sent * numbers).step_by(numbers));
    let extrapolated: Vec<usize> = if extrapolates && numbers == 2 { samples.chain((0..lines.len()).map(held_row)).collect() } else { Vec::new() };

    let mut pending: Vec<Option<Tracked>> = vec![None; nodes];
    let (mut tick, mut sample) = (vec![0; nodes], vec![0; nodes]);
    let held_of = |node: usize| -> Vec<Vec<(usize, f64)>> {
        let of = || lines.iter().enumerate().filter(|(_, line)| line.to == node);
        (0..numbers).map(|number| of().map(|(place, line)| (held_row(place) + number, lifted.weights[(node, line.from)])).collect()).collect()
    };
    // Ticks of a node between two other events of the node are multiplied into one map. The map must be flushed before a sample reads the node's
    // states, and before a delivery changes the samples held by the node.
    let flush = |pending: &mut Vec<Option<Tracked>>, made: &mut Events, node: usize| {
        if let Some(map) = pending[node].take() {
            made.roundings += map.roundings();
            made.steps.push(Step::Move { first: first[node], sizes: map.sizes(), map: map.value, held: held_of(node) });
        }
    };
    for (number, event) in lifted.timetable.events.iter().enumerate() {
        if number.is_multiple_of(LOOK) && watch.stops() {
            return None;
        }
        match *event {
            Event::Sample { node } => {
                // The sample reads the node's position and velocity, so the ticks before the sample must have been applied.
                flush(&mut pending, &mut made, node);
                let object = lifted.nodes[node].rows(first[node]).object;
                for number in 0..numbers {
                    let (position, velocity) = lifted.sampling.shares(number, lifted.time);
                    let row = first_sample[node] + sample[node] * numbers + number;
                    made.steps.push(Step::Sample { row, of: [(object, position), (object + 1, velocity)] });
                }
                sample[node] += 1;
            }
            // Certain deliveries stand in the timetable. A pair without a line exchanges no samples, so the delivery is left out.
            Event::Deliver { from, to, sample } => {
                if let Some(link) = lines.iter().position(|line| (line.from, line.to) == (from, to)) {
                    flush(&mut pending, &mut made, to);
                    let outcomes = vec![Arrive { from: 0, to: 0, take: Some(row_of(from, sample)), probability: 1.0 }];
                    made.steps.push(Step::Deliver { link, row: held_row(link), numbers, outcomes });
                }
            }
            Event::Tick { node, span, exchanges, .. } => {
                // Arrivals come before the tick of the same instant, as in the simulator: the tick already uses the sample that arrived at the tick.
                for (link, line) in lines.iter().enumerate().filter(|(_, line)| line.to == node) {
                    for outcomes in outcomes(line, tick[node], &instants.sends[line.from], frame) {
                        flush(&mut pending, &mut made, node);
                        let arrive = |outcome| Arrive::new(outcome, |sample| row_of(line.from, sample));
                        let mut outcomes: Vec<Arrive> = outcomes.into_iter().map(arrive).collect();
                        // Outcomes are grouped by target state, so that the operator adds up one target at a time.
                        outcomes.sort_by_key(|outcome| (outcome.to, outcome.from));
                        made.steps.push(Step::Deliver { link, row: held_row(link), numbers, outcomes });
                    }
                }
                tick[node] += 1;
                let states = lifted.nodes[node].states();
                let map = pending[node].get_or_insert_with(|| Tracked::new(states, states, numbers));
                map.tick(&lifted.nodes[node], lifted, (span, exchanges), scale);
                if node + 1 == nodes && !extrapolated.is_empty() {
                    // The nodes have equal clocks if the law extrapolates, so the tick of the last node ends the instant, and all samples age by `span`.
                    (0..nodes).for_each(|node| flush(&mut pending, &mut made, node));
                    let share = span.as_secs_f64() / lifted.time;
                    made.steps.extend(extrapolated.iter().map(|row| Step::Sample { row: *row, of: [(*row, 1.0), (row + 1, share)] }));
                }
            }
        }
    }
    // The next frame begins with the states, so ticks still pending at the end of the frame belong to this frame.
    for node in 0..nodes {
        flush(&mut pending, &mut made, node);
    }
    Some(made)
}

impl Line {
    /// Returns the probability per frame, in the long run, that nothing arrives on the line; `None` for a line without randomness.
    pub(crate) fn staying(&self, instants: &Instants, frame: Duration) -> Option<Radius> {
        self.chance.as_ref()?;
        let ticks = 0..instants.ticks[self.to].len();
        let all: Vec<Vec<Outcome>> = ticks.flat_map(|tick| outcomes(self, tick, &instants.sends[self.from], nanoseconds(frame))).collect();
        Some(staying(chain_states(self), &all))
    }
}

/// Returns the number of states of a line's chain: the number of places, times the number of states of the chain of losses if there is one.
fn chain_states(line: &Line) -> usize {
    match &line.chance {
        None => 1,
        Some((hazards, None)) => hazards.places,
        Some((hazards, Some(chain))) => Bursts { hazards, chain: *chain, gap: |_| 0.0 }.states(),
    }
}

/// Returns the outcomes on a line at a tick of its receiver: a list of one entry, or an empty list if the tick changes neither sample nor state.
fn outcomes(line: &Line, tick: usize, sends: &[u64], frame: u64) -> Vec<Vec<Outcome>> {
    let Some((hazards, chain)) = &line.chance else { return Vec::new() };
    let window = hazards.window(tick);
    // Without hazards the tick still changes the state if places are counted from another oldest sample after the tick.
    if hazards.at[tick].is_empty() && (hazards.places == 1 && chain.is_none() || window.before == window.after) {
        return Vec::new();
    }
    vec![match chain {
        None => hazards.outcomes(tick),
        Some(chain) => Bursts { hazards, chain: *chain, gap: |sample| gap(sample, sends, frame) }.outcomes(tick),
    }]
}

/// Returns the span from the sending of the sample before `sample` to the sending of `sample` \[s\]. `sends` are the instants of the frame \[ns\].
fn gap(sample: i64, sends: &[u64], frame: u64) -> f64 {
    let count = i64::try_from(sends.len()).unwrap_or(1);
    let place = usize::try_from(sample.rem_euclid(count)).unwrap_or(0);
    // The sample before the first sample of a frame is the last sample of the previous frame, at a negative instant. Both wraps cancel in the difference.
    let before = if place == 0 { sends[sends.len() - 1].wrapping_sub(frame) } else { sends[place - 1] };
    Duration::from_nanos(sends[place].wrapping_sub(before)).as_secs_f64()
}

pub(super) fn nanoseconds(span: Duration) -> u64 {
    u64::try_from(span.as_nanos()).unwrap_or(u64::MAX)
}
