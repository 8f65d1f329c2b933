//! Every loss model, packet after packet, by its definition.

use cohaptic_tests_common::properties;
use cohaptic_units::{Instant, Probability};
use cohaptic_wan::random::Purpose;
use cohaptic_wan::{Chance, DropCause, FourState, GilbertElliott, GilbertElliottInTime, LinkConfig, Loss, Pattern};
use proptest::prelude::*;

use super::{Act, Dar, Said, Script, delivered, draws, dropped, said, script, sorted};
use crate::any_link::{chance, in_time};
use crate::random_links::{cases, nanos, some_probability};

/// A loss in numbers that can be read.
#[derive(Clone, Debug)]
enum Words {
    None,
    Independent(Probability),
    Correlated(Chance),
    GilbertElliott(GilbertElliott),
    InTime(GilbertElliottInTime),
    /// p13, p31, p32, p23, p14.
    FourState([f64; 5]),
    Pattern {
        spans: Vec<(u64, u64)>,
        period: Option<u64>,
        in_time: bool,
    },
}

fn words() -> BoxedStrategy<Words> {
    let part = || prop_oneof![1 => Just(0.0), 4 => 0.0..0.5f64];
    let chain = (part(), part(), part(), 0.0..=1.0f64, part()).prop_map(|(p13, p31, p32, p23, p14)| Words::FourState([p13, p31, p32, p23, p14]));
    let spans = (proptest::collection::vec((0..6u64, 1..5u64), 0..4), proptest::option::of(1..4u64), any::<bool>());
    let pattern = spans.prop_map(|(gaps, spare, in_time)| {
        let unit = if in_time { 1_000 } else { 1 };
        let (mut spans, mut edge) = (Vec::new(), 0);
        for (before, length) in gaps {
            spans.push((edge + before * unit, edge + (before + length) * unit));
            edge += (before + length) * unit;
        }
        Words::Pattern { spans, period: spare.map(|spare| edge + spare * unit), in_time }
    });
    prop_oneof![
        1 => Just(Words::None),
        1 => some_probability().prop_map(Words::Independent),
        2 => chance().prop_map(Words::Correlated),
        2 => [some_probability(), some_probability(), some_probability(), some_probability()].prop_map(|[p, r, h, k]| Words::GilbertElliott(GilbertElliott { p, r, h, k })),
        2 => in_time().prop_map(Words::InTime),
        2 => chain,
        2 => pattern,
    ]
    .boxed()
}

fn link(words: Words) -> LinkConfig {
    let p = |value| Probability::new(value).unwrap();
    let loss = match words {
        Words::None => Loss::None,
        Words::Independent(probability) => Loss::Independent(probability),
        Words::Correlated(chance) => Loss::Correlated(chance),
        Words::GilbertElliott(chain) => Loss::GilbertElliott(chain),
        Words::InTime(chain) => Loss::GilbertElliottInTime(chain),
        Words::FourState([p13, p31, p32, p23, p14]) => Loss::FourState(FourState::new(p(p13), p(p31), p(p32), p(p23), p(p14)).unwrap()),
        Words::Pattern { spans, period, in_time: false } => {
            Loss::Pattern(Pattern::of_packets(spans.into_iter().map(|(from, to)| from..to).collect(), period).unwrap())
        }
        Words::Pattern { spans, period, in_time: true } => {
            let spans: Vec<_> = spans.into_iter().map(|(from, to)| Instant::from_nanos(from)..Instant::from_nanos(to)).collect();
            Loss::Pattern(Pattern::in_time(&spans, period.map(nanos)).unwrap())
        }
    };
    LinkConfig { loss, ..LinkConfig::default() }
}

/// State of a loss model, one variant per kind. A change to another kind discards the state.
enum Memory {
    Nothing,
    Before(Dar),
    IsBad(bool),
    Seen(Option<(bool, u64)>),
    /// State of a four-state chain, from 1 to 4.
    State(u8),
}

/// The stationary law of the four states: where the chain is after 2⁶⁰ steps from the gap. A lazy chain has the same law and no period.
fn stationary(p: [f64; 5]) -> [f64; 4] {
    let [p13, p31, p32, p23, p14] = p;
    let matrix = [[1.0 - p13 - p14, 0.0, p13, p14], [0.0, 1.0 - p23, p23, 0.0], [p31, p32, 1.0 - p31 - p32, 0.0], [1.0, 0.0, 0.0, 0.0]];
    let mut lazy: [[f64; 4]; 4] = std::array::from_fn(|from| std::array::from_fn(|to| 0.5 * (matrix[from][to] + f64::from(u8::from(from == to)))));
    for _ in 0..60 {
        let squared: [[f64; 4]; 4] = std::array::from_fn(|from| std::array::from_fn(|to| (0..4).map(|via| lazy[from][via] * lazy[via][to]).sum()));
        // Rounding must not let probability leak away.
        lazy = squared.map(|row| row.map(|p| p / row.iter().sum::<f64>()));
    }
    lazy[0]
}

