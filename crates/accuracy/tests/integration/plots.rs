//! Work–precision plots.

use cohaptic_accuracy::{Subject, plots};
use cohaptic_picture::Size;
use cohaptic_picture::testing::faults;

use crate::row;

#[test]
fn every_group_has_one_picture_with_a_line_for_each_method() {
    let rows = [row("one", Some(1.0), Some(1e-3)), row("one", Some(10.0), Some(1e-6)), row("other", Some(3.0), Some(1e-4))];
    let plots = plots(&rows, Size::PAGE);
    let [plot] = plots.as_slice() else { panic!("{}", plots.len()) };
    assert_eq!((plot.id.as_str(), plot.caption.as_str()), ("motion-a-case-position-m", ""));
    assert_eq!(faults(&plot.svg), [""; 0]);
    for text in [">one</text>", ">other</text>", "Cost [ns a tick]", "Error: position [m]"] {
        assert!(plot.svg.contains(text), "{text}");
    }
    // There are two discs for the points of the first method and one in the legend, and one square for the point of the second method and one in the legend.
    assert_eq!((plot.svg.matches("<circle").count(), plot.svg.matches("<path class=\"f1\"").count()), (2 + 1, 1 + 1));
}

/// Zero has no logarithm, so it is a triangle at the foot, and legend and caption mention it.
#[test]
fn an_error_of_zero_is_at_the_foot_and_said() {
    let with = plots(&[row("one", Some(1.0), Some(1e-3)), row("exact", Some(2.0), Some(0.0))], Size::PAGE);
    let plot = &with[0];
    assert!(plot.svg.contains("error exactly 0") && plot.caption.contains("exactly 0"));
    assert_eq!(faults(&plot.svg), [""; 0]);
    let (_, circle) = plot.svg.split_once("cy=\"").unwrap();
    let circle: f64 = circle.split_once('"').unwrap().0.parse().unwrap();
    let triangle = plot.svg.lines().find(|line| line.starts_with("<path class=\"f1\"")).unwrap();
    let corners = triangle.split_once(" d=\"M").unwrap().1.split_once(['Z', '"']).unwrap().0;
    for corner in corners.split('L') {
        let y: f64 = corner.split_once(',').unwrap().1.parse().unwrap();
        assert!(y > circle, "the triangle is below every error: {triangle} {circle}");
    }
    let without = plots(&[row("one", Some(1.0), Some(1e-3))], Size::PAGE);
    assert!(!without[0].svg.contains("exactly 0"));
}

#[test]
fn zeros_alone_one_point_alone_and_extreme_numbers_can_be_drawn() {
    for rows in [
        vec![row("zero", Some(5.0), Some(0.0))],
        vec![row("one", Some(1.0), Some(1.0))],
        vec![row("far", Some(1e-300), Some(4.9e-324)), row("far", Some(1e300), Some(1.7e308)), row("far", Some(1.0), Some(0.0))],
        (0..40).map(|method| row(&format!("method {method}"), Some(f64::from(method + 1)), Some(1e-3))).collect(),
    ] {
        let plots = plots(&rows, Size::PAGE);
        assert_eq!(plots.len(), 1);
        assert_eq!(faults(&plots[0].svg), [""; 0]);
    }
}

#[test]
fn what_cannot_be_drawn_is_counted_and_a_group_of_it_has_no_picture() {
    let nothing = [row("none", Some(1.0), None), row("none", None, Some(1.0)), row("none", Some(f64::NAN), Some(1.0))];
    assert!(plots(&nothing, Size::PAGE).is_empty());
    let some = [row("none", Some(1.0), None), row("one", Some(1.0), Some(1.0))];
    assert!(plots(&some, Size::PAGE)[0].caption.starts_with("One row has no error or no cost"));
}

#[test]
fn names_of_files_differ() {
    let mut rows = Vec::new();
    for (subject, case, cost_unit) in [
        (Subject::Motion, "a", "ns a tick"),
        (Subject::Motion, "A?", "ns a tick"),
        (Subject::Motion, "a", "ms a run"),
        (Subject::Time, "a", "ns a tick"),
    ] {
        let mut row = row("one", Some(1.0), Some(1.0));
        (row.subject, row.case, row.cost_unit) = (subject, case.to_owned(), cost_unit);
        rows.push(row);
    }
    let mut ids: Vec<String> = plots(&rows, Size::PAGE).into_iter().map(|plot| plot.id).collect();
    ids.sort();
    ids.dedup();
    assert_eq!(ids.len(), 4, "{ids:?}");
    assert!(ids.iter().all(|id| id.chars().all(|letter| letter.is_ascii_lowercase() || letter.is_ascii_digit() || letter == '-')));
}
