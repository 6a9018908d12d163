"""The build backend: setuptools, with archives that depend on the source alone, not on when and where they are built.

Members of the source archive are in order and belong to nobody, and all times are ``SOURCE_DATE_EPOCH``, as
https://reproducible-builds.org asks for; without it a fixed day.
"""

from __future__ import annotations

import gzip
import io
import os
import tarfile
from pathlib import Path
from typing import Any

from setuptools import build_meta
from setuptools.build_meta import *  # noqa: F403  (every other hook of the backend)

_DAY = "1735689600"  # 2025-01-01


def build_sdist(sdist_directory: str, config_settings: dict[str, Any] | None = None) -> str:
    """The source archive."""
    name = build_meta.build_sdist(sdist_directory, config_settings)
    _normalise(Path(sdist_directory) / name)
    return name


def build_wheel(
    wheel_directory: str, config_settings: dict[str, Any] | None = None, metadata_directory: str | None = None
) -> str:
    """The wheel, whose times setuptools takes from the environment."""
    os.environ.setdefault("SOURCE_DATE_EPOCH", _DAY)
    return build_meta.build_wheel(wheel_directory, config_settings, metadata_directory)


def _normalise(path: Path) -> None:
    epoch = int(os.environ.get("SOURCE_DATE_EPOCH", _DAY))
    content = io.BytesIO()
    with tarfile.open(path) as old, tarfile.open(fileobj=content, mode="w", format=tarfile.PAX_FORMAT) as new:
        for member in sorted(old.getmembers(), key=lambda member: member.name):
            plain = tarfile.TarInfo(member.name)
            plain.type, plain.size, plain.mtime = member.type, member.size, epoch
            plain.mode = 0o755 if member.isdir() or member.mode & 0o100 else 0o644
            new.addfile(plain, old.extractfile(member) if member.isfile() else None)
    with path.open("wb") as file, gzip.GzipFile(filename="", mode="wb", fileobj=file, mtime=epoch) as packed:
        packed.write(content.getvalue())
