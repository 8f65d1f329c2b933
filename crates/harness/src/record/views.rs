//! `views.svg`: copies of a rotating object, from above, from the front and from the side.

use cohaptic_peer::State;
use cohaptic_peer::rotation::{Attitude, Triple};
use cohaptic_picture::{Axis, Fill, Line, Look, Marker, Panel, Picture, Region};
use cohaptic_scene::Scene;
use cohaptic_units::Instant;

use super::band::Bands;
use super::plot::{CUT, MOST_NAMED, SANE_POSITION};

/// Poses of all copies: at the first tick in each of a fixed number of spans of time, and at the last tick.
#[derive(Debug)]
pub(crate) struct Views {
    /// Edges of the box with the mass and the inertia of the object \[m\], along the body axes.
    edges: Triple,
    /// Points of each copy with drawn traces, in body axes \[m\], indexed by peer: the grasped point, or the ends of the three body axes if the copy is grasped
    /// at its centre of mass.
    traced: Vec<Vec<Triple>>,
    /// Spans of time, without curves.
    spans: Bands,
    /// First pose in each span, indexed by peer, then span; `None` in spans without a tick.
    poses: Vec<Vec<Option<Pose>>>,
    /// Pose at the last tick, indexed by peer.
    last: Vec<Option<Pose>>,
}

/// Position and orientation of a copy.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Pose {
    centre: Triple,
    orientation: [f64; 4],
}

/// Views: title, axis to the right, axis upwards.
const PLANES: [(&str, usize, usize); 3] = [("top", 0, 1), ("front", 0, 2), ("side", 1, 2)];
/// Names of the axes.
const NAMES: [&str; 3] = ["x", "y", "z"];
/// Factor from metres to centimetres.
const SCALE: f64 = 100.0;
const ABOUT: &str = "Boxes of even density with the mass and the inertia of the object: at the beginning, after one and two thirds (thin), and at the end (filled). \
                     Curves: where it is grasped (at the end, a disc), or the ends of the body axes of a copy that is not held off its centre.";

impl Views {
    /// Returns the state before the run; `None` if the object does not turn.
    pub(crate) fn new(scene: &Scene, spans: usize) -> Option<Self> {
        let (rotation, edges) = scene.rotation.as_ref().zip(scene.even_box())?;
        let along = |axis: usize| std::array::from_fn(|other| if axis == other { 0.5 * edges[axis] } else { 0.0 });
        // A grasp at the centre of mass has no arm to trace, so the ends of the body axes show the turn.
        let traced = |grasp: Triple| if grasp.iter().any(|r| *r != 0.0) { vec![grasp] } else { (0..3).map(along).collect() };
        let peers = rotation.peers.len();
        Some(Self {
            edges,
            traced: rotation.peers.iter().map(|peer| traced(peer.grasp)).collect(),
            spans: Bands::new(scene.duration, spans, 0),
            poses: vec![vec![None; spans.max(1)]; peers],
            last: vec![None; peers],
        })
    }

    /// Adds the pose of a copy at a tick. Ignores poses that are not finite.
    pub(crate) fn add(&mut self, peer: usize, at: Instant, centre: &[f64], attitude: &Attitude) {
        let (Some(span), Ok(centre)) = (self.spans.span(at), Triple::try_from(centre)) else { return };
        if attitude.is_finite() && centre.iter().all(|x| x.is_finite()) {
            let pose = Pose { centre, orientation: attitude.orientation };
            // The first pose of a span stays.
            self.poses[peer][span].get_or_insert(pose);
            self.last[peer] = Some(pose);
        }
    }

