//! `cohaptic run --out`: the records agree with the summary, with the equations, and with themselves.

use std::collections::BTreeMap;
use std::str::FromStr;

use serde_json::{Value, json};

use crate::integration::desk::Desk;
use crate::integration::run::dropped;
use crate::integration::scenes::{PLANE, RANDOM, TWO};
use crate::integration::svg;

const FILES: [&str; 7] = ["forces.svg", "links.csv", "network.svg", "packets.csv", "positions.svg", "run.html", "trajectory.csv"];

/// A CSV file by column.
struct Table {
    columns: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Table {
    fn read(desk: &Desk, file: &str) -> Self {
        let text = desk.read(file);
        assert!(text.ends_with('\n') && !text.contains('\r'), "{file}");
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let columns = reader.headers().unwrap().iter().map(str::to_owned).collect();
        let rows = reader.records().map(|row| row.unwrap().iter().map(str::to_owned).collect()).collect();
        Self { columns, rows }
    }

    fn get<'a>(&self, row: &'a [String], column: &str) -> &'a str {
        &row[self.columns.iter().position(|name| name == column).unwrap_or_else(|| panic!("no column {column}"))]
    }

    fn number<T: FromStr>(&self, row: &[String], column: &str) -> T {
        let text = self.get(row, column);
        text.parse().unwrap_or_else(|_| panic!("{column} is {text:?}"))
    }
}

#[test]
fn all_records_are_there_and_whole() {
    let desk = Desk::with("two.toml", TWO);
    let document = desk.json("run two.toml --json --out out");
    assert_eq!(desk.files("out"), FILES);
    let mut files: Vec<&str> = document["files"].as_array().unwrap().iter().map(|file| file.as_str().unwrap()).collect();
    files.sort_unstable();
    assert_eq!(files, FILES.map(|file| format!("out/{file}")));
    let said = desk.cohaptic("run two.toml --out a/folder/within").stderr;
    assert_eq!(desk.files("a/folder/within"), FILES);
    let mut said: Vec<&str> = said.lines().collect();
    said.sort_unstable();
    assert_eq!(said, FILES.map(|file| format!("wrote a/folder/within/{file}")));
}

#[test]
fn the_records_of_a_run_without_out_are_none() {
    let desk = Desk::with("two.toml", TWO);
    assert_eq!(desk.json("run two.toml --json")["files"].as_array().map(Vec::len), Some(0));
    assert_eq!(desk.files(""), ["two.toml"]);
}

#[test]
fn a_trajectory_has_one_row_a_peer_and_tick() {
    let desk = Desk::with("two.toml", TWO);
    desk.text("run two.toml --out out");
    let table = Table::read(&desk, "out/trajectory.csv");
    assert_eq!(table.columns, ["t", "peer", "xh", "vh", "xo", "vo", "xd", "vd", "fc", "ft"]);
    let rows: Vec<(String, &str)> = table.rows.iter().map(|row| (row[0].clone(), row[1].as_str())).collect();
    // Ticks from 0 to 199 ms, as decimals, the peers of each in the order of the scene.
    let expected: Vec<(String, &str)> =
        (0..200_u16).flat_map(|tick| ["left", "right"].map(|peer| ((f64::from(tick) / 1e3).to_string(), peer))).collect();
    assert_eq!(rows, expected);
}

#[test]
fn a_trajectory_ends_one_tick_before_the_document() {
    let desk = Desk::with("two.toml", TWO);
    let free = "--set peer.contact=none --set coordination.stiffness=0 --set coordination.damping=0 --set object.velocity=0.5";
    let document = desk.json(&format!("run two.toml --json --out out {free}"));
    let table = Table::read(&desk, "out/trajectory.csv");
    for (row, peer) in table.rows.iter().rev().zip(document["peers"].as_array().unwrap().iter().rev()) {
        assert_eq!(table.get(row, "peer"), peer["name"].as_str().unwrap());
        let (last, end): (f64, f64) = (table.number(row, "xo"), peer["position_m"].as_f64().unwrap());
        // 0.5 m/s for 1 ms, with the rounding of two numbers near 0.1.
        assert!((end - last - 0.0005).abs() < 0.1 * f64::EPSILON, "{last} {end}");
    }
}

#[test]
fn more_axes_give_more_columns() {
    let desk = Desk::with("plane.toml", PLANE);
    desk.text("run plane.toml --out out");
    let table = Table::read(&desk, "out/trajectory.csv");
    let expected = "t peer xh vh xo vo xd vd fc ft yh vyh yo vyo yd vyd fcy fty";
    assert_eq!(table.columns.join(" "), expected);
    let last = table.rows.iter().rfind(|row| row[1] == "left").unwrap();
    assert!(table.number::<f64>(last, "xo") > 0.0 && table.number::<f64>(last, "yo") < 0.0);
    desk.text("run plane.toml --out three --set scene.axes=3 --set 'peers.left.hand={ force = [1.0, 0.0, 0.5] }'");
    assert_eq!(Table::read(&desk, "three/trajectory.csv").columns.join(" "), format!("{expected} zh vzh zo vzo zd vzd fcz ftz"));
}

