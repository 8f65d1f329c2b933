//! The frames, groups of contacts and stable parts of a scene along one axis, for the inequality and the certificate.

use cohaptic_stability::frames::{Lifted, Node, Sampling, Structure, Timetable, lifted_part};
use cohaptic_stability::numerics::real;
use cohaptic_stability::{Matrix, Method, PartKind, Watch};

use super::along::Along;
use super::contact_frame::{Contact, ContactFrame, Kind};
use super::error::SwitchingError;
use super::products::{Group, PartFrame, inequality};
use crate::boxes::{PartCertificate, stable_difference};
use crate::inequality::Inequality;

/// Largest number of rows of an inequality. The search for an inequality of this size takes some ten seconds.
const MOST_ROWS: usize = 150;

/// All parts of a scene along one axis.
pub(super) struct Asked {
    groups: Vec<Group>,
    /// Parts with contacts: the frame, the group of each contact of the frame, and whether the part is about differences of equal peers.
    pub(super) frames: Vec<(ContactFrame, Vec<usize>, bool)>,
    /// Indexed as `frames`: the class of the differences (`None`: the averages), and the number of sample values of earlier frames in the states, indexed by
    /// class of the part.
    pub(super) parts: Vec<(Option<usize>, Vec<usize>)>,
    pub(super) sampling: Sampling,
    /// Factor of velocities in the states \[s\].
    pub(super) time: f64,
    /// `true` if positions are absolute, not relative to a reference copy.
    pub(super) tied: bool,
    /// `true` if every part without contacts is stable.
    rest_is_stable: bool,
    /// Certificates of the parts without contacts, if a certificate exists.
    pub(super) rest: Vec<PartCertificate>,
}

impl Asked {
    pub(super) fn of(along: &Along<'_>, structure: &Structure, nodes: &[Node], watch: &dyn Watch) -> Result<Self, SwitchingError> {
        let quotient = structure.quotient(along.scene, nodes);
        let (mut contacts, mut groups) = (Vec::new(), Vec::new());
        let ticks = quotient.ticks();
        for (class, members) in structure.classes.iter().enumerate() {
            for contact in along.of_class(structure, class, class, true)? {
                let is_wall = contact.kind == Kind::Wall;
                // A spring to ground pulls a copy or an armed device back to its rest, and at rest a push or a wall may be open.
                let has_rest = structure.tied && (is_wall || contact.armed);
                groups.push(Group { ticks: ticks[class], members: real(members.len()), is_wall, has_rest });
                contacts.push(contact);
            }
        }
        let history: usize = structure.timetable.depth.iter().sum::<usize>() * quotient.sampling.channels();
        let states = nodes.iter().map(Node::states).sum::<usize>() + history;
        let ticks = groups.iter().map(|group| group.ticks).sum::<usize>();
        // The size is known before any matrix is made, so a scene beyond the limit costs nothing.
        let rows = states + 2 * ticks + groups.len();
        if rows > MOST_ROWS {
            return Err(SwitchingError::TooLarge { ticks, states, rows, most: MOST_ROWS });
        }
        let history = |timetable: &Timetable| timetable.depth.iter().map(|depth| depth * quotient.sampling.channels()).collect::<Vec<_>>();
        let mut asked = Self {
            frames: vec![(ContactFrame::new(&quotient, contacts.clone()), (0..groups.len()).collect(), false)],
            parts: vec![(None, history(&structure.timetable))],
            groups,
            rest_is_stable: true,
            rest: Vec::new(),
            sampling: quotient.sampling,
            time: quotient.time,
            tied: structure.tied,
        };
        for class in 0..structure.classes.len() {
            let Some(timetable) = &structure.apart[class] else { continue };
            let weight = Matrix::from_fn(1, 1, |_, _| structure.difference_weight());
            let lifted = Lifted { nodes: &nodes[class..=class], weights: &weight, timetable, tied: true, ..quotient };
            let own: Vec<usize> = (0..contacts.len()).filter(|contact| contacts[*contact].node == class).collect();
            // A part without contacts is linear. Its verdict follows from its radius alone, and no product of contacts refers to it.
            if own.is_empty() {
                let part = lifted_part(&lifted, PartKind::Apart { peer: structure.classes[class][0] }, 1, Method::Reduced, watch)?;
                asked.rest_is_stable &= part.radius.value + part.radius.error < 1.0;
                asked.rest.extend(stable_difference(
                    &structure.classes[class],
                    &nodes[class],
                    structure.difference_weight(),
                    timetable,
                    quotient.time,
                ));
                continue;
            }
            let at_zero = own.iter().map(|contact| Contact { node: 0, ..contacts[*contact] }).collect();
            asked.frames.push((ContactFrame::new(&lifted, at_zero), own, true));
            asked.parts.push((Some(class), history(timetable)));
        }
        Ok(asked)
    }

    /// Returns whether the inequality takes some contact to be open at rest.
    pub(super) fn takes_rest(&self) -> bool {
        self.groups.iter().any(|group| group.has_rest)
    }

    /// Returns the inequality of all parts with contacts, or `None` if a part without contacts is not stable or the inequality has no finite form.
    pub(super) fn inequality(&self) -> Option<Inequality> {
        let parts: Vec<PartFrame<'_>> =
            self.frames.iter().map(|(frame, groups, is_apart)| PartFrame { frame, groups, is_apart: *is_apart }).collect();
        self.rest_is_stable.then(|| inequality(&parts, &self.groups)).flatten()
    }
}
