"""The report on a map."""
