//! A node of the lifted system on one axis, its rows and its tick: a peer, or the common or relative motion of a class of equal peers.
//!
//! Positions are in metres. Velocities are multiplied by a common time and forces by a compliance, so every state is a length. Without a common unit,
//! norms of states and error bounds from norms would have no meaning.

use std::time::Duration;

use cohaptic_peer::{Clock, Exchange, Gains, Integrator, Motion, Plant, StepMap, tick};

use super::operator::Seen;
use super::{Operator, Sampling};
use crate::Matrix;
use crate::linear_form::{LawRow, LinearLaw};

/// A body's step maps for the spans between its ticks.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Body {
    short: (Duration, StepMap),
    long: StepMap,
    /// Rounding of the coefficients of the exact maps; `None` if the operations of a tick round more.
    coarse: Option<Coarse>,
}

/// Rounding of step maps of a body with a decay or turn by more than 1.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Coarse {
    /// Multiple of the rounding of a tick's own operations.
    factor: f64,
    /// Least reference sizes of the coefficients for the rounding: a sine or a cosine near zero is not more exact than a sine near 1.
    least: ([[f64; 2]; 2], [f64; 2]),
}

impl Coarse {
    /// Returns the rounding of the exact maps of a body over spans of up to `span`; `None` if a tick's own operations round more.
    fn of(plant: &Plant, span: Duration) -> Option<Self> {
        let (factor, h) = (plant.rounding_factor(span) - 1.0, span.as_secs_f64());
        let omega = (plant.stiffness / plant.mass).sqrt();
        let least = || ([[1.0, h], [omega, 1.0]], [h * h / plant.mass, h / plant.mass]);
        // Of a free body only the velocity decays: its coefficients keep their relative accuracy.
        (factor > 1.0 && plant.stiffness > 0.0).then(|| Self { factor, least: least() })
    }
}

impl Body {
    pub(crate) fn new(plant: Plant, integrator: Integrator, clock: &Clock) -> Self {
        let (_, long) = clock.spans();
        let coarse = if integrator == Integrator::Exact { Coarse::of(&plant, long) } else { None };
        Self { coarse, ..Self::from_steps(clock, |span| plant.step(span, integrator)) }
    }

    /// Returns a body with the step map `step(span)` over a span between ticks.
    pub(crate) fn from_steps(clock: &Clock, step: impl Fn(Duration) -> StepMap) -> Self {
        let (short, long) = clock.spans();
        let first = step(short);
        Self { short: (short, first), long: if long == short { first } else { step(long) }, coarse: None }
    }

    /// Returns the step map, if all spans between ticks have the same map.
    pub fn only_map(&self) -> Option<StepMap> {
        (self.long == self.short.1).then_some(self.long)
    }

    /// Returns the body with `map` as the step map over every span.
    pub fn with_map(&self, map: StepMap) -> Self {
        Self { short: (self.short.0, map), long: map, ..*self }
    }

    pub(crate) fn map(&self, span: Duration) -> &StepMap {
        if span == self.short.0 { &self.short.1 } else { &self.long }
    }

    /// Returns the reference sizes of the coefficients over a span for the rounding, in the order of [`StepMap::coefficients`], and the rounding in
    /// multiples of the rounding of a tick's own operations: 1 unless the body decays or turns by more than 1 within the span.
    pub(crate) fn sizes(&self, span: Duration) -> ([[f64; 2]; 2], [f64; 2], f64) {
        let map = self.map(span).map(|coefficient| coefficient.abs());
        let (e, g) = map.coefficients();
        let Some(Coarse { factor, least }) = self.coarse else { return (e, g, 1.0) };
        // `f64::max` would drop a NaN; this comparison keeps a NaN of the coefficients.
        let larger = |one: f64, other: f64| if one < other { other } else { one };
        let rows = std::array::from_fn(|row| std::array::from_fn(|column| larger(e[row][column], least.0[row][column])));
        (rows, std::array::from_fn(|row| larger(g[row], least.1[row])), factor)
    }

    /// Returns the step map over a span for velocities multiplied by `time` \[s\]; forces stay in newtons.
    pub fn scaled_map(&self, span: Duration, time: f64) -> StepMap {
        let (e, g) = self.map(span).coefficients();
        StepMap::new([[e[0][0], e[0][1] / time], [e[1][0] * time, e[1][1]]], [g[0], g[1] * time])
    }
}

