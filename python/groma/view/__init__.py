"""Viewers, imported only when asked for."""
