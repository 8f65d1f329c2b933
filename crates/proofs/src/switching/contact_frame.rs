//! One frame of a part of a scene in which the forces of its contacts are inputs.
//!
//! At a tick the force of a contact is zero if the contact is open, and the force of its spring and damper if the contact is closed. This module does not
//! decide between the two. The rows of a frame give the states after the frame, and the depth of every contact at each of its ticks, as linear functions of the
//! states at the beginning and of the forces.

use cohaptic_peer::Gains;
use cohaptic_stability::Matrix;
use cohaptic_stability::frames::{Instrument, Lifted, Rows};

/// The two bodies of a contact.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Kind {
    /// A device that pushes the copy to larger positions if `positive`, otherwise to smaller positions.
    Push { positive: bool },
    /// A copy and the walls at both ends of an axis.
    Wall,
}

/// A contact of a node.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Contact {
    /// Index of the node in the frame.
    pub(super) node: usize,
    pub(super) kind: Kind,
    pub(super) gains: Gains,
    /// `true` if an arm with a stiffness holds the device.
    pub(super) armed: bool,
}

impl Contact {
    /// Returns 1 if the depth grows with the position of the first body (the device of a push, the copy of a wall), and −1 otherwise.
    pub(super) const fn sign(&self) -> f64 {
        match self.kind {
            Kind::Push { positive: false } => -1.0,
            Kind::Push { positive: true } | Kind::Wall => 1.0,
        }
    }
}

/// The rows of a contact. The entries are coefficients of the states at the beginning of a frame, then of all inputs. Values of rows are lengths \[m\].
#[derive(Clone, PartialEq, Debug)]
pub(super) struct ContactRows {
    pub(super) contact: Contact,
    /// Column of the contact's first input. The contact has one input per tick: the force divided by the stiffness.
    pub(super) first: usize,
    /// Depth at each tick of the frame, then at the first tick of the next frame. The depth of a push is the position of the device relative to the copy in the
    /// direction of the push, the depth of a wall is the position of the copy.
    pub(super) depths: Vec<Vec<f64>>,
    /// Velocity of the depth, times B/K, at each tick of the frame.
    pub(super) rates: Vec<Vec<f64>>,
}

/// A frame with the forces of contacts as inputs.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct ContactFrame {
    /// States after the frame, one row per state. The columns are the states before the frame, then the inputs.
    pub(super) next: Matrix,
    /// Rows of the states on which only the depth of their own contact depends: the positions of devices that push and that no arm holds.
    pub(super) loose: Vec<usize>,
    pub(super) contacts: Vec<ContactRows>,
    /// Indices of contacts in the order of time, one entry per tick of a contact.
    pub(super) order: Vec<usize>,
    /// Row of the displacement in this frame of the reference, the position from which all other positions are measured; `None` if the scene is tied to ground.
    pub(super) reference: Option<Vec<f64>>,
    /// Upper bound of the error of every row: the sum of the absolute errors of the row's entries.
    pub(super) error: f64,
}

/// The instrument that makes the forces of contacts inputs of the frame, and records the depths of the contacts.
struct Touching {
    contacts: Vec<Contact>,
    /// Index of the first input of each contact.
    first: Vec<usize>,
    /// Number of inputs of all contacts.
    inputs: usize,
    /// Factor of velocities in the states \[s\].
    time: f64,
    /// Rows of the depths, indexed by contact, then by tick, over the unknowns of the frame.
    depths: Vec<Vec<Vec<f64>>>,
    /// Rows of the velocities of the depths, times B/K, with the indices of `depths`.
    rates: Vec<Vec<Vec<f64>>>,
    order: Vec<usize>,
}

