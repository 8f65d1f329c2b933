//! Loss models: number of packets until the mean loss and the mean run of losses are known, compared with theory.

use cohaptic_units::{Bytes, Instant, Probability};
use cohaptic_wan::netem::Netem;
use cohaptic_wan::{Bursts, Chance, Fate, FourState, GilbertElliott, KernelNetem, Link, LinkConfig, LinkModel, LinkName, Loss};

use super::chain::{Expected, LossChain};
use super::{Effort, RowSink, real, row};
use crate::cost::{nanos, processor_time};
use crate::{AccuracyError, Row};

const MEAN: &str = "mean loss [relative]";
const RUN: &str = "mean run of losses [relative]";

/// A loss model in this program and in the kernel.
struct Case {
    name: &'static str,
    /// Model of this program.
    ours: Loss,
    /// Words of `tc` for the same model in the kernel.
    words: Option<String>,
    /// Markov chain of the model, for the theory.
    chain: LossChain,
}

/// Returns the four models.
fn cases() -> [Case; 4] {
    let p = |value| Probability::new(value).expect("a probability");
    let of_chance = |chance: Chance| {
        let (p, rho) = (chance.probability().get(), chance.correlation());
        LossChain::of_two(p * (1.0 - rho), p + rho * (1.0 - p))
    };
    let correlated = Chance::correlated(p(0.05), 0.5).expect("a correlation");
    let elliott = GilbertElliott { p: p(0.01), r: p(0.2), h: Probability::ZERO, k: Probability::ONE };
    let bursts = Bursts { loss: 0.05, length: 10.0, density: 0.8, isolated: 0.005, good_run: 2.0 };
    let four = FourState::from_bursts(bursts).expect("bursts that a chain has");
    let transitions = four.transitions();
    let four_chain = LossChain {
        transitions: transitions.iter().map(|row| row.to_vec()).collect(),
        stationary: four.stationary().to_vec(),
        lost: vec![false, false, true, true],
    };
    let [gap, within, burst, _] = transitions;
    // The order of `tc`: p13, p31, p32, p23 and p14.
    let percentages: Vec<String> = [gap[2], burst[0], burst[1], within[2], gap[3]].iter().map(|share| format!("{:.9}%", 100.0 * share)).collect();
    [
        Case { name: "loss, independent 5 %", ours: Loss::Independent(p(0.05)), words: Some("loss 5%".into()), chain: LossChain::of_two(0.05, 0.05) },
        Case {
            name: "loss, correlated 5 % and 0.5",
            ours: Loss::Correlated(correlated),
            words: Some("loss 5% 50%".into()),
            chain: of_chance(correlated),
        },
        Case {
            name: "loss, Gilbert-Elliott 1 % and 20 %",
            ours: Loss::GilbertElliott(elliott),
            words: Some("loss gemodel 1% 20%".into()),
            chain: LossChain::of_two(0.01, 0.8),
        },
        Case {
            name: "loss, four states of 5 %",
            ours: Loss::FourState(four),
            words: Some(format!("loss state {}", percentages.join(" "))),
            chain: four_chain,
        },
    ]
}

/// Measures the rows of all models.
pub(super) fn measure(effort: Effort, done: &mut RowSink<'_>) -> Result<(), AccuracyError> {
    for case in cases() {
        let expected = case.chain.expected();
        let ours = LinkModel::from(LinkConfig { loss: case.ours, ..LinkConfig::default() });
        of_model(case.name, "chain", &ours, expected, effort, done)?;
        if let Some(words) = case.words {
            of_model(case.name, "kernel-6.6", &kernel(&words), expected, effort, done)?;
        }
    }
    Ok(())
}

/// Returns the link of the kernel's netem with these words of `tc`.
pub(super) fn kernel(words: &str) -> LinkModel {
    let netem = Netem::parse(words).expect("words of tc");
    KernelNetem::new(netem, Vec::new()).expect("a netem that Linux takes").into()
}

