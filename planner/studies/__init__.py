"""Studies: many variants of a boom on a mission, on one machine or on a Dask cluster."""
