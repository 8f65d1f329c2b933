//! Expectations and results in the document of `cohaptic check` and on its page.

use cohaptic_picture::testing::{page_faults, page_in_browser};
use serde_json::{Value, json};

use crate::integration::desk::{Desk, parse};
use crate::integration::scenes::TWO;

/// The expectations of a scene, by the document.
fn outcomes(desk: &Desk) -> Vec<Value> {
    parse(&desk.cohaptic("check scene.toml --json").stdout)["scenes"][0]["expectations"].as_array().unwrap().clone()
}

/// Of each kind one that passes and one that fails. Samples sent until 96 ms are 13 of 25; those of 104 ms, ... 192 ms are 12. Constant links delay by 24 ms.
#[test]
fn each_kind_of_expectation_passes_and_fails_with_its_numbers() {
    let timeline = "[[timeline]]\nat = \"100ms\"\nlink = \"all\"\nset = { loss = \"100%\" }\n";
    for (key, expect, limits, unit, passed, found) in [
        ("stable", "stable = true", [Value::Null, json!(1.0)], "", true, "it is stable: the spectral radius is 0.97307082862"),
        ("stable", "stable = false", [json!(1.0), Value::Null], "", false, "it is stable: the spectral radius is 0.97307082862"),
        ("discrepancy", "discrepancy = { max = 1.0 }", [Value::Null, json!(1.0)], "m", true, " m"),
        ("discrepancy", "discrepancy = { min = 0.5, max = 1.0 }", [json!(0.5), json!(1.0)], "m", false, " m"),
        ("position", "position = [{ peer = \"right\", at = \"100ms\", max = 0.5 }]", [Value::Null, json!(0.5)], "m", true, " m"),
        ("position", "position = [{ peer = \"right\", at = \"100ms\", min = 0.5 }]", [json!(0.5), Value::Null], "m", false, " m"),
        ("travel", "travel = [{ peer = \"left\", distance = 1e-6, max = \"1s\" }]", [Value::Null, json!(1.0)], "s", true, " s"),
        ("travel", "travel = [{ peer = \"left\", distance = 9.0, max = \"1s\" }]", [Value::Null, json!(1.0)], "s", false, "not reached"),
        ("loss", "loss = [{ cause = \"loss\", min = \"40%\" }]", [json!(0.4), Value::Null], "", true, "0.48 (24 of 50)"),
        ("loss", "loss = [{ cause = \"loss\", max = \"1%\" }]", [Value::Null, json!(0.01)], "", false, "0.48 (24 of 50)"),
        ("delay", "delay = [{ min = \"24ms\", max = \"24ms\" }]", [json!(0.024), json!(0.024)], "s", true, "24ms"),
        ("delay", "delay = [{ min = \"1ms\", max = \"20ms\" }]", [json!(0.001), json!(0.02)], "s", false, "24ms"),
    ] {
        let more = if key == "loss" { timeline } else { "" };
        let scene = format!("{TWO}\n{more}[expect]\n{expect}\n").replace("200ms", if key == "stable" { "2s" } else { "200ms" });
        let desk = Desk::with("scene.toml", &scene);
        let outcome = &outcomes(&desk)[0];
        assert_eq!((&outcome["expectation"], &outcome["unit"], &outcome["passed"]), (&json!(key), &json!(unit), &json!(passed)), "{outcome:#}");
        assert_eq!([&outcome["low"], &outcome["high"]], [&limits[0], &limits[1]], "{outcome:#}");
        assert!(outcome["found"].as_str().unwrap().contains(found), "{outcome:#}");
        assert_eq!(outcome["measured"].is_null(), found == "not reached", "{outcome:#}");
        match (key, outcome["measured"].as_f64()) {
            ("delay", Some(seconds)) => assert!((seconds - 0.024).abs() < 1e-12, "{seconds}"),
            ("loss", Some(share)) => assert!((share - 0.48).abs() < 1e-12, "{share}"),
            _ => {}
        }
        // The bar: a disc for what passed; what failed is a cross, or a triangle where it lies beyond the axis, and nothing if nothing was measured.
        let text = desk.cohaptic("check scene.toml --page page.html");
        assert_eq!((text.status, text.stderr.as_str()), (Some(i32::from(!passed)), "wrote page.html\n"));
        let page = desk.read("page.html");
        assert_eq!(page_faults(&page), [""; 0], "{expect}");
        assert_eq!(page.contains("✗ FAILED"), !passed, "{expect}");
        let drawn = page.split_once("<body>").unwrap().1;
        let (disc, other) = (drawn.contains("<circle class=\"f2\""), drawn.contains("class=\"line s1\"") || drawn.contains("class=\"f1\""));
        assert_eq!((disc, other), (passed, !passed && found != "not reached"), "{expect}");
    }
}

#[test]
fn the_page_has_a_row_for_each_expectation_of_each_scene_and_the_text_of_each_failure() {
    let desk = Desk::new();
    desk.write("scenes/a.toml", format!("{TWO}\n[expect]\ndiscrepancy = {{ max = 0.01 }}\ndelay = [{{ max = \"1ms\" }}, {{ min = \"1ms\" }}]\n"));
    desk.write("scenes/b <i>.toml", "broken <script>");
    desk.write("scenes/c.toml", TWO);
    let outcome = desk.cohaptic("check scenes --page all.html --set scene.title=1");
    assert_eq!(outcome.status, Some(2), "{outcome:?}");
    desk.cohaptic("check scenes --page all.html --threads 1");
    let page = desk.read("all.html");
    desk.cohaptic("check scenes --page again.html --json --threads 2");
    assert_eq!(page, desk.read("again.html"));
    assert_eq!(page_faults(&page), [""; 0]);
    assert_eq!(page.matches("<svg ").count(), 3);
    assert!(page.contains("1 passed, 2 failed. Of 3 expectations 1 are not met."), "{page}");
    for text in ["mean delay on all links: 24ms, expected at most 1ms", "scenes/b &lt;i&gt;.toml:1:", "scenes/c.toml", "nothing was compared"] {
        assert!(page.contains(text), "no {text:?} in {page}");
    }
    std::fs::create_dir(desk.path("browser")).unwrap();
    match page_in_browser(&desk.path("browser"), &page) {
        Some(found) => assert_eq!(found, [""; 0]),
        None => eprintln!("skipped: there is no chromium"),
    }
}

#[test]
fn a_page_that_cannot_be_written_is_an_error_after_the_results() {
    let desk = Desk::with("scene.toml", &format!("{TWO}\n[expect]\ndiscrepancy = {{ max = 0.01 }}\n"));
    let outcome = desk.cohaptic("check scene.toml --page nowhere/page.html");
    assert_eq!((outcome.status, outcome.stdout.as_str()), (Some(3), "ok    scene.toml\n1 passed, 0 failed\n"));
    assert!(outcome.stderr.contains("cannot write nowhere/page.html"), "{}", outcome.stderr);
}
