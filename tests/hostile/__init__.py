"""Hostile input: what no sensor, file or setting should hold."""
