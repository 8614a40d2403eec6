"""Viewers, imported only on request."""
