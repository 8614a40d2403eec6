"""The reports on explorations."""
