# What is done, with the options of a shard or of the merge behind it.
cohaptic campaign scene.toml --vary link.loss=0%..30%/7 --runs 10000 "$@"