/// A node: the linearly moving parts of a peer along one axis.
#[derive(Clone, PartialEq, Debug)]
pub struct Node {
    /// Device with the holding arm; `None` if the device does not touch the copy.
    pub device: Option<Body>,
    /// The copy of the object.
    pub object: Body,
    /// The operator that moves the arm of the device; `None` if the wanted motion of the hand is given.
    pub operator: Option<Operator>,
    /// Gains KC and BC of the coupling between device and copy.
    pub coupling: Gains,
    /// The coordination law.
    pub law: LinearLaw,
    /// Spring and damper between copy and ground, if any.
    pub wall: Option<Gains>,
    /// `true` if forces act one tick after their computation.
    pub compute_delay: bool,
    /// Ticks at which the node reads its device and gives the device a new force. Without a meaning if the node has no device.
    pub exchange: Exchange,
    /// `true` if position and velocity of the own past are both states. Otherwise only the combination used by the law is a state.
    pub keeps_whole_past: bool,
}

/// Rows of the states of a node.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Rows {
    /// Row of the position of the device, if the node has a device; the row of the velocity follows.
    pub device: Option<usize>,
    /// Row of the position of the copy; the row of the velocity follows.
    pub object: usize,
    /// Row of the force on the copy at the next tick, if forces act one tick late; the row of the force of the device's coupling follows.
    pub(crate) pending: Option<usize>,
    /// Rows of what a slow device and its copy know of each other, if the node has such a device.
    pub(crate) exchange: ExchangeRows,
    /// Row of the wanted place of the operator's arm, if it is a state.
    pub(crate) wanted: Option<usize>,
    /// Row of the first number of the law's memory; the rest of the memory follows.
    pub(crate) memory: usize,
    /// First row of the own states of the latest ticks, the newest first, if the law looks back: one combination per tick, or position and velocity.
    pub(crate) past: usize,
}

/// Rows of the readings and of the force between two exchanges with a device.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) struct ExchangeRows {
    /// Row of the position of the device at the latest exchange, if readings are late; the row of the velocity follows.
    pub(crate) latest: Option<usize>,
    /// Row of the position of the reading that the coupling uses, if an exchange is not at each tick; the row of the velocity follows, then the row of the
    /// force that the device keeps.
    pub(crate) reading: Option<usize>,
}

impl ExchangeRows {
    /// Returns the rows from `first` on.
    fn of(exchange: Exchange, first: usize) -> Self {
        let latest = exchange.late.then_some(first);
        Self { latest, reading: exchange.holds().then_some(first + if exchange.late { 2 } else { 0 }) }
    }

    /// Reads the device with the row `device` at a tick, and returns the row of the position that the coupling uses.
    fn read(self, z: &mut Matrix, device: usize, exchanges: bool) -> usize {
        let source = self.latest.unwrap_or(device);
        let Some(reading) = self.reading else { return source };
        if exchanges {
            z.move_rows(source..source + 2, reading);
        }
        reading
    }

    /// Notes the device for the next exchange, if readings are late. After the forces of the tick, because the reading that they use may stand in the row.
    fn note(self, z: &mut Matrix, device: usize, exchanges: bool) {
        if let Some(latest) = self.latest.filter(|_| exchanges) {
            z.move_rows(device..device + 2, latest);
        }
    }

    /// Returns the number of rows.
    fn count(exchange: Exchange) -> usize {
        usize::from(exchange.late) * 2 + usize::from(exchange.holds()) * 3
    }
}

/// The units of the states.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Scale {
    /// Factor of velocities \[s\].
    pub time: f64,
    /// Factor of forces [m/N].
    pub compliance: f64,
}

impl Scale {
    /// Converts gains to gains of a velocity multiplied by the common time.
    pub fn gains(self, gains: Gains) -> Gains {
        Gains { stiffness: gains.stiffness, damping: gains.damping / self.time }
    }
}