    /// Draws the picture. `positions` are the curves of all copies by axis, then peer. Their range decides which poses are left out as far beyond.
    pub(crate) fn picture(&self, title: &str, names: &[String], positions: &Bands) -> Picture {
        let ranges: Vec<_> = positions.split(3).iter().map(|axis| axis.range(SANE_POSITION)).collect();
        let cut = ranges.iter().any(|(_, cut)| *cut);
        let sane = |pose: &Pose| !cut || pose.centre.iter().zip(&ranges).all(|(x, (range, _))| range.contains(x));
        let poses = |peer: usize| self.poses[peer].iter().map(move |pose| pose.as_ref().filter(|pose| sane(pose)));
        let few = self.traced.len() <= MOST_NAMED;
        let look = |peer: usize| if few { Look::of(peer) } else { Look::of(0).thin() };
        let thirds = [0, self.spans.spans() / 3, 2 * self.spans.spans() / 3];
        let panel = |(view, right, up): (&str, usize, usize)| {
            let flat = |point: Triple| (SCALE * point[right], SCALE * point[up]);
            let outline = |pose: &Pose| hull(corners(self.edges).map(|corner| flat(pose.point(corner))).to_vec());
            let axis = |axis: usize| Axis::new(NAMES[axis]).unit("cm");
            let mut panel = Panel::new(axis(right), axis(up)).titled(view);
            for peer in 0..self.traced.len() {
                let (thin, last) = (look(peer).thin(), self.last[peer].as_ref().filter(|pose| sane(pose)));
                for arm in &self.traced[peer] {
                    // A peer with ticks longer than a span has spans without a pose.
                    let trace = poses(peer).flatten().map(|pose| flat(pose.point(*arm)));
                    panel = panel.with(Line::new(trace, thin));
                }
                let before = thirds.iter().filter_map(|span| poses(peer).nth(*span).flatten());
                panel = panel.with(Line::runs(before.map(|pose| closed(outline(pose))), thin));
                let Some(last) = last else { continue };
                if few {
                    panel = panel.with(Region::new([outline(last)], Fill::Tint(peer)));
                }
                let name = names.get(peer).filter(|_| few).map_or("", String::as_str);
                panel = panel.with(Line::new(closed(outline(last)), look(peer)).named(name));
                if let [grasp] = self.traced[peer][..] {
                    panel = panel.with(Line::new([flat(last.point(grasp))], look(peer)).marks_only(Marker::Disc));
                }
            }
            panel
        };
        let picture =
            Picture::new(format!("{title}: three views of the copies")).note(ABOUT).columns(3).aspect(1.0).equal_units().panels(PLANES.map(panel));
        if cut { picture.note(CUT) } else { picture }
    }
}

impl Pose {
    /// Returns the position of a body point in world axes \[m\].
    fn point(&self, arm: Triple) -> Triple {
        let attitude = Attitude { orientation: self.orientation, rate: [0.0; 3] };
        attitude.point(arm, &State { position: self.centre, velocity: [0.0; 3] }).position
    }
}

fn corners(edges: Triple) -> [Triple; 8] {
    // Bit `axis` of the number of a corner chooses the side of the box along this axis.
    std::array::from_fn(|corner| std::array::from_fn(|axis| if corner >> axis & 1 == 0 { -0.5 * edges[axis] } else { 0.5 * edges[axis] }))
}

fn closed(mut outline: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    outline.extend(outline.first().copied());
    outline
}

