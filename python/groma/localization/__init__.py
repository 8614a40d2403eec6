"""A vehicle localized on a landmark map."""