#[test]
fn every_number_reads_back_as_the_same_bits() {
    let desk = Desk::with("three.toml", RANDOM);
    desk.text("run three.toml --out out");
    let table = Table::read(&desk, "out/trajectory.csv");
    let mut numbers = 0;
    for text in table.rows.iter().flat_map(|row| &row[2..]) {
        let value: f64 = text.parse().unwrap();
        assert!(value.is_finite(), "{text}");
        // The fewest digits that read back as this value are those that Rust prints: no digit is missing, and none is idle.
        let again: f64 = format!("{value:e}").parse().unwrap();
        assert_eq!(value.to_bits(), again.to_bits());
        assert_eq!(digits(text), digits(&format!("{value:e}")), "{text}");
        numbers += 1;
    }
    assert_eq!(numbers, 600 * 3 * 8);
}

/// Returns the significant digits of a number.
fn digits(number: &str) -> String {
    let mantissa = number.split(['e', 'E']).next().unwrap();
    let digits: String = mantissa.chars().filter(char::is_ascii_digit).collect();
    digits.trim_matches('0').to_owned()
}

#[test]
fn forces_follow_from_the_state_in_the_same_row() {
    let desk = Desk::with("three.toml", RANDOM);
    desk.text("run three.toml --out out");
    let table = Table::read(&desk, "out/trajectory.csv");
    let mut largest = 0.0_f64;
    for row in &table.rows {
        let [x_h, v_h, x_o, v_o, x_d, v_d, coupling, coordination] =
            ["xh", "vh", "xo", "vo", "xd", "vd", "fc", "ft"].map(|name| table.number::<f64>(row, name));
        let (k_c, b_c, k_t, b_t) = (3500.0, 5.0, 1000.0, 5.0);
        //= Rakhsha & Constantinescu 2015, eq. (9): FC = KC·(xH − xO) + BC·(vH − vO)
        let expected = if table.get(row, "peer") == "third" { 0.0 } else { k_c * (x_h - x_o) + b_c * (v_h - v_o) };
        // Relative to the terms, which may all but cancel.
        let terms = k_c * (x_h.abs() + x_o.abs()) + b_c * (v_h.abs() + v_o.abs());
        assert!((coupling - expected).abs() <= 1e-9 * terms, "{coupling} is not {expected} in {row:?}");
        //= Rakhsha & Constantinescu 2015, eq. (10): FT = KT·(xO − xD) + BT·(vO − vD)
        let expected = k_t * (x_o - x_d) + b_t * (v_o - v_d);
        let terms = k_t * (x_o.abs() + x_d.abs()) + b_t * (v_o.abs() + v_d.abs());
        assert!((coordination - expected).abs() <= 1e-9 * terms, "{coordination} is not {expected} in {row:?}");
        largest = largest.max(coupling.abs().min(coordination.abs()));
    }
    assert!(largest > 0.1, "forces are too small for this test to mean anything: {largest}");
}

#[test]
fn the_target_is_the_mean_of_the_newest_samples_of_the_others() {
    let desk = Desk::with("two.toml", TWO);
    desk.text("run two.toml --out out");
    let table = Table::read(&desk, "out/trajectory.csv");
    for (row, values) in table.rows.iter().enumerate() {
        let tick = row / 2;
        // What the other one sent 24 ms ago, at the last multiple of 8 ms; before that, what everybody knows at the start.
        let sent = (tick / 8 * 8).saturating_sub(24);
        let other = &table.rows[2 * sent + 1 - row % 2];
        assert_eq!([table.get(values, "xd"), table.get(values, "vd")], [table.get(other, "xo"), table.get(other, "vo")], "tick {tick}");
    }
}

/// Returns each link of a document with its counters, by `SENDER->RECEIVER`.
fn links_of(document: &Value) -> BTreeMap<String, Value> {
    let links = document["links"].as_array().unwrap().iter();
    links.map(|link| (format!("{}->{}", link["from"].as_str().unwrap(), link["to"].as_str().unwrap()), link.clone())).collect()
}

