"""How far an estimated trajectory is from the truth: by relations, or against a reference trajectory."""
