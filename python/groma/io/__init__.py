"""File formats, one a file: what ROS users have is read, and what they need is written."""
