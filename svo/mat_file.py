"""Numeric variables of MATLAB's MAT files, up to version 7.2."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray


def read_mat(path: str | Path) -> dict[str, NDArray[np.float64]]:
    """The real numeric variables of a MAT file, as 2-D arrays; others are left out.

    Raises
    ------
    ValueError
        If it is no MAT file, or one of version 7.3 (which is HDF5).
    OSError
        If the file cannot be opened.
    """
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    try:
        with open(path, "rb") as file:
            variables: dict[str, Any] = loadmat(file)
    except NotImplementedError as error:
        raise ValueError(
            f"{path} is a MAT file of version 7.3 (HDF5), which is not supported; "
            "expected version 7.2 or older: in MATLAB, save('log.mat', '-v7', ...)"
        ) from error
    except (MatReadError, ValueError, TypeError, IndexError, KeyError) as error:
        raise ValueError(f"{path} is not a MAT file ({error}); expected one of version 4 to 7.2") from error
    return {
        name: np.asarray(value, dtype=float)
        for name, value in variables.items()
        if not name.startswith("__") and isinstance(value, np.ndarray) and value.dtype.kind in "biuf"
    }
