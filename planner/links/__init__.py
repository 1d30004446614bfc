"""Link design: loads from moves, the design, its checks, report, pictures and files."""