/// Forces of a tick from outside the states, each a function of the unknowns: one entry per column \[N\].
#[derive(Clone, Copy, Debug, Default)]
pub struct External<'a> {
    /// The force of the hand on the device.
    pub hand: Option<&'a [f64]>,
    /// Replacement of the coupling's force.
    pub coupling: Option<&'a [f64]>,
    /// Replacement of the wall's force on the copy.
    pub wall: Option<&'a [f64]>,
}

/// Buffers of a tick, kept from tick to tick.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    coupling: Vec<f64>,
    on_object: Vec<f64>,
    memory: Matrix,
}

impl Scratch {
    /// Gives the buffers this number of columns.
    pub fn resize(&mut self, columns: usize) {
        self.coupling.resize(columns, 0.0);
        self.on_object.resize(columns, 0.0);
    }
}

impl Node {
    /// Returns the number of rows of the node's states.
    pub fn states(&self) -> usize {
        let bodies = if self.device.is_some() { 2 } else { 1 };
        let waiting = if self.compute_delay { bodies } else { 0 } + ExchangeRows::count(self.exchanges());
        2 * bodies + waiting + usize::from(self.has_wanted()) + self.law.memory.len() + self.past_rows()
    }

    /// Returns the exchanges with the device; at each tick for a node without a device.
    pub(crate) fn exchanges(&self) -> Exchange {
        if self.device.is_some() { self.exchange } else { Exchange::EACH_TICK }
    }

    /// Tells whether the wanted place of an operator's arm is a state of the node.
    fn has_wanted(&self) -> bool {
        self.operator.is_some_and(|operator| operator.has_wanted())
    }

    /// Returns the number of rows of the own states of the past.
    fn past_rows(&self) -> usize {
        self.looks_back() * if self.keeps_whole_past { 2 } else { 1 }
    }

    /// Returns the lag of the law in ticks; 0 if the gains of the past state are zero.
    pub fn looks_back(&self) -> usize {
        let Gains { stiffness, damping } = self.law.force.past;
        if stiffness + damping > 0.0 { self.law.lag } else { 0 }
    }

    /// Returns the divisor K + B/time of the combination (K·x + B·v)/(K + B/time) of a past own state, with the law's gains K and B of the past [N/m].
    pub fn past_unit(&self, time: f64) -> f64 {
        let Gains { stiffness, damping } = self.law.force.past;
        stiffness + damping / time
    }

    /// Returns the distance by which a translation of everything by 1 moves the row `row` of the node with the rows `rows`.
    pub fn displacement(&self, rows: Rows, row: usize, time: f64) -> f64 {
        if row == rows.object || [rows.device, rows.exchange.latest, rows.exchange.reading].contains(&Some(row)) {
            1.0
        } else if row >= rows.past && self.keeps_whole_past {
            if (row - rows.past).is_multiple_of(2) { 1.0 } else { 0.0 }
        } else if row >= rows.past {
            self.law.force.past.stiffness / self.past_unit(time)
        } else {
            0.0
        }
    }

    /// Returns the places of the node's rows from `first` on.
    pub fn rows(&self, first: usize) -> Rows {
        let device = self.device.map(|_| first);
        let object = first + if self.device.is_some() { 2 } else { 0 };
        let past = first + self.states() - self.past_rows();
        let memory = past - self.law.memory.len();
        let wanted = self.has_wanted().then(|| memory - 1);
        let pending = self.compute_delay.then_some(object + 2);
        let exchange = ExchangeRows::of(self.exchanges(), memory - usize::from(wanted.is_some()) - ExchangeRows::count(self.exchanges()));
        Rows { device, object, pending, exchange, wanted, memory, past }
    }

    /// Returns the compliance by which the node's forces become lengths: the motion of the copy by a unit force within the common time [m/N].
    pub fn compliance(&self, time: f64) -> f64 {
        self.object.short.1.coefficients().1[1] * time
    }

    /// Returns the largest sum of absolute values of a row of one tick's matrix, in the units of `scale`. Rounding errors grow by at most this factor per tick.
    pub(crate) fn step_norm(&self, scale: Scale) -> f64 {
        // A sample extrapolated without end counts by the gains alone.
        self.step_norm_up_to(scale, 0.0)
    }

