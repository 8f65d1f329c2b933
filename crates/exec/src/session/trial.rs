//! Plans of trials: the same commands over other links.

use std::sync::Arc;

use cohaptic_linkfile::LinkTable;
use cohaptic_wan::LinkModel;

use super::{LinkReport, Plan, Report};
use crate::lost::{LostPacket, LostPackets};
use crate::search::Trial;

impl Plan {
    /// Returns the plan of a trial.
    #[must_use]
    pub fn of_trial(&self, trial: Trial<'_>) -> Self {
        match trial {
            Trial::Ideal => self.with_links(|_, _| LinkModel::default()),
            Trial::Seed(seed) => Self { seed, ..self.clone() },
            Trial::Case(case) => Self { seed: case.seed, ..self.losing(&case.lost) },
        }
    }

    /// Returns the plan with links that lose these packets, and none by the key `loss`. Losses of replays, recorded traces and listed impairments stay.
    #[must_use]
    pub fn losing(&self, lost: &LostPackets) -> Self {
        self.with_links(|from, to| self.links.between(from, to).with_loss(&lost.on_link(from, to)))
    }

    fn with_links(&self, link: impl Fn(usize, usize) -> LinkModel) -> Self {
        let nodes = self.links.peers();
        // A table leaves out the pairs of a node with itself.
        let pairs = (0..nodes).flat_map(|from| (0..nodes).map(move |to| (from, to)));
        let links = pairs.map(|(from, to)| ((from, to), Arc::new(link(from, to))));
        Self { links: LinkTable::new(nodes, Arc::default(), links), ..self.clone() }
    }
}

impl Report {
    /// Returns the packets that the links have dropped: of each link the first 1000.
    #[must_use]
    pub fn lost(&self) -> LostPackets {
        let packets = |link: &LinkReport| {
            let (from, to) = (link.from, link.to);
            link.dropped.iter().map(move |&number| LostPacket { from, to, number }).collect::<Vec<_>>()
        };
        self.links.iter().flat_map(packets).collect()
    }
}

#[cfg(test)]
mod tests {
    use core::time::Duration;

    use cohaptic_linkfile::link_from_keys;
    use cohaptic_realtime::{Pacing, Tolerance, Wishes};
    use cohaptic_wan::Loss;

    use super::*;
    use crate::search::Case;
    use crate::{GatewayPlan, HostPlan, Output, Setup};

    /// A loopback is linked with its host, and not with the world.
    #[test]
    fn a_loopback_is_linked_with_its_host_alone() {
        let host = |loopback| HostPlan {
            name: "command".to_owned(),
            setup: Setup { loopback, ..Setup::default() },
            command: Vec::new(),
            is_main: true,
            ready: None,
            output: Output::Lines,
        };
        let plan = |loopback| Plan {
            hosts: vec![host(loopback)],
            gateway: Some(GatewayPlan { name: "world".to_owned(), name_server: None, listen: Vec::new() }),
            links: LinkTable::uniform(3, LinkModel::default()),
            ..empty()
        };
        let linked = |plan: &Plan| {
            let pairs = (0..4).flat_map(|from| (0..4).map(move |to| (from, to)));
            pairs.filter(|(from, to)| plan.has_link(*from, *to)).collect::<Vec<_>>()
        };
        assert_eq!((plan(true).nodes(), linked(&plan(true))), (vec!["command", "world", "loopback"], vec![(0, 1), (0, 2), (1, 0), (2, 0)]));
        assert_eq!((plan(false).nodes(), linked(&plan(false))), (vec!["command", "world"], vec![(0, 1), (1, 0)]));
    }

    fn empty() -> Plan {
        Plan {
            seed: 1,
            hosts: Vec::new(),
            gateway: None,
            links: LinkTable::uniform(2, LinkModel::default()),
            pacing: Pacing::Sleep,
            wishes: Wishes::NONE,
            tolerance: Tolerance { limit: Duration::from_millis(1) },
            captures: None,
        }
    }

    /// Chosen losses stand in the place of losses by chance, and all else of each link stays.
    #[test]
    fn a_trial_changes_losses_and_seed_alone() {
        let link = |keys: &[&str]| link_from_keys(&keys.iter().map(|key| (*key).to_owned()).collect::<Vec<_>>()).unwrap();
        let (there, back) = (link(&["delay=5ms", "loss=50%"]), link(&["delay=6ms", "jitter=1ms", "loss=1%"]));
        let plan = Plan { links: LinkTable::new(2, Arc::new(there.clone()), [((1, 0), Arc::new(back.clone()))]), ..empty() };
        let lost: LostPackets = [LostPacket { from: 0, to: 1, number: 3 }].into_iter().collect();
        let case = plan.of_trial(Trial::Case(&Case { seed: 9, lost: lost.clone() }));
        assert_eq!(
            (case.seed, case.links.between(0, 1), case.links.between(1, 0)),
            (9, &there.with_loss(&lost.on_link(0, 1)), &back.with_loss(&Loss::None))
        );
        assert_ne!(case.links.between(0, 1), &there);
        let seed = plan.of_trial(Trial::Seed(4));
        assert_eq!((seed.seed, seed.links), (4, plan.links.clone()));
        let ideal = plan.of_trial(Trial::Ideal);
        assert_eq!((ideal.links.between(0, 1), ideal.links.between(1, 0)), (&LinkModel::default(), &LinkModel::default()));
    }
}
