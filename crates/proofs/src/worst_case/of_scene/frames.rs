//! The matrix of one frame with losses and delays of samples.
//!
//! The frame has the nodes, ticks and samplings of the nominal analysis. The symbol decides the samples of a receiver and their ticks. The sample that a
//! receiver holds at the beginning is a separate unknown, because the sample may be of any age. The state is the state of the nominal analysis, then the newest
//! samples of each node, then the sample held on each link.

use cohaptic_stability::Matrix;
use cohaptic_stability::frames::{Autonomous, Event, Lifted, Timetable};

use super::channel::{Channel, Link};

/// Part of a scene: nodes, and the links between these nodes, with losses and delays.
pub(super) struct Block<'a> {
    /// Nodes and timetable of a frame. The deliveries of the timetable are replaced.
    pub lifted: Lifted<'a>,
    /// Indexed by channel: each link of the channel in this part, with its index in the channel; the ends are nodes of this part.
    pub links: Vec<Vec<(usize, Link)>>,
}

/// A delivered sample.
struct Delivery {
    from: usize,
    to: usize,
    tick: usize,
    /// Number of frames since the frame of the sending.
    age: usize,
}

impl Block<'_> {
    /// Returns one matrix for each joint symbol of the channels, with the first channel as the most significant digit, and an upper bound of the errors of
    /// their entries, as the largest sum over a row.
    pub(super) fn matrices(&self, channels: &[Channel]) -> (Vec<Matrix>, f64) {
        let count: usize = channels.iter().map(|channel| channel.symbols.len()).product();
        let mut error = 0.0_f64;
        let matrix = |joint: usize| {
            let (matrix, own) = self.matrix(channels, joint);
            error = error.max(own);
            matrix
        };
        let matrices = (0..count).map(matrix).collect();
        (matrices, error)
    }

    fn matrix(&self, channels: &[Channel], joint: usize) -> (Matrix, f64) {
        let links: Vec<Link> = self.links.iter().flatten().map(|(_, link)| *link).collect();
        let mut depth = vec![0; self.lifted.nodes.len()];
        for link in &links {
            depth[link.from] = depth[link.from].max(link.oldest);
        }
        let (mut deliveries, mut rest) = (Vec::new(), joint);
        // The first channel is the most significant digit of the joint symbol, so the digits come off from the last channel on.
        for (channel, own) in channels.iter().zip(&self.links).rev() {
            let symbol = &channel.symbols[rest % channel.symbols.len()];
            rest /= channel.symbols.len();
            for (place, link) in own {
                let delivery = |tick: usize, age: usize| Delivery { from: link.from, to: link.to, tick, age };
                // The older sample first, so that the receiver holds the newer sample if both arrive at one tick.
                deliveries.extend(symbol.late[*place].map(|tick| delivery(tick, link.age + 1)));
                deliveries.extend(symbol.now[*place].map(|tick| delivery(tick, link.age)));
            }
        }
        // The frame knows a held sample as a sample of its sender with an age beyond all ages in use, one such age per receiver.
        let timetable = timetable(self.lifted.timetable, &links, &deliveries, &depth);
        let frame = Lifted { timetable: &timetable, ..self.lifted }.frame(&mut Autonomous);
        if self.lifted.sampling.is_silent(self.lifted.time) {
            // Samples have no part in the motion, so the state needs none.
            return (frame.monodromy(), frame.error);
        }

        let states = frame.state_unknowns();
        let mut first = Vec::with_capacity(depth.len());
        let mut size = states;
        for depth in &depth {
            first.push(size);
            size += depth;
        }
        let held = size;
        size += links.len();
        // The age of a held sample in the timetable is beyond `depth` by one and the receiver's number, see `timetable`.
        let unknown = |column: usize| -> Option<usize> {
            if column < states {
                return Some(column);
            }
            let (node, age) = *frame.used.get(column - states)?;
            if age <= depth[node] {
                return Some(first[node] + age - 1);
            }
            links.iter().position(|link| link.from == node && link.to == age - depth[node] - 1).map(|place| held + place)
        };
        let columns: Vec<usize> = (0..states + frame.used.len()).map_while(unknown).collect();
        let mut matrix = Matrix::zeros(size, size);
        // A row is a combination of the unknowns, or an unknown without change (`same`), less `moved` times the displacement of the reference.
        let mut put = |row: usize, source: &[f64], same: Option<usize>, moved: f64| {
            for (column, entry) in columns.iter().zip(source) {
                matrix[(row, *column)] += entry;
            }
            if let Some(reference) = frame.reference() {
                for (column, entry) in columns.iter().zip(frame.states.row(reference)) {
                    matrix[(row, *column)] -= moved * entry;
                }
            }
            if let Some(same) = same {
                matrix[(row, same)] += 1.0;
            }
        };
        let kept = (0..frame.states.rows()).filter(|row| Some(*row) != frame.reference());
        for (row, source) in kept.enumerate() {
            put(row, frame.states.row(source), None, frame.displacement(source));
        }
        for (node, depth) in depth.iter().enumerate() {
            for age in 1..=*depth {
                let row = first[node] + age - 1;
                // Samples grow older by one frame: age 1 is the sample sent now, and each older row takes the row before.
                match age {
                    1 => put(row, frame.sent.row(frame.sent_by(node).start), None, frame.translation(1)),
                    _ => put(row, &[], Some(row - 1), frame.translation(1)),
                }
            }
        }
        for (place, link) in links.iter().enumerate() {
            let newest = deliveries.iter().filter(|delivery| (delivery.from, delivery.to) == (link.from, link.to)).map(|delivery| delivery.age).min();
            // The youngest delivery of a frame is held at its end. Without a delivery the held sample stays.
            match newest {
                Some(0) => put(held + place, frame.sent.row(frame.sent_by(link.from).start), None, frame.translation(1)),
                Some(age) => put(held + place, &[], Some(first[link.from] + age - 1), frame.translation(1)),
                None => put(held + place, &[], Some(held + place), frame.translation(1)),
            }
        }
        (matrix, frame.error)
    }
}

/// Returns the timetable `nominal` with `deliveries` instead of its own deliveries.
fn timetable(nominal: &Timetable, links: &[Link], deliveries: &[Delivery], depth: &[usize]) -> Timetable {
    let number = |age: usize| -i64::try_from(age).unwrap_or(i64::MAX);
    let mut ticks = vec![0; nominal.sent.len()];
    let mut events = Vec::with_capacity(nominal.events.len() + deliveries.len());
    for event in &nominal.events {
        match *event {
            Event::Sample { .. } => events.push(*event),
            Event::Deliver { .. } => {}
            // A delivery matters from the receiver's next tick on.
            Event::Tick { node, .. } => {
                let now = deliveries.iter().filter(|delivery| delivery.to == node && delivery.tick == ticks[node]);
                events.extend(now.map(|delivery| Event::Deliver { from: delivery.from, to: node, sample: number(delivery.age) }));
                events.push(*event);
                ticks[node] += 1;
            }
        }
    }
    let held = links.iter().map(|link| (link.to, link.from, number(depth[link.from] + 1 + link.to))).collect();
    Timetable { frame: nominal.frame, events, sent: nominal.sent.clone(), depth: depth.to_vec(), held, clocks: nominal.clocks.clone() }
}
