"""Calibrate a vehicle: wheels, steering, delay and the pose of its laser."""
