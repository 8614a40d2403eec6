"""Corners and reflectors of laser scans: find them, describe them, pair them."""