impl Touching {
    /// Returns the row of the depth of a contact if `of` is 0, and of the velocity of the depth if `of` is 1.
    fn row(contact: &Contact, z: &Matrix, rows: Rows, of: usize) -> Vec<f64> {
        let copy = z.row(rows.object + of);
        match (contact.kind, rows.device) {
            (Kind::Wall, _) | (Kind::Push { .. }, None) => copy.to_vec(),
            (Kind::Push { .. }, Some(device)) => z.row(device + of).iter().zip(copy).map(|(device, copy)| contact.sign() * (device - copy)).collect(),
        }
    }
}

impl Instrument for Touching {
    fn inputs(&self) -> usize {
        self.inputs
    }

    fn touch(&mut self, node: usize, z: &Matrix, rows: Rows, [coupling, wall]: [&mut [f64]; 2]) -> [bool; 2] {
        coupling.fill(0.0);
        wall.fill(0.0);
        let mut acts = [false; 2];
        for (place, contact) in self.contacts.iter().enumerate().filter(|(_, contact)| contact.node == node) {
            // One depth per tick was recorded so far, so their number is the number of this tick.
            let input = self.first[place] + self.depths[place].len();
            match contact.kind {
                Kind::Push { .. } => {
                    // The input is the force divided by the stiffness, hence the stiffness as its coefficient.
                    coupling[input] = contact.sign() * contact.gains.stiffness;
                    acts[0] = true;
                }
                Kind::Wall => {
                    wall[input] = -contact.gains.stiffness;
                    acts[1] = true;
                }
            }
            self.order.push(place);
            // The states hold velocities times `time`, the rates are velocities times B/K.
            let share = contact.gains.damping / contact.gains.stiffness / self.time;
            self.depths[place].push(Self::row(contact, z, rows, 0));
            self.rates[place].push(Self::row(contact, z, rows, 1).iter().map(|entry| share * entry).collect());
        }
        acts
    }
}

impl ContactFrame {
    /// Returns the frame of `lifted` with the forces of `contacts` as inputs.
    pub(super) fn new(lifted: &Lifted<'_>, contacts: Vec<Contact>) -> Self {
        let ticks = lifted.ticks();
        let mut inputs = 0;
        let mut first = Vec::with_capacity(contacts.len());
        for contact in &contacts {
            first.push(inputs);
            inputs += ticks[contact.node];
        }
        let none = vec![Vec::new(); contacts.len()];
        let mut touching = Touching { contacts, first, inputs, time: lifted.time, depths: none.clone(), rates: none, order: Vec::new() };
        let mut map = lifted.frame(&mut touching);
        let rows = lifted.rows();
        // The position of a device with an arm is measured from the arm's rest, not from the reference copy.
        for contact in touching.contacts.iter().filter(|contact| contact.armed) {
            rows[contact.node].device.iter().for_each(|device| map.tie(*device));
        }
        let Touching { contacts, first, depths, rates, order, .. } = touching;
        let (places, _) = map.places(inputs);
        let next = map.driven(inputs);
        let placed = |row: &[f64]| {
            let mut entries = vec![0.0; next.columns()];
            places.iter().zip(row).for_each(|(place, entry)| entries[*place] += entry);
            entries
        };
        let seen = contacts.iter().zip(first).zip(depths.iter().zip(&rates)).map(|((contact, first), (depths, rates))| {
            // The depth at the next frame's first tick follows from the states at the end of this frame.
            let last = Touching::row(contact, &map.states, rows[contact.node], 0);
            ContactRows {
                contact: *contact,
                first: next.rows() + first,
                depths: depths.iter().chain([&last]).map(|row| placed(row)).collect(),
                rates: rates.iter().map(|row| placed(row)).collect(),
            }
        });
        // The row of the reference is left out of `next`, so the rows after the reference move up by one.
        let state = |row: usize| row - usize::from(map.reference().is_some_and(|reference| reference < row));
        let free = contacts.iter().filter(|contact| !contact.armed && contact.kind != Kind::Wall);
        let loose = free.filter_map(|contact| rows[contact.node].device.map(state)).collect();
        Self { contacts: seen.collect(), loose, order, reference: map.reference().map(|row| placed(map.states.row(row))), error: map.error, next }
    }
}
