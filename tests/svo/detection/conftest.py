"""A proof of a small plant whose last healthy sample is known, as files: proven once for all tests of this folder."""

from __future__ import annotations

import pytest
from proof_cases import Files, proven, tiny

from tests.svo.observers.long_chains import long_chains


@pytest.fixture(scope="session")
def case(tmp_path_factory: pytest.TempPathFactory) -> tuple[Files, int]:
    plant, log, healthy = tiny()
    with long_chains():
        files = proven(plant, log, tmp_path_factory.mktemp("tiny"))
    assert files is not None
    return files, healthy


@pytest.fixture(scope="session")
def short_case(tmp_path_factory: pytest.TempPathFactory) -> tuple[Files, int]:
    """The same from the readings alone."""
    plant, log, healthy = tiny()
    files = proven(plant, log, tmp_path_factory.mktemp("short"))
    assert files is not None
    return files, healthy
