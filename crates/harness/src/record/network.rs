//! `network.svg`: a row of two panels for each link. The first panel shows delays over time with the losses below; the second shows the distribution of the
//! delay, with the configured distribution.
//!
//! Memory is bounded: the least and greatest delay of each span, and the number of delays in each step of ten microseconds.

use std::collections::{BTreeMap, BTreeSet};

use cohaptic_picture::{Axis, Line, Look, Panel, Picture, Rug};
use cohaptic_scene::Scene;
use cohaptic_units::print::Counted;
use cohaptic_wan::{Delay, Fate};

use super::band::Bands;
use crate::PacketRow;

/// Shown links of a scene, and the delays and losses of their packets.
#[derive(Debug)]
pub(super) struct Network {
    /// All links of the scene, by sender, then receiver.
    pairs: Vec<(usize, usize)>,
    /// Delays \[s\] over the instant of sending, one curve for each shown link.
    delays: Bands,
    shown: Vec<Shown>,
}

/// A shown link.
#[derive(Debug, Default)]
struct Shown {
    from: usize,
    to: usize,
    /// Number of delivered packets, by delay in steps of [`STEP`].
    delays: BTreeMap<u64, u64>,
    /// Configured propagation delay. `None` for a recording, and if the timeline of the scene has changes.
    configured: Option<Delay>,
    /// Spans in which lost packets were sent.
    losses: BTreeSet<usize>,
    /// Number of packets with a known fate.
    known: u64,
    /// Number of dropped packets among `known`.
    dropped: u64,
}

/// Greatest number of links in a picture: the first by sender, then receiver. Enough for all links of three users.
pub(super) const MOST_LINKS: usize = 6;

/// Greatest number of names of links without a panel in a note.
const MOST_NAMED: usize = 20;

/// Resolution of the distribution of delays \[ns\], far below a pixel.
const STEP: u64 = 10_000;

impl Network {
    /// Returns the state before the run, with `spans` spans of time.
    pub(super) fn new(scene: &Scene, spans: usize) -> Self {
        // With changes of the timeline a single configured law would not describe the whole run.
        let configured = |from: usize, to: usize| {
            let config = scene.links.between(from, to).as_fixed().filter(|_| scene.timeline.is_empty());
            config.map(|config| config.delay.clone())
        };
        let pairs: Vec<(usize, usize)> = scene.linked_pairs().collect();
        let shown = pairs.iter().copied().take(MOST_LINKS).map(|(from, to)| Shown { from, to, configured: configured(from, to), ..Shown::default() });
        let shown: Vec<Shown> = shown.collect();
        Self { pairs, delays: Bands::new(scene.duration, spans, shown.len()), shown }
    }

    pub(super) fn on_packet(&mut self, row: &PacketRow) {
        // Packets of links without a panel are ignored.
        let Some(place) = self.shown.iter().position(|link| (link.from, link.to) == (row.path.from.index(), row.path.to.index())) else { return };
        let link = &mut self.shown[place];
        link.known += 1;
        if matches!(row.fate, Fate::Delivered(_)) {
            let delay = row.at - row.offered;
            self.delays.add(place, row.offered, delay.as_secs_f64());
            // Rounded to the nearest step.
            let steps = u64::try_from(delay.as_nanos()).unwrap_or(u64::MAX).saturating_add(STEP / 2) / STEP;
            *link.delays.entry(steps).or_default() += 1;
        } else {
            link.dropped += 1;
            link.losses.extend(self.delays.span(row.offered));
        }
    }

