//! Maps and boundaries: scenes with keys left open.

use cohaptic_answers::{NamedMap, boundary_picture, map_picture};
use cohaptic_picture::Picture;
use cohaptic_stability::{Boundary, BoundaryError, BoundaryOptions, Criterion, Family, FamilyError, Grid, KeyRange, Map, MapError, MapRow};
use numpy::{IntoPyArray, PyArray1};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::arrays::matrix;
use crate::campaign_table::unit_of;
use crate::drawing::Drawing;
use crate::errors::{of_analysis, of_scene, of_value};
use crate::interrupt::on_threads;
use crate::scene::Scene;

fn range(text: &str) -> PyResult<KeyRange> {
    KeyRange::parse(text).map_err(|error| of_value(&error))
}

/// Returns the exception for an error of a family.
fn refused(py: Python<'_>, error: &FamilyError) -> PyErr {
    match error {
        FamilyError::Scene(error) => of_scene(py, error),
        FamilyError::Analysis(error) => of_analysis(py, error),
        error => of_value(error),
    }
}

impl Scene {
    fn family(&self, py: Python<'_>, keys: Vec<KeyRange>) -> PyResult<Family> {
        let (text, file, overrides) = self.source();
        py.detach(|| Family::new(text, file, overrides, keys)).map_err(|error| refused(py, &error))
    }
}

/// Returns the scene of a family with every open key at the lower end. Pictures show the title and the name of the law of this scene.
fn at_low(py: Python<'_>, family: &Family) -> PyResult<cohaptic_scene::Scene> {
    let low: Vec<f64> = family.keys().iter().map(|key| key.low).collect();
    family.scene(&low).map_err(|error| refused(py, &error))
}

fn criterion(family: &Family) -> &'static str {
    family.criterion().word()
}

/// Returns the radius over a grid of two keys, each `KEY=LOW..HIGH`, as a mapping.
#[pyfunction]
#[pyo3(name = "map", signature = (scene: "Scene", x: "str", y: "str", columns: "int", rows: "int", threads: "int") -> "dict[str, typing.Any]")]
pub(crate) fn map_of<'py>(
    py: Python<'py>,
    scene: &Scene,
    x: &str,
    y: &str,
    columns: usize,
    rows: usize,
    threads: usize,
) -> PyResult<Bound<'py, PyDict>> {
    let keys = vec![range(x)?, range(y)?];
    let grid = Grid::new(columns, rows).map_err(|error| of_value(&error))?;
    let family = scene.family(py, keys.clone())?;
    let nothing = |_: usize, _: &MapRow| ();
    let filled = on_threads(py, threads, |stop| {
        let map = Map::resume_watched(&family, grid, Vec::new(), nothing, stop)?;
        let verdicts = if map.is_complete() { map.verdicts(&family)? } else { Vec::new() };
        Ok((map, verdicts))
    })?;
    let (map, verdicts) = filled.map_err(|error: MapError| match error {
        MapError::Family(error) => refused(py, &error),
        error => of_value(&error),
    })?;
    let said = PyDict::new(py);
    let drawing = {
        let (map, keys, low, criterion) = (map.clone(), keys.clone(), at_low(py, &family)?, family.criterion());
        let left_out = family.left_out().to_vec();
        Drawing::of(move || {
            let named = NamedMap { name: low.coordination.strategy.name(), map: &map, criterion, left_out: &left_out };
            let drawn = map_picture(&low.title, [&keys[0], &keys[1]], &[named]);
            drawn.unwrap_or_else(|| Picture::new(low.title.as_str()))
        })
    };
    said.set_item("drawing", drawing)?;
    said.set_item("keys", keys.iter().map(|key| key.key.clone()).collect::<Vec<_>>())?;
    said.set_item("units", keys.iter().map(|key| unit_of(&key.key, &key.unit)).collect::<Vec<_>>())?;
    said.set_item("criterion", criterion(&family))?;
    let contours = map.contour().into_iter().map(|line| {
        let (points, count) = (line.points.iter().flat_map(|(x, y)| [*x, *y]).collect(), line.points.len());
        matrix::<f64>(py, count, 2, points)
    });
    said.set_item("contours", PyList::new(py, contours.collect::<PyResult<Vec<_>>>()?)?)?;
    said.set_item("radius", matrix(py, rows, columns, map.radius.into_iter().flatten().collect())?)?;
    said.set_item("nominal", matrix(py, rows, columns, map.nominal.into_iter().flatten().collect::<Vec<bool>>())?)?;
    let words = verdicts.into_iter().flatten().map(|verdict| verdict.word());
    said.set_item("verdicts", words.collect::<Vec<_>>())?;
    said.set_item("x", map.x.into_pyarray(py))?;
    said.set_item("y", map.y.into_pyarray(py))?;
    Ok(said)
}

/// Returns every crossing along a key, `KEY=LOW..HIGH`, as a mapping.
#[pyfunction]
#[pyo3(name = "boundary", signature = (scene: "Scene", along: "str", tolerance: "float | None", samples: "int | None", threads: "int") -> "dict[str, typing.Any]")]
pub(crate) fn boundary_of<'py>(
    py: Python<'py>,
    scene: &Scene,
    along: &str,
    tolerance: Option<f64>,
    samples: Option<usize>,
    threads: usize,
) -> PyResult<Bound<'py, PyDict>> {
    let key = range(along)?;
    let family = scene.family(py, vec![key.clone()])?;
    let usual = if family.criterion() == Criterion::MeanSquare { BoundaryOptions::of_mean_square(&key) } else { BoundaryOptions::of(&key) };
    let options = BoundaryOptions { tolerance: tolerance.unwrap_or(usual.tolerance), samples: samples.unwrap_or(usual.samples), ..usual };
    let found = on_threads(py, threads, |stop| Boundary::find_watched(&family, options, &[], |_| (), stop))?;
    let found = found.map_err(|error| match error {
        BoundaryError::Radius(error) => refused(py, &error),
        error => of_value(&error),
    })?;
    let said = PyDict::new(py);
    let drawing = {
        let (found, key, title, criterion) = (found.clone(), key.clone(), at_low(py, &family)?.title, family.criterion());
        let left_out = family.left_out().to_vec();
        Drawing::of(move || boundary_picture(&title, &key, criterion, &left_out, &found))
    };
    said.set_item("drawing", drawing)?;
    said.set_item("key", &key.key)?;
    said.set_item("unit", unit_of(&key.key, &key.unit))?;
    said.set_item("criterion", criterion(&family))?;
    said.set_item("first", found.first.word())?;
    let crossings = found.crossings.iter().map(|crossing| (crossing.value, crossing.from.word(), crossing.to.word()));
    said.set_item("crossings", crossings.collect::<Vec<_>>())?;
    said.set_item("marginal", found.marginal.iter().map(|stretch| (stretch.low, stretch.high)).collect::<Vec<_>>())?;
    said.set_item("tolerance", options.tolerance)?;
    said.set_item("is_settled", found.is_settled())?;
    said.set_item("nominal", found.nominal())?;
    let column = |of: fn(&(f64, cohaptic_stability::Cell)) -> f64| -> Bound<'py, PyArray1<f64>> {
        found.known.iter().map(of).collect::<Vec<f64>>().into_pyarray(py)
    };
    said.set_item("values", column(|(value, _)| *value))?;
    said.set_item("radius", column(|(_, cell)| cell.radius.value))?;
    said.set_item("error", column(|(_, cell)| cell.radius.error))?;
    Ok(said)
}