    /// Returns the norm of `step_norm` with `oldest` \[s\] as the age of the oldest sample, for laws with unlimited extrapolation of samples.
    pub fn step_norm_up_to(&self, scale: Scale, oldest: f64) -> f64 {
        let gain = |gains: Gains| gains.stiffness.abs() + gains.damping.abs() / scale.time;
        let wall = self.wall.map_or(0.0, gain);
        // Samples are extrapolated up to the horizon at most.
        let oldest = self.law.horizon.map_or(0.0, |horizon| if horizon.is_finite() { horizon } else { oldest });
        let seen = |row: &LawRow| gain(row.own) + gain(row.past) + gain(row.heard) + row.ahead.abs() * oldest / scale.time;
        let remembered = |row: &LawRow| row.memory.iter().enumerate().map(|(place, by)| by.abs() / self.memory_unit(place, scale)).sum::<f64>();
        // A pull towards the mean has the same gains for the own state and the heard samples, hence the factor 2.
        let coordination = match self.law.pull() {
            Some(gains) => 2.0 * gain(gains),
            None => seen(&self.law.force) + remembered(&self.law.force),
        };
        let on_object = 2.0 * if self.device.is_some() { gain(self.coupling) } else { 0.0 } + coordination + wall;
        let row = |body: &Body, force: f64| {
            let (e, g, factor) = body.sizes(body.short.0);
            let position = 1.0 + e[0][0] + e[0][1] / scale.time + g[0] * force;
            let velocity = 1.0 + e[1][0] * scale.time + e[1][1] + g[1] * scale.time * force;
            factor * position.max(velocity)
        };
        let hand = self.operator.map_or(0.0, |operator| operator.force_norm());
        // A force that the device keeps is a length by the compliance.
        let kept = if self.exchanges().holds() { 1.0 / scale.compliance } else { 0.0 };
        let device = self.device.as_ref().map_or(0.0, |body| row(body, (2.0 * gain(self.coupling)).max(kept) + hand));
        let taken = if kept > 0.0 { 2.0 * gain(self.coupling) * scale.compliance } else { 0.0 };
        let wanted = self.operator.map_or(0.0, |operator| 1.0 + operator.tick * operator.crossover.abs());
        let memory = |(place, row): (usize, &LawRow)| (seen(row) + remembered(row)) * self.memory_unit(place, scale);
        let memory = self.law.memory.iter().enumerate().map(memory).fold(0.0, f64::max);
        row(&self.object, on_object).max(device).max(taken).max(wanted).max(memory)
    }

    /// Returns the factor by which number `place` of the law's memory becomes a length: the motion of the copy by the force of one unit of the number within
    /// the common time.
    pub fn memory_unit(&self, place: usize, scale: Scale) -> f64 {
        let by = self.law.force.memory[place].abs();
        // A remembered force acts for the whole common time, whereas a waiting force acts for a tick.
        let ticks = scale.time / self.object.short.0.as_secs_f64();
        scale.compliance * ticks * if by > 0.0 { by } else { 1.0 }
    }

