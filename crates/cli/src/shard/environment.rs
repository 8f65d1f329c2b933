//! `--shard auto`: which shard a scheduler or launcher means, by the variables that it sets.

use cohaptic_campaign::Shard;

/// A scheduler or a launcher, and the variables by which it says which of how many tasks a process is.
struct Source {
    name: &'static str,
    index: &'static str,
    first: First,
    count: Count,
}

/// Which index the first task has.
enum First {
    Is(u64),
    /// It stands in a variable: users choose it.
    In(&'static str),
}

/// How many tasks there are.
enum Count {
    In(&'static str),
    /// The last index, and the step between two of them, stand in variables.
    Upto {
        last: &'static str,
        step: &'static str,
    },
    /// It is not said: users say it.
    Unknown,
}

/// Job arrays: tasks that a scheduler starts one by one. Of several the first counts.
const ARRAYS: [Source; 7] = [
    Source {
        name: "Slurm array",
        index: "SLURM_ARRAY_TASK_ID",
        first: First::In("SLURM_ARRAY_TASK_MIN"),
        count: Count::Upto { last: "SLURM_ARRAY_TASK_MAX", step: "SLURM_ARRAY_TASK_STEP" },
    },
    Source {
        name: "SGE array",
        index: "SGE_TASK_ID",
        first: First::In("SGE_TASK_FIRST"),
        count: Count::Upto { last: "SGE_TASK_LAST", step: "SGE_TASK_STEPSIZE" },
    },
    Source { name: "AWS Batch array", index: "AWS_BATCH_JOB_ARRAY_INDEX", first: First::Is(0), count: Count::In("AWS_BATCH_JOB_ARRAY_SIZE") },
    Source { name: "AWS Batch nodes", index: "AWS_BATCH_JOB_NODE_INDEX", first: First::Is(0), count: Count::In("AWS_BATCH_JOB_NUM_NODES") },
    Source { name: "Kubernetes indexed job", index: "JOB_COMPLETION_INDEX", first: First::Is(0), count: Count::Unknown },
    Source { name: "PBS array", index: "PBS_ARRAY_INDEX", first: First::Is(1), count: Count::Unknown },
    Source { name: "Torque array", index: "PBS_ARRAYID", first: First::Is(1), count: Count::Unknown },
];

/// Launchers: processes that are started together, also within each task of an array. Of several the first counts: `mpirun` within a job of Slurm sets its own, and
/// leaves those of `srun` as they are.
const LAUNCHERS: [Source; 5] = [
    Source { name: "Open MPI", index: "OMPI_COMM_WORLD_RANK", first: First::Is(0), count: Count::In("OMPI_COMM_WORLD_SIZE") },
    Source { name: "MVAPICH2", index: "MV2_COMM_WORLD_RANK", first: First::Is(0), count: Count::In("MV2_COMM_WORLD_SIZE") },
    Source { name: "MPI (PMI)", index: "PMI_RANK", first: First::Is(0), count: Count::In("PMI_SIZE") },
    // The script of a batch job has SLURM_PROCID and SLURM_NTASKS too, and is one process: the step's count is that of `srun`.
    Source { name: "srun", index: "SLURM_PROCID", first: First::Is(0), count: Count::In("SLURM_STEP_NUM_TASKS") },
    Source { name: "GNU parallel", index: "PARALLEL_SEQ", first: First::Is(1), count: Count::Unknown },
];

/// One task of a number of tasks.
struct Task {
    of: &'static Source,
    /// From 0.
    place: u64,
    count: Option<u64>,
}

/// The shard that the variables mean. `count` is how many shards there are, where the user says it.
pub(super) fn auto(get: &dyn Fn(&str) -> Option<String>, count: Option<u64>) -> Result<Shard, String> {
    let array = ARRAYS.iter().find_map(|source| source.task(get).transpose()).transpose()?;
    let launcher = LAUNCHERS.iter().find_map(|source| source.task(get).transpose()).transpose()?;
    let (place, known, name) = match (array, launcher) {
        (Some(array), Some(launcher)) => {
            let name = format!("{} and {}", array.of.name, launcher.of.name);
            let Some(each) = launcher.count else {
                return Err(format!("{name}: the number of tasks within each is not known: expected --shard I/N"));
            };
            (array.place * each + launcher.place, array.count.map(|count| count * each), name)
        }
        (Some(task), None) | (None, Some(task)) => (task.place, task.count, task.of.name.to_owned()),
        (None, None) => {
            let names = ARRAYS.iter().chain(&LAUNCHERS).map(|source| source.index).collect::<Vec<_>>().join(", ");
            return Err(format!("no scheduler says which shard this is: expected one of the variables {names}, or --shard I/N"));
        }
    };
    let count = match (count, known) {
        (Some(said), Some(known)) if said != known => return Err(format!("{name} has {known} tasks: expected auto, auto/{known}, or --shard I/N")),
        (Some(count), _) | (None, Some(count)) => count,
        (None, None) => return Err(format!("{name} does not say how many tasks there are: expected auto/N, such as auto/8")),
    };
    Shard::new(place + 1, count).ok_or_else(|| format!("{name} says that this is task {} of {count}: expected one from 1 to {count}", place + 1))
}

impl Source {
    /// The task that this process is; `None` if this source started none.
    fn task(&'static self, get: &dyn Fn(&str) -> Option<String>) -> Result<Option<Task>, String> {
        let number = |variable: &'static str| match get(variable) {
            Some(text) => text.trim().parse::<u64>().map(Some).map_err(|_| format!("{variable} is \"{}\": expected a number", text.escape_debug())),
            None => Ok(None),
        };
        let needed = |variable: &'static str| number(variable)?.ok_or_else(|| format!("{} is set and {variable} is not: expected both", self.index));
        // Jobs of SGE that are no array have this.
        let Some(index) = (if get(self.index).as_deref() == Some("undefined") { None } else { number(self.index)? }) else { return Ok(None) };
        let first = match self.first {
            First::Is(first) => first,
            First::In(variable) => needed(variable)?,
        };
        let below = || format!("{} is {index}: expected {first} or more, the index of the first task", self.index);
        let place = index.checked_sub(first).ok_or_else(below)?;
        match self.count {
            // A batch script that starts no step.
            Count::In(variable) if self.name == "srun" && number(variable)?.is_none() => Ok(None),
            Count::In(variable) => Ok(Some(Task { of: self, place, count: Some(needed(variable)?) })),
            Count::Unknown => Ok(Some(Task { of: self, place, count: None })),
            Count::Upto { last, step } => {
                let (last, step) = (needed(last)?, needed(step)?.max(1));
                if last < index || place % step != 0 {
                    return Err(format!("{}: {index} is no index from {first} to {last} in steps of {step}: expected --shard I/N", self.name));
                }
                Ok(Some(Task { of: self, place: place / step, count: Some((last - first) / step + 1) }))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn auto_of(variables: &str, count: Option<u64>) -> Result<String, String> {
        let get = |name: &str| variables.split(' ').find_map(|one| one.strip_prefix(name)?.strip_prefix('=')).map(str::to_owned);
        auto(&get, count).map(|shard| shard.to_string())
    }

    #[test]
    fn each_scheduler_counts_from_its_own_first_task() {
        for (variables, count, shard) in [
            ("SLURM_ARRAY_TASK_ID=0 SLURM_ARRAY_TASK_MIN=0 SLURM_ARRAY_TASK_MAX=7 SLURM_ARRAY_TASK_STEP=1 SLURM_PROCID=0", None, "1/8"),
            ("SLURM_ARRAY_TASK_ID=8 SLURM_ARRAY_TASK_MIN=1 SLURM_ARRAY_TASK_MAX=8 SLURM_ARRAY_TASK_STEP=1", None, "8/8"),
            ("SLURM_ARRAY_TASK_ID=20 SLURM_ARRAY_TASK_MIN=10 SLURM_ARRAY_TASK_MAX=35 SLURM_ARRAY_TASK_STEP=10", None, "2/3"),
            ("SGE_TASK_ID=3 SGE_TASK_FIRST=1 SGE_TASK_LAST=9 SGE_TASK_STEPSIZE=2", None, "2/5"),
            ("SGE_TASK_ID=undefined PMI_RANK=1 PMI_SIZE=4", None, "2/4"),
            ("AWS_BATCH_JOB_ARRAY_INDEX=9 AWS_BATCH_JOB_ARRAY_SIZE=10", None, "10/10"),
            ("JOB_COMPLETION_INDEX=0", Some(5), "1/5"),
            ("PBS_ARRAY_INDEX=5", Some(5), "5/5"),
            ("PBS_ARRAYID=1", Some(5), "1/5"),
            ("PARALLEL_SEQ=4", Some(4), "4/4"),
            ("OMPI_COMM_WORLD_RANK=0 OMPI_COMM_WORLD_SIZE=3", Some(3), "1/3"),
            ("MV2_COMM_WORLD_RANK=2 MV2_COMM_WORLD_SIZE=3", None, "3/3"),
            ("SLURM_PROCID=1 SLURM_STEP_NUM_TASKS=2 SLURM_NTASKS=9", None, "2/2"),
            // mpirun within a step, and srun within an array.
            ("OMPI_COMM_WORLD_RANK=5 OMPI_COMM_WORLD_SIZE=6 SLURM_PROCID=1 SLURM_STEP_NUM_TASKS=2", None, "6/6"),
            (
                "SLURM_ARRAY_TASK_ID=2 SLURM_ARRAY_TASK_MIN=1 SLURM_ARRAY_TASK_MAX=3 SLURM_ARRAY_TASK_STEP=1 SLURM_PROCID=3 SLURM_STEP_NUM_TASKS=4",
                None,
                "8/12",
            ),
        ] {
            assert_eq!(auto_of(variables, count).as_deref(), Ok(shard), "{variables}");
        }
    }

    #[test]
    fn what_is_not_known_is_not_guessed() {
        for (variables, count, part) in [
            ("", None, "no scheduler says which shard this is"),
            ("SLURM_PROCID=0 SLURM_NTASKS=4", None, "no scheduler says which shard this is"),
            ("JOB_COMPLETION_INDEX=0", None, "expected auto/N"),
            ("JOB_COMPLETION_INDEX=5", Some(5), "task 6 of 5"),
            ("PBS_ARRAY_INDEX=0", Some(5), "PBS_ARRAY_INDEX is 0: expected 1 or more"),
            ("PMI_RANK=0", None, "PMI_RANK is set and PMI_SIZE is not"),
            ("PMI_RANK=a PMI_SIZE=4", None, "PMI_RANK is \"a\": expected a number"),
            ("PMI_RANK=4 PMI_SIZE=4", None, "task 5 of 4"),
            ("PMI_RANK=1 PMI_SIZE=4", Some(5), "has 4 tasks: expected auto, auto/4"),
            ("PMI_RANK=0 PMI_SIZE=0", None, "task 1 of 0"),
            ("JOB_COMPLETION_INDEX=1 PARALLEL_SEQ=1", Some(4), "expected --shard I/N"),
            ("SLURM_ARRAY_TASK_ID=6 SLURM_ARRAY_TASK_MIN=1 SLURM_ARRAY_TASK_MAX=9 SLURM_ARRAY_TASK_STEP=4", None, "in steps of 4"),
            ("SGE_TASK_ID=1 SGE_TASK_FIRST=1", None, "SGE_TASK_LAST is not"),
        ] {
            let said = auto_of(variables, count).unwrap_err();
            assert!(said.contains(part) && said.contains("expected"), "{variables}: {said}");
        }
    }

    /// An array with gaps has fewer tasks than indices.
    #[test]
    fn an_array_with_gaps_leaves_shards_out_and_renumbers_none() {
        let of = |index: u64| {
            format!("SLURM_ARRAY_TASK_ID={index} SLURM_ARRAY_TASK_MIN=1 SLURM_ARRAY_TASK_MAX=7 SLURM_ARRAY_TASK_STEP=1 SLURM_ARRAY_TASK_COUNT=3")
        };
        assert_eq!([1, 3, 7].map(|index| auto_of(&of(index), None).unwrap()), ["1/7", "3/7", "7/7"]);
    }
}
