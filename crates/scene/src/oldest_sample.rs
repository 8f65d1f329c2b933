//! How old the samples in use are at most, where the links of a scene bound it.

use core::time::Duration;

use cohaptic_peer::coordination::LawValue;
use cohaptic_wan::{Counts, Layout, LinkConfig, LinkModel, Loss, Order};

use crate::{ChangeKind, Scene};

impl Scene {
    /// How many ticks old a sample in use is at most: ⌈delay/Tc⌉ + M − 1 + M·(longest run of lost packets), of the slowest link and the worst pattern, with M
    /// ticks from sample to sample.
    ///
    /// `None` where the links bound no such age or do not keep it: anything but constant delays and patterns of lost packets, changes of links in the
    /// timeline, peers whose clocks differ, dead bands.
    #[must_use]
    pub fn oldest_sample(&self) -> Option<u64> {
        let clock = self.peers[0].clock;
        let is_link_change = |what: &ChangeKind| matches!(what, ChangeKind::Link(_) | ChangeKind::AllLinks(_));
        // A sample that is not sent leaves the one before it in use.
        let thinned = self.coordination.send_when.is_some();
        if thinned || self.peers.iter().any(|peer| peer.clock != clock) || self.timeline.iter().any(|change| is_link_change(&change.what)) {
            return None;
        }
        let line = |model: Option<&LinkModel>| {
            model.map_or(Some(Duration::ZERO), |model| bounded(model).filter(|(_, run)| *run == 0).map(|(delay, _)| delay))
        };
        let (mut up, mut down) = (Duration::ZERO, Duration::ZERO);
        for peer in &self.peers {
            up = up.max(line(peer.uplink.as_ref())?);
            down = down.max(line(peer.downlink.as_ref())?);
        }
        let (mut slowest, mut longest) = (Duration::ZERO, 0);
        for model in self.links.configs() {
            let (delay, run) = bounded(model)?;
            (slowest, longest) = (slowest.max(delay), longest.max(run));
        }
        let delay = slowest.saturating_add(up).saturating_add(down).as_nanos();
        let ticks = u64::try_from(delay.div_ceil(clock.tick.as_nanos())).ok()?;
        let update = u64::try_from(self.coordination.update.as_nanos() / clock.tick.as_nanos()).ok()?;
        ticks.checked_add(update.checked_mul(longest.checked_add(1)?)?)?.checked_sub(1)
    }

    /// Why a parameter of the coordination law cannot be `"auto"` in this scene; `None` if none is, or all can.
    pub(crate) fn refused_automatic(&self) -> Option<&'static str> {
        let values = self.coordination.settings.of(self.coordination.strategy);
        let parameters = self.coordination.strategy.parameters();
        let is_automatic =
            |key: &str| parameters.iter().position(|parameter| parameter.key == key).is_some_and(|place| values.get(place) == LawValue::Automatic);
        if !is_automatic("damping") {
            return None;
        }
        if self.timeline.iter().any(|change| matches!(change.what, ChangeKind::Coordination(_))) {
            return Some("the timeline changes the gains, and a damping of \"auto\" does not follow them: expected a damping in N·s/m");
        }
        (is_automatic("age") && self.oldest_sample().is_none()).then_some(
            "a damping of \"auto\" needs the age of the oldest sample in use, which the links of this scene do not bound: expected an age, or a damping in N·s/m",
        )
    }
}

/// The delay of a link and the longest run of packets that it loses, if it leaves nothing to chance and does nothing else.
fn bounded(model: &LinkModel) -> Option<(Duration, u64)> {
    let config = model.as_fixed()?;
    let plain = LinkConfig { loss: Loss::None, order: Order::default(), layout: Layout::default(), ..config.clone() };
    if !plain.is_constant_delay() {
        return None;
    }
    let run = match &config.loss {
        Loss::None => 0,
        Loss::Pattern(pattern) if pattern.counts() == Counts::Packets => pattern.longest_run()?,
        Loss::Pattern(_)
        | Loss::Independent(_)
        | Loss::Correlated(_)
        | Loss::GilbertElliott(_)
        | Loss::GilbertElliottInTime(_)
        | Loss::FourState(_) => return None,
    };
    Some((config.delay.mean(), run))
}
