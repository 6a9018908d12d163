"""Identification of the nonlinear surrogate from the published derivatives.

Run ``python -m aircraft.eclipse.identification`` to redo it and print the table of coefficients.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from scipy.optimize import least_squares

from aircraft.eclipse.derivatives import VALID_AIRSPEED, Derivatives
from aircraft.eclipse.simulator import Surrogate
from aircraft.eclipse.trim import level_trim, linearise
from svo.checks import Array

AIRSPEEDS = np.linspace(*VALID_AIRSPEED, 13)  # every 2.5 m/s
COEFFICIENTS = tuple(f.name for f in fields(Surrogate) if f.name != "normal_coupling")
# A rough aircraft of this size; the fit does not depend on it.
_START = np.array([0.0, 2.0, -0.003, 0.01, 0.6, 1e-4, 0.03, -0.1, -0.5, 0.8, 0.001])
_SCALE = np.array([0.01, 1.0, 0.003, 0.01, 0.5, 1e-4, 0.03, 0.1, 0.5, 0.8, 0.001])


@dataclass(frozen=True)
class Identification:
    """The fitted surrogate, and its entrywise relative error over 25 to 55 m/s.

    ``rms`` is over everything; ``errors`` maps each derivative to its rms error divided by its rms value.
    """

    surrogate: Surrogate
    rms: float
    errors: dict[str, float]


def identify() -> Identification:
    """Least-squares fit of the surrogate's trimmed linearisation to A(V) and B(V) over 25 to 55 m/s.

    Each entry's error is divided by the rms of that entry over the airspeeds, so that all derivatives
    weigh the same. Cm0 = 0 (the elevator zero cannot be identified); X_tau and M_tau are used as published.

    Raises
    ------
    RuntimeError
        If the fit does not converge.
    """
    derivatives = Derivatives()

    def residual(scaled: Array) -> Array:
        return _errors(Surrogate(*(scaled * _SCALE)), derivatives)[1].ravel()

    fit = least_squares(residual, _START / _SCALE, jac="3-point", diff_step=1e-4, xtol=1e-12, ftol=1e-12)
    if not fit.success:
        raise RuntimeError(f"the identification did not converge: {fit.message}")
    names, table = _errors(Surrogate(*(fit.x * _SCALE)), derivatives)
    per_entry = np.sqrt((table**2).mean(axis=0))
    errors = {name: float(e) for name, e in zip(names, per_entry, strict=True)}
    return Identification(Surrogate(*(fit.x * _SCALE).tolist()), float(np.sqrt((table**2).mean())), errors)


def _errors(surrogate: Surrogate, derivatives: Derivatives) -> tuple[tuple[str, ...], Array]:
    """Relative errors (airspeeds, derivatives) of the surrogate's linearisation."""
    linear = linearise(surrogate, level_trim(surrogate, AIRSPEEDS))
    names, columns = [], []
    for row, axis in ((0, "X"), (1, "Z"), (3, "M")):
        for which, suffixes in ((0, ("u", "w", "theta", "q")), (1, ("eta",))):
            for column, suffix in enumerate(suffixes):
                name = f"{axis}_{suffix}"
                published = derivatives.value(name, AIRSPEEDS)
                names.append(name)
                columns.append((linear[which][:, row, column] - published) / np.sqrt(np.mean(published**2)))
    return tuple(names), np.column_stack(columns)


def main() -> None:
    """Print the identified coefficients beside the ones in use, and the errors per derivative."""
    result = identify()
    used = Surrogate()
    print("coefficient   identified        in use")
    for name in COEFFICIENTS:
        print(f"{name:<10} {getattr(result.surrogate, name):13.5g} {getattr(used, name):13.5g}")
    print(f"entrywise rms error {100 * result.rms:.2f} %")
    for name, error in result.errors.items():
        print(f"  {name:<8} {100 * error:5.2f} %")


if __name__ == "__main__":
    main()
