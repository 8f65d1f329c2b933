//! The verdicts of `docs/claims.md` on regions of claims: *proven* where boxes of gains cover a region and a checker that shares no code accepts their certificate, *on paper* where the page derives it, *searched* where random scenes gave no
//! counterexample, and *fails*. The column is computed here; `COHAPTIC_UPDATE_PAGES=1` writes it.

use std::fs;
use std::path::Path;

use crate::integration::certificate_checker::{accepts, can_check};
use crate::integration::desk::Desk;

/// A region of gains in which every scene is stable, or in which some piece is unstable throughout.
struct Region {
    /// Text of the scene, to which the overrides `set` are applied.
    scene: &'static str,
    set: String,
    /// Arguments for the two keys and for the finest division.
    keys: &'static str,
    /// Argument for the numbers of peers; empty for the number of the scene.
    numbers: &'static str,
    /// `true` if the region is stable throughout, `false` if some part is unstable.
    is_stable: bool,
}

const GAINS: &str = "--x coordination.stiffness=10..1000 --y peer.coupling.stiffness=500..6000 --prove 10";
/// Scene of Figs. 3 and 4 in which all peers touch, with BT = BC = 5 N·s/m.
const FIGURE: &str = r#"
scene = { title = "Figs. 3 and 4", duration = "1s", count = 3 }
object = { mass = 0.45, split-mass = false }
coordination = { strategy = "average-position", stiffness = 100.0, damping = 5.0, update = "8ms" }
peer = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
link = { delay = "8ms" }
"#;

/// The scene of Section 5.2 without its push.
const ONE_TOUCHES: &str = include_str!("../../../../scenarios/counterexamples/both-stable.toml");

/// Returns the regions that prove a claim.
fn regions(claim: &str) -> Vec<Region> {
    let stable = |set: String, keys, numbers| Region { scene: FIGURE, set, keys, numbers, is_stable: true };
    match claim {
        "region-contains" => {
            let of = |delay| stable(format!("--set link.delay={delay}ms"), GAINS, "--every-number 3..");
            [0, 3, 8].map(of).into()
        }
        "region-larger" => {
            let six = |strategy: &str| format!("--set scene.count=6 --set object.split-mass=true --set coordination.strategy={strategy}");
            let unstable = Region { scene: FIGURE, set: six("proportional-derivative"), keys: GAINS_COARSE, numbers: "", is_stable: false };
            vec![stable(six("average-position"), GAINS, ""), unstable]
        }
        "both-stable" => {
            let of = |peers: u32, strategy: &str| Region {
                scene: ONE_TOUCHES,
                ..stable(format!("--set scene.count={peers} --set coordination.strategy={strategy}"), DELAYS, "")
            };
            [2, 3].iter().flat_map(|peers| ["average-position", "proportional-derivative"].map(|strategy| of(*peers, strategy))).collect()
        }
        _ => Vec::new(),
    }
}

/// Lines at a single delay count too.
const DELAYS: &str = "--x link.delay=0ms..8ms --y coordination.stiffness=100..1000 --prove 10";

const GAINS_COARSE: &str = "--x coordination.stiffness=10..1000 --y peer.coupling.stiffness=500..6000 --prove 5";

/// Proves a region and checks its certificate. Returns the number of boxes.
fn prove(region: &Region) -> u64 {
    let Region { scene, set, keys, numbers, is_stable } = region;
    let desk = Desk::with("figure.toml", scene);
    let document = desk.json(&format!("stability map figure.toml {keys} {numbers} {set} --certificate --out out --json"));
    let found = &document["regions"][0];
    let share = |verdict: &str| found[verdict].as_f64().unwrap();
    if *is_stable {
        let lines = |verdict: &str| found["lines"][verdict].as_u64().unwrap();
        let is_whole = share("stable") > 1.0 - 1e-12 && lines("unstable") + lines("undecided") == 0;
        assert!(is_whole, "{set} {keys} {numbers}: {found}");
    } else {
        assert!(share("unstable") > 0.0, "{set} {keys} {numbers}: {found}");
    }
    if can_check() {
        let text = accepts(&desk, "out/certificate.json", &format!("{set} {keys} {numbers}"));
        let words = if *is_stable { "stable 100.000 %" } else { "unstable" };
        assert!(text.contains(words), "{text}");
    }
    found["boxes"].as_u64().unwrap()
}

