//! Claims about the effective coordination stiffness: equations (3) and (6), compared with simulated scenes on an ideal network.

use std::convert::Infallible;
use std::path::Path;

use cohaptic_harness::{Model, Observer, Simulation, TickRow};
use cohaptic_scene::Scene;
use cohaptic_stability::{Matrix, eigenvalues};

use super::{Claim, Topic, Verdict};
use crate::case::{Case, Strategy};
use crate::table::Table;
use crate::{PaperError, Watch};

/// Numbers of peers computed.
const PEERS: [usize; 8] = [2, 3, 4, 5, 8, 16, 32, 50];
/// Coordination stiffness KT of the simulated scenes \[N/m\].
const STIFFNESS: f64 = 1000.0;
/// Tick of the simulation and period of sending \[s\]. The ideal network has no delay and no limit of its rate, so packets are at most a tick old.
const TICK: f64 = 1e-4;

/// Effective stiffness for a number of peers, in units of KT.
struct Found {
    peers: usize,
    /// Largest eigenvalue of the stiffness matrix.
    matrix: f64,
    /// Stiffness measured from the swinging copies of a simulated scene.
    scene: f64,
    /// Frequency of the swing \[Hz\].
    hz: f64,
}

pub(super) fn claims(watch: &dyn Watch) -> Result<Vec<Claim>, PaperError> {
    let found = |strategy, scaled| PEERS.into_iter().map(|peers| one(strategy, peers, scaled, watch)).collect::<Result<Vec<Found>, PaperError>>();
    let (ap, pd, scaled) = (found(Strategy::Ap, false)?, found(Strategy::Pd, false)?, found(Strategy::Ap, true)?);
    Ok(vec![bounded(&ap, &pd), frequency(&ap, &scaled)])
}

/// Arguments that make the scene of [`swing`] of a scene of the paper, for the command line.
const SWING: &str =
    "run FILE --set coordination.update=0.1ms --set peer.tick=0.1ms --set scene.duration=0.1s --set peers.peer1.position=0.001 --against";

fn bounded(ap: &[Found], pd: &[Found]) -> Claim {
    // The bound must hold by the formula and in the simulated scenes.
    let falls = ap.windows(2).all(|pair| pair[1].matrix < pair[0].matrix && pair[1].scene < pair[0].scene);
    let rises = pd.windows(2).all(|pair| pair[1].matrix > pair[0].matrix && pair[1].scene > pair[0].scene);
    // The tolerances are for rounding of the eigenvalue, and for the fit to the simulated scene.
    let is_bounded = ap.iter().all(|found| found.matrix <= 2.0 + 1e-9 && found.scene <= 2.0 + 1e-6);
    let apart = ap.iter().chain(pd).map(|found| (found.matrix - found.scene).abs() / found.matrix).fold(0.0, f64::max);
    let ends = |all: &[Found]| all.first().zip(all.last()).map_or((f64::NAN, f64::NAN), |(first, last)| (first.scene, last.scene));
    let ((ap_first, ap_last), (pd_first, pd_last)) = (ends(ap), ends(pd));
    let verdict = if falls && rises && is_bounded && apart < 1e-6 {
        Verdict::Holds
    } else {
        Verdict::FailsAt(format!("a bound of 2·KT: AP has {ap_first:.3} to {ap_last:.3}"))
    };
    let table = Table::new("Effective stiffness, in units of KT", &["N", "paper", "here", "paper", "here"])
        .grouped([("", 1), ("AP", 2), ("PD", 2)])
        .all(ap.iter().zip(pd).map(|(ap, pd)| {
            let number = |value: f64| format!("{value:.3}");
            vec![ap.peers.to_string(), number(ap.matrix), number(ap.scene), number(pd.matrix), number(pd.scene)]
        }));
    let claim = Claim {
        claim: "AP has a bounded effective coordination stiffness, which falls to KT as N grows; that of PD grows with N",
        short: "AP bounds the stiffness that holds the copies together, however many users there are",
        paper: "eqs. (3) and (6)",
        says: "The stiffness matrix has the eigenvalue N/(N−1)·KT with AP, and N·KT with PD.",
        ours: format!(
            "On an ideal network, copies that are moved apart swing with these stiffnesses: AP's falls from {ap_first:.3} to {ap_last:.3} KT, PD's grows from {pd_first:.3} to \
             {pd_last:.3} KT. The largest relative difference from the eigenvalue is {apart:.0e}."
        ),
        tables: vec![table],
        verdict,
        ..Claim::blank("bounded-stiffness", Topic::Stiffness)
    };
    let how = "One copy begins 1 mm away from the others. Its swing is slower with AP than with PD.";
    claim.shown_by(case(Strategy::Ap, 8, false).text(), how, &[&format!("{SWING} coordination.strategy=proportional-derivative")])
}

