//! `--set KEY=VALUE`, in each form of the manual.

use serde_json::Value;

use crate::integration::desk::Desk;
use crate::integration::scenes::TWO;

/// The mean delay of a link of the document.
fn delay(document: &Value, from: &str, to: &str) -> f64 {
    let link = document["links"].as_array().unwrap().iter().find(|link| link["from"] == from && link["to"] == to).unwrap();
    link["mean_delay_s"].as_f64().unwrap()
}

#[test]
fn a_duration_needs_no_quotes() {
    let desk = Desk::with("two.toml", TWO);
    for set in [r#"link.delay='"8ms"'"#, "link.delay=8ms", r"'link.delay = 8ms'"] {
        let document = desk.json(&format!("run two.toml --json --set {set}"));
        assert_eq!((delay(&document, "left", "right"), delay(&document, "right", "left")), (0.008, 0.008), "{set}");
    }
}

#[test]
fn a_link_is_named_by_both_ends_and_made_where_there_is_none() {
    let document = Desk::with("two.toml", TWO).json("run two.toml --json --set links.left.right.delay=8ms");
    assert_eq!((delay(&document, "left", "right"), delay(&document, "right", "left")), (0.008, 0.024));
}

#[test]
fn a_number_is_a_number() {
    let desk = Desk::with("two.toml", TWO);
    for (set, gains) in [("coordination.stiffness=700", "KT = 700 N/m"), ("coordination.stiffness=1.5e3", "KT = 1500 N/m")] {
        let text = desk.text(&format!("explain two.toml --set {set}"));
        assert!(text.contains(gains), "{text}");
    }
    assert_eq!(desk.json("run two.toml --json --set coordination.update=4ms")["links"][0]["offered"], 50);
}

#[test]
fn a_peer_is_named() {
    let desk = Desk::with("two.toml", TWO);
    for set in [r#"peers.left.contact='"none"'"#, "peers.left.contact=none", "'peers.left.hand={ force = 0.0 }'"] {
        // Only the hand of the left moves anything here.
        let document = desk.json(&format!("run two.toml --json --set {set}"));
        assert_eq!(document["peers"][0]["position_m"].as_f64(), Some(0.0), "{set}");
    }
    assert!(desk.json("run two.toml --json")["peers"][0]["position_m"].as_f64() > Some(0.0));
}

#[test]
fn an_entry_of_a_list_is_named_by_its_place() {
    let scene = format!("{TWO}\n[[timeline]]\nat = \"100ms\"\nlink = \"all\"\nset = {{ loss = \"100%\" }}\n");
    let desk = Desk::with("two.toml", &scene);
    let lost = |set: &str| desk.json(&format!("run two.toml --json {set}"))["links"][0]["dropped"]["loss"].as_u64().unwrap();
    // Of the 25 samples each 8 ms, 13 are sent before 100 ms and 19 before 150 ms.
    assert_eq!((lost(""), lost("--set timeline.0.at=150ms"), lost("--set 'timeline=[]'")), (12, 6, 0));
}

#[test]
fn the_last_word_counts() {
    let document = Desk::with("two.toml", TWO).json("run two.toml --json --set link.delay=80ms --set link.delay=8ms");
    assert_eq!(delay(&document, "left", "right"), 0.008);
}

#[test]
fn a_wrong_override_is_named() {
    let desk = Desk::with("two.toml", TWO);
    for (set, parts) in [
        ("link.dlay=8ms", &["--set link.dlay=8ms: link.dlay: unknown key", "did you mean \"delay\"?", "     ^^^^"][..]),
        ("link.delay=8", &["--set link.delay=8: link.delay", "^"]),
        ("peers.nobody.contact=none", &["--set peers.nobody.contact=none", "nobody", "^"]),
        ("links.left.nobody.delay=8ms", &["--set links.left.nobody.delay=8ms", "nobody", "^"]),
        ("timeline.3.at=1s", &["--set timeline.3.at=1s", "^"]),
        ("object.mass=-1", &["--set object.mass=-1: object.mass", "^"]),
        ("object.mass=nan", &["--set object.mass=nan: object.mass", "^"]),
        ("object.mass", &["--set object.mass"]),
        ("=", &["--set ="]),
        ("''", &["--set "]),
    ] {
        for command in ["run", "explain"] {
            desk.cohaptic(&format!("{command} two.toml --set {set} --json")).assert_refused(2, parts);
        }
    }
}
