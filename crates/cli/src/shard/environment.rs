//! `--shard auto`: finds the shard of this process from the environment variables of schedulers and launchers.

use cohaptic_campaign::Shard;

/// Scheduler or launcher, with the environment variables for the index of a task and the number of tasks.
struct Source {
    name: &'static str,
    index: &'static str,
    first: First,
    count: Count,
}

/// Index of the first task.
enum First {
    Is(u64),
    /// Name of the variable of the first index, for schedulers with a first index of the user's choice.
    In(&'static str),
}

/// Source of the number of tasks.
enum Count {
    In(&'static str),
    /// The number follows from the last index and from the step between two indices, which stand in these variables.
    Upto {
        last: &'static str,
        step: &'static str,
    },
    /// No variable holds the number: the user gives the number, as in `auto/8`.
    Unknown,
}

/// Job arrays: tasks started singly by a scheduler. If the variables of several entries are set, the first entry of this list counts.
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

/// Launchers: programs that start several processes together, possibly within each task of an array. If the variables of several entries are set, the first
/// entry of this list counts: `mpirun` within a Slurm job sets its own variables and leaves the variables of `srun` as they are.
const LAUNCHERS: [Source; 5] = [
    Source { name: "Open MPI", index: "OMPI_COMM_WORLD_RANK", first: First::Is(0), count: Count::In("OMPI_COMM_WORLD_SIZE") },
    Source { name: "MVAPICH2", index: "MV2_COMM_WORLD_RANK", first: First::Is(0), count: Count::In("MV2_COMM_WORLD_SIZE") },
    Source { name: "MPI (PMI)", index: "PMI_RANK", first: First::Is(0), count: Count::In("PMI_SIZE") },
    // The script of a batch job is one process but has SLURM_PROCID and SLURM_NTASKS too. Only `srun` sets the number of tasks of a step.
    Source { name: "srun", index: "SLURM_PROCID", first: First::Is(0), count: Count::In("SLURM_STEP_NUM_TASKS") },
    Source { name: "GNU parallel", index: "PARALLEL_SEQ", first: First::Is(1), count: Count::Unknown },
];

/// Place of this process among the tasks of a source.
struct Task {
    of: &'static Source,
    /// Place of the task, counted from 0.
    place: u64,
    /// Number of tasks, or `None` if no variable of the source holds the number.
    count: Option<u64>,
}

/// Returns the shard that the environment variables give to this process. `get` looks up a variable. `count` is the number of shards, if the user gave it.
///
/// # Errors
///
/// A message if no source is found, if the number of shards is unknown or differs from `count`, or if a variable has no valid value.
pub(super) fn auto(get: &dyn Fn(&str) -> Option<String>, count: Option<u64>) -> Result<Shard, String> {
    let array = ARRAYS.iter().find_map(|source| source.task(get).transpose()).transpose()?;
    let launcher = LAUNCHERS.iter().find_map(|source| source.task(get).transpose()).transpose()?;
    let (place, known, name) = match (array, launcher) {
        (Some(array), Some(launcher)) => {
            let name = format!("{} and {}", array.of.name, launcher.of.name);
            let Some(each) = launcher.count else {
                return Err(format!("{name}: the number of tasks within each is not known: expected --shard I/N"));
            };
            // The processes of a launcher within each task of an array have consecutive shards: the array is the outer index, the launcher is the inner index.
            (array.place * each + launcher.place, array.count.map(|count| count * each), name)
        }
        (Some(task), None) | (None, Some(task)) => (task.place, task.count, task.of.name.to_owned()),
        (None, None) => {
            let names = ARRAYS.iter().chain(&LAUNCHERS).map(|source| source.index).collect::<Vec<_>>().join(", ");
            return Err(format!("no scheduler says which shard this is: expected one of the variables {names}, or --shard I/N"));
        }
    };
    // A number from the user must agree with the number of the scheduler: otherwise some shards would be done by no task.
    let count = match (count, known) {
        (Some(said), Some(known)) if said != known => return Err(format!("{name} has {known} tasks: expected auto, auto/{known}, or --shard I/N")),
        (Some(count), _) | (None, Some(count)) => count,
        (None, None) => return Err(format!("{name} does not say how many tasks there are: expected auto/N, such as auto/8")),
    };
    Shard::new(place + 1, count).ok_or_else(|| format!("{name} says that this is task {} of {count}: expected one from 1 to {count}", place + 1))
}

impl Source {
    /// Returns the task of this process, or `None` if this source did not start the process.
    fn task(&'static self, get: &dyn Fn(&str) -> Option<String>) -> Result<Option<Task>, String> {
        let number = |variable: &'static str| match get(variable) {
            Some(text) => text.trim().parse::<u64>().map(Some).map_err(|_| format!("{variable} is \"{}\": expected a number", text.escape_debug())),
            None => Ok(None),
        };
        let needed = |variable: &'static str| number(variable)?.ok_or_else(|| format!("{} is set and {variable} is not: expected both", self.index));
        // SGE sets the value "undefined" for jobs that are no array.
        let Some(index) = (if get(self.index).as_deref() == Some("undefined") { None } else { number(self.index)? }) else { return Ok(None) };
        let first = match self.first {
            First::Is(first) => first,
            First::In(variable) => needed(variable)?,
        };
        let below = || format!("{} is {index}: expected {first} or more, the index of the first task", self.index);
        let place = index.checked_sub(first).ok_or_else(below)?;
        match self.count {
            // SLURM_PROCID without the number of a step belongs to a batch script, which `srun` did not start.
            Count::In(variable) if self.name == "srun" && number(variable)?.is_none() => Ok(None),
            Count::In(variable) => Ok(Some(Task { of: self, place, count: Some(needed(variable)?) })),
            Count::Unknown => Ok(Some(Task { of: self, place, count: None })),
            Count::Upto { last, step } => {
                let (last, step) = (needed(last)?, needed(step)?.max(1));
                if last < index || place % step != 0 {
                    return Err(format!("{}: {index} is not an index from {first} to {last} in steps of {step}: expected --shard I/N", self.name));
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
            // `mpirun` within a step of Slurm; then `srun` within an array.
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

    /// An array with gaps has fewer tasks than indices, and the number of shards is the number of indices.
    #[test]
    fn an_array_with_gaps_leaves_shards_out_and_renumbers_none() {
        let of = |index: u64| {
            format!("SLURM_ARRAY_TASK_ID={index} SLURM_ARRAY_TASK_MIN=1 SLURM_ARRAY_TASK_MAX=7 SLURM_ARRAY_TASK_STEP=1 SLURM_ARRAY_TASK_COUNT=3")
        };
        assert_eq!([1, 3, 7].map(|index| auto_of(&of(index), None).unwrap()), ["1/7", "3/7", "7/7"]);
    }
}
