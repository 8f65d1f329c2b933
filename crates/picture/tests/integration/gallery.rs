//! A gallery: a picture of each kind.

use cohaptic_picture::{Axis, Band, Fill, HeatMap, LegendPlace, Line, Look, Marker, Panel, Picture, Region, Rug, Size};

/// Returns the pictures with their names.
pub(crate) fn gallery() -> Vec<(String, Picture)> {
    let sized = [("page", Size::PAGE), ("one-column", Size::ONE_COLUMN), ("two-columns", Size::TWO_COLUMNS), ("600x400", "600x400".parse().unwrap())];
    let kinds = [
        ("lines", lines()),
        ("bands", bands()),
        ("map", regions()),
        ("heat", heat()),
        ("bode", bode()),
        ("links", links()),
        ("work", work_precision()),
    ];
    let named = |(name, picture): (&str, Picture)| sized.map(|(size, of)| (format!("{name}-{size}"), picture.clone().size(of)));
    kinds.into_iter().flat_map(named).collect()
}

/// Cells at 0, 1 and 10 on axes from 1 to 10. The first cell ends at 0.5, below the axes. The second ends at 5.5, which is 74 % up (the decimal logarithm
/// of 5.5).
#[test]
fn cells_and_bands_that_begin_at_zero_reach_the_foot_of_a_logarithmic_axis() {
    let places = [0.0, 1.0, 10.0];
    let axis = || Axis::new("x").logarithmic().range(1.0, 10.0);
    let map = HeatMap::new(&places, &places, vec![vec![1.0, 2.0, 3.0]; 3], Axis::new("value"));
    let cells = Region::cells(&places, &places, Fill::Hatch, |column, row| column == 1 && row < 2);
    let band = Band::new([(1.0, 0.0, 5.0), (10.0, 0.0, 5.0)], Fill::Grey);
    let svg = Picture::new("").panel(Panel::new(axis(), axis()).with(map).with(cells).with(band)).svg();
    assert_eq!(cohaptic_picture::testing::faults(&svg), [""; 0]);
    let ys = |class: &str| {
        let path = svg.lines().find(|line| line.starts_with(&format!("<path class=\"{class}"))).unwrap_or_else(|| panic!("{class}: {svg}"));
        let data = path.split_once(" d=\"").unwrap().1.split_once('"').unwrap().0;
        let ys = data.split(['M', 'L', 'Z']).filter_map(|point| Some(point.split_once(',')?.1.parse::<f64>().unwrap()));
        ys.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), y| (low.min(y), high.max(y)))
    };
    let (top, foot) = ys("cells");
    let (end, low) = ys("hatch");
    assert!((low - foot).abs() < 0.02 && ((foot - end) / (foot - top) - 0.7404).abs() < 1e-3, "{top} {foot} {end} {low}");
    assert!((ys("tint").1 - foot).abs() < 0.02, "{svg}");
}

/// The edge of the area is a line within the panel; the other sides lie on the axes and have no line. The sample in the legend has the fill and the edge.
#[test]
fn an_area_with_a_border_is_one_entry_of_the_legend() {
    let corners = vec![(0.0, 0.0), (2.0, 0.0), (0.0, 2.0)];
    let axis = || Axis::new("x").range(0.0, 4.0);
    let area = Region::new([corners], Fill::Tint(1)).bordered([[(2.0, 0.0), (0.0, 2.0)]], Look::of(1)).named("stable");
    let svg = Picture::new("").panel(Panel::new(axis(), axis()).with(area)).svg();
    assert_eq!(cohaptic_picture::testing::faults(&svg), [""; 0]);
    let edges: Vec<&str> = svg.lines().filter(|line| line.starts_with("<path class=\"line s1\"")).collect();
    assert!(edges.len() == 2 && edges.iter().all(|edge| edge.contains("stroke-dasharray")), "{edges:?}");
    // In the panel a segment between two points, in the legend a closed frame.
    assert!(edges[0].matches(['M', 'L']).count() == 2 && edges[1].contains("Z\""), "{edges:?}");
    assert_eq!(["<path class=\"tint f1\"", "<rect class=\"tint f1\"", ">stable</text>"].map(|part| svg.matches(part).count()), [1, 1, 1]);
}

