"""The build backend: scikit-build-core, with a C compiler from the package index where the machine has none.

Archives depend on the source alone, not on when and where they are built: all times are ``SOURCE_DATE_EPOCH``, as
https://reproducible-builds.org asks for; without it a fixed day.
"""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Callable
from typing import Any

from scikit_build_core import build
from scikit_build_core.build import *  # noqa: F403  (every other hook of the backend)

_COMPILERS = ("cc", "gcc", "clang")
_DAY = "1735689600"  # 2025-01-01

Settings = dict[str, Any] | None


def has_compiler() -> bool:
    """Whether the user named a C compiler, or one is found that knows the flags of the core."""
    return bool(os.environ.get("CC")) or any(map(shutil.which, _COMPILERS))


def _needed(hook: Callable[[Settings], list[str]]) -> Callable[[Settings], list[str]]:
    def requires(config_settings: Settings = None) -> list[str]:
        return hook(config_settings) + ([] if has_compiler() else ["ziglang"])

    return requires


def _built(hook: Callable[..., str]) -> Callable[..., str]:
    def build_it(directory: str, config_settings: Settings = None, metadata_directory: str | None = None) -> str:
        os.environ.setdefault("SOURCE_DATE_EPOCH", _DAY)
        if not has_compiler():  # for the baseline of its kind of machine, as other compilers build by themselves
            os.environ["CC"] = f"{sys.executable} -m ziglang cc -mcpu=baseline"
        return hook(directory, config_settings, metadata_directory)

    return build_it


get_requires_for_build_wheel = _needed(build.get_requires_for_build_wheel)
get_requires_for_build_editable = _needed(build.get_requires_for_build_editable)
build_wheel, build_editable = _built(build.build_wheel), _built(build.build_editable)
