//! Shards of proofs: the blocks of each proof, and their pieces as rows in a folder.

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

/// What the header of its file says of rows.
pub(super) const ROW: &str = "each row: the number of the proof, from and to of each key, and 0 if it is stable, 1 unstable, 2 undecided";

/// Removes the rows of a proof that is written, and the logs of workers.
pub(super) fn remove(folder: &Path, name: &'static str) -> Result<(), Failure> {
    let kept = Kept { folder, name, header: &[] };
    let remove = |path: PathBuf| match std::fs::remove_file(&path) {
        Err(error) if error.kind() != ErrorKind::NotFound => Err(Failure::File { verb: "remove", path, error }),
        Ok(()) | Err(_) => Ok(()),
    };
    kept.read()?.1.into_iter().chain(logs_in(folder)).try_for_each(remove)
}

/// The proofs of a command, which share the ranges of their keys.
#[derive(Clone, Copy)]
pub(super) struct Proofs<'a> {
    pub(super) families: &'a [Family],
    pub(super) shared: &'a SharedProof,
    pub(super) kept: Kept<'a>,
    pub(super) threads: usize,
}

/// The pieces of one proof that are known, and where those go that are found.
pub(super) struct Pieces<'a> {
    /// Which of the proofs it is.
    number: usize,
    known: BTreeMap<Vec<u64>, Guarantee>,
    file: Option<&'a Mutex<(RowsFile, Option<Failure>)>>,
}

const WORDS: [Guarantee; 3] = [Guarantee::Stable, Guarantee::Unstable, Guarantee::Undecided];

fn bits(ranges: &[[f64; 2]]) -> Vec<u64> {
    ranges.iter().flatten().map(|value| value.to_bits()).collect()
}

impl<'a> Pieces<'a> {
    /// Those of a proof among all rows.
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
            broken.get_or_insert(failure);
        }
    }
}

impl Proofs<'_> {
    /// Whether each block is done.
    pub(super) fn pieces(self) -> Result<Vec<Piece>, Failure> {
        let (rows, _) = self.kept.read()?;
        let of = |number| {
            let known = Pieces::of(number, &rows, None);
            (0..self.shared.blocks()).map(move |block| Piece { units: 1, is_done: self.shared.is_known(block, &known) })
        };
        Ok((0..self.families.len()).flat_map(of).collect())
    }

    /// The folder, and its rows from which a proof goes on: of a merge all that it needs.
    pub(super) fn rows(self, sharing: Sharing<'_>) -> Result<(Option<OwnFolder>, Vec<Row>), Failure> {
        if let Sharing::Merge(folder) = sharing {
            all_done(folder, NAMES, &self.pieces()?)?;
        }
        let own = sharing.own_folder()?;
        Ok((own, self.kept.read()?.0))
    }

    /// Looks at the blocks of a shard.
    pub(super) fn shard(self, shard: Shard, failed: impl Fn(usize, ProofError) -> Failure) -> Result<Done, Failure> {
        let folder = self.kept.folder;
        // Rows of other work are refused before anything is written.
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

    /// How many blocks the shard has, and how many of them were not known.
    fn blocks_of_shard(self, shard: Shard, name: &str, worker: &Worker, failed: &dyn Fn(usize, ProofError) -> Failure) -> Result<[u64; 2], Failure> {
        let (file, rows) = self.kept.open(Some(name))?;
        let file = Mutex::new((file, None));
        let is_broken = || file.lock().unwrap_or_else(PoisonError::into_inner).1.is_some();
        let (mut mine, mut computed) = (0, 0);
        for (number, family) in self.families.iter().enumerate() {
            let pieces = Pieces::of(number, &rows, Some(&file));
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
            drop(watch);
            looked.map_err(|error| failed(number, error))?;
            let done = done.into_inner().unwrap_or_else(PoisonError::into_inner);
            computed += done;
            if is_broken() || done < wanted.len() as u64 {
                break;
            }
        }
        if let Some(failure) = file.into_inner().unwrap_or_else(PoisonError::into_inner).1 {
            return Err(failure);
        }
        if interrupt::requested() || !worker.goes_on() {
            let kept = format!("what was looked at is kept in {}", output::path(self.kept.folder));
            return Err(Failure::Interrupted(format!("shard {shard}: {kept}; the same command goes on from there")));
        }
        Ok([mine, computed])
    }
}

/// The bar of a proof, and the end of its worker.
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

/// Works on that number of threads, 0 for one a core.
pub(super) fn on_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    match rayon::ThreadPoolBuilder::new().num_threads(threads).build() {
        Ok(pool) => pool.install(work),
        // Without threads of its own it uses those that there are.
        Err(_) => work(),
    }
}