    /// Makes one tick: computes the forces from the rows `z` and moves device and copy by `span`. `heard` returns the force on each row of the law from
    /// the held samples \[N\], the row of FT first. `external` has the forces from outside the states. `exchanges` tells whether the node exchanges with its
    /// device at this tick. Every row is a linear function of the same unknowns, one column each.
    #[expect(clippy::too_many_arguments, reason = "what a tick needs, each of its own kind")]
    pub fn tick<'a>(
        &self,
        z: &mut Matrix,
        rows: Rows,
        heard: impl Fn(usize) -> &'a [f64],
        external: External<'_>,
        (span, exchanges): (Duration, bool),
        scale: Scale,
        scratch: &mut Scratch,
    ) {
        let wall = self.wall.filter(|_| external.wall.is_none());
        let own = scale.gains(coordination_of(self.law.force.own, wall));
        let columns = z.columns();
        let Scratch { coupling, on_object, memory } = scratch;
        // All forces are computed from the state at the tick, before any body moves.
        {
            let target = heard(0);
            let (x, v) = (z.row(rows.object), z.row(rows.object + 1));
            for column in 0..columns {
                let copy = Motion { position: x[column], velocity: v[column] };
                on_object[column] = tick::on_object(0.0, tick::coordinate(&own, copy) - target[column]);
            }
        }
        if let Some(device) = rows.device {
            let reading = rows.exchange.read(z, device, exchanges);
            let (x, v) = (z.row(rows.object), z.row(rows.object + 1));
            let (xh, vh) = (z.row(reading), z.row(reading + 1));
            let gains = scale.gains(self.coupling);
            for column in 0..columns {
                let copy = Motion { position: x[column], velocity: v[column] };
                let grasp = || tick::grasp(&gains, Motion { position: xh[column], velocity: vh[column] }.relative_to(copy));
                coupling[column] = external.coupling.map_or_else(grasp, |force| force[column]);
                on_object[column] += coupling[column];
            }
            rows.exchange.note(z, device, exchanges);
        }
        for (force, wall) in on_object.iter_mut().zip(external.wall.unwrap_or_default()) {
            *force += wall;
        }
        // Past states and memory change here, before the copy moves, because both take in the state used by the forces of this tick.
        if self.looks_back() > 0 {
            self.look_back(z, rows, scale, on_object);
        }
        if !self.law.memory.is_empty() {
            self.remember(z, rows, heard, scale, (on_object, memory));
        }
        // With a delay of the computation the forces of the previous tick act now, and the new forces wait.
        if let Some(pending) = rows.pending {
            exchange(z.row_mut(pending), on_object, scale.compliance);
            if rows.device.is_some() {
                // The device gets the same coupling force as the copy, with the opposite sign, and moves after the force on the copy is known.
                exchange(z.row_mut(pending + 1), coupling, scale.compliance);
            }
        }
        if let Some(reading) = rows.exchange.reading {
            keep(z.row_mut(reading + 2), coupling, scale.compliance, exchanges);
        }
        advance(z, rows.object, &self.object.scaled_map(span, scale.time), on_object);
        if let (Some(first), Some(device)) = (rows.device, &self.device) {
            for (column, force) in coupling.iter_mut().enumerate() {
                *force = tick::on_device(external.hand.map_or(0.0, |hand| hand[column]), *force);
            }
            advance(z, first, &device.scaled_map(span, scale.time), coupling);
        }
    }
}

impl Node {
    /// Adds the force of the oldest own state to `on_object`, and stores the present own state in place of the oldest.
    fn look_back(&self, z: &mut Matrix, rows: Rows, scale: Scale, on_object: &mut [f64]) {
        let (count, unit, gains) = (self.looks_back(), self.past_unit(scale.time), scale.gains(self.law.force.past));
        if self.keeps_whole_past {
            // Past states stand newest first. The oldest acts now and drops out, all further states become older by one place, and the present state goes
            // first.
            let oldest = rows.past + 2 * (count - 1);
            let (x, v) = (z.row(oldest), z.row(oldest + 1));
            for (force, (x, v)) in on_object.iter_mut().zip(x.iter().zip(v)) {
                *force -= gains.stiffness * x + gains.damping * v;
            }
            z.move_rows(rows.past..oldest, rows.past + 2);
            for column in 0..z.columns() {
                z[(rows.past, column)] = z[(rows.object, column)];
                z[(rows.past + 1, column)] = z[(rows.object + 1, column)];
            }
            return;
        }
        for (force, oldest) in on_object.iter_mut().zip(z.row(rows.past + count - 1)) {
            *force -= unit * oldest;
        }
        z.move_rows(rows.past..rows.past + count - 1, rows.past + 1);
        let (stiffness, damping) = (gains.stiffness / unit, gains.damping / unit);
        for column in 0..z.columns() {
            z[(rows.past, column)] = stiffness * z[(rows.object, column)] + damping * z[(rows.object + 1, column)];
        }
    }