#[test]
fn every_packet_has_one_row() {
    let desk = Desk::with("three.toml", RANDOM);
    let document = desk.json("run three.toml --json --out out");
    let table = Table::read(&desk, "out/packets.csv");
    assert_eq!(table.columns, ["link", "sequence", "sent", "arrived", "fate"]);
    let mut seen: BTreeMap<(String, u64), usize> = BTreeMap::new();
    let mut delivered: BTreeMap<String, (u64, f64)> = BTreeMap::new();
    let mut fates: BTreeMap<String, u64> = BTreeMap::new();
    for row in &table.rows {
        let (link, sent): (&str, f64) = (table.get(row, "link"), table.number(row, "sent"));
        *seen.entry((link.to_owned(), table.number(row, "sequence"))).or_default() += 1;
        *fates.entry(table.get(row, "fate").to_owned()).or_default() += 1;
        if table.get(row, "fate") == "delivered" {
            let arrived: f64 = table.number(row, "arrived");
            assert!(arrived >= sent && arrived <= 0.6, "{row:?}");
            let (count, delays) = delivered.entry(link.to_owned()).or_default();
            *count += 1;
            *delays += arrived - sent;
        } else {
            assert_eq!(table.get(row, "arrived"), "", "{row:?}");
        }
        assert!((sent * 1e3 / 8.0 - (sent * 1e3 / 8.0).round()).abs() < 1e-9, "samples are sent every 8 ms: {row:?}");
    }
    assert!(seen.values().all(|rows| *rows == 1), "a packet has two rows");
    let links = links_of(&document);
    let line = &document["access_lines"][0];
    for (link, count) in links.iter().map(|(name, link)| (name, link["delivered"].as_u64().unwrap())) {
        assert_eq!(delivered.get(link).map(|(count, _)| *count), Some(count), "{link}");
        // "left" is behind an access line: its packets need longer from end to end than on the link.
        if !link.starts_with("left") {
            let (count, delays) = delivered[link];
            #[expect(clippy::cast_precision_loss, reason = "a few packets")]
            let mean = delays / count as f64;
            assert!((mean - links[link]["mean_delay_s"].as_f64().unwrap()).abs() < 2e-9, "{link}: a mean is rounded to nanoseconds");
        }
    }
    for cause in ["loss", "outage", "queue-full"] {
        let counted: u64 = links.values().chain([line]).map(|link| link["dropped"][cause].as_u64().unwrap()).sum();
        assert_eq!(fates.get(cause), Some(&counted), "{cause}");
    }
    let rows: u64 = links.values().map(|link| link["delivered"].as_u64().unwrap() + dropped(link)).sum::<u64>() + dropped(line);
    assert_eq!(table.rows.len() as u64, rows);
}

#[test]
fn packets_of_a_constant_link_arrive_after_its_delay() {
    let desk = Desk::with("two.toml", TWO);
    desk.text("run two.toml --out out");
    let table = Table::read(&desk, "out/packets.csv");
    assert_eq!(table.rows.len(), 46);
    for (place, row) in table.rows.iter().enumerate() {
        let (frame, link) = (place as u64 / 2, ["left->right", "right->left"][place % 2]);
        assert_eq!((table.get(row, "link"), table.number::<u64>(row, "sequence"), table.get(row, "fate")), (link, frame, "delivered"));
        let seconds = |millis: u64| std::time::Duration::from_millis(millis).as_secs_f64().to_string();
        assert_eq!([table.get(row, "sent"), table.get(row, "arrived")], [seconds(8 * frame), seconds(8 * frame + 24)]);
    }
}

#[test]
fn links_agree_with_the_document() {
    // The uplink of 100 kbit/s, shared with cross packets of the same rate, whose queue of two packets is often full.
    let scene = RANDOM
        .replace("uplink = { rate = \"100kbit\",", "uplink = { rate = \"100kbit\", cross-traffic.poisson = { rate = \"100kbit\", size = \"100B\" },");
    let desk = Desk::with("three.toml", &scene);
    let document = desk.json("run three.toml --json --out out");
    let cross = |counters: &Value, count: &str| counters.get("cross_traffic").map_or_else(|| json!(0), |counts| counts[count].clone());
    assert!(cross(&document["access_lines"][0], "dropped").as_u64().unwrap() > 0);
    let table = Table::read(&desk, "out/links.csv");
    let links = links_of(&document);
    let mut agreed = 0;
    for row in &table.rows {
        let counters = links.get(table.get(row, "link")).unwrap_or_else(|| &document["access_lines"][0]);
        for (column, value) in table.columns.iter().zip(row).skip(1) {
            let expected = match column.as_str() {
                "in-flight" => counters["in_flight"].clone(),
                "mean-delay-s" => counters["mean_delay_s"].clone(),
                // A line that met no cross packet has no counts in the document, and zeros in the file.
                "cross-offered" => cross(counters, "offered"),
                "cross-dropped" => cross(counters, "dropped"),
                key if counters[key].is_u64() => counters[key].clone(),
                cause => counters["dropped"][cause].clone(),
            };
            assert_eq!(value.parse::<f64>().ok(), expected.as_f64(), "{column} of {row:?}");
            agreed += 1;
        }
    }
    assert_eq!((table.rows.len(), agreed), (3 * 2 + 1, 7 * (table.columns.len() - 1)));
}

