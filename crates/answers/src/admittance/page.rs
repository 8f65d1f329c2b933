//! The page `admittance.html`.

use cohaptic_picture::page::{Html, Table};

use super::Curve;
use super::words::{felt_sizes, significant, subject, verdicts};
use crate::page::{AnswerPage, MOST_ROWS, Origin, more_rows};

/// Returns the page. The bytes of the page depend on the curves and on the picture alone. `peer`: name of the peer whose device is pushed.
#[must_use]
pub fn html(peer: &str, curves: &[Curve], origin: &Origin<'_>) -> String {
    let title = curves.first().map_or("", |curve| curve.title.as_str());
    let mut page = AnswerPage { title: format!("{title}: what {peer} feels"), tables: Html::heading(2, "Frequencies"), ..AnswerPage::default() };
    let several = curves.len() > 1;
    // The name of a single curve would say nothing.
    let of = |curve: &Curve, said: &str| if several { format!("{}: {said}", curve.name) } else { said.to_owned() };
    for (number, curve) in curves.iter().enumerate() {
        page.warnings.extend(curve.warning().map(|warning| of(curve, warning)));
        if is_felt(curve) {
            let felt = felt_sizes(curve).into_iter().map(|(what, size)| format!("{what} of {size}")).collect::<Vec<String>>();
            page.sentences.push(of(curve, &format!("moved slowly, {peer} feels {}", felt.join(" and "))));
        }
        page.sentences.extend(verdicts(curve).iter().map(|verdict| of(curve, verdict)));
        // Curves of a scene mostly have the same notes. A repeated note is shown once.
        page.notes.extend(curve.notes().into_iter().filter(|note| curves[..number].iter().all(|before| !before.notes().contains(note))));
        page.tables = page.tables.and(points(curve, several));
    }
    page.asked = vec![("Pushed", Html::lines(curves.iter().map(|curve| of(curve, &subject(peer, curve)).into())))];
    if let Some(points) = curves.first().map(|curve| &curve.response.points) {
        let hz = || points.iter().map(|point| point.hz);
        let (low, high) = hz().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), hz| (low.min(hz), high.max(hz)));
        let words = if points.len() == 1 {
            format!("{} Hz", significant(low))
        } else {
            format!("{} from {} to {} Hz", points.len(), significant(low), significant(high))
        };
        page.asked.push(("Frequencies", words.into()));
    }
    page.html(origin)
}

/// Returns `true` if the motion is looked at along the axis of the push, so that the hand feels the curve as an object.
fn is_felt(curve: &Curve) -> bool {
    let [axis, seen] = curve.admittance.axes();
    axis == seen
}

/// Returns the table of a curve, hidden until opened.
fn points(curve: &Curve, several: bool) -> Html {
    let head = Table::new().number("frequency [Hz]").number("magnitude [dB]").number("phase [degrees]").number("free mass [dB]");
    let shown = curve.response.points.iter().take(MOST_ROWS);
    let table = shown.fold(head, |table, point| {
        let (magnitude, phase) = (format!("{:.3}", point.magnitude_db()), format!("{:.2}", point.phase_deg()));
        table.row([significant(point.hz), magnitude, phase, format!("{:.3}", curve.ideal_db(point.hz))].map(Html::from))
    });
    let name = if several { format!("Table: {}", curve.name) } else { "Table".to_owned() };
    let more = more_rows(curve.response.points.len() as u64, "frequencies", "admittance.csv");
    Html::details(&name, Html::table(&table).and(more))
}
