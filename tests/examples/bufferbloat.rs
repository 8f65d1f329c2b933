//! Round trips of a ping during a download, at a home with a measured DSL line and with four disciplines of the queue before the line.
//!
//! A download fills the queue of a slow line, and all other packets wait behind the download. This is bufferbloat. The discipline of the queue is one word
//! of the test, so that a program can be tested with and without bufferbloat.
//!
//! ```text
//! cargo run -p cohaptic-tests --example bufferbloat
//! ```
//!
//! With the name of a file, the example also draws the round trips over time into this file.
#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "an example prints, and its sockets are there")]

use std::cell::{Cell, RefCell};
use std::fmt::{self, Write as _};
use std::rc::Rc;
use std::time::Duration;

use cohaptic_picture::{Axis, Line, Look, Panel, Picture};
use cohaptic_testkit::{Bed, Testbed, time};
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};

/// Number of pings, one every 50 ms: 30 s.
const PINGS: u16 = 600;
/// Number of the first ping that the table counts. In the 10 s before, the download fills the queue.
const FIRST: usize = 200;

/// A home behind the line. The queue before the line has room for 250 packets.
fn home(discipline: &str) -> Testbed {
    let line = format!("dsl queue={{ limit = '250 packets', discipline = '{discipline}' }}");
    Testbed::new(["server", "home"]).access("home", line).seed(1)
}

/// Downloads from the server for as long as the test runs. Returns the number of bytes that have arrived so far.
async fn download(bed: &Bed) -> Rc<Cell<usize>> {
    let listener = bed.host("server").listen("0.0.0.0:80").unwrap();
    bed.host("server").spawn(async move {
        let (mut stream, _) = listener.accept().await.unwrap();
        while stream.write_all(&[0; 16_384]).await.is_ok() {}
    });
    let mut stream = bed.host("home").connect("server:80").await.unwrap();
    let arrived = Rc::new(Cell::new(0));
    let count = Rc::clone(&arrived);
    bed.host("home").spawn(async move {
        let mut buffer = [0; 16_384];
        while let Ok(bytes @ 1..) = stream.read(&mut buffer).await {
            count.set(count.get() + bytes);
        }
    });
    arrived
}

/// Sends pings from the home to the server. Returns instant \[s\] and round trip \[ms\] of each ping; the round trip of a lost ping is NaN.
async fn ping(bed: &Bed) -> Vec<(f64, f64)> {
    let echo = bed.host("server").bind("0.0.0.0:7").unwrap();
    bed.host("server").spawn(async move {
        let mut ping = [0; 56];
        while let Ok((_, from)) = echo.recv_from(&mut ping).await {
            echo.send_to(&ping, from).await.unwrap();
        }
    });
    let socket = Rc::new(bed.host("home").bind("0.0.0.0:0").unwrap());
    let pings = Rc::new(RefCell::new(Vec::new()));
    let (answered, waiting) = (Rc::clone(&socket), Rc::clone(&pings));
    bed.host("home").spawn(async move {
        let mut answer = [0; 56];
        while answered.recv(&mut answer).await.is_ok() {
            let number = usize::from(u16::from_le_bytes([answer[0], answer[1]]));
            let (sent, round_trip): &mut (f64, f64) = &mut waiting.borrow_mut()[number];
            *round_trip = (time::now().as_secs_f64() - *sent) * 1e3;
        }
    });
    for number in 0..PINGS {
        pings.borrow_mut().push((time::now().as_secs_f64(), f64::NAN));
        // A ping carries its number, because the answer of an earlier one may be lost.
        let mut ping = [0; 56];
        ping[..2].copy_from_slice(&number.to_le_bytes());
        socket.send_to(&ping, "server:7").await.unwrap();
        time::sleep(Duration::from_millis(50)).await;
    }
    // Two seconds for the answers of the latest pings.
    time::sleep(Duration::from_secs(2)).await;
    pings.take()
}

/// Pings of a run, and the rate of the download \[Mbit/s\].
struct Measured {
    pings: Vec<(f64, f64)>,
    rate: f64,
}

impl Measured {
    /// Measures a home that downloads nothing.
    fn idle() -> Self {
        Self { pings: home("tail-drop").run(|bed| async move { ping(&bed).await }), rate: 0.0 }
    }

    /// Measures a home that downloads.
    fn busy(discipline: &str) -> Self {
        home(discipline).run(|bed| async move {
            let arrived = download(&bed).await;
            let pings = ping(&bed).await;
            #[expect(clippy::cast_precision_loss, reason = "some megabytes")]
            let rate = arrived.get() as f64 * 8e-6 / bed.now().as_secs_f64();
            Self { pings, rate }
        })
    }

