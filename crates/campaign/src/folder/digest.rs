//! The digest of a part: a small file beside the part, with the identity of the part and the hash of its bytes.
//!
//! ```text
//! # part 0 of campaign 6f0c…: 16384 runs, 5242880 bytes
//! 9b74…  part-00000.parquet
//! ```
//!
//! `sha256sum --check part-*.sha256` does the same check. The digest gets its name before its part. A part without a digest, as written by early versions of
//! the program, is computed again.

use std::fs::File;
use std::io::{self, Read as _, Seek as _, Write};
use std::path::{Path, PathBuf};

use sha2::{Digest as _, Sha256};

/// End of the name of a digest, after the name of its part.
pub(crate) const DIGEST: &str = ".sha256";

/// Greatest number of bytes read from a digest, several times the length of a digest \[bytes\].
const MOST: u64 = 4096;

/// Returns the SHA-256 of some bytes, in 64 hexadecimal digits.
pub(crate) fn hash(bytes: &[u8]) -> String {
    hexadecimal(&Sha256::digest(bytes))
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Identity of a part, as its digest must state it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Label<'a> {
    pub(crate) part: u64,
    /// Number of runs of the part.
    pub(crate) runs: u64,
    /// Hash of the campaign's manifest.
    pub(crate) campaign: &'a str,
}

/// Difference between a part and its digest, in words.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Fault(pub(crate) String);

impl Label<'_> {
    /// Returns the first line of the digest: the identity and the length \[bytes\] of the part.
    fn head(self, bytes: u64) -> String {
        let Self { part, runs, campaign } = self;
        format!("# part {part} of campaign {campaign}: {runs} runs, {bytes} bytes\n")
    }

    /// Returns the whole text of the digest of the part at `path`.
    fn text(self, path: &Path, bytes: u64, hash: &str) -> String {
        let name = path.file_name().map(|name| name.to_string_lossy()).unwrap_or_default();
        format!("{}{hash}  {name}\n", self.head(bytes))
    }

    /// Opens a part after a check of its bytes, positioned at the beginning. `Ok(Err)`: the file is not the part.
    ///
    /// The bytes are checked through the returned handle, so nobody can replace the file between the check and the use.
    pub(crate) fn open(self, path: &Path) -> io::Result<Result<File, Fault>> {
        // The digest is read first: without a digest, nothing else about the file matters.
        let digest = match read_digest(&name_of(path)) {
            Ok(digest) => digest,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Err(Fault("it has no digest".to_owned()))),
            Err(error) => return Err(error),
        };
        let mut file = cohaptic_files::open(path, cohaptic_files::MOST_CAPTURE_BYTES)?;
        // A wrong length or a wrong part is found without reading the part.
        let head = self.head(file.metadata()?.len());
        let Some(rest) = digest.strip_prefix(head.as_bytes()) else {
            // The digest may hold arbitrary bytes, so they are escaped before they go into a message.
            let found = digest.split(|byte| *byte == b'\n').next().unwrap_or_default();
            let found = String::from_utf8_lossy(found).escape_debug().to_string();
            return Ok(Err(Fault(format!("its digest says \"{found}\": expected \"{}\"", head.trim_end()))));
        };
        let mut hashing = HashingWriter::new(io::sink());
        io::copy(&mut file, &mut hashing)?;
        let (bytes, hash) = hashing.finish();
        // The digest also contains the name of the part, so a renamed part with its old digest is refused.
        let expected = self.text(path, bytes, &hash);
        if digest != expected.as_bytes() {
            let said = String::from_utf8_lossy(rest.split(|byte| *byte == b' ').next().unwrap_or_default()).escape_debug().to_string();
            return Ok(Err(Fault(format!("its bytes hash to {hash}, and its digest says {said}"))));
        }
        file.rewind()?;
        Ok(Ok(file))
    }
}

/// Returns the path of the digest of the part at `path`.
pub(crate) fn name_of(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(DIGEST);
    name.into()
}

