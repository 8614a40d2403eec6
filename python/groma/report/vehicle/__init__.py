"""The report on a calibrated vehicle."""
