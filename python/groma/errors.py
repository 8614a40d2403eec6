"""The ways in which a run may fail without there being a bug."""


class UserError(Exception):
    """The input or the request is wrong: one line says what and how to fix it; the command exits with 2."""


class EstimationError(Exception):
    """The data did not allow an estimate: one line says why; the command exits with 1."""


class ToldError(EstimationError):
    """The result must not be relied on, or there is none, as the findings told; the command exits with 1."""
