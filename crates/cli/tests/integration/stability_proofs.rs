//! `cohaptic stability point --every-number` and `cohaptic stability map --prove`: verdicts on sets of scenes, beside those on single ones.

use crate::integration::desk::Desk;
use crate::integration::scenes::TWO;

const EQUAL: &str = r#"
scene = { title = "Equal peers", duration = "1s", count = 3 }
object = { mass = 0.45, split-mass = false }
coordination = { strategy = "proportional-derivative", stiffness = 1000.0, damping = 5.0, update = "8ms" }
peer = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
link = { delay = "8ms" }
"#;

const GAINS: &str = "--x coordination.stiffness=100..6000 --y coordination.damping=0..60";

/// Single scenes on either side of each change say what the spans say.
#[test]
fn spans_of_numbers_change_where_single_verdicts_do() {
    let desk = Desk::with("equal.toml", EQUAL);
    let document = desk.json("stability point equal.toml --every-number 2..200 --json");
    let spans = document["every_number"]["spans"].as_array().unwrap();
    assert!(spans.len() > 1 && spans[0]["from"] == 2 && spans.last().unwrap()["to"] == 200, "{document:#}");
    for span in spans {
        for end in ["from", "to"] {
            let single = desk.json(&format!("stability point equal.toml --json --set scene.count={}", span[end]));
            assert_eq!(single["verdict"], span["verdict"], "{span}");
        }
    }
    let average = "stability point equal.toml --set coordination.strategy=average-position";
    let text = desk.text(&format!("{average} --every-number"));
    assert!(text.contains("of which more and more are equal to peer1, proven:\n    stable    for N >= 2\n"), "{text}");
    let without_end = desk.json(&format!("{average} --every-number 5.. --json"));
    let expected = serde_json::json!([{ "from": 5, "to": null, "verdict": "stable" }]);
    assert_eq!((&without_end["every_number"]["spans"], &without_end["every_number"]["without_limit"]), (&expected, &serde_json::Value::Null));
    let text = desk.text("stability point equal.toml --every-number");
    let note = "note: as N grows, the gains of the coordination grow with N: beyond N = 100000 only instability can be proven\n";
    assert!(text.contains(note) && text.contains("unstable  for N >= 180\n"), "{text}");
    let text = desk.text("stability point equal.toml --every-number 200000..");
    assert!(text.contains("beyond N = 200000 only instability can be proven\n") && text.contains("unstable  for N >= 200000\n"), "{text}");
    let text = desk.text("stability point equal.toml --every-number 2..9 --set link.loss=5%");
    assert!(text.contains("equal to peer1, proven in the mean square:\n    stable    for 2 <= N <= 9\n"), "{text}");
}

