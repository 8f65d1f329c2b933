//! Figure 5: admittance of the object.

use std::fmt::Write as _;

use cohaptic_picture::{Axis, Line, Look, Panel, Picture, Size};

use super::Figure;
use super::admittance::{Curve, MASS, Responses};
use crate::case::{Case, Strategy};

pub(super) fn figure(responses: &Responses, size: Size) -> Figure {
    let title = "Figure 5: admittance of the object, KT = 1000 N/m, BT = 5 N·s/m, Td = Tn = 8 ms".to_owned();
    let panels = [panel(responses, true, true), panel(responses, false, true), panel(responses, true, false), panel(responses, false, false)];
    let caption = format!(
        "Velocity of the first user's device over the force on it, beside that of a free mass of {MASS} kg. KC = 3500 N/m and BC = 5 N·s/m are those of Section 5, because \
         Section 4 gives none. The paper does not say whether the other users touch the object, so both are drawn. At low frequencies the device meets a damper where the ideal \
         is a mass. At high frequencies the device's own mass and its coupling show, which the paper's axis does not tell from the object's."
    );
    Figure {
        id: "fig-5".to_owned(),
        svg: Picture::new(title.as_str()).columns(2).panels(panels).size(size).svg(),
        title,
        caption,
        csv: csv(responses),
    }
}

fn is_one(case: &Case) -> bool {
    case.touching == 1
}

fn name(case: &Case) -> String {
    if case.peers == 2 { "N = 2".to_owned() } else { format!("{} N = {}", case.strategy.word(), case.peers) }
}

/// Returns the style of a curve: a colour per number of peers, and dashes for PD.
fn look(case: &Case) -> Look {
    // Looks repeat their colours after seven numbers with another dash, so PD gets the colour of AP with dashes.
    const COLOURS: usize = 7;
    let number = case.peers - 2;
    if case.strategy == Strategy::Pd { Look::of(number + COLOURS) } else { Look::of(number).solid() }
}

fn panel(responses: &Responses, one: bool, magnitude: bool) -> Panel {
    let points = |values: &[f64]| responses.frequencies.iter().copied().zip(values.iter().copied()).collect::<Vec<_>>();
    let curves = responses.curves.iter().filter(|curve| is_one(&curve.case) == one).map(|curve| {
        let values = if magnitude { &curve.decibels } else { &curve.phases };
        Line::new(points(values), look(&curve.case)).named(name(&curve.case))
    });
    // The admittance of a mass, 1/(iωm), has the phase −90° at all frequencies.
    let ideal = if magnitude { responses.ideal() } else { vec![-90.0; responses.frequencies.len()] };
    let frequency = Axis::new("Frequency").symbol("f").unit("Hz").logarithmic().range(0.01, 40.0);
    let up = if magnitude {
        Axis::new("Magnitude").unit("dB re 1 m/(N·s)").multiples_of(20).range(-60.0, 60.0)
    } else {
        Axis::new("Phase").unit("degrees").multiples_of(45).range(-270.0, 90.0)
    };
    let (word, quantity) = (if one { "one touches" } else { "all touch" }, if magnitude { "magnitude" } else { "phase" });
    Panel::new(frequency, up)
        .titled(format!("{quantity}, {word}"))
        .with_all(curves)
        .with(Line::new(points(&ideal), Look::reference()).named("ideal mass"))
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
