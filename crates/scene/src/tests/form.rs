//! Tests of the printed form of a fault.

use super::{SCENE, check, check_replaced, refused};

#[test]
fn the_display_form_shows_the_line_with_carets_below_the_place() {
    let error = refused(&SCENE.replace("delay = \"24ms\"", "delay     = \"8 parsecs\""), &[]);
    let expected = r#"x.toml:17:13: link.delay: unknown unit "parsecs" in "8 parsecs": expected a duration such as "8ms", "1.5s" or "250us" (units: ns, us, ms, s, min, h)
   |
17 | delay     = "8 parsecs"
   |             ^^^^^^^^^^^"#;
    assert_eq!(error.to_string(), expected);
    assert!(!error.is_io());
}

#[test]
fn the_display_form_of_an_override_shows_the_override() {
    let error = refused(SCENE, &["link.dlay=\"8ms\""]);
    let keys = cohaptic_linkfile::schema::link::LINK_TABLE.keys().map(|key| key.name).collect::<Vec<_>>().join(", ");
    assert!(keys.starts_with("delay, jitter, order, loss, mark-instead-of-loss, duplicate, corrupt, reorder, rate, queue"), "{keys}");
    let expected = format!(
        "--set link.dlay=\"8ms\": link.dlay: unknown key: expected one of {keys}; did you mean \"delay\"?\n |\n | link.dlay=\"8ms\"\n |      ^^^^"
    );
    assert_eq!(error.to_string(), expected);
}

#[test]
fn what_is_no_toml_is_refused_in_the_same_form() {
    check_replaced(&[
        ("\"24ms\"", "24ms", "17:9: link.delay: not TOML: "),
        ("delay =", "delay", "17:7: link: not TOML: "),
        ("mass = 0.45", "mass = 0.45\nmass = 0.5", "5:1: object.mass: this key or table was given before: expected it once"),
        ("[link]", "[link]\n[link]", "17:2: link: this key or table was given before"),
        ("[link]", "[link", "16:6: link: not TOML: "),
        ("\"7s\"", "\"7s", "2:15: scene.duration: not TOML: "),
    ]);
    check("", "1:1: scene: missing key");
}

#[test]
fn of_several_faults_the_first_in_the_file_is_said() {
    let text = SCENE.replace("0.45", "-1").replace("\"24ms\"", "\"x\"").replace("\"7s\"", "\"7x\"");
    check(&text, "2:12: scene.duration: ");
    // [scene] is read first, wherever it stands. The fault that stands first is reported all the same.
    let late = "[link]\ndelay = \"x\"\n".to_owned() + &SCENE.replace("[link]\ndelay = \"24ms\"\n", "").replace("\"7s\"", "7");
    check(&late, "2:9: link.delay: ");
    // A fault in an override comes after every fault in the file.
    assert!(refused(&SCENE.replace("0.45", "-1"), &["link.dlay=1"]).to_string().starts_with("x.toml:4:8: object.mass"));
}

#[test]
fn what_a_text_holds_does_not_reach_the_terminal_raw() {
    let shown = refused(&SCENE.replace("\"24ms\"", "\"\\u001b[31m\\u202e\""), &["x\u{1b}=1"]).to_string();
    assert!(shown.contains("\\u{1b}[31m\\u{202e}"), "{shown}");
    assert!(shown.chars().all(|c| c == '\n' || !c.is_control()));
}

#[test]
fn a_line_of_any_length_is_cut_around_the_place() {
    let text = SCENE.replace("delay = \"24ms\"", &format!("outage = [{}{{ from = 1 }}]", "{ from = \"1s\", to = \"2s\" }, ".repeat(1000)));
    let error = refused(&text, &[]);
    let place = error.diagnostic().unwrap();
    assert_eq!(place.line(), 17);
    assert!(place.shown_line().chars().count() <= 202);
    let shown = error.to_string();
    let lines: Vec<&str> = shown.lines().collect();
    let caret = lines[3].chars().position(|c| c == '^').unwrap();
    assert_eq!(lines[2].chars().nth(caret), Some('1'), "{shown}");
}

#[test]
fn an_override_that_leads_nowhere_is_refused() {
    for (given, expected) in [
        ("link.delay", "--set link.delay: no = in the override: expected KEY=VALUE"),
        ("=1", "--set =1: the key is not a dotted path"),
        ("link..delay=1ms", "--set link..delay=1ms: link..delay: the key is not a dotted path"),
        (
            "peers.lefft.tick=1ms",
            "--set peers.lefft.tick=1ms: peers.lefft: there is no peer \"lefft\": expected one of left, right; did you mean \"left\"?",
        ),
        ("links.left=1", "--set links.left=1: links.left: one end of a link"),
        ("links.left.nobody.delay=1ms", "--set links.left.nobody.delay=1ms: links.left.nobody.to: there is no peer \"nobody\""),
        ("timeline.3.at=1s", "--set timeline.3.at=1s: timeline.3: there is no entry \"3\": expected the place of one of its 0 entries, from 0"),
        ("link.delay.mean=1ms", "--set link.delay.mean=1ms: link.delay.mean: link.delay is the text \"24ms\" here and holds no keys"),
        ("link.delay=8 parsecs", "--set link.delay=8 parsecs: link.delay: unknown unit \"parsecs\""),
        ("object.mass=nan", "--set object.mass=nan: object.mass: nan is not finite"),
        ("object.mass=-1", "--set object.mass=-1: object.mass: -1 is out of range"),
        ("objects.mass=1", "--set objects.mass=1: objects: unknown key"),
        ("peers.left=3", "--set peers.left=3: peers.left"),
        ("scene.duration=", "--set scene.duration=: scene.duration: \"\" does not begin"),
    ] {
        let shown = refused(SCENE, &[given]).to_string();
        assert!(shown.starts_with(expected), "\nexpected {expected}\nfound    {shown}");
    }
}
