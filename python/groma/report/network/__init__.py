"""The report on the map of a camera network."""