/// Measures the rows of one model.
fn of_model(case: &str, method: &str, model: &LinkModel, expected: Expected, effort: Effort, done: &mut RowSink<'_>) -> Result<(), AccuracyError> {
    let mut seed = 0;
    for (packets, runs) in effort.loss_runs {
        let (mut of_mean, mut of_run) = (0.0, 0.0);
        let start = processor_time();
        for _ in 0..*runs {
            // A new seed for each run makes the runs independent.
            seed += 1;
            let seen = Seen::of(model, seed, *packets);
            of_mean += (seen.mean() / expected.mean - 1.0).powi(2);
            of_run += (seen.run() / expected.run - 1.0).powi(2);
            done.check()?;
        }
        let (n, count) = (real(*packets), real(*runs));
        // The cost of a row is the number of packets; the time per packet goes into the note.
        let each = nanos(processor_time() - start) / (n * count);
        let row = Row { reference: "the chain's stationary law", ..row(case, method, format!("{packets} packets"), (n, "packets")) };
        // Both rows have the same note: a table with both errors in a line then shows the note once.
        let [mean, run] = [expected.mean_variance, expected.run_variance].map(|variance| (variance / n).sqrt());
        let note = format!("root mean square of {runs} runs; theory expects {mean:.1e} of the mean and {run:.1e} of the run; {each:.0} ns a packet");
        for (of, error_unit) in [(of_mean, MEAN), (of_run, RUN)] {
            done.push(Row { error: Some((of / count).sqrt()), error_unit, note: note.clone(), ..row.clone() })?;
        }
    }
    Ok(())
}

/// Losses of a link.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
struct Seen {
    /// Number of packets sent.
    packets: usize,
    /// Number of packets lost.
    lost: usize,
    /// Number of losses that follow a received packet.
    begun: usize,
}

impl Seen {
    /// Sends `packets` packets through a link.
    fn of(model: &LinkModel, seed: u64, packets: usize) -> Self {
        let mut link = Link::new(seed, &LinkName::between("left", "right"), model.clone());
        let (mut seen, mut before) = (Self { packets, ..Self::default() }, false);
        let mut now = Instant::ZERO;
        for _ in 0..packets {
            now += core::time::Duration::from_micros(1);
            link.handle_packet(now, Bytes::new(64), ()).expect("time goes on");
            // Without a delay the packet leaves at the instant of its arrival.
            link.handle_timeout(now).expect("time goes on");
            while let Some(event) = link.poll_event() {
                let lost = matches!(event.fate, Fate::Dropped(_));
                seen.lost += usize::from(lost);
                seen.begun += usize::from(lost && !before);
                before = lost;
            }
        }
        seen
    }

    fn mean(self) -> f64 {
        real(self.lost) / real(self.packets)
    }

    /// Returns the mean run of losses; 0 without any loss, which has a relative error of 1.
    fn run(self) -> f64 {
        real(self.lost) / real(self.begun.max(1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The chains for the theory equal the chains of the models.
    #[test]
    fn theory_and_models_speak_of_the_same_chain() {
        for case in cases() {
            let expected = case.chain.expected();
            let mean = case.ours.mean().unwrap();
            assert!((expected.mean - mean).abs() < 1e-12, "{}: {} is not {mean}", case.name, expected.mean);
            if let Some(run) = case.ours.mean_run() {
                assert!((expected.run - run).abs() < 1e-12, "{}: {} is not {run}", case.name, expected.run);
            }
        }
    }

    /// Gilbert-Elliott with p = 1 % and r = 20 % loses 1/21 of the packets, five in a row on average, computed by hand.
    #[test]
    fn a_known_chain_has_its_known_figures() {
        let [_, _, elliott, _] = cases();
        let expected = elliott.chain.expected();
        assert!((expected.mean - 1.0 / 21.0).abs() < 1e-15 && (expected.run - 5.0).abs() < 1e-12);
    }
}