fn read_digest(path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    // A longer file is no digest, whatever its content.
    File::open(path)?.take(MOST).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// A writer which hashes all bytes on their way to another writer.
pub(crate) struct HashingWriter<W> {
    to: W,
    state: Sha256,
    bytes: u64,
}

impl<W: Write> HashingWriter<W> {
    pub(crate) fn new(to: W) -> Self {
        Self { to, state: Sha256::new(), bytes: 0 }
    }

    /// Returns the number of written bytes and their hash.
    pub(crate) fn finish(self) -> (u64, String) {
        (self.bytes, hexadecimal(&self.state.finalize()))
    }
}

impl<W: Write> Write for HashingWriter<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.to.write(bytes)?;
        // A writer may accept fewer bytes than offered. The caller offers the rest again.
        self.state.update(&bytes[..written]);
        self.bytes += written as u64;
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.to.flush()
    }
}

/// Writes the digest of the part at `path`, with this number of bytes and this hash. `write_whole` writes the file.
pub(crate) fn write<E>(
    label: Label<'_>,
    path: &Path,
    (bytes, hash): (u64, String),
    write_whole: impl FnOnce(&Path, &[u8]) -> Result<(), E>,
) -> Result<(), E> {
    write_whole(&name_of(path), label.text(path, bytes, &hash).as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    const LABEL: Label<'static> = Label { part: 3, runs: 2, campaign: "c0ffee" };

    /// Writes a part with this content, and its digest.
    fn written(path: &Path, content: &[u8]) {
        std::fs::write(path, content).unwrap();
        let mut hashing = HashingWriter::new(io::sink());
        hashing.write_all(content).unwrap();
        write(LABEL, path, hashing.finish(), |path, bytes| std::fs::write(path, bytes)).unwrap();
    }

    fn fault(label: Label<'_>, path: &Path) -> Option<String> {
        label.open(path).unwrap().err().map(|Fault(words)| words)
    }

    /// Source: FIPS 180-4, example "abc".
    #[test]
    fn the_hash_is_that_of_the_standard() {
        assert_eq!(hash(b"abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    }

    #[test]
    fn every_flipped_bit_of_a_part_and_of_its_digest_is_found() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("part-00003.csv");
        written(&path, b"run,seed\n6,7\n7,8\n");
        assert_eq!(fault(LABEL, &path), None);
        for file in [path.clone(), name_of(&path)] {
            let whole = std::fs::read(&file).unwrap();
            for bit in 0..8 * whole.len() {
                let mut flipped = whole.clone();
                flipped[bit / 8] ^= 1 << (bit % 8);
                std::fs::write(&file, flipped).unwrap();
                assert!(fault(LABEL, &path).is_some(), "bit {bit} of {}", file.display());
            }
            for length in 0..whole.len() {
                std::fs::write(&file, &whole[..length]).unwrap();
                assert!(fault(LABEL, &path).is_some(), "{length} bytes of {}", file.display());
            }
            std::fs::write(&file, [whole.as_slice(), b"\n"].concat()).unwrap();
            assert!(fault(LABEL, &path).is_some(), "a byte behind {}", file.display());
            std::fs::write(&file, whole).unwrap();
        }
        assert_eq!(fault(LABEL, &path), None);
    }

    #[test]
    fn a_part_of_another_number_campaign_or_length_is_told() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("part-00003.csv");
        written(&path, b"run\n6\n7\n");
        for (label, words) in [
            (Label { part: 4, ..LABEL }, "expected \"# part 4 of campaign c0ffee: 2 runs, 8 bytes\""),
            (Label { campaign: "decaf", ..LABEL }, "its digest says \"# part 3 of campaign c0ffee: 2 runs, 8 bytes\""),
            (Label { runs: 3, ..LABEL }, "3 runs"),
        ] {
            let fault = fault(label, &path).unwrap();
            assert!(fault.contains(words), "{fault}");
        }
        // The part under the name of another part: first without a digest, then with the digest of its old name.
        let other = folder.path().join("part-00004.csv");
        std::fs::copy(&path, &other).unwrap();
        assert_eq!(fault(LABEL, &other).unwrap(), "it has no digest");
        std::fs::copy(name_of(&path), name_of(&other)).unwrap();
        assert!(fault(LABEL, &other).is_some());
    }
}