/// Numbers whose eigenvalue lies on the circle, beyond those that are followed, near a limit on the circle, with bounds that overflow, and in the mean square:
/// each has a reason. Numbers that a certificate leaves open are named.
#[test]
fn undecided_numbers_have_a_reason_and_uncertified_ones_a_note() {
    let desk = Desk::with("equal.toml", EQUAL);
    let reason = |rest: &str, span: &str| {
        let text = desk.text(&format!("stability point {rest}"));
        let line = text.lines().find(|line| line.contains("undecided for ")).unwrap_or_else(|| panic!("{text}"));
        assert!(line.contains(&format!("undecided for {span}: ")), "{text}");
        line.split_once(": ").map(|(_, reason)| reason.to_owned()).unwrap()
    };
    let shipped = env!("CARGO_MANIFEST_DIR").to_owned() + "/../../scenarios";
    let on_circle = reason(&format!("{shipped}/coordination/difference-mode.toml --every-number"), "N >= 2");
    assert!(on_circle.starts_with("at N = 2 the largest eigenvalue of a frame, of the size 1"), "{on_circle}");
    assert!(on_circle.contains(", is too near to the unit circle for bounds of "), "{on_circle}");
    assert_eq!(reason(&format!("{shipped}/coordination/n50.toml --every-number"), "N >= 100001"), "no proof was found beyond N = 100000");
    assert_eq!(reason(&format!("{shipped}/coordination/n50.toml --every-number 200000.."), "N >= 200001"), "no proof was found beyond N = 200000");
    let limit = reason(&format!("{shipped}/coordination/wave.toml --every-number"), "N >= 131071");
    assert!(limit.starts_with("as N grows, the largest eigenvalue of a frame, of the size 1"), "{limit}");
    let lossy = "equal.toml --set object.mass=1 --set coordination.stiffness=5000 --set link.loss=20% --every-number 30..38";
    assert_eq!(reason(lossy, "32 <= N <= 37"), "no second moment was found that decides N = 32");
    let queue = format!("{shipped}/network/rate-and-queue.toml --every-number 2..1100");
    assert_eq!(reason(&queue, "1075 <= N <= 1100"), "at N = 1075 the bounds of a frame are no finite numbers");
    let document = desk.json(&format!("stability point {shipped}/network/rate-and-queue.toml --every-number 30..40 --certificate queue.json --json"));
    let certificate: serde_json::Value = serde_json::from_str(&desk.read("queue.json")).unwrap();
    let open = certificate["spans"].as_array().unwrap().iter().filter(|span| span["verdict"] == "undecided");
    let open: Vec<[u64; 2]> = open.map(|span| ["from", "to"].map(|end| span[end].as_u64().unwrap())).collect();
    let (first, last) = (open.first().unwrap()[0], open.last().unwrap()[1]);
    assert_eq!(document["every_number"]["uncertified"], serde_json::json!([{ "from": first, "to": last }]), "{document:#}");
    assert!(document["every_number"]["spans"].as_array().unwrap().iter().all(|span| span.get("reason").is_none()), "{document:#}");
    let text = desk.text(&format!("stability point {shipped}/network/rate-and-queue.toml --every-number 30..40 --certificate queue.json"));
    assert!(text.contains(&format!("note: the certificate leaves open numbers that are decided here: {first} <= N <= {last}\n")), "{text}");
}

/// Pieces of a long frame that are decided and left open by the certificate: as many as its open boxes within stretches with a verdict.
#[test]
fn pieces_that_a_certificate_leaves_open_are_counted() {
    let desk = Desk::with("equal.toml", EQUAL);
    let queue = env!("CARGO_MANIFEST_DIR").to_owned() + "/../../scenarios/network/rate-and-queue.toml";
    let command = format!("stability boundary {queue} --along coordination.stiffness=100..6000 --prove --certificate --out out");
    let document = desk.json(&format!("{command} --json"));
    let certificate: serde_json::Value = serde_json::from_str(&desk.read("out/certificate.json")).unwrap();
    let number = |value: &serde_json::Value| value.as_f64().unwrap();
    let decided = |at: f64| {
        document["stretches"]
            .as_array()
            .unwrap()
            .iter()
            .any(|one| one["verdict"] != "undecided" && number(&one["low"]) < at && at < number(&one["high"]))
    };
    let is_open =
        |one: &&serde_json::Value| one["verdict"] == "undecided" && decided(number(&one["ranges"][0][0]).midpoint(number(&one["ranges"][0][1])));
    let open = certificate["boxes"].as_array().unwrap().iter().filter(is_open).count();
    assert!(open > 1, "{document:#}");
    assert_eq!(document["uncertified"], open, "{document:#}");
    let note = format!("certificate leaves open {open} pieces of those that are decided here");
    assert!(desk.read("out/proof.html").contains(&format!("<li>The {note}.</li>")));
    assert!(desk.text(&command).contains(&format!("note: the {note}")), "{command}");
}