fn frequency(ap: &[Found], scaled: &[Found]) -> Claim {
    let grows = ap.windows(2).all(|pair| pair[1].hz > pair[0].hz);
    let stays = scaled.iter().all(|found| (found.hz / scaled[0].hz - 1.0).abs() < 1e-6);
    let ends = |all: &[Found]| all.first().zip(all.last()).map_or((f64::NAN, f64::NAN), |(first, last)| (first.hz, last.hz));
    let ((first, last), (scaled_first, scaled_last)) = (ends(ap), ends(scaled));
    let table = Table::new("Frequency at which the copies swing apart, AP [Hz]", &["N", "gains as they are", "gains scaled with N"])
        .all(ap.iter().zip(scaled).map(|(ap, scaled)| vec![ap.peers.to_string(), format!("{:.2}", ap.hz), format!("{:.2}", scaled.hz)]));
    let verdict = if grows && stays {
        Verdict::Holds
    } else {
        Verdict::FailsAt(format!("{first:.2} to {last:.2} Hz unscaled, {scaled_first:.2} to {scaled_last:.2} Hz scaled"))
    };
    let claim = Claim {
        claim: "The copies are governed by (N/mO)·K_AP, so that a bounded stiffness is not enough for any N: gains have to be scaled with N",
        short: "a bounded stiffness is not enough for any number of users: the gains have to be scaled too",
        paper: "Section 2, not used there",
        says: "Each copy has the mass mO/N, so AP has to be coupled with a scaling of KT to guarantee stability for arbitrary N.",
        ours: format!(
            "The swing gets faster with each user under AP too, from {first:.2} to {last:.2} Hz, because each copy gets lighter. With scaling = \"inverse-n\" it stays at \
             {scaled_first:.2} Hz."
        ),
        tables: vec![table],
        verdict,
        ..Claim::blank("frequency-needs-scaling", Topic::Stiffness)
    };
    claim.shown_by(
        case(Strategy::Ap, 8, false).text(),
        "The second run has scaled gains and swings more slowly.",
        &[&format!("{SWING} coordination.scaling=inverse-n")],
    )
}

/// Returns the scene in which copies swing without delay, damping and touch.
const fn case(strategy: Strategy, peers: usize, scaled: bool) -> Case {
    Case { strategy, stiffness: STIFFNESS, damping: 0.0, delay_us: 0, touching: 0, scaled, ..Case::paper(strategy, peers) }
}

fn one(strategy: Strategy, peers: usize, scaled: bool, watch: &dyn Watch) -> Result<Found, PaperError> {
    if watch.stops() {
        return Err(PaperError::Stopped);
    }
    let n = crate::region::share(peers, 1);
    // Equations (3) and (6) with KT = 1: diagonal and other entries of the stiffness matrix.
    let (own, other) = match strategy {
        Strategy::Pd => (n - 1.0, -1.0),
        Strategy::Ap => (1.0, -1.0 / (n - 1.0)),
    };
    let matrix = Matrix::from_fn(peers, peers, |row, column| if row == column { own } else { other });
    // The matrix is symmetric, so the imaginary parts are rounding.
    let matrix = eigenvalues(&matrix).iter().map(|value| value.re).fold(0.0, f64::max);
    let stiffness = swing(strategy, peers, scaled)?;
    // A copy has the mass mO/N with mO = 0.45 kg.
    let hz = (stiffness * n / 0.45).sqrt() / std::f64::consts::TAU;
    Ok(Found { peers, matrix, scene: stiffness / STIFFNESS, hz })
}

/// Returns the stiffness with which a copy, moved away from the others, swings against the others \[N/m\].
///
/// With forces held over a tick T, the distance d of two copies of mass m obeys exactly d₂ − 2d₁ + d₀ = −q·(d₁ + d₀) with q = κT²/2m. The function fits q
/// to all ticks by least squares.
fn swing(strategy: Strategy, peers: usize, scaled: bool) -> Result<f64, PaperError> {
    let overrides = ["coordination.update=0.1ms", "peer.tick=0.1ms", "scene.duration=0.1s", "peers.peer1.position=0.001"].map(str::to_owned);
    let scene = Scene::parse(&case(strategy, peers, scaled).text(), Path::new("swing.toml"), &overrides)?;
    let mut distances = Distances::default();
    let Ok(_) = Simulation::new(&scene, Model::Least).run(&mut distances);
    let (mut above, mut below) = (0.0, 0.0);
    // Least squares for q: minimises the sum of (d₂ − 2d₁ + d₀ + q·(d₁ + d₀))² over all ticks.
    for d in distances.all.windows(3) {
        above += (2.0 * d[1] - d[0] - d[2]) * (d[1] + d[0]);
        below += (d[1] + d[0]) * (d[1] + d[0]);
    }
    let mass = 0.45 / crate::region::share(peers, 1);
    Ok(above / below * 2.0 * mass / (TICK * TICK))
}

/// Observer of the distance between the first two copies, at every tick \[m\].
#[derive(Default)]
struct Distances {
    first: f64,
    all: Vec<f64>,
}

impl Observer for Distances {
    type Error = Infallible;

    fn wants_ticks(&self) -> bool {
        true
    }

    fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), Infallible> {
        match row.peer {
            // Ticks of one instant come in the order of the peers, so `first` is of the same instant.
            0 => self.first = row.object.position[0],
            1 => self.all.push(self.first - row.object.position[0]),
            _ => {}
        }
        Ok(())
    }
}