fn samples(count: u32, end: f64) -> impl Iterator<Item = f64> {
    (0..count).map(move |n| f64::from(n) / f64::from(count - 1) * end)
}

fn lines() -> Picture {
    let curve = |shift: f64| samples(5000, 6.0).map(move |t| (t, 2.0 + (3.0 * t + shift).sin() * (0.3 * t).exp()));
    let panel = Panel::new(Axis::new("Time").symbol("t").unit("s").tight(), Axis::new("Position of the copy").symbol("x_O").unit("cm"))
        .with(Line::new(curve(0.0), Look::of(0)).named("left"))
        .with(Line::new(curve(0.0), Look::of(1)).named("right"))
        .with(Line::new(curve(0.4), Look::of(2)).named("third"))
        .with(Line::level(5.0).named("goal, 20 mm"));
    Picture::new(
        "Section 5.1: two of three users, AP at 2100 N/m, with arms, with coordination.strategy=proportional-derivative: position of each copy",
    )
    .note("What goes far beyond is cut off.")
    .panel(panel)
}

fn bands() -> Picture {
    let band = |spread: f64| samples(60, 90.0).map(move |x| (x, 1.0 + 0.02 * x - spread * x, 1.0 + 0.02 * x + spread * x));
    let panel = Panel::new(Axis::new("Loss").unit("%"), Axis::new("Difference of the copies").unit("mm").include(0.0))
        .with(Band::new(band(0.012), Fill::Tint(0)).named("5 % to 95 %"))
        .with(Band::new(band(0.005), Fill::Deep(0)).named("25 % to 75 %"))
        .with(Line::new(band(0.0).map(|(x, low, _)| (x, low)), Look::of(0)).named("median").marked(Marker::Disc))
        .labels_at_ends();
    Picture::new("Difference over loss, 200 runs each").panel(panel)
}

fn regions() -> Picture {
    let circle =
        |radius: f64| samples(100, std::f64::consts::TAU).map(|a| (5000.0 + radius * a.cos(), 30.0 + radius / 200.0 * a.sin())).collect::<Vec<_>>();
    let cells: Vec<f64> = samples(40, 10_000.0).collect();
    let rows: Vec<f64> = samples(30, 60.0).collect();
    let x = Axis::new("Coordination stiffness").symbol("K_T").unit("N/m").range(0.0, 10_000.0);
    let y = Axis::new("Coordination damping").symbol("B_T").unit("N·s/m").range(0.0, 60.0);
    let mut panel = Panel::new(x, y)
        .with(Region::new([circle(4500.0), circle(1500.0)], Fill::Tint(0)).named("stable: as it stands"))
        .with(Region::cells(&cells, &rows, Fill::Hatch, |column, row| column > 28 && row < 12).named("nominal: chance is left out"));
    for number in 0..11_u32 {
        let name = format!("scene.count={}, coordination.strategy=average-position", number + 2);
        let line = Line::new(circle(4500.0 - 250.0 * f64::from(number)), Look::of(usize::try_from(number).unwrap())).named(name);
        panel = panel.with(line);
    }
    Picture::new("Two of three users: spectral radius 1").panel(panel)
}

