"""The report on drives tried out before a camera."""
