"""The report on a drive planned before one camera."""
