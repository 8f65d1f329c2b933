//! Figures 3 and 4: stability regions over KT × KC.

use std::fmt::Write as _;

use cohaptic_picture::{Axis, Line, Look, Panel, Picture, Size};

use super::{Figure, Table};
use crate::case::Strategy;
use crate::page::{percent, percents};
use crate::region::{Atlas, HIGHEST, PEERS, Setting};

pub(super) fn figures(atlas: &Atlas, size: Size) -> Vec<Figure> {
    let of = |id: &str, number: &str, damping: f64| {
        let settings: Vec<Setting> = Setting::all().into_iter().filter(|setting| (setting.damping - damping).abs() < 0.5).collect();
        let title = format!("Figure {number}: stability regions, BT = BC = {damping} N·s/m");
        let panels: Vec<Panel> = settings.iter().flat_map(|setting| Strategy::BOTH.map(|strategy| panel(atlas, *setting, strategy))).collect();
        Figure {
            id: id.to_owned(),
            svg: Picture::new(title.as_str()).columns(2).aspect(1.0).panels(panels).size(size).svg(),
            title,
            caption: caption(atlas, &settings),
            table: table(atlas, &settings),
            csv: csv(atlas, &settings),
        }
    };
    vec![of("fig-3", "3", 0.0), of("fig-4", "4", 5.0)]
}

fn panel(atlas: &Atlas, setting: Setting, strategy: Strategy) -> Panel {
    let kilo = |(x, y): (f64, f64)| (x / 1000.0, y / 1000.0);
    let lines = PEERS.iter().enumerate().filter_map(|(number, peers)| {
        let region = atlas.region(setting, strategy, *peers)?;
        let closed = |line: cohaptic_stability::Polyline| {
            // A closed contour repeats its first point, so that the drawn line closes.
            let first = line.points.first().copied().filter(|_| line.closed);
            line.points.into_iter().chain(first).map(kilo).collect::<Vec<_>>()
        };
        Some(Line::runs(region.map.contour().into_iter().map(closed), Look::of(number)).named(format!("N = {peers}")))
    });
    let mass = setting.mass.words();
    let axis = |name: &str, symbol: &str| Axis::new(name).symbol(symbol).unit("kN/m").range(0.0, HIGHEST / 1000.0);
    Panel::new(axis("Coordination stiffness", "K_T"), axis("Coupling stiffness", "K_C"))
        .titled(format!("{}, {mass}, {} ms one way", strategy.word(), setting.delay_us / 1000))
        .with_all(lines)
}

fn caption(atlas: &Atlas, settings: &[Setting]) -> String {
    let mut text = "Lines are where the spectral radius is 1: gains that cross one change from stable to unstable or back. The shares below say how much is stable. \
                    The paper has one panel and prints no areas; it leaves open whether Td is one way, and its Section 2 gives each copy mO/N."
        .to_owned();
    for setting in settings {
        let (ap, pd) = (atlas.areas(*setting, Strategy::Ap), atlas.areas(*setting, Strategy::Pd));
        let end = |areas: &[f64]| areas.last().copied().unwrap_or(f64::NAN) / areas.first().copied().unwrap_or(f64::NAN) - 1.0;
        let only = PEERS.map(|peers| atlas.only_pd(*setting, peers)).into_iter().fold(0.0, f64::max);
        let _ = write!(
            text,
            " With {}, {} ms one way, from N = 2 to 8 AP's area changes by {:+.0} % and PD's by {:+.0} %; up to {} of the square is stable with PD alone.",
            setting.mass.words(),
            setting.delay_us / 1000,
            100.0 * end(&ap),
            100.0 * end(&pd),
            percent(only)
        );
    }
    text
}

fn table(atlas: &Atlas, settings: &[Setting]) -> Table {
    let mut table = Table::new(&["region", "the paper", "ours: stable share, N = 2, 3, 4, 5, 8"]);
    for setting in settings {
        for strategy in Strategy::BOTH {
            let paper = if strategy == Strategy::Ap { "largely unaffected by N" } else { "decreases with N" };
            let name = format!("{}, {}, {} ms one way", strategy.word(), setting.mass.words(), setting.delay_us / 1000);
            table.rows.push(vec![name, paper.to_owned(), percents(&atlas.areas(*setting, strategy))]);
        }
    }
    table
}

fn csv(atlas: &Atlas, settings: &[Setting]) -> String {
    let mut csv = "strategy,peers,mass,delay_ms,damping,stiffness,coupling_stiffness,radius\n".to_owned();
    for region in atlas.regions.iter().filter(|region| settings.contains(&region.setting)) {
        let setting = region.setting;
        let mass = if setting.mass == crate::case::Mass::Split { "split" } else { "whole" };
        for (y, row) in region.map.y.iter().zip(&region.map.radius) {
            for (x, radius) in region.map.x.iter().zip(row) {
                let (strategy, delay) = (region.strategy.word(), setting.delay_us / 1000);
                let _ = writeln!(csv, "{strategy},{},{mass},{delay},{},{x},{y},{radius:.9}", region.peers, setting.damping);
            }
        }
    }
    csv
}
