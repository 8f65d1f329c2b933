//! The differences of equal peers from their average, at a single point of the numbers instead of a box.

use cohaptic_stability::Matrix;
use cohaptic_stability::frames::{Node, Timetable};

use super::certificate::PartCertificate;
use super::corners::{self, Common, Point};
use super::discs;
use super::guarantee::Proven;
use super::steps::Plans;

/// Returns the certificate of the differences between the members of a class, or `None` if these are not proven stable. `members` are places in the scene,
/// `weight` is the weight with which a difference hears itself, and velocities are multiplied by `time` \[s\].
pub(crate) fn stable_difference(members: &[usize], node: &Node, weight: f64, timetable: &Timetable, time: f64) -> Option<PartCertificate> {
    let nodes = vec![node.clone()];
    // One point is a box without width: no number varies.
    let points = [Point { nodes: nodes.clone(), weights: Matrix::from_fn(1, 1, |_, _| weight) }];
    let common = Common { timetable, plans: &Plans::default(), tied: true, time };
    let decision = discs::decide(&corners::steps(&points, &[nodes], common).ok()?.product())?;
    let part = PartCertificate::new(vec![members.to_vec()], true, corners::states(&points, common).ok()?, time, &decision.witness);
    (decision.proven == Proven::Stable).then_some(part)
}