#[test]
fn a_link_that_delivered_nothing_has_no_mean_delay() {
    let desk = Desk::with("two.toml", TWO);
    let document = desk.json("run two.toml --json --out out --set links.left.right.loss=100%");
    assert!(document["links"][0]["mean_delay_s"].is_null());
    let table = Table::read(&desk, "out/links.csv");
    assert_eq!(table.get(&table.rows[0], "mean-delay-s"), "");
}

#[test]
fn plots_are_well_formed_and_name_the_peers() {
    let odd = TWO.replace("\"left\"", "\"R&D<1\"").replace("Two users", "A & B: \\\"x\\\" < y\\u0007");
    for (scene, names) in [(TWO, ["left", "right"]), (PLANE, ["left", "right"]), (odd.as_str(), ["R&D<1", "right"])] {
        let desk = Desk::with("scene.toml", scene);
        desk.text("run scene.toml --out out");
        for plot in ["positions.svg", "forces.svg", "network.svg"] {
            let document = desk.read(&format!("out/{plot}"));
            assert_eq!(cohaptic_picture::testing::faults(&document), [""; 0], "{plot}");
            let words = svg::words(&document);
            let row = [format!("{} → {}: none of ", names[0], names[1]), format!("{} → {}: none of ", names[1], names[0])];
            let links = row.iter().all(|link| words.iter().any(|word| word.starts_with(link.as_str())));
            assert!(links || plot != "network.svg", "a row for each link: {words:?}");
            let names: &[&str] = if plot == "network.svg" { &["Delay [ms]", "Share of packets"] } else { &names };
            assert!(names.iter().all(|name| words.iter().any(|word| word == name)), "{plot}: {words:?}");
        }
    }
}

/// A column of a paper is 85 mm wide: 321.26 px of a 96th of an inch.
#[test]
fn pictures_have_the_size_that_was_asked_for() {
    let desk = Desk::with("two.toml", TWO);
    for (command, picture) in [
        ("run two.toml --no-plot", "network.svg"),
        ("admittance two.toml --peer left --points 5", "admittance.svg"),
        ("stability boundary two.toml --along coordination.stiffness=0..5000 --samples 20", "boundary.svg"),
        ("stability map two.toml --x coordination.stiffness=100..6000 --y coordination.damping=0..60 --grid 4x4", "map.svg"),
    ] {
        for (size, root) in [("one-column", "width=\"85mm\" "), ("700x900", "width=\"700\" height=\"900\" ")] {
            desk.text(&format!("{command} --out out --size {size}"));
            let svg = desk.read(&format!("out/{picture}"));
            assert!(svg.lines().next().is_some_and(|line| line.contains(root)), "{command}: {}", svg.lines().next().unwrap_or_default());
            assert_eq!(cohaptic_picture::testing::faults(&svg), [""; 0], "{command} {size}");
        }
    }
    desk.cohaptic("run two.toml --out out --size 20x20mm").assert_refused(2, &["a picture is 160 px (42 mm) to"]);
    desk.cohaptic("run two.toml --size page").assert_refused(2, &["--out"]);
}

#[test]
fn an_existing_folder_is_used_and_its_records_replaced() {
    let desk = Desk::with("two.toml", TWO);
    desk.write("out/notes.txt", "mine");
    desk.write("out/trajectory.csv", "old");
    desk.write("out/packets.csv.partial", "left behind by a run that was killed");
    desk.text("run two.toml --out out");
    let first = desk.read("out/trajectory.csv");
    assert!(first.starts_with("t,peer,xh,"), "{first}");
    desk.text("run two.toml --out out --set scene.duration=50ms");
    let (second, notes) = (desk.read("out/trajectory.csv"), desk.read("out/notes.txt"));
    assert_eq!((second.lines().count(), notes.as_str()), (1 + 2 * 50, "mine"));
    assert!(first.starts_with(&second), "the shorter run is the beginning of the longer one");
    assert_eq!(desk.files("out").len(), FILES.len() + 1);
}

#[test]
fn records_do_not_depend_on_the_model() {
    let desk = Desk::with("three.toml", RANDOM);
    desk.text("run three.toml --out least");
    desk.text("run three.toml --out general --general");
    // The page names the command, which is another one.
    for file in FILES.into_iter().filter(|file| *file != "run.html") {
        assert!(desk.read(&format!("least/{file}")) == desk.read(&format!("general/{file}")), "{file}");
    }
}