    /// Returns the line through the least and the greatest delay of each span of a shown link: time \[s\] and delay \[ms\]. The line is interrupted between two
    /// spans if packets of a span between them were lost and none arrived: a delay that nobody measured is not drawn.
    fn delay_runs(&self, place: usize) -> Vec<Vec<(f64, f64)>> {
        let losses: Vec<f64> = self.shown[place].losses.iter().map(|span| self.delays.middle_of(*span)).collect();
        let mut runs: Vec<Vec<(f64, f64)>> = Vec::new();
        let mut before = f64::NEG_INFINITY;
        for (t, low, high) in self.delays.curve(place) {
            // The first loss after the span before. Losses of a span with delivered packets are at the instant of the span itself, and leave no gap.
            let lost = losses.get(losses.partition_point(|loss| *loss <= before)).is_some_and(|loss| *loss < t);
            // A new run of points leaves a gap in the drawn line.
            if lost || runs.is_empty() {
                runs.push(Vec::new());
            }
            // A part with a single delay has a single point, which is drawn as a dot. Two equal points would be a line without a length.
            let points = [Some(low), Some(high).filter(|high| high.to_bits() != low.to_bits())].into_iter().flatten().map(|delay| (t, 1e3 * delay));
            if let Some(run) = runs.last_mut() {
                run.extend(points);
            }
            before = t;
        }
        runs
    }

    /// Draws the picture.
    pub(super) fn picture(&self, title: &str, names: &[String]) -> Picture {
        let name = |from: usize, to: usize| format!("{} → {}", names[from], names[to]);
        // Both panels of a link share the range of delays, so the curves can be compared.
        let longest = self.shown.iter().filter_map(|link| link.delays.last_key_value()).map(|(steps, _)| milliseconds(*steps)).fold(0.0, f64::max);
        let delay = || Axis::new("Delay").unit("ms").range(0.0, if longest > 0.0 { 1.05 * longest } else { 1.0 });
        let mut picture = Picture::new(format!("{title}: delays and losses of links")).columns(2).aspect(0.42);
        for (place, link) in self.shown.iter().enumerate() {
            let lost = Rug::new(link.losses.iter().map(|span| self.delays.middle_of(*span)), Look::of(1)).named("packets lost");
            let over_time = Panel::new(Axis::new("Time").symbol("t").unit("s").range(0.0, self.delays.seconds()), delay())
                .titled(format!("{}: {}", name(link.from, link.to), link.losses_in_words()))
                .with(Line::runs(self.delay_runs(place), Look::of(0).thin()).named("delay of packets"))
                .with(lost);
            let shares = Panel::new(delay(), Axis::new("Share of packets").range(0.0, 1.0))
                .titled(link.median_in_words())
                .with(Line::steps(link.distribution(), Look::of(0)).named("no longer than this"))
                .with_all(
                    link.configured.as_ref().map(|delay| Line::new(configured_distribution(delay), Look::reference()).named("configured delay")),
                );
            picture = picture.panel(over_time).panel(shares);
        }
        let rest: Vec<String> = self.pairs.iter().skip(self.shown.len()).map(|(from, to)| name(*from, *to)).collect();
        if !rest.is_empty() {
            let unnamed = rest.len().saturating_sub(MOST_NAMED);
            let end = if unnamed > 0 { format!(" and {unnamed} more") } else { String::new() };
            let (named, shown, all) = (rest[..rest.len() - unnamed].join(", "), self.shown.len(), self.shown.len() + rest.len());
            picture = picture.note(format!("{shown} of {all} links are shown; links.csv has all. Not shown: {named}{end}."));
        }
        picture
    }
}

impl Shown {
    /// Returns the share of delivered packets with at most each delay \[ms\].
    fn distribution(&self) -> Vec<(f64, f64)> {
        let all = count(self.delays.values().sum());
        // The curve begins at share 0 and the least delay, so that the first step is drawn.
        let first = self.delays.first_key_value().map(|(steps, _)| (milliseconds(*steps), 0.0));
        let mut until = 0;
        let rising = self.delays.iter().map(|(steps, packets)| {
            until += packets;
            (milliseconds(*steps), count(until) / all)
        });
        first.into_iter().chain(rising).collect()
    }

    fn losses_in_words(&self) -> String {
        match (self.dropped, self.known) {
            (_, 0) => "no packets".to_owned(),
            (0, known) => format!("none of {} lost", Counted(known, "packet")),
            (dropped, known) => format!("{dropped} of {} lost ({:.2} %)", Counted(known, "packet"), 100.0 * count(dropped) / count(known)),
        }
    }