    /// Returns the round trips of the answered pings \[ms\], in ascending order.
    fn round_trips(&self) -> Vec<f64> {
        let mut answered: Vec<f64> =
            self.pings[FIRST..].iter().map(|(_, round_trip)| *round_trip).filter(|round_trip| !round_trip.is_nan()).collect();
        answered.sort_by(f64::total_cmp);
        answered
    }

    /// Returns the round trip \[ms\] within which a share of the answered pings come back.
    fn within(&self, share: f64) -> f64 {
        let answered = self.round_trips();
        #[expect(clippy::cast_precision_loss, clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some hundred pings")]
        let place = (share * (answered.len() - 1) as f64).round() as usize;
        answered[place]
    }

    /// Returns the number of lost pings.
    fn lost(&self) -> usize {
        usize::from(PINGS) - FIRST - self.round_trips().len()
    }
}

/// Returns the runs with their names.
fn all() -> Vec<(&'static str, Measured)> {
    let busy = [("tail drop", "tail-drop"), ("CoDel", "codel"), ("PIE", "pie"), ("FQ-CoDel", "fq-codel")];
    let busy = busy.map(|(name, word)| (name, Measured::busy(word)));
    [("no download", Measured::idle())].into_iter().chain(busy).collect()
}

/// Returns the table of the book.
fn table(all: &[(&str, Measured)]) -> Result<String, fmt::Error> {
    let mut text = String::from("queue         ping: 50 % within   99 % within   lost        download\n");
    for (name, measured) in all {
        let [half, most] = [0.5, 0.99].map(|share| measured.within(share));
        writeln!(text, "{name:<13} {half:>14.1} ms {most:>10.1} ms {:>6} {:>8.2} Mbit/s", measured.lost(), measured.rate)?;
    }
    Ok(text)
}

/// Returns the picture of the gallery: the runs with a download.
fn picture(all: &[(&str, Measured)]) -> String {
    let panels = all.iter().skip(1).map(|(name, measured)| {
        let round_trip = Axis::new("Round trip of a ping").unit("ms").logarithmic();
        Panel::new(Axis::new("Sent").unit("s"), round_trip).titled(*name).with(Line::new(measured.pings.iter().copied(), Look::of(0).thin()))
    });
    let picture = Picture::new("Pings beside a download over a DSL line, by the discipline of its queue").columns(2).shared_x().shared_y();
    picture.panels(panels).svg()
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let all = all();
    print!("{}", table(&all)?);
    if let Some(file) = std::env::args().nth(1) {
        std::fs::write(file, picture(&all))?;
    }
    Ok(())
}

/// The line has 5 Mbit/s down and 1.4 Mbit/s up, and the least round trip is 19.9 ms.
#[test]
fn a_ping_waits_behind_a_download_unless_flows_have_queues_of_their_own() {
    // 250 packets of 1500 bytes take 600 ms. A packet is lost when the queue is full. CUBIC then keeps 0.7 of what is under way: of the queue and of what
    // travels beside the queue, for at most 33 ms in the mean (round trip and jitter). Even after two losses, 0.49 · 633 − 33 = 277 ms of the queue
    // remain.
    let tail_drop = Measured::busy("tail-drop");
    assert!(tail_drop.within(0.5) > 277.0 + 19.9 && tail_drop.within(0.99) > 600.0);
    // FQ-CoDel sends a ping after the packet on the line, which takes 2.4 ms. The ping takes 0.09 ms down and 0.32 ms up, and waits on its way up for at
    // most one acknowledgement of 64 bytes, 0.37 ms. Jitter of the ping and of the packets before it, one every 2.4 ms, holds the ping back for at most 2
    // ms with the probability F(2 ms)·F(4.4 ms)·F(6.8 ms)·… = 0.587, F the gamma law of the profile.
    let fq_codel = Measured::busy("fq-codel");
    assert!(fq_codel.within(0.5) < 19.9 + 2.4 + 0.09 + 0.32 + 0.37 + 2.0);
}

#[test]
fn the_book_shows_the_table_and_the_gallery_the_picture() {
    let all = all();
    let docs = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs");
    let (page, table) = (std::fs::read_to_string(docs.join("testing.md")).unwrap(), table(&all).unwrap());
    assert!(page.contains(&table), "docs/testing.md does not show\n{table}");
    let drawn = std::fs::read_to_string(docs.join("images/gallery/bufferbloat.svg")).unwrap();
    assert!(drawn == picture(&all), "cargo run -p cohaptic-tests --example bufferbloat docs/images/gallery/bufferbloat.svg draws it anew");
}
