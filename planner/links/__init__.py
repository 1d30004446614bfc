"""A link designed as a job: loads from moves, the design, its checks, report, pictures and files."""
