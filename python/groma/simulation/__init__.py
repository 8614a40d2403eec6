"""Recordings and surveys that are simulated, with the truth beside them."""
