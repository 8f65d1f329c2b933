//! Enumeration of the combinations of open and closed contacts. In each combination the scene is linear.

use cohaptic_peer::Contact;
use cohaptic_scene::Scene;

use crate::AnalysisError;
use crate::pieces::{self, Piece};
use crate::structure::Contacts;

/// One combination of open and closed contacts, and the number of equal axes that it describes.
#[derive(Clone, Debug)]
pub struct Combination {
    /// The contacts that are closed.
    pub contacts: Contacts,
    pub(crate) axes: usize,
    /// Name of the motion, as in [`ContactMode::motion`](crate::ContactMode::motion).
    pub(crate) motion: String,
    pub(crate) words: String,
}

impl Combination {
    /// Returns the motion and the contacts, in words; empty for a linear scene.
    #[must_use]
    pub fn name(&self) -> String {
        let between = if self.motion.is_empty() || self.words.is_empty() { "" } else { ": " };
        format!("{}{between}{}", self.motion, self.words)
    }
}

/// Largest number of combinations of one piece; a piece with more is refused.
const MOST: u128 = 4096;

/// Returns every combination of contacts of a piece.
///
/// # Errors
///
/// [`AnalysisError::TooManyModes`] for more than [`MOST`] combinations.
pub(crate) fn combinations(piece: &Piece<'_>) -> Result<Vec<Combination>, AnalysisError> {
    let Piece { scene, axes: copies, motion, absent } = piece;
    let grasping = |peer: usize| scene.peers[peer].contact == Contact::Grasp;
    let pushing_along = |axis: usize| -> Vec<usize> {
        let pushes = |peer: &usize| matches!(scene.peers[*peer].contact, Contact::Push(direction) if direction.axis == axis);
        (0..scene.peers.len()).filter(pushes).collect()
    };
    let axes = scene.axes.count();
    let walls = if scene.object.enclosure.is_some() { vec![false, true] } else { vec![false] };
    // The exponent is limited so that the shift stays within 128 bits; 2^100 combinations are refused anyway.
    let count = (0..axes).map(|axis| pushing_along(axis).len()).fold(0_u128, |sum, pushing| sum.saturating_add(1_u128 << pushing.min(100)));
    if count.saturating_mul(walls.len() as u128) > MOST {
        return Err(AnalysisError::TooManyModes { modes: count.saturating_mul(walls.len() as u128), most: MOST });
    }
    let linear = (0..axes).all(|axis| pushing_along(axis).is_empty());
    let mut all = Vec::new();
    for at_wall in walls {
        let wall = if !at_wall { "" } else { "every copy at a wall" };
        if linear {
            let touching = (0..scene.peers.len()).map(grasping).collect();
            let contacts = Contacts { touching, at_wall, absent: absent.clone() };
            all.push(Combination { contacts, axes: *copies, motion: motion.clone(), words: wall.to_owned() });
            continue;
        }
        for axis in 0..axes {
            let pushing = pushing_along(axis);
            for closed in 0..1_u64 << pushing.len() {
                let touches =
                    |peer: usize| grasping(peer) || pushing.iter().position(|pushing| *pushing == peer).is_some_and(|place| closed >> place & 1 == 1);
                let touching: Vec<bool> = (0..scene.peers.len()).map(touches).collect();
                let names: Vec<&str> = pushing.iter().filter(|peer| touching[**peer]).map(|peer| scene.peers[*peer].name.as_str()).collect();
                let mut words = if axes > 1 { format!("along {}: ", ["x", "y", "z"][axis]) } else { String::new() };
                words.push_str(&if names.is_empty() { "nobody pushes".to_owned() } else { format!("pushing: {}", names.join(", ")) });
                if at_wall {
                    words.push_str("; every copy at a wall");
                }
                let contacts = Contacts { touching, at_wall, absent: absent.clone() };
                // In a scene of several axes each axis has separate combinations, so a combination stands for its own axis only.
                all.push(Combination { contacts, axes: copies / axes, motion: motion.clone(), words });
            }
        }
    }
    Ok(all)
}

/// Returns each piece with each of its combinations of contacts. `combines` becomes true if a piece has several combinations.
///
/// # Errors
///
/// [`AnalysisError::TooManyModes`] if a piece has too many combinations.
pub fn pairs<'p, 's>(pieces: &'p [Piece<'s>], combines: &mut bool) -> Result<Vec<(&'p Piece<'s>, Combination)>, AnalysisError> {
    let mut pairs = Vec::new();
    for piece in pieces {
        let combinations = combinations(piece)?;
        *combines |= combinations.len() > 1;
        pairs.extend(combinations.into_iter().map(|combination| (piece, combination)));
    }
    Ok(pairs)
}

/// Returns the combinations of contacts of all pieces of a scene, for the general path.
pub(crate) fn whole(scene: &Scene) -> Result<Vec<Combination>, AnalysisError> {
    let mut all = Vec::new();
    for piece in pieces::pieces_with_operators(scene, "the matrix")? {
        all.extend(combinations(&piece)?);
    }
    Ok(all)
}
