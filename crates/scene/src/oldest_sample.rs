//! Ages of the samples in use, where the links of a scene determine these ages.

use core::time::Duration;

use cohaptic_peer::coordination::{Law, LawValue};
use cohaptic_peer::{Clock, Coordination};
use cohaptic_wan::{Counts, Layout, LinkConfig, LinkModel, Loss, Order};

use crate::{ChangeKind, Scene};

/// Largest number of ticks that a law may look back. Bounds the memory of a mistyped lag.
const MOST_LAG: usize = 10_000;

impl Scene {
    /// Returns the largest age of a sample in use, in ticks: ⌈delay/Tc⌉ + M − 1 + M·(longest run of lost packets), for the slowest link and the worst
    /// pattern, with M ticks from sample to sample.
    ///
    /// `None` where the links do not bound the age, or where the bound may change: for links with anything but constant delays and patterns of lost packets,
    /// lossy access lines, changes of links in the timeline, peers with different clocks, and dead bands.
    #[must_use]
    pub(crate) fn oldest_sample(&self) -> Option<u64> {
        let clock = self.lasting_clock()?;
        // An access line may delay but not lose packets: the formula below counts the longest run of a single line.
        let line = |model: Option<&LinkModel>| {
            model.map_or(Some(Duration::ZERO), |model| bounded(model).filter(|(_, run)| *run == 0).map(|(delay, _)| delay))
        };
        // The slowest uplink, link and downlink together, also if no sample passes all three: a bound, not the exact age.
        let (mut up, mut down) = (Duration::ZERO, Duration::ZERO);
        for peer in &self.peers {
            up = up.max(line(peer.uplink.as_deref())?);
            down = down.max(line(peer.downlink.as_deref())?);
        }
        let (mut slowest, mut longest) = (Duration::ZERO, 0);
        for (model, _) in self.used_links() {
            let (delay, run) = bounded(model)?;
            (slowest, longest) = (slowest.max(delay), longest.max(run));
        }
        let (ticks, update) = self.ticks_of(slowest.saturating_add(up).saturating_add(down), clock)?;
        // An overflow gives `None` too: no usable bound.
        ticks.checked_add(update.checked_mul(longest.checked_add(1)?)?)?.checked_sub(1)
    }

    /// Returns the age of a sample in the middle of its use, in ticks: ⌈delay/Tc⌉ + ⌊(M − 1)/2⌋, with M ticks from sample to sample. The sample in use is then
    /// older in as many ticks as younger, or in a tick more.
    ///
    /// `None` where samples have different ages: for links with more than a constant delay or with different delays, access lines, dead bands, changes of links
    /// in the timeline, and peers with different clocks.
    #[must_use]
    pub(crate) fn middle_age(&self) -> Option<u64> {
        let clock = self.lasting_clock()?;
        if self.peers.iter().any(|peer| peer.uplink.is_some() || peer.downlink.is_some()) {
            return None;
        }
        let mut delays = self.used_links().into_iter().map(|(link, _)| link.is_constant_delay().then(|| link.mean_delay()));
        let delay = delays.next()??;
        if delays.any(|other| other != Some(delay)) {
            return None;
        }
        let (ticks, update) = self.ticks_of(delay, clock)?;
        ticks.checked_add(update.saturating_sub(1) / 2)
    }

    /// Returns the common clock of all peers; `None` if clocks differ, if dead bands leave out samples, or if the timeline changes links.
    fn lasting_clock(&self) -> Option<Clock> {
        let clock = self.peers[0].clock;
        let is_link_change = |what: &ChangeKind| matches!(what, ChangeKind::Link(_) | ChangeKind::AllLinks(_));
        // In place of an omitted sample, the sample before stays in use and gets older.
        let thinned = self.leaves_out_samples();
        let differs = self.peers.iter().any(|peer| peer.clock != clock);
        (!thinned && !differs && !self.timeline.iter().any(|change| is_link_change(&change.what))).then_some(clock)
    }

    /// Returns two numbers of ticks: from sending to the use of a sample with the travel time `delay`, rounded up, and from sample to sample.
    fn ticks_of(&self, delay: Duration, clock: Clock) -> Option<(u64, u64)> {
        let tick = clock.tick.as_nanos();
        let ticks = u64::try_from(delay.as_nanos().div_ceil(tick)).ok()?;
        Some((ticks, u64::try_from(self.coordination.update.as_nanos() / tick).ok()?))
    }

    /// Returns why the coordination law cannot look back as far as the lag; `None` if the law can.
    pub(crate) fn refused_lag(&self) -> Option<&'static str> {
        let is_automatic = self.coordination.settings.of(self.coordination.strategy).any_automatic();
        if self.coordination.strategy == Coordination::LocalLag && is_automatic && self.middle_age().is_none() {
            return Some(
                "a lag of \"auto\" needs links that all have one constant delay and do nothing else, and peers whose clocks are alike: expected a lag such as \"16ms\"",
            );
        }
        // The peer with the shortest tick needs the most ticks for the same lag.
        let (_, place) = self.peers.iter().enumerate().map(|(place, peer)| (peer.clock.tick, place)).min()?;
        (Law::<f64>::lag(&self.law(place)?) > MOST_LAG)
            .then_some("the lag is more than 10000 ticks of a peer, which it does not remember: expected at most 10000 ticks")
    }

    /// Returns why a parameter of the coordination law cannot be `"auto"` in this scene; `None` if no parameter is automatic, or if all automatic parameters
    /// are possible.
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
        // With a given age, the damping does not depend on the links.
        (is_automatic("age") && self.oldest_sample().is_none()).then_some(
            "a damping of \"auto\" needs the age of the oldest sample in use, which the links of this scene do not bound: expected an age, or a damping in N·s/m",
        )
    }
}

/// Returns the delay of a link and the longest run of lost packets. `None` if the link does anything at random, or anything but delay and lose packets by a
/// pattern.
fn bounded(model: &LinkModel) -> Option<(Duration, u64)> {
    let config = model.as_fixed()?;
    // With constant delays, and without changes of the link, order policy and layout have no influence. The loss is looked at below.
    let plain = LinkConfig { loss: Loss::None, order: Order::default(), layout: Layout::default(), ..config.clone() };
    if !plain.is_constant_delay() {
        return None;
    }
    let run = match &config.loss {
        Loss::None => 0,
        // Only a pattern that counts packets bounds a run of lost packets.
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
