"""The life of a run: one folder, its progress, its findings, and the results of it; every command has one."""