    /// Returns the text of the median delay: the least delay that at least half of the delivered packets do not exceed.
    fn median_in_words(&self) -> String {
        let median = self.distribution().into_iter().find(|(_, share)| *share >= 0.5);
        median.map_or_else(|| "nothing arrived".to_owned(), |(delay, _)| format!("median {delay:.2} ms"))
    }
}

/// Number of points of a configured distribution, at evenly spaced probabilities.
const QUANTILES: u16 = 500;

/// Returns points of the configured distribution: delay \[ms\] and the probability of at most this delay. Only propagation counts; queues and other stages add
/// to it.
fn configured_distribution(delay: &Delay) -> Vec<(f64, f64)> {
    let Some(law) = delay.law() else {
        let mean = 1e3 * delay.mean().as_secs_f64();
        return vec![(mean, 0.0), (mean, 1.0)];
    };
    (0..QUANTILES)
        .map(|place| {
            let probability = (f64::from(place) + 0.5) / f64::from(QUANTILES);
            (law.quantile(probability) / 1e6, probability)
        })
        .collect()
}

#[expect(clippy::cast_precision_loss, reason = "delays of more than a month and counts beyond 2^53 do not occur")]
fn milliseconds(steps: u64) -> f64 {
    steps as f64 * (STEP as f64 / 1e6)
}

