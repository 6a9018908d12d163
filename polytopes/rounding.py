"""The rounding that every bound counts with: to nearest.

A library may leave the processor in another mode (pplpy 0.9 leaves it rounding upward), which no result would show.
"""

_ONE, _BELOW_HALF, _ABOVE_HALF = 1.0, 2.0**-53, 1.5 * 2.0**-53  # of the distance between 1 and the next float


def check_rounding() -> None:
    """FloatingPointError unless floats round to nearest now, in this thread."""
    if _ONE + _BELOW_HALF > _ONE or -_ONE - _BELOW_HALF < -_ONE or _ONE + _ABOVE_HALF == _ONE:
        raise FloatingPointError(
            "this thread does not round floats to nearest, as the bounds of sets and states expect: a library has set "
            "the processor so (pplpy 0.9 does); set it back first, with ctypes.CDLL(None).fesetround(0)"
        )
