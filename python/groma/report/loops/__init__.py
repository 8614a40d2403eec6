"""The report on an evaluation of loop closure."""
