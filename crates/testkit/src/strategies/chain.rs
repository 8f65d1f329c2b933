//! Chains that lose as much in the long run as they should.

use cohaptic_wan::netem::{LossSpec, Netem};

use super::admits::{SLACK, long_run};
use super::link::ImpairedLink;

/// The chain whose way into bursts, up to `most` ten-thousandths of a percent, makes it lose that share in the long run, which grows with it; `None` if
/// none does to half of what it may miss by.
pub(super) fn fitting(share: u64, most: u64, chain: impl Fn(u64) -> LossSpec) -> Option<LossSpec> {
    let lost = |p: u64| {
        let netem = Netem { loss: Some(chain(p)), ..Netem::default() };
        ImpairedLink::new(netem).ok().as_ref().and_then(long_run)
    };
    let (mut low, mut high) = (1, most);
    while low < high {
        let middle = low.midpoint(high);
        if lost(middle)? < share {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    lost(low).filter(|lost| lost.abs_diff(share) <= SLACK / 2).map(|_| chain(low))
}