impl Memory {
    fn change(self, words: &Words) -> Self {
        let initial = draws(0, 0).draws(Purpose::InitialState).next_unit();
        match (self, words) {
            (Self::Before(mut dar), Words::Correlated(chance)) => {
                dar.change(*chance);
                Self::Before(dar)
            }
            (_, Words::Correlated(_)) => Self::Before(Dar::default()),
            (Self::IsBad(bad), Words::GilbertElliott(_)) => Self::IsBad(bad),
            // 0/0 is less than nothing.
            (_, Words::GilbertElliott(chain)) => Self::IsBad(initial < chain.p.get() / (chain.p.get() + chain.r.get())),
            (Self::Seen(seen), Words::InTime(_)) => Self::Seen(seen),
            (_, Words::InTime(_)) => Self::Seen(None),
            (Self::State(state), Words::FourState(_)) => Self::State(state),
            (_, Words::FourState(p)) => {
                let [gap, received, lost, _] = stationary(*p);
                Self::State(if initial < gap {
                    1
                } else if initial < gap + received {
                    2
                } else if initial < gap + received + lost {
                    3
                } else {
                    4
                })
            }
            (_, Words::None | Words::Independent(_) | Words::Pattern { .. }) => Self::Nothing,
        }
    }
}

fn loses(words: &Words, memory: &mut Memory, now: u64, number: u64) -> bool {
    let mut draws = draws(number, 0).draws(Purpose::Loss);
    match (words, memory) {
        (Words::Independent(p), _) => draws.next_unit() < p.get(),
        (Words::Correlated(chance), Memory::Before(dar)) => !chance.is_never() && dar.happens(*chance, || draws.next_unit()),
        (Words::GilbertElliott(chain), Memory::IsBad(bad)) => {
            let was_bad = *bad;
            let moves = draws.next_unit() < if was_bad { chain.r.get() } else { chain.p.get() };
            *bad = was_bad != moves;
            draws.next_unit() >= if was_bad { chain.h.get() } else { chain.k.get() }
        }
        (Words::InTime(chain), Memory::Seen(seen)) => {
            let (good, bad) = chain.mean_times();
            let (alpha, beta) = (1.0 / good.as_secs_f64(), 1.0 / bad.as_secs_f64());
            let always = alpha / (alpha + beta);
            let now_bad = match *seen {
                None => always,
                Some((was_bad, then)) => {
                    let forgotten = 1.0 - (-(alpha + beta) * (now - then) as f64 * 1e-9).exp();
                    if was_bad { 1.0 - (1.0 - always) * forgotten } else { always * forgotten }
                }
            };
            let is_bad = draws.next_unit() < now_bad;
            *seen = Some((is_bad, now));
            draws.next_unit() >= if is_bad { chain.h.get() } else { chain.k.get() }
        }
        (Words::FourState([p13, p31, p32, p23, p14]), Memory::State(state)) => {
            let u = draws.next_unit();
            *state = match *state {
                1 if u < *p14 => 4,
                1 if u < p14 + p13 => 3,
                3 if u < *p32 => 2,
                3 if u < p32 + p31 => 1,
                2 if u < *p23 => 3,
                4 => 1,
                same => same,
            };
            matches!(*state, 3 | 4)
        }
        (Words::Pattern { spans, period, in_time }, _) => {
            let mut place = if *in_time { now } else { number };
            if let Some(period) = period {
                place -= place / period * period;
            }
            spans.iter().any(|(from, to)| *from <= place && place < *to)
        }
        _ => false,
    }
}

fn model(script: &Script<Words>) -> Vec<Said> {
    let (mut words, mut memory, mut said) = (Words::None, Memory::Nothing, Vec::new());
    for (now, act) in script {
        match act {
            Act::Change(new) => {
                words = new.clone();
                memory = memory.change(new);
            }
            Act::Offer(packet) => said.push(match loses(&words, &mut memory, *now, packet.number) {
                true => dropped(*packet, *now, DropCause::Loss, false),
                false => delivered(*packet, *now, false),
            }),
        }
    }
    sorted(said)
}

properties! {
    #![proptest_config(cases(1_000))]

    #[test]
    fn every_loss_model_and_the_changes_between_them(script in script(words())) {
        prop_assert_eq!(said(&script, link), model(&script));
    }
}
