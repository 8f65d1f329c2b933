//! Divides proofs among shards: each proof is a number of blocks, and the decided pieces of all blocks are kept as rows in a shared folder.

use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use cohaptic_campaign::Shard;
use cohaptic_files::OwnFolder;
use cohaptic_proofs::{Guarantee, KnownPieces, ProofError, SharedProof};
use cohaptic_stability::{Family, Watch};

use super::guarantee::PieceWatch;
use super::rows_file::{Kept, Row, RowsFile};
use crate::failure::Failure;
use crate::shard::{Done, Names, Piece, Sharing, Worker, all_done, logs_in, owner};
use crate::{interrupt, output};

pub(super) const NAMES: Names = Names { piece: "block", unit: "range" };

/// Header line with the meaning of the rows.
pub(super) const ROW: &str = "each row: the number of the proof, from and to of each key, and 0 if it is stable, 1 unstable, 2 undecided";

/// Removes the files of rows of a finished proof and the workers' logs.
pub(super) fn remove(folder: &Path, name: &'static str) -> Result<(), Failure> {
    let kept = Kept { folder, name, header: &[] };
    let remove = |path: PathBuf| match std::fs::remove_file(&path) {
        Err(error) if error.kind() != ErrorKind::NotFound => Err(Failure::File { verb: "remove", path, error }),
        Ok(()) | Err(_) => Ok(()),
    };
    kept.read()?.1.into_iter().chain(logs_in(folder)).try_for_each(remove)
}

/// The proofs of a command, one per family. All proofs have the same ranges of keys, and so the same blocks.
#[derive(Clone, Copy)]
pub(super) struct Proofs<'a> {
    pub(super) families: &'a [Family],
    pub(super) shared: &'a SharedProof,
    pub(super) kept: Kept<'a>,
    /// Number of threads; 0 for one thread per core.
    pub(super) threads: usize,
}

/// The known pieces of a proof, and the file for newly decided pieces.
pub(super) struct Pieces<'a> {
    /// Index of the proof, which is also the number of its rows.
    number: usize,
    /// Verdict of each known piece, by the bits of the piece's ranges.
    known: BTreeMap<Vec<u64>, Guarantee>,
    /// File of rows, with the first failure to write; `None` if found pieces are not kept.
    file: Option<&'a Mutex<(RowsFile, Option<Failure>)>>,
}

/// Verdicts in the order of their numbers 0, 1, 2 in rows.
const WORDS: [Guarantee; 3] = [Guarantee::Stable, Guarantee::Unstable, Guarantee::Undecided];

/// Returns the bits of all ends of the ranges. Bits are compared, because a piece is known only if its ends are exactly the same.
fn bits(ranges: &[[f64; 2]]) -> Vec<u64> {
    ranges.iter().flatten().map(|value| value.to_bits()).collect()
}

impl<'a> Pieces<'a> {
    /// Selects the pieces of proof `number` among the rows of all proofs. Rows of another form are skipped, and their pieces are proven again.
    pub(super) fn of(number: usize, rows: &[Row], file: Option<&'a Mutex<(RowsFile, Option<Failure>)>>) -> Self {
        let piece = |(_, values): &Row| {
            let (place, values) = values.split_last()?;
            let guarantee = WORDS.into_iter().zip([0.0, 1.0, 2.0]).find(|(_, number): &(_, f64)| number.to_bits() == place.to_bits())?.0;
            Some((values.iter().map(|value| value.to_bits()).collect(), guarantee))
        };
        Self { number, known: rows.iter().filter(|(of, _)| *of == number).filter_map(piece).collect(), file }
    }
}

impl KnownPieces for Pieces<'_> {
    fn known(&self, ranges: &[[f64; 2]]) -> Option<Guarantee> {
        self.known.get(&bits(ranges)).copied()
    }

    fn found(&self, ranges: &[[f64; 2]], guarantee: Guarantee) {
        let Some(file) = self.file else { return };
        let place = WORDS.into_iter().zip([0.0, 1.0, 2.0]).find(|(word, _)| *word == guarantee).map(|(_, place)| place);
        let values: Vec<f64> = ranges.iter().flatten().copied().chain(place).collect();
        let (file, broken) = &mut *file.lock().unwrap_or_else(PoisonError::into_inner);
        if let Err(failure) = file.add(self.number, &values) {
            // A proof cannot return the failure from here: the watcher stops the proof, and the shard returns the failure afterwards.
            broken.get_or_insert(failure);
        }
    }
}

