"""Calibrate cameras, find targets in images, and map the cameras of a building."""
