//! Writes `docs/measured-stability.md`: `cargo run --profile dist -p cohaptic-benches --bin stability-table > docs/measured-stability.md`. Takes some minutes;
//! `--quick` less.
#![allow(clippy::print_stdout, reason = "printing the page is what this program is for")]
#![allow(clippy::cast_precision_loss, reason = "counts of verdicts")]

use std::hint::black_box;
use std::time::{Duration, Instant};

use cohaptic_accuracy::analysis::growth::growth;
use cohaptic_accuracy::analysis::references::{Reference, references};
use cohaptic_benches::bare_pair::BarePair;
use cohaptic_benches::effort::Effort;
use cohaptic_benches::machine::{median, process_time, time};
use cohaptic_benches::verdicts::{eight_different, equal, family, figure_3};
use cohaptic_peer::Gains;
use cohaptic_proofs::{Guarantee, ProvenRegion};
use cohaptic_stability::{Family, FamilyScratch, Grid, Map, Method, Radius, Unwatched, analyse};

/// How much is measured.
#[derive(Clone, Copy)]
struct Work {
    /// Rounds of which the median is taken.
    rounds: usize,
    /// What all repetitions of a subject in one round take together \[s\].
    worth: f64,
    /// Cells along each axis of a map.
    cells: usize,
    /// How often a range of a proven region is halved at most.
    halvings: u32,
    /// Samples that take this number of frames.
    frames: &'static [u32],
    /// The largest number of equal peers.
    most_peers: usize,
}

/// Something that is measured.
type Subject<'a> = Box<dyn FnMut() + 'a>;

impl Work {
    const fn of(effort: Effort) -> Self {
        match effort {
            Effort::Full => Self { rounds: 9, worth: 0.05, cells: 200, halvings: 9, frames: &[10, 30, 100, 300, 1000], most_peers: 100_000 },
            Effort::Quick => Self { rounds: 3, worth: 0.02, cells: 100, halvings: 9, frames: &[10, 30, 100, 300], most_peers: 100_000 },
            Effort::Smoke => Self { rounds: 1, worth: 0.0, cells: 4, halvings: 3, frames: &[10, 30], most_peers: 2_000 },
        }
    }

