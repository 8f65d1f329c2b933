use super::*;

fn run(title: &str, frames: &[[f64; 2]]) -> MotionRun {
    MotionRun {
        title: title.to_owned(),
        names: vec!["left".to_owned(), "a <b>".to_owned()],
        frames: frames.iter().map(|place| vec![*place, *place]).collect(),
        hands: vec![MotionHand { copy: 1, frames: frames.to_vec() }],
    }
}

fn both() -> Motion {
    let runs = vec![run("AP", &[[0.0, 0.0], [0.02, 0.01], [0.04, 0.0]]), run("PD", &[[0.0, 0.0], [0.04, 0.0], [f64::INFINITY, 0.0]])];
    Motion::new("t", "100 ms", 0.5, runs)
}

/// Shift along the first axis that a class has at a share of the cycle.
fn shift(svg: &str, name: &str, share: &str) -> f64 {
    let way = svg.split(&format!("@keyframes {name}{{")).nth(1).unwrap().lines().next().unwrap();
    let begin = format!("{share}%{{transform:translate(");
    let at = if way.starts_with(&begin) { 0 } else { way.find(&format!("}}{begin}")).unwrap() + 1 };
    way[at + begin.len()..].split("px").next().unwrap().parse().unwrap()
}

#[test]
fn every_copy_has_a_way_and_both_runs_have_the_scale_of_the_first() {
    let svg = both().svg();
    assert_eq!(svg, both().svg());
    assert_eq!(crate::testing::faults(&svg), [""; 0]);
    assert!(svg.contains(">a &lt;b&gt;<") && svg.contains(">100 ms<") && svg.contains(">1.0 s<"), "{svg}");
    assert!(svg.contains(".c1-1{animation:c1-1 3.5s linear infinite}"));
    // A second of motion and a still of 2.5 s: the last frame is shown from 28.57 % of the cycle on.
    assert_eq!(shift(&svg, "c0-0", "28.57"), shift(&svg, "c0-0", "100"));
    // Where the first run is at its end, the second run is in the middle of its time. Then it leaves.
    assert_eq!(shift(&svg, "c0-0", "100"), shift(&svg, "c1-0", "14.29"));
    assert!((shift(&svg, "c0-0", "100") + shift(&svg, "c0-0", "0")).abs() < 0.02, "the first run fills its frame");
    assert!(shift(&svg, "c1-0", "100") > WIDTH);
    // A hand moves as the copy at its position does.
    assert_eq!(shift(&svg, "h0-0", "14.29"), shift(&svg, "c0-1", "14.29"));
}

#[test]
fn a_run_whose_copies_left_says_since_when() {
    let svg = both().svg();
    let told = "All copies are outside this frame from 1.0 s on.";
    assert_eq!(svg.matches(&format!(">{told}<")).count(), 1);
    assert!(
        svg.contains(&format!("<desc>100 ms AP: left, a &lt;b&gt; in motion for 1.0 s. PD: left, a &lt;b&gt; in motion for 1.0 s. {told}</desc>")),
        "{svg}"
    );
    assert!(svg.contains("@keyframes g1{0%,28.57%{opacity:0"));
    // Copies that come back have not left.
    let mut motion = both();
    motion.runs[1].frames.push(vec![[0.0; 2]; 2]);
    assert!(!motion.svg().contains("outside"));
    // Nor has a run left whose one copy is still there.
    let mut motion = both();
    motion.runs[1].frames[2][0] = [0.0; 2];
    assert!(!motion.svg().contains("outside"));
}

#[test]
fn a_path_is_whole_and_appears_piece_by_piece() {
    let frames: Vec<[f64; 2]> = (0..12).map(|frame| [0.01 * f64::from(frame), 0.0]).collect();
    let svg = Motion::new("t", "", 0.1, vec![run("AP", &frames)]).svg();
    let ends: Vec<&str> = svg.split("path p").skip(1).map(|rest| rest.split('"').next().unwrap()).collect();
    assert_eq!(ends, ["5", "10", "11", "5", "10", "11"]);
    for end in ["5", "10", "11"] {
        assert_eq!(svg.matches(&format!("@keyframes p{end}{{")).count(), 1, "{svg}");
    }
    let pieces: Vec<Vec<&str>> = svg.split("points=\"").skip(1).map(|rest| rest.split('"').next().unwrap().split(' ').collect()).collect();
    assert_eq!(pieces[..3].iter().map(Vec::len).collect::<Vec<_>>(), [6, 6, 2]);
    assert_eq!((pieces[0].last(), pieces[1].last()), (pieces[1].first(), pieces[2].first()), "pieces join");
}

/// Runs of 12 and of 8 frames: the shorter run ends with a piece that the longer run does not have.
#[test]
fn each_piece_of_a_shorter_run_appears_too() {
    let frames: Vec<[f64; 2]> = (0..12).map(|frame| [0.01 * f64::from(frame), 0.0]).collect();
    let svg = Motion::new("t", "", 0.1, vec![run("AP", &frames), run("PD", &frames[..8])]).svg();
    let ends: Vec<&str> = svg.split("path p").skip(1).map(|rest| rest.split('"').next().unwrap()).collect();
    assert_eq!(ends, ["5", "10", "11", "5", "10", "11", "5", "7", "5", "7"]);
    for end in ends {
        assert_eq!(svg.matches(&format!("@keyframes p{end}{{")).count(), 1, "{end}: {svg}");
    }
}

#[test]
fn copies_at_one_position_are_all_seen() {
    let svg = both().svg();
    let edges: Vec<f64> =
        svg.split(" copy c0-").skip(1).map(|rest| rest.split("width=\"").nth(1).unwrap().split('"').next().unwrap().parse().unwrap()).collect();
    assert_eq!(edges, [EDGE, LEAST_EDGE]);
    assert_eq!(edge_of(0, 1), EDGE);
}

#[test]
fn a_picture_without_runs_or_positions_is_a_picture() {
    for runs in [Vec::new(), vec![run("nobody moved", &[])], vec![run("one frame", &[[f64::NAN; 2]])]] {
        assert_eq!(crate::testing::faults(&Motion::new("t", "", 0.1, runs).svg()), [""; 0]);
    }
}
