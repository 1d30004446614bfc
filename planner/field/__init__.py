"""In the field: geotags of measurements, plot maps, and row scans."""
