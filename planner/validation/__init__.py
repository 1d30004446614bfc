"""The thesis's printed tables, and their comparison with this model row by row."""