#[test]
fn a_region_is_written_as_boxes_and_pictures_the_same_on_any_number_of_threads() {
    let desk = Desk::with("equal.toml", EQUAL);
    let line = |folder: &str, rest: &str| {
        format!(
            "stability map equal.toml {GAINS} --prove 4 --set scene.count=6 --against coordination.strategy=average-position --out {folder} {rest}"
        )
    };
    let document = desk.json(&line("out", "--json --threads 1"));
    assert_eq!(desk.files("out"), ["proof-2.csv", "proof-2.svg", "proof.csv", "proof.html", "proof.svg"]);
    desk.text(&line("again", "--threads 3"));
    for file in desk.files("out") {
        assert_eq!(desk.read(&format!("out/{file}")), desk.read(&format!("again/{file}")), "{file}");
    }
    let regions = document["regions"].as_array().unwrap();
    let share = |region: usize, key: &str| regions[region][key].as_f64().unwrap();
    for region in 0..2 {
        let sum: f64 = ["stable", "unstable", "undecided"].map(|key| share(region, key)).iter().sum();
        assert!((sum - 1.0).abs() < 1e-12 && share(region, "undecided") < 0.5, "{document:#}");
    }
    // Average position is stable wherever proportional-derivative coordination is, and elsewhere.
    assert!(share(1, "stable_alone") > 0.02 && share(1, "unstable_alone") < 1e-12, "{document:#}");
    let table = desk.read("out/proof.csv");
    assert!(
        table.starts_with("coordination.stiffness from,coordination.stiffness to,coordination.damping from,coordination.damping to,verdict\n"),
        "{table}"
    );
    assert_eq!(table.lines().count() - 1, usize::try_from(regions[0]["boxes"].as_u64().unwrap()).unwrap());
    assert!(desk.read("out/proof.svg").contains("proven stable"));
    let text = desk.text(&format!("stability map equal.toml {GAINS} --prove 2"));
    assert!(text.contains("proven stable ") && text.contains("undecided "), "{text}");
}

#[test]
fn a_line_encloses_the_crossings_of_the_search() {
    let desk = Desk::with("equal.toml", EQUAL);
    let along = "stability boundary equal.toml --along coordination.stiffness=100..6000";
    let found = desk.json(&format!("{along} --json"));
    let proven = desk.json(&format!("{along} --prove --tolerance 1e-3 --json --out out"));
    let stretches = proven["stretches"].as_array().unwrap();
    let open: Vec<(f64, f64)> = stretches
        .iter()
        .filter(|stretch| stretch["verdict"] == "undecided")
        .map(|stretch| (stretch["low"].as_f64().unwrap(), stretch["high"].as_f64().unwrap()))
        .collect();
    let crossings = found["crossings"].as_array().unwrap();
    assert!(!crossings.is_empty() && open.len() == crossings.len(), "{proven:#} {found:#}");
    for (crossing, (low, high)) in crossings.iter().zip(&open) {
        let value = crossing["value"].as_f64().unwrap();
        assert!(value > low - 1e-4 && value < high + 1e-4 && high - low < 4e-3, "{value} is not between {low} and {high}");
    }
    assert_eq!(desk.read("out/proof.csv").lines().count(), 1 + stretches.len());
    let text = desk.text(&format!("{along} --prove"));
    assert!(text.contains("  crossing:  from coordination.stiffness=") && text.contains("nothing crosses anywhere else"), "{text}");
}

