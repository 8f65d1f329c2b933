//! `cohaptic link`.

mod spec;
mod words;

use std::io;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant as Clock;

use cohaptic_files::WholeFile;
use cohaptic_measure::achieved::{Accumulator, Achieved};
use cohaptic_measure::comparison::{Comparison, Figure};
use cohaptic_measure::fates::FateWriter;
use cohaptic_measure::pcapng::CaptureWriter;
use cohaptic_measure::steady::SteadyStream;
use cohaptic_wan::{Link, LinkName, PacketInfo, PacketRecord};

use crate::arguments::LinkArguments;
use crate::document_schema::{DocumentSchema, document};
use crate::failure::{Failure, INTERRUPTED};
use crate::file::unwritten;
use crate::progress::Progress;
use crate::{interrupt, output};
use spec::Spec;
pub(crate) use spec::link_and_keys;

/// Without `--packets`.
const PACKETS: u64 = 100_000;

/// The most packets that figures are of. Each takes 127 bytes while figures are worked out: half a gigabyte of these.
pub(crate) const MOST_MEASURED: u64 = 4_000_000;

/// What came of the stream.
struct Measured {
    achieved: Achieved,
    figures: Vec<Figure>,
    sent: u64,
    wanted: u64,
    interrupted: bool,
    packets_per_s: f64,
    files: Vec<String>,
}

/// Drives one link and says what it was asked for and what it achieved.
pub(crate) fn link(arguments: &LinkArguments) -> Result<ExitCode, Failure> {
    let spec = Spec::read(arguments)?;
    let measured = drive(arguments, &spec)?;
    if arguments.json {
        output::json(
            DocumentSchema::LINK,
            &document! {
                asked: document! {
                    spec: spec.said.as_str(),
                    #[serde(flatten)]
                    figures: &spec.asked,
                },
                achieved: &measured.achieved,
                compared: measured.figures.as_slice(),
                measured_packets: measured.sent.min(MOST_MEASURED),
                fates: &measured.achieved.fates,
                packets_per_s: measured.packets_per_s,
                interrupted: measured.interrupted,
                files: measured.files.as_slice(),
            },
        )?;
    } else {
        output::text(&words::describe(&spec, &measured))?;
        output::wrote(&measured.files);
    }
    Ok(if measured.interrupted { ExitCode::from(INTERRUPTED) } else { ExitCode::SUCCESS })
}

fn drive(arguments: &LinkArguments, spec: &Spec) -> Result<Measured, Failure> {
    let wanted = arguments.packets.map(Into::into).or(spec.packets).unwrap_or(PACKETS);
    let info = PacketInfo { size: arguments.size, ecn_capable: arguments.ecn };
    let stream = SteadyStream { packets: wanted, every: arguments.every, info };
    // Half of all time is left for delays.
    if stream.sent(wanted).as_nanos() > u64::MAX / 2 {
        return Err(Failure::Input("the stream lasts longer than 292 years: expected fewer packets, or less time between them".to_owned()));
    }
    let mut link = Link::new(arguments.seed, &LinkName::between("sender", "receiver"), spec.model.clone());
    let mut sinks = Sinks::create(arguments)?;
    let mut accumulator = Accumulator::of_first(MOST_MEASURED);
    let mut beside = Comparison::default();
    let progress = Progress::new(wanted, "{bar:30} {percent:>3} %  {pos}/{len} packets, {eta} left");
    let start = Clock::now();
    let sent = stream.over(
        &mut link,
        |record| {
            // Records come in the order in which things happen.
            let _ = accumulator.record(record);
            if record.sequence < MOST_MEASURED {
                beside.record(record);
            }
            sinks.write(record)
        },
        |sent| {
            progress.reach_number(sent);
            interrupt::has_results();
            !interrupt::requested()
        },
    )?;
    let wall_s = start.elapsed().as_secs_f64();
    progress.clear();
    let files = sinks.finish()?;
    #[expect(clippy::cast_precision_loss, reason = "for people")]
    let packets_per_s = sent as f64 / wall_s;
    let figures = beside.figures(&spec.asked);
    Ok(Measured { achieved: accumulator.finish(), figures, sent, wanted, interrupted: sent < wanted, packets_per_s, files })
}

/// The files that are written.
struct Sinks {
    fates: Option<Sink<FateWriter<WholeFile>>>,
    capture: Option<Sink<CaptureWriter<WholeFile>>>,
}

/// A file that is written, and its name.
type Sink<W> = (PathBuf, W);

impl Sinks {
    fn create(arguments: &LinkArguments) -> Result<Self, Failure> {
        Ok(Self {
            fates: begin(arguments.fates.as_ref(), FateWriter::new)?,
            capture: begin(arguments.pcapng.as_ref(), |to| CaptureWriter::new(to, "link"))?,
        })
    }

    fn write(&mut self, record: &PacketRecord) -> Result<(), Failure> {
        if let Some((path, writer)) = &mut self.fates {
            writer.write(record).map_err(unwritten(path))?;
        }
        if let Some((path, writer)) = &mut self.capture {
            writer.write(record, &[]).map_err(unwritten(path))?;
        }
        Ok(())
    }

    fn finish(self) -> Result<Vec<String>, Failure> {
        let fates = self.fates.map(|(path, writer)| (path, writer.finish()));
        let capture = self.capture.map(|(path, writer)| (path, writer.finish()));
        let mut files = Vec::new();
        for (path, file) in fates.into_iter().chain(capture) {
            file.and_then(WholeFile::finish).map_err(unwritten(&path))?;
            files.push(output::path(&path));
        }
        Ok(files)
    }
}

/// Begins a file, if it is asked for.
fn begin<W>(path: Option<&PathBuf>, writer: impl FnOnce(WholeFile) -> io::Result<W>) -> Result<Option<Sink<W>>, Failure> {
    let begun = path.map(|path| WholeFile::create(path).and_then(writer).map(|writer| (path.clone(), writer)).map_err(unwritten(path)));
    begun.transpose()
}
