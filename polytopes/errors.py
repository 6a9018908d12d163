"""Errors of their own kind."""


class UndecidedError(ArithmeticError):
    """A question whose answer could be neither proved nor refuted; the message says why."""


class UnboundedError(ValueError):
    """An operation that needs a bounded set was given an unbounded one."""


class EmptySetError(ValueError):
    """An operation that needs a point was given the empty set."""


class ProjectionLimitError(RuntimeError):
    """Fourier-Motzkin elimination would form more rows than it was allowed to."""
