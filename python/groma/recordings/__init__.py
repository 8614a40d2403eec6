"""What a recording holds and which of its streams make a drive."""
