"""The life of a run: one folder, its progress, its findings, and what is told of it; every command has one."""