/// A delay is divided where a sample comes into force at another tick: single delays within say what its pieces say.
#[test]
fn delays_are_proven_tick_by_tick() {
    let desk = Desk::with("equal.toml", EQUAL);
    let set = "--set coordination.stiffness=2000";
    let proven = desk.json(&format!("stability boundary equal.toml --along link.delay=0ms..30ms {set} --prove --json"));
    let stretches = proven["stretches"].as_array().unwrap();
    let ends = |stretch: &serde_json::Value| ["low", "high"].map(|end| stretch[end].as_f64().unwrap());
    assert!(stretches.len() > 1 && stretches.iter().all(|stretch| stretch["verdict"] != "undecided"), "{proven:#}");
    assert!(stretches.iter().all(|stretch| ends(stretch)[1].fract() == 0.0), "{proven:#}");
    for stretch in stretches {
        for value in ends(stretch) {
            let single = desk.json(&format!("stability point equal.toml --json {set} --set link.delay={value:?}ms"));
            assert_eq!(single["verdict"], stretch["verdict"], "{value} {stretch}");
        }
    }
    let region = desk.json("stability map equal.toml --x link.delay=0ms..4ms --y coordination.stiffness=100..6000 --prove 4 --json --out out");
    let found = &region["regions"][0];
    let stable = found["stable"].as_f64().unwrap();
    assert!(stable > 0.1 && stable < 1.0, "{region:#}");
    // No delay at all is a line without an area: what is undecided on it is counted apart.
    let rows = desk.read("out/proof.csv");
    let mut lines = std::collections::BTreeMap::<&str, u64>::new();
    rows.lines().filter(|row| row.starts_with("0.0,0.0,")).for_each(|row| *lines.entry(row.rsplit(',').next().unwrap()).or_default() += 1);
    assert!(!lines.is_empty(), "{rows}");
    for verdict in ["stable", "unstable", "undecided"] {
        assert_eq!(found["lines"][verdict], lines.get(verdict).copied().unwrap_or(0), "{verdict}: {found}");
    }
    let text = desk.text("stability map equal.toml --x link.delay=0ms..4ms --y coordination.stiffness=100..6000 --prove 4");
    let words = format!("and without an area, lines at a single delay: {} proven stable", lines.get("stable").copied().unwrap_or(0));
    assert!(text.contains(&words), "{text}");
}

/// The verdicts of proven stretches, of a server with clients and of peers on a ring, equal the verdicts of single scenes at the ends of the stretches.
#[test]
fn servers_and_topologies_are_proven_as_single_scenes_are_judged() {
    let desk = Desk::with("equal.toml", EQUAL);
    for (set, key) in [
        ("--set coordination.strategy=client-server", "peer.coupling.stiffness"),
        ("--set scene.count=5 --set topology={kind=\"ring\",neighbours=2}", "coordination.stiffness"),
    ] {
        let proven = desk.json(&format!("stability boundary equal.toml {set} --along {key}=10..4000 --tolerance 10 --prove --json"));
        let stretches = proven["stretches"].as_array().unwrap();
        let decided: Vec<_> = stretches.iter().filter(|stretch| stretch["verdict"] != "undecided").collect();
        assert!(decided.iter().any(|one| one["verdict"] == "stable") && decided.iter().any(|one| one["verdict"] == "unstable"), "{set}: {proven:#}");
        for stretch in decided {
            for end in ["low", "high"] {
                let single = desk.json(&format!("stability point equal.toml --json {set} --set {key}={}", stretch[end]));
                assert_eq!(single["verdict"], stretch["verdict"], "{set} {stretch}");
            }
        }
    }
}

/// A box for every number of peers is one for each of them.
#[test]
fn a_region_of_every_number_holds_each_number() {
    let desk = Desk::with("equal.toml", EQUAL);
    let average = "--set coordination.strategy=average-position --x coordination.stiffness=100..6000 --y coordination.damping=0..60 --prove 5";
    let share = |rest: &str| desk.json(&format!("stability map equal.toml {average} --json {rest}"))["regions"][0]["stable"].as_f64().unwrap();
    let every = share("--every-number 3..");
    assert!(every > 0.1, "{every}");
    for count in [3, 4, 9, 50] {
        let one = share(&format!("--set scene.count={count}"));
        assert!(one >= every - 0.02, "{count}: {one} {every}");
    }
}