    /// Time of each subject once, medians of alternating rounds of this number of repetitions.
    fn medians(self, subjects: &mut [(u32, Subject<'_>)]) -> Vec<Duration> {
        let mut rounds = vec![Vec::new(); subjects.len()];
        for _ in 0..self.rounds {
            for ((repetitions, subject), times) in subjects.iter_mut().zip(&mut rounds) {
                let took = time(|| (0..*repetitions).for_each(|_| subject()));
                times.push(took / *repetitions);
            }
        }
        rounds.into_iter().map(median).collect()
    }

    /// What it is worth, at least once.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 1 and a million")]
    fn repetitions(self, subject: &mut Subject<'_>) -> u32 {
        subject();
        let once = time(&mut *subject).as_secs_f64();
        (self.worth / once.max(1e-7)).clamp(1.0, 1e6) as u32
    }

    fn measured(self, subjects: Vec<Subject<'_>>) -> Vec<Duration> {
        let mut counted: Vec<(u32, Subject<'_>)> = subjects.into_iter().map(|mut subject| (self.repetitions(&mut subject), subject)).collect();
        self.medians(&mut counted)
    }

    /// The median of some, or the only one if it takes long.
    fn once_or_median(self, mut subject: impl FnMut()) -> Duration {
        let first = time(&mut subject);
        if first > Duration::from_millis(500) || self.rounds == 1 {
            return first;
        }
        self.measured(vec![Box::new(subject)])[0]
    }
}

fn main() -> Result<(), String> {
    let effort = Effort::parse(std::env::args().skip(1))?;
    let work = Work::of(effort);
    let what = "Processor time of verdicts on one core, but for the maps.";
    println!("{}", effort.head("Stability: speed and error", what, "stability-table", "docs/measured-stability.md"));
    println!("Each figure is the median of {} rounds in which all rows or columns of a table alternate.\n", work.rounds);
    equal_peers(work);
    figure(work);
    mean_square_cells(work);
    different_peers(work);
    long_delays(work);
    speed_against_error(work);
    println!("\nThe same work as criterion benches: `cargo bench -p cohaptic-benches --bench stability`.");
    Ok(())
}

fn equal_peers(work: Work) {
    println!("## Equal peers, Td = Tn\n");
    println!(
        "Verdicts a second along the map KT × KC of N equal peers with average-position coordination, B = 5 N·s/m, both keys changing from verdict to"
    );
    println!(
        "verdict. The *bare pair* (`benches/src/bare_pair.rs`) builds both blocks over fixed arrays, written by hand for this one kind of scene, and"
    );
    println!(
        "takes their radii; *bounds* are computed ones on the error of the radius. A thousandth of 0.45 kg is so light that most of the map diverges at once:"
    );
    println!("radii beyond 10¹⁰, from badly scaled matrices.\n");
    println!("| peers | a copy | radius | asked for | with bounds | asked for | bare pair | bare pair / radius |");
    println!("| ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |");
    for (peers, split) in [(3, true), (8, true), (1000, true), (1000, false), (work.most_peers, false)] {
        let family = family(peers, &[format!("object.split-mass={split}")]);
        let pair = BarePair::new(&family.scene(&[1000.0, 3500.0]).expect("in the range"));
        let (mut first, mut second, mut third) = (Walk::default(), Walk::default(), Walk::default());
        let (mut one, mut other) = (FamilyScratch::default(), FamilyScratch::default());
        let times = work.measured(vec![
            Box::new(|| drop(black_box(family.radius(&first.next(), &mut one)))),
            Box::new(|| drop(black_box(family.bounded_radius(&second.next(), &mut other)))),
            Box::new(|| {
                let [stiffness, coupling] = third.next();
                black_box(pair.radius(Gains { stiffness, damping: 5.0 }, Gains { stiffness: coupling, damping: 5.0 }));
            }),
        ]);
        let [radius, bounded, bare] = [0, 1, 2].map(|place: usize| 1.0 / times[place].as_secs_f64());
        let mass = if split { "0.45 kg / N" } else { "0.45 kg" };
        println!("| {peers} | {mass} | {radius:.0} | 150000 | {bounded:.0} | 60000 | {bare:.0} | {:.2} |", bare / radius);
    }
    println!(
        "\nFor scale, from the project's requirements and not measured by this command: numpy, scipy and python-control on the full matrix 1,400 to 9,000."
    );
}

/// Values of KT and KC that spread over the map without repeating.
#[derive(Default)]
struct Walk(u32);

impl Walk {
    fn next(&mut self) -> [f64; 2] {
        self.0 += 1;
        let share = |factor: f64| (f64::from(self.0) * factor).fract();
        [6000.0 * share(0.618_033_988_749_894_9), 100.0 + 5900.0 * share(0.414_213_562_373_095_1)]
    }
}

fn figure(work: Work) {
    println!("\n## The paper's Figure 3\n");
    filled(work, 0, "5 s");
    proven(work);
}

/// The regions of Figure 3, each with a proven verdict on all but a small share of its area.
fn proven(work: Work) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().expect("threads");
    let (wall, processor) = (Instant::now(), process_time());
    let prove = |family: &Family| pool.install(|| ProvenRegion::prove(family, work.halvings, None, &Unwatched)).expect("a region");
    let regions: Vec<ProvenRegion> = figure_3(0).iter().map(prove).collect();
    let (wall, processor) = (wall.elapsed().as_secs_f64(), (process_time() - processor).as_secs_f64());
    let boxes: usize = regions.iter().map(|region| region.attempts).sum();
    let least = regions.iter().map(|region| 1.0 - region.share(Guarantee::Undecided)).fold(1.0, f64::min);
    println!(
        "\nThe same regions *proven* (`map --prove {}`): boxes of gains of which every scene is stable, or every one unstable.\n",
        work.halvings
    );
    println!("| wall | asked for | processor | boxes looked at | processor a box | least share of an area that is decided | asked for |");
    println!("| ---: | ---: | ---: | ---: | ---: | ---: | ---: |");
    println!("| {wall:.1} s | 60 s | {processor:.1} s | {boxes} | {:.0} µs | {:.2} % | 99 % |", processor / boxes as f64 * 1e6, 100.0 * least);
}

/// The maps of Figure 3 over links that lose that share of the samples.
fn filled(work: Work, loss: u32, asked: &str) {
    let Work { rounds: count, cells: side, .. } = work;
    let count = if loss == 0 { count } else { count.min(3) };
    let families = figure_3(loss);
    let grid = Grid::new(side, side).expect("a grid");
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().expect("threads");
    let mut rounds = (Vec::new(), Vec::new());
    for _ in 0..count {
        let (wall, processor) = (Instant::now(), process_time());
        for family in &families {
            black_box(pool.install(|| Map::fill(family, grid, |_| {}, || false)).expect("a map"));
        }
        rounds.0.push(wall.elapsed());
        rounds.1.push(process_time() - processor);
    }
    let cells = families.len() * side * side;
    println!(
        "{} curves, a map of {side} × {side} cells each: {cells} radii without bounds, on two threads of two cores that others use too.\n",
        families.len()
    );
    println!("| wall | asked for | processor | processor a cell |");
    println!("| ---: | ---: | ---: | ---: |");
    let (wall, processor) = (median(rounds.0).as_secs_f64(), median(rounds.1).as_secs_f64());
    println!("| {wall:.2} s | {asked} | {processor:.2} s | {:.2} µs |", processor / cells as f64 * 1e6);
}

fn mean_square_cells(work: Work) {
    println!("\n## The mean square\n");
    println!(
        "Radii a second along the map KT × KC of N equal peers, over links of Tn that lose 5 % of the samples, or also have a jitter that is spread over"
    );
    println!("five ticks: the radii of a map, and those with proven bounds, which `point`, `boundary` and cells next to 1 take.\n");
    println!("| peers | links | radius | asked for | with bounds |");
    println!("| ---: | --- | ---: | ---: | ---: |");
    let spread = "link.jitter={ sd = \"1ms\", distribution = \"uniform\" }".to_owned();
    for (peers, jitter) in [(2, false), (3, false), (8, false), (1000, false), (3, true)] {
        let changes = ["link.loss=5%".to_owned()].into_iter().chain(jitter.then(|| spread.clone()));
        let family = family(peers, &changes.collect::<Vec<_>>());
        let (mut first, mut second) = (Walk::default(), Walk::default());
        let (mut one, mut other) = (FamilyScratch::default(), FamilyScratch::default());
        let times = work.measured(vec![
            Box::new(|| drop(black_box(family.radius(&first.next(), &mut one)))),
            Box::new(|| drop(black_box(family.bounded_radius(&second.next(), &mut other)))),
        ]);
        let [radius, bounded] = [0, 1].map(|place: usize| 1.0 / times[place].as_secs_f64());
        let (links, asked) = if jitter { ("loss and jitter", "—") } else { ("loss", "2000") };
        println!("| {peers} | {links} | {radius:.0} | {asked} | {bounded:.0} |");
    }
    println!("\nFigure 3 with a loss of 5 %:\n");
    filled(work, 5, "20 s");
}

fn different_peers(work: Work) {
    println!("\n## Eight peers, all different\n");
    println!(
        "From the scene to the verdict with its bounds, everything anew. *Reduced* finds no two peers equal, and only saves what nothing depends on.\n"
    );
    println!("| delay | states | full | asked for | reduced | states |");
    println!("| --- | ---: | ---: | ---: | ---: | ---: |");
    for (name, delay, asked) in [("Tn", 8, "350 µs"), ("6 Tn", 48, "20 ms")] {
        let scene = eight_different(delay);
        let of = |method| analyse(&scene, method).expect("an analysis");
        let times = work.measured(vec![Box::new(|| drop(black_box(of(Method::Full)))), Box::new(|| drop(black_box(of(Method::Reduced))))]);
        let states = |method| of(method).modes[0].parts[0].size;
        let (full, reduced) = (states(Method::Full), states(Method::Reduced));
        println!("| {name} | {full} | {} | {asked} | {} | {reduced} |", taken(times[0]), taken(times[1]));
    }
}

fn long_delays(work: Work) {
    println!("\n## Long delays\n");
    println!(
        "Three equal peers, KT = 20 N/m, KC = 3500 N/m, samples that take D frames: the radius of both blocks as matrices of D + 3 and D + 4 rows,"
    );
    println!(
        "and from their characteristic determinants of four rows (`DelayedLoop`), each with the error that it claims. *Chosen* is what a verdict"
    );
    println!("takes: the matrix with bounds up to 500 rows, the determinant beyond.\n");
    println!("| D | matrix, no bounds | chosen | its error | determinant | its error | apart |");
    println!("| ---: | ---: | ---: | ---: | ---: | ---: | ---: |");
    for &frames in work.frames {
        let changes = [format!("link.delay={}ms", 8 * frames), "coordination.stiffness=20".into()];
        let scene = equal(3, &changes);
        let family = family(3, &changes[..1]);
        let values = [20.0, 3500.0];
        let mut scratch = FamilyScratch::default();
        let of = || determinant(&scene, frames);
        let plain = work.once_or_median(|| drop(black_box(family.radius(&values, &mut scratch))));
        let mut bounded = None;
        let with_bounds = work.once_or_median(|| bounded = analyse(&scene, Method::Reduced).ok().map(|analysis| analysis.radius));
        let (matrix, found) = (bounded.expect("an analysis"), of());
        let times = work.once_or_median(|| {
            black_box(of());
        });
        println!(
            "| {frames} | {} | {} | {:.0e} | {} | {:.0e} | {:.0e} |",
            taken(plain),
            taken(with_bounds),
            matrix.error,
            taken(times),
            found.error,
            (matrix.value - found.value).abs()
        );
    }
}

fn determinant(scene: &cohaptic_scene::Scene, frames: u32) -> Radius {
    let [apart, together] = BarePair::new(scene).loops(frames, scene.coordination.gains, scene.peers[0].coupling);
    apart.bounded_radius(0.0).or(together.bounded_radius(0.0))
}

fn speed_against_error(work: Work) {
    println!("\n## Speed against error\n");
    println!(
        "Time of a verdict from the scene on, error of its radius against a reference of 50 digits (`crates/stability/tests/reference/radii.json`), and"
    );
    println!(
        "the error that it claims. *Growth* is that of a disturbance in a simulation of 200 frames, which claims nothing; *determinant* is for equal"
    );
    println!("peers who grasp. A dash: the method is not for that scene, or takes more than a minute.\n");
    println!("| scene | method | time | error | claimed |");
    println!("| --- | --- | ---: | ---: | ---: |");
    for reference in references() {
        let Reference { name, scene, radius, frames } = &reference;
        let peers = scene.peers.len();
        let short = frames.is_none_or(|frames| frames < 100);
        let row = |method: &str, found: Option<(Duration, f64, Option<f64>)>| match found {
            Some((time, value, claimed)) => {
                let claimed = claimed.map_or_else(|| "—".to_owned(), |claimed| format!("{claimed:.0e}"));
                println!("| {name} | {method} | {} | {:.0e} | {claimed} |", taken(time), (value - radius).abs());
            }
            None => println!("| {name} | {method} | — | — | — |"),
        };
        let by_method = |method| {
            let mut found = Radius { value: 0.0, error: 0.0 };
            let time = work.once_or_median(|| found = analyse(scene, method).expect("an analysis").radius);
            (time, found.value, Some(found.error))
        };
        row("full", (short && peers < 100).then(|| by_method(Method::Full)));
        row("reduced", Some(by_method(Method::Reduced)));
        let of_determinant = |frames| {
            let mut found = Radius { value: 0.0, error: 0.0 };
            let time = work.once_or_median(|| found = determinant(scene, frames));
            (time, found.value, Some(found.error))
        };
        row("determinant", frames.map(of_determinant));
        let of_growth = || {
            let mut found = None;
            let time = work.once_or_median(|| found = growth(scene));
            found.map(|value| (time, value, None))
        };
        row("growth", (short && peers < 100).then(of_growth).flatten());
    }
}

/// A time with three digits.
fn taken(time: Duration) -> String {
    let seconds = time.as_secs_f64();
    let (value, unit) = if seconds < 1e-3 {
        (seconds * 1e6, "µs")
    } else if seconds < 1.0 {
        (seconds * 1e3, "ms")
    } else {
        (seconds, "s")
    };
    let places = if value < 10.0 { 2 } else { usize::from(value < 100.0) };
    format!("{value:.places$} {unit}")
}
