//! `cohaptic link`: drives a link with a steady stream of packets and measures the link.

mod library;
mod spec;

use std::io::{self, Write as _};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant as Clock;

use cohaptic_answers::link::{CrossSamples, LinkPicture, Measured, Meter, Written, too_long};
use cohaptic_files::WholeFile;
use cohaptic_measure::fates::FateWriter;
use cohaptic_measure::pcapng::CaptureWriter;
use cohaptic_measure::steady::SteadyStream;
use cohaptic_units::Ecn;
use cohaptic_wan::{Link, LinkName, PacketInfo, PacketRecord};

use crate::arguments::{EcnKind, LinkArguments};
use crate::document_schema::DocumentSchema;
use crate::failure::{Failure, INTERRUPTED};
use crate::file::unwritten;
use crate::progress::Progress;
use crate::{interrupt, output};
use spec::Spec;
pub(crate) use spec::link_and_keys;

/// Number of packets without `--packets`, for links other than a replay.
const PACKETS: u64 = 100_000;

/// Drives a link, and prints the configured figures beside the measured figures.
pub(crate) fn link(arguments: &LinkArguments) -> Result<ExitCode, Failure> {
    if arguments.list || arguments.show {
        return library::answer(arguments).map(|()| ExitCode::SUCCESS);
    }
    let (measured, written) = drive(arguments, Spec::read(arguments)?)?;
    let document = cohaptic_answers::link::document(&measured, Some(&written));
    let words = || cohaptic_answers::link::words(&measured);
    output::answer(arguments.json, DocumentSchema::LINK, &document, words, &written.files)?;
    if let Some(note) = spec::note(&arguments.spec).filter(|_| !output::is_quiet()) {
        let _ = writeln!(io::stderr(), "note: {note}");
    }
    Ok(if measured.is_interrupted() { ExitCode::from(INTERRUPTED) } else { ExitCode::SUCCESS })
}

fn drive(arguments: &LinkArguments, spec: Spec) -> Result<(Measured, Written), Failure> {
    // A replay without `--packets` offers as many packets as the log has.
    let wanted = arguments.packets.map(Into::into).or(spec.packets).unwrap_or(PACKETS);
    let info = PacketInfo { size: arguments.size, ecn: arguments.ecn.map_or(Ecn::NotCapable, EcnKind::codepoint) };
    let stream = SteadyStream { packets: wanted, every: arguments.every, info };
    if let Some(why) = too_long(&stream) {
        return Err(Failure::Input(why.to_owned()));
    }
    let mut link = Link::new(arguments.seed, &LinkName::between("sender", "receiver"), spec.model);
    // The files are created before the stream begins, so that a path that cannot be written is refused before a long run.
    let mut sinks = Sinks::create(arguments)?;
    let mut meter = Meter::default();
    let progress = Progress::new(wanted, "{bar:30} {percent:>3} %  {pos}/{len} packets, {eta} left");
    let start = Clock::now();
    let mut crossed = CrossSamples::default();
    let sent = stream.over(
        &mut link,
        |record| {
            meter.record(record);
            sinks.write(record)
        },
        |sent, link| {
            if arguments.picture.is_some() {
                crossed.record(stream.sent(sent), link.stats().cross_traffic());
            }
            // The packets sent so far are a result, so a signal ends the stream and the report covers these packets.
            progress.reach_number(sent);
            interrupt::has_results();
            !interrupt::requested()
        },
    )?;
    let wall_s = start.elapsed().as_secs_f64();
    progress.clear();
    let cross_traffic = link.stats().cross_traffic();
    crossed.record(stream.sent(sent), cross_traffic);
    let files = sinks.finish(&spec.said, &crossed)?;
    #[expect(clippy::cast_precision_loss, reason = "for people")]
    let packets_per_s = sent as f64 / wall_s;
    Ok((meter.finish(spec.said, spec.asked, [sent, wanted], cross_traffic), Written { packets_per_s, files }))
}

/// Files for the packets of a link.
struct Sinks {
    fates: Option<Sink<FateWriter<WholeFile>>>,
    capture: Option<Sink<CaptureWriter<WholeFile>>>,
    picture: Option<(WholeFile, PathBuf, LinkPicture)>,
}

/// Path of a file, and the writer of the file.
type Sink<W> = (PathBuf, W);

impl Sinks {
    fn create(arguments: &LinkArguments) -> Result<Self, Failure> {
        Ok(Self {
            fates: begin(arguments.fates.as_ref(), FateWriter::new)?,
            capture: begin(arguments.pcapng.as_ref(), |to| CaptureWriter::new(to, "link"))?,
            picture: begin(arguments.picture.as_ref(), Ok)?.map(|(path, file)| (file, path, LinkPicture::default())),
        })
    }

    fn write(&mut self, record: &PacketRecord) -> Result<(), Failure> {
        if let Some((path, writer)) = &mut self.fates {
            writer.write(record).map_err(unwritten(path))?;
        }
        if let Some((path, writer)) = &mut self.capture {
            // A link knows sizes and no content, so that the capture has frames without payload.
            writer.write(record, &[]).map_err(unwritten(path))?;
        }
        if let Some((.., picture)) = &mut self.picture {
            picture.record(record);
        }
        Ok(())
    }

    /// Completes the files, and returns their names. `said` is the link in words.
    fn finish(self, said: &str, crossed: &CrossSamples) -> Result<Vec<String>, Failure> {
        let fates = self.fates.map(|(path, writer)| (path, writer.finish()));
        let capture = self.capture.map(|(path, writer)| (path, writer.finish()));
        let picture = self.picture.map(|(mut file, path, picture)| (path, file.write_all(picture.svg(said, crossed).as_bytes()).map(|()| file)));
        let mut files = Vec::new();
        for (path, file) in fates.into_iter().chain(capture).chain(picture) {
            file.and_then(WholeFile::finish).map_err(unwritten(&path))?;
            files.push(output::path(&path));
        }
        Ok(files)
    }
}

/// Creates a file and its writer, or returns `None` if the user gave no path.
fn begin<W>(path: Option<&PathBuf>, writer: impl FnOnce(WholeFile) -> io::Result<W>) -> Result<Option<Sink<W>>, Failure> {
    let begun = path.map(|path| WholeFile::create(path).and_then(writer).map(|writer| (path.clone(), writer)).map_err(unwritten(path)));
    begun.transpose()
}
