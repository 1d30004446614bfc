"""Reports of motions: summaries, documents, tables and pictures."""
