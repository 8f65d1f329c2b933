//! Maps of scenes, and lines in maps made up.

use super::contour::Polyline;
use super::*;
use crate::Unwatched;
use crate::paper_scene::PAPER;

fn family(keys: &[&str]) -> Family {
    let keys = keys.iter().map(|key| KeyRange::parse(key).unwrap()).collect();
    Family::new(PAPER, "map.toml".as_ref(), &[], keys).unwrap()
}

const KEYS: [&str; 2] = ["coordination.stiffness=0..6000", "peer.coupling.stiffness=500..20000"];

fn filled(family: &Family, grid: Grid) -> Map {
    Map::fill(family, grid, |_| (), || false).unwrap()
}

#[test]
fn grids_of_nothing_and_of_too_much_are_refused() {
    for (columns, rows) in [(0, 10), (10, 0), (100_000, 10_000), (usize::MAX, 2), (100_000_001, 1)] {
        let message = Grid::new(columns, rows).unwrap_err().to_string();
        assert!(message.contains("expected at least 1 and at most 100000000"), "{message}");
    }
    assert!(Grid::new(10_000, 10_000).is_ok());
    let one = Map::fill(&family(&KEYS[..1]), Grid::new(2, 2).unwrap(), |_| (), || false);
    assert!(matches!(one, Err(MapError::Keys { keys: 1 })));
}

#[test]
fn a_map_is_the_same_whatever_the_number_of_threads() {
    let (family, grid) = (family(&KEYS), Grid::new(23, 17).unwrap());
    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let one = pool(1).install(|| filled(&family, grid));
    assert_eq!(one, pool(8).install(|| filled(&family, grid)));
    assert!(one.is_complete());
    assert_eq!((one.x[0], one.x[22], one.y[0], one.y[16]), (0.0, 6000.0, 500.0, 20000.0));
}

#[test]
fn known_rows_are_not_computed_again() {
    let (family, grid) = (family(&KEYS), Grid::new(6, 9).unwrap());
    let whole = filled(&family, grid);
    let rows = Mutex::new(Vec::new());
    let stop = || rows.lock().unwrap().len() >= 4;
    let part = Map::fill(&family, grid, |row| rows.lock().unwrap().push(row), stop).unwrap();
    assert!(!part.is_complete());
    let first = rows.into_inner().unwrap();
    assert!(first.iter().all(|row| part.radius[*row] == whole.radius[*row]));
    // A mark shows that the row was taken as it is.
    let known_row = |radius: Vec<f64>| MapRow { nominal: vec![false; radius.len()], radius };
    let mut known: Vec<MapRow> = part.radius.into_iter().map(known_row).collect();
    known[first[0]] = MapRow { radius: vec![7.0; 6], nominal: vec![true; 6] };
    let again = Mutex::new(Vec::new());
    let put_away = |row: usize, cells: &MapRow| again.lock().unwrap().push((row, cells.clone()));
    let resumed = Map::resume_watched(&family, grid, known, put_away, &Unwatched).unwrap();
    assert!(resumed.is_complete());
    let again = again.into_inner().unwrap();
    assert_eq!(first.len() + again.len(), 9);
    assert!(again.iter().all(|(row, cells)| !first.contains(row) && cells.radius == whole.radius[*row]));
    assert_eq!((&resumed.radius[first[0]], &resumed.nominal[first[0]]), (&vec![7.0; 6], &vec![true; 6]));
    let odd = Map::resume_watched(&family, grid, vec![known_row(vec![1.0; 5])], |_, _| (), &Unwatched);
    assert!(matches!(odd, Err(MapError::Known { row: 0, cells: 5, columns: 6 })));
    let odd = Map::resume_watched(&family, grid, vec![MapRow::default(); 10], |_, _| (), &Unwatched);
    assert!(matches!(odd, Err(MapError::Known { row: 9, .. })));
}

/// Returns a map of the radius exp(`level(x, y)`).
fn made_up(columns: usize, rows: usize, level: impl Fn(f64, f64) -> f64) -> Map {
    let range = |text| KeyRange::parse(text).unwrap();
    let (x, y) = (nodes(&range("x=-2..2"), columns), nodes(&range("y=-1..1"), rows));
    let radius = y.iter().map(|y| x.iter().map(|x| libm::exp(level(*x, *y))).collect()).collect();
    let nominal = vec![vec![false; columns]; rows];
    Map { x, y, radius, nominal }
}

/// Returns twice the area to the left of a closed line, by the shoelace formula.
fn area(line: &Polyline) -> f64 {
    let ends = line.points.iter().zip(line.points.iter().cycle().skip(1));
    0.5 * ends.map(|((x0, y0), (x1, y1))| x0 * y1 - x1 * y0).sum::<f64>()
}

#[test]
fn a_round_region_has_a_closed_line_with_the_stable_side_on_its_left() {
    let map = made_up(201, 101, |x, y| x * x + y * y - 0.64);
    let lines = map.contour();
    assert!(lines.len() == 1 && lines[0].closed);
    // The level is a parabola between nodes 0.02 apart: linear interpolation is off by at most 0.02²/4 in it.
    assert!(lines[0].points.iter().all(|(x, y)| (libm::hypot(*x, *y) - 0.8).abs() < 1e-4));
    assert!((area(&lines[0]) - 0.64 * std::f64::consts::PI).abs() < 2e-3);
    assert!(map.regions().iter().all(|line| line.closed));
    // Inside out, the hole is on the right of its line.
    let hole = made_up(201, 101, |x, y| 0.64 - x * x - y * y);
    assert!(hole.contour().iter().all(|line| line.closed && area(line) < 0.0));
    let total: f64 = hole.regions().iter().map(area).sum();
    assert!((total - (8.0 - 0.64 * std::f64::consts::PI)).abs() < 2e-3);
}

#[test]
fn a_line_that_leaves_the_map_is_open_and_its_region_closed() {
    let map = made_up(11, 7, |x, y| x + 0.5 * y);
    let lines = map.contour();
    assert!(lines.len() == 1 && !lines[0].closed);
    assert!(lines[0].points.iter().all(|(x, y)| (x + 0.5 * y).abs() < 1e-12));
    let regions = map.regions();
    assert!(regions.len() == 1 && regions[0].closed);
    assert!((area(&regions[0]) - 4.0).abs() < 1e-12);
    assert!(made_up(5, 5, |_, _| 1.0).regions().is_empty());
    assert!((made_up(5, 5, |_, _| -1.0).regions().iter().map(area).sum::<f64>() - 8.0).abs() < 1e-12);
}

#[test]
fn saddles_gaps_and_infinities_have_lines_that_hang_together() {
    let map = made_up(4, 4, |x, y| if x * y > 0.0 { -1.0 } else { 1.5 });
    assert!((map.regions().iter().map(area).sum::<f64>()) > 0.0);
    let mut odd = made_up(8, 6, |x, y| libm::sin(9.0 * x) * libm::cos(7.0 * y));
    odd.radius[2] = Vec::new();
    odd.radius[3][4] = f64::INFINITY;
    odd.radius[3][5] = f64::NAN;
    odd.radius[4][1] = 0.0;
    let within = |line: &Polyline| line.points.iter().all(|(x, y)| x.abs() <= 2.0 && y.abs() <= 1.0);
    assert!(odd.contour().iter().all(within) && odd.regions().iter().all(|line| line.closed && within(line)));
}
