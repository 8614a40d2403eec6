"""Results as pages and figures that people read."""
