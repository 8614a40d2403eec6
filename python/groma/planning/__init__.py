"""What to drive next: before a camera, through a building, to calibrate a vehicle."""
