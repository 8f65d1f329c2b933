//! Figure 5: the admittance of the object.

use std::fmt::Write as _;

use super::admittance::{Curve, MASS, Responses};
use super::chart::{Line, Panel, draw};
use super::{Figure, Table};
use crate::case::{Case, Strategy};

pub(super) fn figure(responses: &Responses) -> Figure {
    let title = "Figure 5: admittance of the object, KT = 1000 N/m, BT = 5 N·s/m, Td = Tn = 8 ms".to_owned();
    let panels = [panel(responses, true, true), panel(responses, false, true), panel(responses, true, false), panel(responses, false, false)];
    let caption = format!(
        "Velocity over force of the first peer's device, KC = 3500 N/m and BC = 5 N·s/m as in Section 5 (Section 4 gives none), with the {MASS} kg of an ideal object. Agrees: a damper at \
         low frequencies where the ideal is a mass, more of it with more peers, and with PD more than with AP. The paper does not say whether the others touch the object; both are \
         shown. At high frequencies the device's own mass and coupling show, which the paper's ordinate does not tell from the object's. The paper prints no numbers."
    );
    Figure { id: "fig-5".to_owned(), svg: draw(&panels, 2, &title), title, caption, table: table(responses), csv: csv(responses) }
}

fn is_one(case: &Case) -> bool {
    case.touching == 1
}

fn name(case: &Case) -> String {
    if case.peers == 2 { "N = 2".to_owned() } else { format!("{} N = {}", case.strategy.word(), case.peers) }
}

fn panel(responses: &Responses, one: bool, magnitude: bool) -> Panel {
    let y = if magnitude { (-60.0, 60.0) } else { (-270.0, 60.0) };
    let points = |values: &[f64]| responses.frequencies.iter().copied().zip(values.iter().copied()).collect::<Vec<_>>();
    let mut lines: Vec<Line> = Vec::new();
    for curve in responses.curves.iter().filter(|curve| is_one(&curve.case) == one) {
        let values = if magnitude { &curve.decibels } else { &curve.phases };
        let line = Line::within(name(&curve.case), curve.case.peers - 2, points(values), y);
        lines.push(if curve.case.strategy == Strategy::Pd { line.dashed() } else { line });
    }
    let ideal = if magnitude { responses.ideal() } else { vec![-90.0; responses.frequencies.len()] };
    lines.push(Line::within("ideal mass".to_owned(), 6, points(&ideal), y));
    if !magnitude {
        for line in &mut lines {
            line.name.clear();
        }
    }
    let (word, quantity) = (if one { "one touches" } else { "all touch" }, if magnitude { "magnitude" } else { "phase" });
    Panel {
        title: format!("{quantity}, {word}"),
        x_label: "f [Hz]",
        y_label: if magnitude { "dB re 1 m/(N·s)" } else { "degrees" },
        x: (0.01, 40.0),
        y,
        decades: true,
        lines,
    }
}

fn table(responses: &Responses) -> Table {
    let mut table = Table::new(&["curve", "the paper", "ours: the loop is", "at 0.01 Hz", "at low frequency, viscosity"]);
    for curve in &responses.curves {
        let Curve { case, is_stable, decibels, .. } = curve;
        let stable = if *is_stable { "stable" } else { "unstable" };
        let fit = responses.fits.iter().find(|fit| fit.case == *case);
        let viscosity = fit.map_or_else(String::new, |fit| format!("{:.2} N·s/m", fit.viscosity));
        let first = decibels.first().map_or_else(String::new, |first| format!("{first:.2} dB"));
        let touch = if is_one(case) { "one touches" } else { "all touch" };
        table.rows.push(vec![format!("{}, {touch}", name(case)), "curve only".to_owned(), stable.to_owned(), first, viscosity]);
    }
    let ideal = responses.ideal().first().map_or_else(String::new, |first| format!("{first:.2} dB"));
    table.rows.push(vec!["ideal mass".to_owned(), "curve only".to_owned(), "stable".to_owned(), ideal, "0 N·s/m".to_owned()]);
    table
}

fn csv(responses: &Responses) -> String {
    let mut csv = "strategy,peers,touching,hz,magnitude_db,phase_deg\n".to_owned();
    for Curve { case, decibels, phases, .. } in &responses.curves {
        for ((hz, decibels), phase) in responses.frequencies.iter().zip(decibels).zip(phases) {
            let _ = writeln!(csv, "{},{},{},{hz:.9},{decibels:.9},{phase:.9}", case.strategy.word(), case.peers, case.touching);
        }
    }
    csv
}
