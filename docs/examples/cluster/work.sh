# What is done: the same for all shards and for the merge.
work="campaign scene.toml --vary link.loss=0%..30%/7 --runs 10000"
