"""Types of the Rust core."""

__version__: str

def map_defaults() -> dict[str, object]: ...
