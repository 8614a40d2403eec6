"""What all commands have in common in how they take parameters."""

from __future__ import annotations

from cyclopts import Parameter

PLAIN = Parameter(negative=())
"""No ``--no-x`` beside a switch and no ``--empty-x`` beside a list."""
