//! Figures 3 and 4: stability regions over KT × KC.

use std::fmt::Write as _;

use cohaptic_picture::{Axis, Fill, Look, Panel, Picture, Region, Size};

use super::Figure;
use crate::case::Strategy;
use crate::region::{Atlas, HIGHEST, PEERS, Setting};

pub(super) fn figures(atlas: &Atlas, size: Size) -> Vec<Figure> {
    let of = |id: &str, number: &str, damping: f64| {
        // The dampings are 0 and 5.
        let settings: Vec<Setting> = Setting::all().into_iter().filter(|setting| (setting.damping - damping).abs() < 0.5).collect();
        let title = format!("Figure {number}: stability regions, BT = BC = {damping} N·s/m");
        let panels: Vec<Panel> = settings.iter().flat_map(|setting| Strategy::BOTH.map(|strategy| panel(atlas, *setting, strategy))).collect();
        Figure {
            id: id.to_owned(),
            svg: Picture::new(title.as_str()).note(SHADES).columns(2).aspect(1.0).panels(panels).size(size).svg(),
            title,
            caption: caption(),
            csv: csv(atlas, &settings),
        }
    };
    vec![of("fig-3", "3", 0.0), of("fig-4", "4", 5.0)]
}

/// Meaning of the shades of a panel, for the caption.
const SHADES: &str =
    "Each region is filled on the stable side of its line. The stronger the tint of a place, the more of these numbers of users are stable there.";

fn panel(atlas: &Atlas, setting: Setting, strategy: Strategy) -> Panel {
    // The axes are in kN/m, the maps in N/m.
    let kilo = |points: Vec<(f64, f64)>| points.into_iter().map(|(x, y)| (x / 1000.0, y / 1000.0)).collect::<Vec<_>>();
    let areas = PEERS.iter().enumerate().filter_map(|(number, peers)| {
        let map = &atlas.region(setting, strategy, *peers)?.map;
        let outlines = map.regions().into_iter().map(|region| kilo(region.points));
        let edges = map.contour().into_iter().map(|edge| kilo(edge.path()));
        // One tint for all regions: where several lie on each other, a patchwork of colours would hide which side of an edge is stable.
        Some(Region::new(outlines, Fill::Grey).bordered(edges, Look::of(number)).named(format!("N = {peers}")))
    });
    let mass = setting.mass.words();
    let axis = |name: &str, symbol: &str| Axis::new(name).symbol(symbol).unit("kN/m").range(0.0, HIGHEST / 1000.0);
    Panel::new(axis("Coordination stiffness", "K_T"), axis("Coupling stiffness", "K_C"))
        .titled(format!("{}, {mass}, {} ms one way", strategy.word(), setting.delay_us / 1000))
        .with_all(areas)
}

fn caption() -> String {
    "Lines are where the spectral radius is 1: gains that cross one change from stable to unstable or back. The paper has one panel for all numbers of users. It leaves open \
     whether its delay of 8 ms is one way, and whether a copy has the mass mO/N of its Section 2, so each reading has panels of its own."
        .to_owned()
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
