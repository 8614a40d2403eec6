"""Maps from drives, at poses that are estimated or known; places seen before; landmarks promoted to the map."""