/// Returns the corners of the convex hull of the points, counterclockwise (Andrew 1979).
fn hull(mut points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    // From left to right, and upwards among points with the same abscissa.
    points.sort_by(|one, other| one.0.total_cmp(&other.0).then(one.1.total_cmp(&other.1)));
    let chain = |points: &mut dyn Iterator<Item = (f64, f64)>| {
        let mut chain: Vec<(f64, f64)> = Vec::new();
        for point in points {
            // A point that makes no left turn with the two points before shows that the point between is not a corner of the hull.
            while let [.., a, b] = chain[..]
                && (b.0 - a.0) * (point.1 - a.1) - (b.1 - a.1) * (point.0 - a.0) <= 0.0
            {
                chain.pop();
            }
            chain.push(point);
        }
        chain.pop();
        chain
    };
    // The lower chain from left to right, then the upper chain from right to left: each leaves out its last point, with which the other begins.
    let mut lower = chain(&mut points.iter().copied());
    lower.extend(chain(&mut points.iter().rev().copied()));
    lower
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use cohaptic_picture::testing::faults;

    use super::*;

    fn scene(grasp: &str) -> Scene {
        let text = format!(
            "scene = {{ duration = \"1s\", axes = 3, count = 2 }}\nobject = {{ mass = 1.2, inertia = [0.009, 0.016, 0.025] }}\n\
             coordination = {{ strategy = \"average-position\", stiffness = 100, damping = 5, update = \"8ms\" }}\n\
             peer = {{ device = {{ mass = 0.1 }}, coupling = {{ stiffness = 100 }}, grasp = {grasp} }}\n"
        );
        Scene::parse(&text, Path::new("x.toml"), &[]).unwrap()
    }

    /// A tray of 0.4 m × 0.3 m turned by 45° about z reaches (0.4 + 0.3)/√8 = 0.2475 m along x and y.
    #[test]
    fn an_outline_is_that_of_the_box_as_it_is_turned() {
        let mut attitude = Attitude::REST;
        attitude.turn([0.0, 0.0, std::f64::consts::FRAC_PI_4]);
        let pose = Pose { centre: [1.0, 2.0, 3.0], orientation: attitude.orientation };
        let edges = scene("0").even_box().unwrap();
        let outline = hull(corners(edges).map(|corner| pose.point(corner)).map(|[x, y, _]| (x, y)).to_vec());
        let most = outline.iter().fold((0.0, 0.0), |most: (f64, f64), (x, y)| (most.0.max(x - 1.0), most.1.max(y - 2.0)));
        let expected = 0.7 / 8.0_f64.sqrt();
        assert!((most.0 - expected).abs() < 1e-12 && (most.1 - expected).abs() < 1e-12, "{most:?} {outline:?}");
        let twice: f64 = outline.iter().zip(outline.iter().cycle().skip(1)).map(|(a, b)| a.0 * b.1 - a.1 * b.0).sum();
        assert!((twice / 2.0 - 0.12).abs() < 1e-12, "counterclockwise, and as large as the tray: {twice}");
    }

    #[test]
    fn what_is_within_is_no_corner() {
        let points = vec![(0.0, 0.0), (1.0, 0.0), (0.5, 0.5), (1.0, 1.0), (0.0, 1.0), (0.5, 0.0), (1.0, 0.0)];
        assert_eq!(hull(points), [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]);
    }

    #[test]
    fn three_views_name_every_peer_and_leave_out_what_goes_far_beyond() {
        for (grasp, discs) in [("[0.2, 0.15, 0]", 6), ("0", 0)] {
            let scene = scene(grasp);
            let (mut views, mut positions) = (Views::new(&scene, 100).unwrap(), Bands::new(scene.duration, 100, 6));
            let mut record = |millis: u64, centre: Triple| {
                let at = Instant::from_nanos(millis * 1_000_000);
                for peer in 0..2 {
                    views.add(peer, at, &centre, &Attitude::REST);
                    (0..3).for_each(|axis| positions.add(axis * 2 + peer, at, centre[axis]));
                }
            };
            (0..1000).for_each(|millis| record(millis, [1e-4 * f64::from(u32::try_from(millis).unwrap()), 0.0, 0.0]));
            let names = ["left".to_owned(), "right".to_owned()];
            let svg = views.picture("a tray", &names, &positions).svg();
            assert_eq!(faults(&svg), [""; 0]);
            assert_eq!(svg, views.picture("a tray", &names, &positions).svg());
            assert!(["left", "right", "top", "front", "side"].iter().all(|name| svg.contains(&format!(">{name}</text>"))), "{svg}");
            assert_eq!(svg.matches("<circle").count(), discs);
            assert!(!svg.contains(CUT));
            let mut explodes = |millis: u64| {
                let at = Instant::from_nanos(millis * 1_000_000);
                views.add(0, at, &[1e9, 0.0, 0.0], &Attitude::REST);
                positions.add(0, at, 1e9);
            };
            explodes(999);
            let cut = views.picture("a tray", &names, &positions).svg();
            assert!(cut.contains(CUT) && faults(&cut).is_empty());
        }
    }
}