impl Proofs<'_> {
    /// Returns every block of every proof with whether the block is done, in the order of the proofs.
    pub(super) fn pieces(self) -> Result<Vec<Piece>, Failure> {
        let (rows, _) = self.kept.read()?;
        let of = |number| {
            let known = Pieces::of(number, &rows, None);
            (0..self.shared.blocks()).map(move |block| Piece { units: 1, is_done: self.shared.is_known(block, &known) })
        };
        Ok((0..self.families.len()).flat_map(of).collect())
    }

    /// Takes the folder, and returns the folder's ownership with the rows from which the proofs continue. A merge fails unless every block is done.
    pub(super) fn rows(self, sharing: Sharing<'_>) -> Result<(Option<OwnFolder>, Vec<Row>), Failure> {
        if let Sharing::Merge(folder) = sharing {
            all_done(folder, NAMES, &self.pieces()?)?;
        }
        let own = sharing.own_folder()?;
        Ok((own, self.kept.read()?.0))
    }

    /// Proves the blocks of a shard. `failed` converts the error of the proof with the given index.
    pub(super) fn shard(self, shard: Shard, failed: impl Fn(usize, ProofError) -> Failure) -> Result<Done, Failure> {
        let folder = self.kept.folder;
        // A folder with rows of another computation is refused before the shard writes anything.
        self.kept.read()?;
        std::fs::create_dir_all(folder).map_err(|error| Failure::File { verb: "create", path: folder.to_path_buf(), error })?;
        let owner = owner();
        let worker = Worker::begin(folder, shard, &owner)?;
        let done = self.blocks_of_shard(shard, &owner.name(), &worker, &failed);
        let done = done.map(|[pieces, computed]| Done {
            shard,
            folder: output::path(folder),
            names: NAMES,
            pieces,
            units: pieces,
            computed,
            wall_s: worker.wall_s(),
        });
        worker.end(done, |failure| failure)
    }

    /// Proves the blocks of a shard that are not known yet. Returns the number of blocks of the shard, and the number of blocks proven now.
    fn blocks_of_shard(self, shard: Shard, name: &str, worker: &Worker, failed: &dyn Fn(usize, ProofError) -> Failure) -> Result<[u64; 2], Failure> {
        let (file, rows) = self.kept.open(Some(name))?;
        let file = Mutex::new((file, None));
        let is_broken = || file.lock().unwrap_or_else(PoisonError::into_inner).1.is_some();
        let (mut mine, mut computed) = (0, 0);
        for (number, family) in self.families.iter().enumerate() {
            let pieces = Pieces::of(number, &rows, Some(&file));
            // Shards count blocks through all proofs: the blocks of this proof begin at `first`.
            let first = number as u64 * self.shared.blocks();
            let blocks: Vec<u64> = (0..self.shared.blocks()).filter(|block| shard.has(first + block)).collect();
            mine += blocks.len() as u64;
            let wanted: Vec<u64> = blocks.into_iter().filter(|block| !self.shared.is_known(*block, &pieces)).collect();
            let done = Mutex::new(0);
            let keep = |block: u64| {
                worker.kept(first + block, 1);
                *done.lock().unwrap_or_else(PoisonError::into_inner) += 1;
            };
            let watch = ShardWatch { shown: PieceWatch::new(), worker, is_broken: &is_broken };
            let looked = on_threads(self.threads, || self.shared.look_at(family, &wanted, &pieces, keep, &watch));
            // The bar is cleared before a failure is printed.
            drop(watch);
            looked.map_err(|error| failed(number, error))?;
            let done = done.into_inner().unwrap_or_else(PoisonError::into_inner);
            computed += done;
            // Fewer blocks than wanted mean that the watcher has stopped the proof. The watcher would stop the next proof as well.
            if is_broken() || done < wanted.len() as u64 {
                break;
            }
        }
        if let Some(failure) = file.into_inner().unwrap_or_else(PoisonError::into_inner).1 {
            return Err(failure);
        }
        if interrupt::requested() || !worker.goes_on() {
            let kept = format!("what was looked at is kept in {}", output::path(self.kept.folder));
            return Err(Failure::Interrupted(format!("shard {shard}: {kept}; repeat the command to go on from there")));
        }
        Ok([mine, computed])
    }
}

/// Watcher of a shard's proof: shows progress, and stops the proof if the worker must end or the file of rows cannot be written.
struct ShardWatch<'a> {
    shown: PieceWatch,
    worker: &'a Worker,
    is_broken: &'a (dyn Fn() -> bool + Sync),
}

impl Watch for ShardWatch<'_> {
    fn expects(&self, operations: f64) {
        self.shown.expects(operations);
    }

    fn done(&self, operations: f64) {
        self.shown.done(operations);
    }

    fn stops(&self) -> bool {
        !self.worker.goes_on() || (self.is_broken)()
    }
}

/// Runs `work` on a pool of `threads` threads; 0 for one thread per core.
pub(super) fn on_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    match rayon::ThreadPoolBuilder::new().num_threads(threads).build() {
        Ok(pool) => pool.install(work),
        // If the pool cannot be made, the work runs on the global pool, with the same result.
        Err(_) => work(),
    }
}
