//! `cohaptic fit --hold-out`: a link is judged by packets that it has not seen.

use serde_json::{Value, json};

use crate::integration::desk::Desk;

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is not a number"))
}

/// 40 000 packets of a link that a fit can say: the two halves are alike.
#[test]
fn a_link_that_is_what_it_says_is_not_refused() {
    let desk = Desk::new();
    desk.text("link delay 40ms 4ms 50% distribution normal loss gemodel 1% 25% --packets 40000 --fates f.csv");
    let document = desk.json("fit f.csv --hold-out 50% --json --require-law --out link.toml");
    let judged = &document["hold_out"];
    assert_eq!((&judged["fitted"], &judged["held_out"], &document["goodness"]["packets"]), (&json!(20_000), &json!(20_000), &json!(20_000)));
    assert_eq!(judged["refused"], json!([]), "{judged:#}");
    // The mean of each half is known to 4 ms·√(3/20 000) = 49 µs, so W₁ is hardly above that. The link's own figures are those of the law.
    assert!(number(&judged["best"]["wasserstein_s"]) < 5.0 * 49e-6, "{judged:#}");
    assert!(
        (number(&judged["best"]["autocorrelation"][0]) - 0.5).abs() < 0.02 && number(&judged["best"]["autocorrelation"][1]).abs() < 0.02,
        "{judged:#}"
    );
    assert!((number(&judged["best"]["mean_run"]) - 4.0).abs() < 0.3, "{judged:#}");
    assert!(judged["measured"]["wasserstein_s"].is_null() && desk.path("link.toml").exists());
    let text = desk.text("fit f.csv --hold-out 50%");
    assert!(text.contains("not refused: the held-out packets are as this link says, as far as they tell\n"), "{text}");
    // 10^6 bytes over TCP: packets that overtake each other, in nearly all flights, are the same in all columns but for their order.
    let transfer = &document["hold_out"]["transfer_s"];
    let times = ["measured", "best", "independent", "gilbert", "replay"].map(|column| number(&transfer[column]));
    assert!(times.iter().all(|seconds| *seconds > 0.6), "{transfer}");
    assert!((times[1] / times[0] - 1.0).abs() < (times[2] / times[0] - 1.0).abs(), "{transfer}");
    let row = format!("  {:<22}{:>12.3} s{:>12.3} s", "TCP, 10^6 bytes", times[0], times[1]);
    assert!(text.contains(&row), "no {row} in:\n{text}");
    // A third of the time.
    assert_eq!(desk.json("fit f.csv --hold-out 0.25 --json")["hold_out"]["held_out"], json!(10_000));
}

/// Delays that stay long for 200 ms: in the mean a spike of 50 ms in each second, which decays in 200 ms. A fit finds that a share of the variation lasts that long,
/// but the rest is its own for each packet, while two packets of one spike are nearly alike.
#[test]
fn a_link_with_another_memory_is_refused() {
    let desk = Desk::new();
    desk.text("link delay=20ms jitter={sd=\"2ms\"} spike={rate=1,height=\"50ms\",decay=\"200ms\"} --packets 40000 --every 10ms --fates f.csv");
    let document = desk.json("fit f.csv --hold-out 50% --json");
    let refused = document["hold_out"]["refused"].as_array().unwrap();
    assert!(refused.iter().any(|reason| reason.as_str().unwrap().contains("1 packet apart")), "{document:#}");
    let share = number(&document["link"]["jitter"]["correlation_share"]);
    assert!(share > 0.5 && share < 0.95 && number(&document["link"]["jitter"]["correlation_time_s"]) > 0.1, "{document:#}");
    // The answer is printed all the same, and no file is written.
    let outcome = desk.cohaptic("fit f.csv --hold-out 50% --require-law --out link.toml");
    assert_eq!((outcome.status, desk.path("link.toml").exists()), (Some(1), false), "{outcome:?}");
    for part in [
        "fitted to the first 20000 packets, judged by the 20000 after them\n",
        "held out",
        "W1 from held out",
        "refused: the correlation of its delays",
    ] {
        assert!(outcome.stdout.contains(part), "no {part:?} in:\n{}", outcome.stdout);
    }
    for part in ["0", "1", "100%", "half"] {
        desk.cohaptic(&format!("fit f.csv --hold-out {part}")).assert_refused(2, &["expected a part above 0 and below 1, such as 0.5 or 50%"]);
    }
    desk.write("few.csv", format!("t,delay\n{}", (0..90).map(|i| format!("{i},0.0{}\n", 20 + i % 7)).collect::<String>()));
    desk.cohaptic("fit few.csv --hold-out 50%")
        .assert_refused(2, &["hold-out: a part has 45 packets that arrived: expected at least 50 in each part"]);
}
