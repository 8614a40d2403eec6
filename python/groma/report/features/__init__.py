"""The report on an evaluation of features."""
