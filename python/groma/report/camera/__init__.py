"""The report on a calibrated camera."""