    /// Adds the force of the law's memory to `on_object`, and gives the memory its next values.
    fn remember<'a>(
        &self,
        z: &mut Matrix,
        rows: Rows,
        heard: impl Fn(usize) -> &'a [f64],
        scale: Scale,
        (on_object, next): (&mut [f64], &mut Matrix),
    ) {
        let columns = z.columns();
        for (place, by) in self.law.force.memory.iter().enumerate() {
            let share = by / self.memory_unit(place, scale);
            for (force, remembered) in on_object.iter_mut().zip(z.row(rows.memory + place)) {
                *force -= share * remembered;
            }
        }
        // A memory number is a length by its unit, so the force divides by the unit.
        // The next values are collected first, because every row may depend on all present values.
        next.reset(self.law.memory.len(), columns);
        for (row, law) in self.law.memory.iter().enumerate() {
            let unit = self.memory_unit(row, scale);
            let (x, v, heard) = (z.row(rows.object), z.row(rows.object + 1), heard(row + 1));
            let damping = law.own.damping / scale.time;
            for (column, next) in next.row_mut(row).iter_mut().enumerate() {
                *next = unit * (law.own.stiffness * x[column] + damping * v[column] - heard[column]);
            }
            for (place, by) in law.memory.iter().enumerate() {
                let share = unit * (by / self.memory_unit(place, scale));
                for (next, remembered) in next.row_mut(row).iter_mut().zip(z.row(rows.memory + place)) {
                    *next += share * remembered;
                }
            }
        }
        for row in 0..self.law.memory.len() {
            z.row_mut(rows.memory + row).copy_from_slice(next.row(row));
        }
    }

    /// Iterates over the forces on the rows of the law from a unit of number `channel` of a sample of age `age` \[s\], the row of FT first [N/m].
    pub fn heard(&self, sampling: Sampling, channel: usize, age: f64, time: f64) -> impl Iterator<Item = f64> {
        let age = self.law.horizon.map_or(0.0, |horizon| age.min(horizon));
        self.law.rows().map(move |row| sampling.heard(row, channel, age, time))
    }
}

impl Sampling {
    /// Returns the numbers of a sample used by the laws of the nodes: one number if all rows use multiples of the same combination, or hear nothing.
    pub fn of(nodes: &[Node]) -> Self {
        let heard = |row: &LawRow| (row.heard.stiffness != 0.0 || row.heard.damping != 0.0).then_some(row.heard);
        let rows = || nodes.iter().flat_map(|node| node.law.rows());
        let gains = rows().find_map(heard).unwrap_or(Gains { stiffness: 0.0, damping: 0.0 });
        #[expect(clippy::float_cmp, reason = "multiples of one another to the bit")]
        // Two pairs of gains are multiples if their cross product is zero. An extrapolated sample needs position and velocity separately.
        let is_multiple = |row: &LawRow| {
            row.ahead == 0.0
                && (row.heard == gains
                    || (row.heard.stiffness * gains.damping == row.heard.damping * gains.stiffness && row.heard.damping.is_finite()))
        };
        // An operator that looks at a sample sees the position alone, which is no combination of a law.
        let is_looked_at = nodes.iter().any(|node| node.operator.is_some_and(|operator| matches!(operator.sees, Seen::Held { .. })));
        if rows().all(is_multiple) && !is_looked_at { Self::Combined(gains) } else { Self::Whole }
    }
}

/// Returns the sum of both gains, because coordination and wall pull on the copy's own state alike.
pub(crate) fn coordination_of(coordination: Gains, wall: Option<Gains>) -> Gains {
    wall.map_or(coordination, |wall| Gains { stiffness: coordination.stiffness + wall.stiffness, damping: coordination.damping + wall.damping })
}

/// Exchanges forces: stores the new forces as lengths, and puts the forces stored a tick before into `force` \[N\].
fn exchange(stored: &mut [f64], force: &mut [f64], compliance: f64) {
    for (stored, force) in stored.iter_mut().zip(force) {
        let before = *stored / compliance;
        *stored = *force * compliance;
        *force = before;
    }
}

/// Stores the forces as lengths at an exchange. At other ticks replaces the forces by the forces of the latest exchange \[N\].
fn keep(kept: &mut [f64], force: &mut [f64], compliance: f64, exchanges: bool) {
    for (kept, force) in kept.iter_mut().zip(force) {
        if exchanges {
            *kept = *force * compliance;
        } else {
            *force = *kept / compliance;
        }
    }
}

fn advance(z: &mut Matrix, first: usize, map: &StepMap, force: &[f64]) {
    let (x, v) = z.two_rows_mut(first);
    for ((x, v), force) in x.iter_mut().zip(v).zip(force) {
        let mut body = Motion { position: *x, velocity: *v };
        map.advance(&mut body, *force);
        (*x, *v) = (body.position, body.velocity);
    }
}
