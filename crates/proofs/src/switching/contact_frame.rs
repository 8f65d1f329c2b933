//! One frame of a part of a scene in which the forces of its contacts are inputs.
//!
//! A contact that is open at a tick has the force zero, one that is closed that of its spring and damper: which of them is left open here. Rows say where the frame
//! leads, and how deep every contact is at each of its ticks, as linear functions of the states at the beginning and of the forces.

use cohaptic_peer::Gains;
use cohaptic_stability::Matrix;
use cohaptic_stability::frames::{Instrument, Lifted, Rows};

/// What a contact is between.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Kind {
    /// A device that pushes the copy to larger positions, or to smaller ones.
    Push { positive: bool },
    /// A copy and the walls at both ends of an axis.
    Wall,
}

/// A contact of a node.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Contact {
    pub(super) node: usize,
    pub(super) kind: Kind,
    pub(super) gains: Gains,
    /// Whether an arm with a stiffness holds the device.
    pub(super) armed: bool,
}

impl Contact {
    /// 1 where a larger position of the first body is deeper; −1 otherwise.
    pub(super) const fn sign(&self) -> f64 {
        match self.kind {
            Kind::Push { positive: false } => -1.0,
            Kind::Push { positive: true } | Kind::Wall => 1.0,
        }
    }
}

/// The rows of a contact, over the states at the beginning of a frame and then all inputs. Lengths \[m\].
#[derive(Clone, PartialEq, Debug)]
pub(super) struct ContactRows {
    pub(super) contact: Contact,
    /// The first of its inputs, one a tick: its force divided by its stiffness.
    pub(super) first: usize,
    /// The position of the device relative to the copy in the direction of the push, or that of the copy of a wall, at each tick and the first of the next frame.
    pub(super) depths: Vec<Vec<f64>>,
    /// The velocity of the same, times B/K, at each tick.
    pub(super) rates: Vec<Vec<f64>>,
}

/// A frame with the forces of contacts as inputs.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct ContactFrame {
    /// The states after the frame, a row each, over the states before it and then the inputs.
    pub(super) next: Matrix,
    /// The states that nothing but their own contact depends on, through its depth alone: positions of devices that no arm holds.
    pub(super) loose: Vec<usize>,
    pub(super) contacts: Vec<ContactRows>,
    /// The contacts in the order in which their ticks come, one entry a tick.
    pub(super) order: Vec<usize>,
    /// How far the position moves that all others are relative to, if there is one.
    pub(super) reference: Option<Vec<f64>>,
    /// A bound of the error of every row, as the sum of the sizes of its entries' errors.
    pub(super) error: f64,
}

/// Sets the forces of contacts, and notes where they are.
struct Touching {
    contacts: Vec<Contact>,
    /// The first input of each, and their number.
    first: Vec<usize>,
    inputs: usize,
    time: f64,
    /// By contact and tick, over the unknowns of the frame.
    depths: Vec<Vec<Vec<f64>>>,
    rates: Vec<Vec<Vec<f64>>>,
    order: Vec<usize>,
}

impl Touching {
    /// The depth of a contact, or the velocity of that if `of` is 1.
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
            let input = self.first[place] + self.depths[place].len();
            match contact.kind {
                Kind::Push { .. } => {
                    coupling[input] = contact.sign() * contact.gains.stiffness;
                    acts[0] = true;
                }
                Kind::Wall => {
                    wall[input] = -contact.gains.stiffness;
                    acts[1] = true;
                }
            }
            self.order.push(place);
            let share = contact.gains.damping / contact.gains.stiffness / self.time;
            self.depths[place].push(Self::row(contact, z, rows, 0));
            self.rates[place].push(Self::row(contact, z, rows, 1).iter().map(|entry| share * entry).collect());
        }
        acts
    }
}

impl ContactFrame {
    /// A frame with those contacts.
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
        // A device that an arm holds stands relative to that, not to the copy that all others are relative to.
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
            let last = Touching::row(contact, &map.states, rows[contact.node], 0);
            ContactRows {
                contact: *contact,
                first: next.rows() + first,
                depths: depths.iter().chain([&last]).map(|row| placed(row)).collect(),
                rates: rates.iter().map(|row| placed(row)).collect(),
            }
        });
        // Rows after the one that is left out stand one before.
        let state = |row: usize| row - usize::from(map.reference().is_some_and(|reference| reference < row));
        let free = contacts.iter().filter(|contact| !contact.armed && contact.kind != Kind::Wall);
        let loose = free.filter_map(|contact| rows[contact.node].device.map(state)).collect();
        Self { contacts: seen.collect(), loose, order, reference: map.reference().map(|row| placed(map.states.row(row))), error: map.error, next }
    }
}