/// Claims that the page derives in a place that does not have the name of the claim.
const ON_PAPER: [&str; 1] = ["ap-unaffected"];

/// Claims of the paper for which random scenes are searched for a counterexample, each with the file and the name of the property test.
const SEARCHED: [(&str, &str, &str); 10] = [
    ("bounded-stiffness", "stiffness.rs", "copies_swing_with_the_stiffness_of_equations_3_and_6"),
    ("frequency-needs-scaling", "stiffness.rs", "with_scaled_gains_the_swing_of_every_number_of_peers_is_that_of_two"),
    ("region-contains", "regions.rs", "what_pd_keeps_stable_over_lossy_links_ap_keeps_stable"),
    ("pd-decreases", "regions.rs", "what_pd_keeps_stable_for_one_more_it_keeps_stable"),
    ("ap-unaffected", "regions.rs", "above_the_bound_of_local_damping_ap_is_stable_for_any_number_of_peers"),
    ("less-viscous", "felt.rs", "ap_is_less_viscous_than_pd_and_both_grow_with_the_number_of_peers"),
    ("damping-grows", "felt.rs", "ap_is_less_viscous_than_pd_and_both_grow_with_the_number_of_peers"),
    ("nearer-to-mass", "felt.rs", "below_20_hz_ap_is_nearer_to_a_mass_than_pd"),
    ("travel-order", "felt.rs", "a_push_takes_less_time_with_ap_than_with_pd"),
    ("stability-tests", "experiments.rs", "with_arms_the_four_outcomes_are_those_of_the_paper"),
];

/// Returns the cell of the verdict of a claim. `name` and `asserted` are the cells of its name and of its region.
fn verdict(name: &str, asserted: &str, page: &str, root: &Path) -> String {
    if asserted == "nowhere" {
        return "*fails*".to_owned();
    }
    let claim = name.strip_prefix('`').and_then(|rest| rest.split('`').next()).unwrap_or_default();
    let regions = regions(claim);
    if !regions.is_empty() {
        let boxes: u64 = regions.iter().map(prove).sum();
        let searched = if SEARCHED.iter().any(|(searched, ..)| *searched == claim) { "; else *searched*" } else { "" };
        return format!("*proven*, {boxes} boxes{searched}");
    }
    let derived = name.split("](#").nth(1).and_then(|rest| rest.split(')').next());
    if let Some(anchor) = derived {
        let heading = |line: &&str| line.strip_prefix("### ").is_some_and(|title| title.to_lowercase().replace(' ', "-") == anchor);
        assert!(page.lines().any(|line| heading(&line)), "{name}: no derivation {anchor}");
        return "*on paper*".to_owned();
    }
    if ON_PAPER.contains(&claim) {
        return "*on paper*".to_owned();
    }
    if let Some((_, file, property)) = SEARCHED.iter().find(|(searched, ..)| *searched == claim) {
        let text = fs::read_to_string(root.join("tests/claims").join(file)).unwrap();
        assert!(text.contains(&format!("fn {property}(")), "{claim}: {file} has no {property}");
        return "*searched*".to_owned();
    }
    assert!(claim.is_empty(), "{claim} has no proof and no property");
    "*searched*".to_owned()
}

#[test]
#[ignore = ".ci/nightly runs it: it takes long"]
fn the_page_of_claims_says_what_is_proven() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let file = root.join("docs/claims.md");
    let page = fs::read_to_string(&file).unwrap();
    let anew = page.lines().map(|line| {
        let cells: Vec<&str> = line.trim().trim_matches('|').split(" | ").map(str::trim).collect();
        let is_claim = line.starts_with("| ") && cells.len() == 4 && cells[1].starts_with('*');
        if !is_claim {
            return line.to_owned();
        }
        let anew = verdict(cells[0], cells[2], &page, &root);
        line.replacen(&format!("| {} |", cells[1]), &format!("| {anew} |"), 1)
    });
    let anew = anew.collect::<Vec<_>>().join("\n") + "\n";
    if std::env::var_os("COHAPTIC_UPDATE_PAGES").is_some() {
        fs::write(&file, anew).unwrap();
    } else {
        assert_eq!(page, anew, "docs/claims.md: run this test with COHAPTIC_UPDATE_PAGES=1");
    }
}
