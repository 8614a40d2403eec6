"""File formats, one per file: what ROS users have is read, and what they need is written."""