fn heat() -> Picture {
    let xs: Vec<f64> = samples(30, 40.0).collect();
    let ys: Vec<f64> = samples(20, 12.0).collect();
    let value = |x: f64, y: f64| if x > 35.0 && y > 10.0 { f64::NAN } else { 1e-4 * (0.2 * x).exp() * (1.0 + y) };
    let values: Vec<Vec<f64>> = ys.iter().map(|y| xs.iter().map(|x| value(*x, *y)).collect()).collect();
    let missing: Vec<Vec<bool>> = values.iter().map(|row| row.iter().map(|value| value.is_nan()).collect()).collect();
    let map = HeatMap::new(&xs, &ys, values, Axis::new("Largest difference of the copies").unit("m").logarithmic());
    let panel = Panel::new(Axis::new("Delay").symbol("T_d").unit("ms").tight(), Axis::new("Loss").unit("%").tight())
        .with(map)
        .with(Region::cells(&xs, &ys, Fill::HatchedTint(1), move |column, row| missing[row][column]).named("diverges"));
    Picture::new("Difference over delay and loss").panel(panel)
}

fn bode() -> Picture {
    let hz = || samples(200, 5.0).map(|power| 10_f64.powf(power - 2.0));
    let curve = |resonance: f64| hz().map(move |f| (f, -20.0 * (f / resonance).hypot(0.1).log10()));
    let x = || Axis::new("Frequency").symbol("f").unit("Hz").logarithmic().tight();
    let magnitude = Panel::new(x(), Axis::new("Admittance |Y|").unit("dB re 1 m/(s·N)").multiples_of(20).ends_at_ticks())
        .titled("Magnitude")
        .with_all([1.0, 1.2, 1.4, 9.0].iter().enumerate().map(|(n, at)| Line::new(curve(*at), Look::of(n)).named(format!("{at} Hz, AP"))))
        .labels_at_ends();
    let phase = Panel::new(x(), Axis::new("Phase").unit("°").multiples_of(45).ends_at_ticks())
        .titled("Phase")
        .with(Line::new(hz().map(|f| (f, -90.0 - 90.0 * f / (1.0 + f))), Look::of(0)));
    Picture::new("Velocity over force of the left user").panel(magnitude).panel(phase).shared_x().aspect(0.4)
}

fn links() -> Picture {
    let names = ["left → right", "right → left", "left → third", "third → left"];
    let mut picture = Picture::new("Delay of packets").columns(2).legend(LegendPlace::Below);
    for (number, name) in names.into_iter().enumerate() {
        let delays: Vec<(f64, f64)> =
            samples(400, 10.0).enumerate().map(|(n, t)| (t, 24.0 + f64::from(u32::try_from(n * 7 % 13).unwrap()) * 0.4)).collect();
        let over_time = Panel::new(Axis::new("Time").symbol("t").unit("s").tight(), Axis::new("Delay").unit("ms").include(0.0))
            .titled(name)
            .with(Line::new(delays.iter().copied(), Look::of(number).solid().thin()))
            .with(Rug::new(samples(40, 9.0).map(|t| t * t / 9.0), Look::of(1)).named("lost"));
        let share = Panel::new(Axis::new("Delay").unit("ms"), Axis::new("Share of packets").range(0.0, 1.0))
            .titled(name)
            .with(Line::distribution(delays.iter().map(|(_, delay)| *delay), Look::of(0)).named("measured"))
            .with(Line::new([(24.0, 0.0), (28.8, 1.0)], Look::of(1)).named("asked for"));
        picture = picture.panel(over_time).panel(share);
    }
    picture
}

fn work_precision() -> Picture {
    let axis = |name: &str| Axis::new(name).logarithmic();
    let method = |n: usize, order: f64| {
        Line::new(samples(6, 5.0).map(|k| (1e-7 * 4_f64.powf(k), 1e-2 * 4_f64.powf(-order * k))), Look::of(n))
            .marked(Marker::of(n))
            .named(format!("order {order}"))
    };
    let panel = Panel::new(axis("Time a step").unit("s"), axis("Error").unit("m"))
        .with_all((1..5).map(|n| method(n, f64::from(u32::try_from(n).unwrap()))))
        .with(Line::new([(2e-6, 1e-12)], Look::of(5)).marks_only(Marker::TriangleDown).named("error exactly 0, drawn at the foot"));
    Picture::new("Work and precision").legend(LegendPlace::Right).panel(panel)
}
