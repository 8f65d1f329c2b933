//! SIGINT and SIGTERM while a command computes: it ends within a second, with status 130, a word on standard error, and what was whole by then.
//!
//! The guarantee is one second. On a machine that does other things besides, a second of the clock is less than a second of work, so the tests count the
//! processor time after the signal: at most a second on each core. Without the guarantee each of these commands goes on for minutes.

use std::process::{Child, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::integration::desk::{Desk, Outcome, parse};
use crate::integration::scenes::TWO;

/// After this time a command is held for one that does not end.
const NEVER: Duration = Duration::from_secs(60);
/// The processor time that a command may use after the signal, on each core [1/100 s].
const ONE_SECOND: u64 = 100;

/// Sends a signal to a command once it is at work, and gives what it left when it has ended.
fn stopped(desk: &Desk, line: &str, signal: &str) -> Outcome {
    stopped_after(HALF_A_SECOND, desk, line, signal)
}

/// Far more than reading a scene takes, and than starting up [1/100 s].
const HALF_A_SECOND: u64 = 50;

/// Enough to be past the frame of 400 users, which asks whether to go on [1/100 s].
const TWO_SECONDS: u64 = 200;

/// [`stopped`] after a span of computing [1/100 s].
fn stopped_after(worked: u64, desk: &Desk, line: &str, signal: &str) -> Outcome {
    // Files, for nobody reads a pipe meanwhile.
    let file = |name: &str| Stdio::from(std::fs::File::create(desk.path(name)).unwrap());
    let mut child = desk.command(line).stdout(file("stdout")).stderr(file("stderr")).spawn().unwrap();
    while !has_worked(worked, child.id()) {
        assert_eq!(child.try_wait().unwrap(), None, "it ended by itself: {} {}", desk.read("stdout"), desk.read("stderr"));
        sleep(Duration::from_millis(5));
    }
    let before = computed(child.id()).unwrap();
    assert!(std::process::Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
    let status = end_soon(&mut child, before);
    Outcome { status, stdout: desk.read("stdout"), stderr: desk.read("stderr") }
}

/// Returns whether a process listens to signals, and has computed that long [1/100 s].
pub(crate) fn has_worked(worked: u64, id: u32) -> bool {
    crate::integration::interrupt::listens(id) && computed(id).is_some_and(|computed| computed >= worked)
}

/// The processor time of a process [1/100 s]; `None` if it has ended.
fn computed(id: u32) -> Option<u64> {
    let stat = std::fs::read_to_string(format!("/proc/{id}/stat")).ok()?;
    // The fields behind the name, which is in brackets: the 12th and 13th of them are the time in user mode and in the system [1/100 s].
    let fields: Vec<&str> = stat.rsplit(')').next()?.split_whitespace().collect();
    let ticks = |place: usize| fields.get(place).and_then(|field| field.parse::<u64>().ok());
    Some(ticks(11)? + ticks(12)?)
}

/// Waits for the end of a command that had computed for a time `before` the signal [1/100 s].
fn end_soon(child: &mut Child, before: u64) -> Option<i32> {
    let (asked, mut last) = (Instant::now(), before);
    loop {
        if let Some(status) = child.try_wait().unwrap() {
            let cores = std::thread::available_parallelism().map_or(1, |cores| cores.get() as u64);
            assert!(last - before <= ONE_SECOND * cores, "it computed for {} hundredths of a second after the signal", last - before);
            return status.code();
        }
        last = computed(child.id()).unwrap_or(last);
        if asked.elapsed() > NEVER {
            child.kill().unwrap();
            panic!("it did not end");
        }
        sleep(Duration::from_millis(5));
    }
}

fn assert_interrupted(outcome: &Outcome) {
    assert_eq!(outcome.status, Some(130), "{outcome:?}");
    // A long analysis has said what it costs.
    let mut lines = outcome.stderr.lines().skip_while(|line| line.starts_with("note: "));
    let last = lines.next().is_some_and(|line| line.starts_with("interrupted: "));
    assert!(last && lines.next().is_none(), "{outcome:?}");
}

/// 400 users, no two of them alike: a matrix of 400·(4 + 2·4) rows, whose eigenvalues take minutes and cannot ask.
fn many() -> String {
    let peers: String = (0..400).map(|peer| format!("[[peers]]\nname = \"p{peer}\"\ndevice = {{ mass = 0.1{peer:03}, damping = 5.0 }}\n")).collect();
    let (head, _) = TWO.split_once("[[peers]]").unwrap();
    format!("{head}{peers}[link]\ndelay = \"24ms\"\n")
}

#[test]
#[ignore = ".ci/nightly runs it: it takes long"]
fn an_analysis_ends_while_it_works_out_the_eigenvalues_of_a_large_matrix() {
    let desk = Desk::with("many.toml", &many());
    for signal in ["-INT", "-TERM"] {
        let outcome = stopped_after(TWO_SECONDS, &desk, "stability point many.toml --json", signal);
        assert_interrupted(&outcome);
        // A machine that is slow may still be at the frame, which ends by itself and says so.
        assert!(outcome.stdout.is_empty() || parse(&outcome.stdout)["status"] == 130, "{outcome:?}");
    }
}

#[test]
fn an_analysis_of_the_whole_state_ends() {
    let desk = Desk::with("two.toml", TWO);
    assert_interrupted(&stopped(&desk, "stability point two.toml --method full --set peers=[] --set scene.count=300", "-TERM"));
}

/// Samples that overtake each other on six links, followed by which of them is held.
#[test]
fn a_mean_square_ends() {
    let desk = Desk::with("two.toml", TWO);
    assert_interrupted(&stopped(&desk, "stability point two.toml --set peers=[] --set scene.count=3 --set link.jitter=2ms", "-INT"));
}

/// An ended proof is written as far as it has come, and the page warns that cells are missing.
#[test]
fn the_page_of_a_proof_that_was_ended_says_so() {
    let desk = Desk::with("two.toml", TWO);
    for line in [
        "stability map two.toml --x coordination.stiffness=100..6000 --y coordination.damping=0..50 --prove 14 --out out",
        "stability boundary two.toml --along coordination.stiffness=100..6000 --prove --tolerance 1e-12 --set peers=[] --set scene.count=8 \
         --set link.delay=200ms --out out",
    ] {
        let outcome = stopped_after(20, &desk, line, "-INT");
        assert_eq!(outcome.status, Some(130), "{line}: {outcome:?}");
        assert!(desk.read("out/proof.html").contains("<p class=\"warning\">The proof was stopped; "), "{line}");
    }
}

#[test]
fn a_search_for_the_worst_case_ends() {
    let desk = Desk::with("two.toml", TWO);
    let line = "stability point two.toml --losses-in-a-row 4 --links each --accuracy 1e-9 --products 1000000000";
    assert_interrupted(&stopped(&desk, line, "-TERM"));
}

#[test]
fn the_paper_says_that_it_was_ended() {
    assert_interrupted(&stopped(&Desk::new(), "paper --out out", "-INT"));
}

/// The points that are finished are the first of those that were asked for, in a whole document and a whole table.
#[test]
fn an_admittance_keeps_the_points_that_it_has() {
    let desk = Desk::with("two.toml", TWO);
    // The first points are there after milliseconds; there shall be fewer than a busy machine prints in a second.
    let outcome = stopped_after(20, &desk, "admittance two.toml --peer left --points 1000000 --json --out out", "-INT");
    assert_interrupted(&outcome);
    let document = parse(&outcome.stdout);
    let points = document["points"].as_array().unwrap();
    assert_eq!(desk.files("out"), ["admittance.csv"]);
    assert_eq!(desk.read("out/admittance.csv").lines().count(), 1 + points.len());
    assert!(!points.is_empty() && points.len() < 1_000_000 && document["interrupted"] == true);
    // The first of a million from 0.01 Hz to 100 Hz; each is 10^(4/999999) times the one before.
    let hz = |place: usize| points[place]["hz"].as_f64().unwrap();
    assert!((hz(0) - 0.01).abs() < 1e-15 && (hz(points.len() - 1) / hz(points.len() - 2) / 10_f64.powf(4.0 / 999_999.0) - 1.0).abs() < 1e-9);
}

/// Of two scenes the first is told, whatever becomes of the second.
#[test]
fn a_check_keeps_the_scenes_that_were_checked() {
    let desk = Desk::with("scenes/b.toml", &format!("{}\n[expect]\nstable = true\n", many().replace("200ms", "10ms")));
    desk.write("scenes/a.toml", format!("{TWO}\n[expect]\nstable = true\n"));
    let outcome = stopped(&desk, "check scenes --json", "-TERM");
    assert_interrupted(&outcome);
    let scenes = parse(&outcome.stdout)["scenes"].clone();
    assert_eq!((&scenes[0]["file"], &scenes[0]["passed"]), (&"scenes/a.toml".into(), &true.into()));
    assert_eq!((&scenes[1]["file"], &scenes[1]["passed"]), (&"scenes/b.toml".into(), &false.into()));
    assert!(scenes[1]["failures"][0].as_str().unwrap().starts_with("interrupted"), "{scenes:#}");
    assert!(outcome.stderr.contains("1 of 2 scenes"), "{}", outcome.stderr);
}
