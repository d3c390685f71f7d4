"""Many runs of one scene: the plan of a sweep, its jobs, and the table of its results."""