#[test]
fn sets_that_cannot_be_proven_are_refused_with_a_way_out() {
    let desk = Desk::with("equal.toml", EQUAL);
    for (line, words) in [
        ("stability point equal.toml --every-number 1..", "at least 2 peers"),
        ("stability point equal.toml --every-number 9..8", "expected the smaller number first"),
        ("stability point equal.toml --every-number some", "expected FROM.. or FROM..TO"),
        ("stability point equal.toml --every-number --set link.loss=5% --set peers.peer1.contact=none", "leave something to chance"),
        ("stability point equal.toml --certificate numbers.json", "expected --every-number or --switching"),
        (
            "stability map equal.toml --x coordination.update=1ms..9ms --y coordination.damping=0..9 --prove",
            "coordination.update does more than to set",
        ),
        ("stability boundary equal.toml --along coordination.update=1ms..9ms --prove", "coordination.update does more than to set"),
        ("stability map equal.toml --x object.mass=1..2 --y coordination.damping=0..9 --prove --every-number", "depend on the number of peers"),
        ("stability map equal.toml --x object.mass=1..2 --y coordination.damping=0..9 --grid 2x2 --every-number", "cannot be used with"),
        ("stability map equal.toml --x link.loss=0%..9% --y coordination.damping=0..9 --prove", "link.loss does more than to set"),
        ("stability map equal.toml --x object.mass=1..2 --y coordination.damping=0..9", "--grid"),
        ("stability map equal.toml --x object.mass=1..2 --y coordination.damping=0..9 --prove --grid 2x2", "cannot be used with"),
        ("stability map equal.toml --x object.mass=1..2 --y coordination.damping=0..9 --prove 99", "99"),
    ] {
        desk.cohaptic(line).assert_refused(2, &[words]);
    }
    let set = |law: &str| format!("equal.toml --set coordination.strategy={law}");
    let keys = "--along coordination.stiffness=100..6000 --prove";
    let ring = "topology={kind=\"ring\",neighbours=2}";
    let turned = "equal.toml --set scene.axes=3 --set object.inertia=2.7e-4 --set peers.peer1.grasp=[0.03,0,0]";
    let loses = "equal.toml --set coordination.strategy=extrapolated --set link.loss=5%";
    for (line, words) in [
        (format!("map {} {GAINS} --prove 2 --every-number", set("client-server")), "client-server coordination: a box of keys holds for"),
        (format!("map equal.toml {GAINS} --prove 2 --every-number --set {ring}"), "expected no --every-number, and one number at a time"),
        (format!("map {} {GAINS} --prove 2 --every-number", set("wave")), "wave coordination: a box of keys holds for"),
        (format!("point {} --losses-in-a-row 1", set("client-server")), "client-server coordination is analysed only as a whole"),
        (format!("point {} --switching", set("set-position")), "set-position coordination has no analysis: simulations tell"),
        (format!("point {} --every-number", set("passivity-control")), "passivity-control coordination has no analysis: simulations tell"),
        (format!("point {} --losses-in-a-row 1", set("extrapolated")), "the worst case does not follow extrapolated coordination"),
        (format!("point {loses} --every-number"), "ask `stability point` for one number of peers at a time"),
        (format!("boundary {loses} {keys}"), "take the mean square, `stability point --losses-in-a-row` bounds all losses"),
        (format!("point {turned} --every-number"), "the proof for every number of peers of an object that turns"),
        (format!("boundary {turned} {keys}"), "take all components together where nothing else is asked for"),
        (format!("point {turned} --losses-in-a-row 1"), "the worst case of an object that turns"),
        (format!("point equal.toml --every-number --set {ring}"), "follow a topology where nothing but --prove is asked for"),
        ("point equal.toml --every-number --set coordination.send-when={position=0.001}".to_owned(), "expected a scene without it"),
    ] {
        desk.cohaptic(&format!("stability {line}")).assert_refused(2, &[words]);
    }
    let unequal = Desk::with("two.toml", TWO);
    unequal
        .cohaptic("stability point two.toml --every-number --set peers.right.device.mass=0.3")
        .assert_refused(2, &["two.toml: --every-number: no two peers are equal"]);
}
