"""Renders the shards of an Octolux picture on a Dask cluster and merges them.

Data flows one way: `cli` reads the command line into a `job.Job`; `scene` collects the files that travel with it;
`farm` hands one `task` per shard to Dask; `parts` keeps what comes back and merges it.
"""
