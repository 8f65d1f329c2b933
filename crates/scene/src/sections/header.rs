//! Readers of `[scene]` and `[simulation]`.

use core::time::Duration;

use cohaptic_linkfile::document::Node;
use cohaptic_linkfile::reading::{Context, TableReader, values};
use cohaptic_linkfile::schema::{Choices, Form, Table, optional, required, usual, words};
use cohaptic_peer::Integrator;

use super::MOST;
use crate::model::Axes;

pub(crate) static SCENE: Table = Table::of(&[&[
    optional("title", Form::Text, "Title for people; the name of the file by default"),
    required("duration", Form::PositiveDuration, "Length of the scene, above zero").expecting("a duration above zero such as \"7s\""),
    usual("seed", Form::Integer(0, MOST), "0", "Seed of all random numbers"),
    usual("axes", Form::Integer(1, 3), "1", "Number of translational axes: x, then y, then z").expecting("a number of axes: 1, 2 or 3"),
    // Bounds the memory of a mistyped count: each peer takes about two kilobytes.
    optional("count", Form::Integer(2, 1_000_000), "Number of equal peers, named peer1, peer2 and so on; entries [[peers]] may change some of them")
        .expecting("a number of peers, {}"),
]]);

pub(crate) static SIMULATION: Table = Table::of(&[&[
    usual("integrator", Form::Words(const { &words(&INTEGRATORS) }), "\"exact\"", "Integration of the motion between two ticks"),
    usual("substeps", Form::Integer(1, u32::MAX as u64), "1", "Steps of the integrator per tick; not with exact").expecting(STEPS),
    // Bounds the computing time of a tick.
    usual("rotation-steps", Form::Integer(1, 10_000), "1", "Steps of the rotation per substep").expecting(STEPS),
]]);
const INTEGRATORS: Choices<Method, 3> = [
    ("exact", Method::Exact, "the exact solution"),
    ("semi-implicit-euler", Method::SemiImplicitEuler, "the velocity first, then the position"),
    ("rk4", Method::RungeKutta4, "Runge and Kutta's fourth order"),
];
const STEPS: &str = "a number of steps a tick, {}";

/// Values of `[scene]`. A field is `None` after a refused value.
#[derive(Debug, Default)]
pub(crate) struct Header {
    /// `Some(None)` if the scene has no title.
    pub(crate) title: Option<Option<String>>,
    pub(crate) duration: Option<Duration>,
    pub(crate) seed: Option<u64>,
    pub(crate) axes: Option<Axes>,
    /// `Some(None)` if the scene has no count.
    pub(crate) count: Option<Option<u64>>,
}

/// Values of `[simulation]`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Stepping {
    pub(crate) integrator: Integrator,
    /// Steps of the rotation per tick, multiplied by the substeps of the integrator.
    pub(crate) rotation_steps: u32,
}

pub(crate) fn read_header(node: &Node, context: Context<'_>) -> Option<Header> {
    let mut table = TableReader::new(node, context, &SCENE, "a table such as [scene]")?;
    let title = table.maybe("title", |node, context| values::text(node, context, "a text").map(str::to_owned));
    let (duration, seed) = (table.value("duration"), table.value("seed"));
    let axes = table.value("axes").map(|axes: u64| match axes {
        1 => Axes::One,
        2 => Axes::Two,
        _ => Axes::Three,
    });
    let count = table.maybe_value("count");
    table.finish();
    Some(Header { title, duration, seed, axes, count })
}

/// Reads `[simulation]`.
pub(crate) fn read_stepping(node: &Node, context: Context<'_>) -> Option<Stepping> {
    const NO_STEPS: &str = "the integrator \"exact\" takes no substeps: expected no such key, or \"semi-implicit-euler\" or \"rk4\"";
    let mut table = TableReader::new(node, context, &SIMULATION, "a table such as [simulation]")?;
    let method = table.choice("integrator", &INTEGRATORS);
    let substeps: Option<u64> = table.only_if(method != Some(Method::Exact), "substeps", NO_STEPS).and_then(|()| table.value("substeps"));
    let rotation_steps: Option<u64> = table.value("rotation-steps");
    table.finish();
    let steps = u32::try_from(substeps?).ok()?;
    let integrator = match method? {
        Method::Exact => Integrator::Exact,
        Method::SemiImplicitEuler => Integrator::SemiImplicitEuler { steps },
        Method::RungeKutta4 => Integrator::RungeKutta4 { steps },
    };
    Some(Stepping { integrator, rotation_steps: u32::try_from(rotation_steps?).ok()? })
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Method {
    Exact,
    SemiImplicitEuler,
    RungeKutta4,
}