#[expect(clippy::cast_precision_loss, reason = "counts beyond 2^53 do not occur")]
fn count(number: u64) -> f64 {
    number as f64
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use cohaptic_picture::testing::faults;
    use cohaptic_units::{Bytes, Instant};
    use cohaptic_wan::{Correlation, Distribution, DropCause, Jitter, NodeId, Path};

    use super::*;

    const SCENE: &str = r#"
        scene = { duration = "1s", count = COUNT }
        object = { mass = 0.45 }
        coordination = { strategy = "average-position", stiffness = 1000.0, damping = 5.0, update = "8ms" }
        peer = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
        link = { delay = "24ms" }
    "#;

    /// Returns ten spans of a second with the given packets of the first peer: (receiver, sent \[ms\], delay \[ms\] or `None` for a lost packet).
    fn network(peers: usize, packets: &[(usize, u64, Option<u64>)]) -> (Network, String) {
        let scene = Scene::parse(&SCENE.replace("COUNT", &peers.to_string()), "scene.toml".as_ref(), &[]).unwrap();
        let mut network = Network::new(&scene, 10);
        let at = |millis: u64| Instant::from_nanos(millis * 1_000_000);
        for (sequence, (to, sent, delay)) in (0..).zip(packets) {
            let arrival = at(sent + delay.unwrap_or(0));
            let fate = if delay.is_some() { Fate::Delivered(arrival) } else { Fate::Dropped(DropCause::Loss) };
            network.on_packet(&PacketRow {
                path: Path { from: NodeId(0), to: NodeId::new(*to) },
                sequence,
                copy: 0,
                offered: at(*sent),
                at: arrival,
                size: Bytes::new(64),
                fate,
                marked: false,
                damaged: false,
            });
        }
        let names: Vec<String> = (1..=peers).map(|peer| format!("p{peer}")).collect();
        let svg = network.picture("A test", &names).svg();
        assert_eq!(faults(&svg), [""; 0]);
        (network, svg)
    }

    /// Delays of 10, 20, 20 and 40 ms: a quarter of the packets took at most 10 ms, three quarters at most 20 ms.
    #[test]
    fn each_link_has_its_own_delays_losses_and_distribution() {
        let packets = [(1, 0, Some(10)), (1, 120, Some(20)), (1, 130, None), (1, 240, Some(20)), (1, 900, Some(40)), (2, 0, Some(5))];
        let (network, svg) = network(3, &packets);
        assert_eq!(network.shown[0].distribution(), [(10.0, 0.0), (10.0, 0.25), (20.0, 0.75), (40.0, 1.0)]);
        assert_eq!(network.shown[1].distribution(), [(5.0, 0.0), (5.0, 1.0)]);
        assert_eq!(network.shown[0].losses.iter().copied().collect::<Vec<_>>(), [1]);
        for text in
            ["p1 → p2: 1 of 5 packets lost (20.00 %)", "median 20.00 ms", "p1 → p3: none of 1 packet lost", "p3 → p2: no packets", "nothing arrived"]
        {
            assert!(svg.contains(&format!(">{text}</text>")), "{text}");
        }
        assert!(!svg.contains("Not shown"));
    }

    /// Ten spans of 100 ms. Packets of the spans 3 and 4 are lost, of span 6 one is lost and one arrives, and in span 7 nothing is sent: one gap.
    #[test]
    fn no_line_crosses_a_burst_of_losses() {
        let sent = [(0, true), (100, true), (200, true), (300, false), (400, false), (500, true), (600, false), (650, true), (800, true)];
        let packets: Vec<_> = sent.iter().map(|(at, arrives)| (1, *at, arrives.then_some(10))).collect();
        let (network, svg) = network(2, &packets);
        let runs = network.delay_runs(0);
        let times = |run: &[(f64, f64)]| run.iter().map(|(t, _)| (t * 1e3).round()).collect::<Vec<f64>>();
        assert_eq!(runs.iter().map(|run| times(run)).collect::<Vec<_>>(), [vec![50.0, 150.0, 250.0], vec![550.0, 650.0, 850.0]]);
        let line = svg.lines().find(|line| line.starts_with("<path class=\"line s0\" stroke-width=\"0.9\"")).unwrap();
        assert_eq!(line.matches('M').count(), 2, "{line}");
    }

    /// A uniform delay from 20 to 30 ms is a straight line; a constant delay is a step.
    #[test]
    fn the_configured_distribution_is_that_of_the_law() {
        let sd = Duration::from_nanos(2_886_751);
        let jitter = Jitter { sd, distribution: Distribution::Uniform, floor: Duration::ZERO, correlation: Correlation::None };
        let uniform = configured_distribution(&Delay::with_jitter(Duration::from_millis(25), jitter).unwrap());
        // √12 · 2.886751 ms is 10 ms to a nanosecond.
        assert!(uniform.iter().all(|(delay, probability)| (delay - (20.0 + 10.0 * probability)).abs() < 1e-5), "{uniform:?}");
        assert_eq!(configured_distribution(&Delay::constant(Duration::from_millis(24))), [(24.0, 0.0), (24.0, 1.0)]);
        let (_, svg) = network(2, &[(1, 0, Some(24))]);
        assert_eq!(svg.matches(">configured delay</text>").count(), 1, "{svg}");
    }

    /// A link that changes during the run has several configured delays.
    #[test]
    fn a_link_that_changes_has_no_configured_distribution() {
        let text = SCENE.replace("COUNT", "2") + "timeline = [{ at = \"0.5s\", link = \"all\", set = { delay = \"48ms\" } }]\n";
        let scene = Scene::parse(&text, "scene.toml".as_ref(), &[]).unwrap();
        assert!(Network::new(&scene, 10).shown.iter().all(|link| link.configured.is_none()));
    }

    #[test]
    fn links_beyond_the_sixth_are_named_in_a_note_and_not_drawn() {
        let (_, svg) = network(4, &[]);
        let note = "6 of 12 links are shown; links.csv has all. Not shown: p3 → p1, p3 → p2, p3 → p4, p4 → p1, p4 → p2, p4 → p3.";
        assert!(svg.contains(note) && !svg.contains(">p3 → p1: no packets</text>"), "{svg}");
        assert_eq!(svg.matches(": no packets</text>").count(), MOST_LINKS);
        let (_, svg) = network(20, &[]);
        assert!(svg.contains("6 of 380 links are shown") && svg.contains("and 354 more."), "{svg}");
    }
}
