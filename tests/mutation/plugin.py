"""A plugin of pytest that gives one constant another value: ``MUTATE=module:NAME=value``.

A Python module is imported before any test, so whatever imports the constant from it gets the new value too. Of a file
of the core (``core/window/rows.c:UNIT``) a copy of the core is built in which the constant has the new value from that
file's own includes on, and loaded in the place of the installed one.
"""

from __future__ import annotations

import ctypes
import os
import re
import shutil
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

VARIABLE = "MUTATE"
ROOT = Path(__file__).parents[2]
INCLUDE = re.compile(r"^#include .*\n(?!#include|\n#include)", re.MULTILINE)


def pytest_configure() -> None:
    """Change the constant of a module; that of the core is changed when this plugin is imported."""
    module, name, value = _asked()
    if "/" in module:
        return
    loaded = import_module(module)
    if not hasattr(loaded, name):
        raise AttributeError(f"{module} has no constant {name}")
    setattr(loaded, name, type(getattr(loaded, name))(float(value)))


def _asked() -> tuple[str, str, str]:
    where, _, value = os.environ[VARIABLE].partition("=")
    module, _, name = where.partition(":")
    return module, name, value


def defined(module: str, name: str) -> str:
    """The value of a constant of the core, as a file defines it or one of its headers does."""
    file = ROOT / module
    headers = sorted((*file.parent.glob("*.h"), *(ROOT / "core").glob("*.h")))
    found = (_definition(name).search(path.read_text("utf-8")) for path in (file, *headers))
    match = next((match for match in found if match), None)
    if match is None:
        raise AttributeError(f"{module} has no constant {name}")
    return match["value"]


def _definition(name: str) -> re.Pattern[str]:
    """Of a constant: ``#define NAME value``, or ``static const double OTHER = value, NAME = value;``."""
    variable = rf"static const (?:double|integer) (?:\w+ = [^,;]+, )*{name} = "
    return re.compile(rf"^(?P<start>#define {name} |{variable})(?P<value>[^\s,;]+(?: \* EPS)?)", re.MULTILINE)


def changed(text: str, name: str, value: str) -> str:
    """The text of a file in which a constant has another value: in its definition, or after its includes."""
    text, count = _definition(name).subn(lambda found: found["start"] + value, text)
    if count:
        return text
    at = list(INCLUDE.finditer(text))[-1].end()
    return f"{text[:at]}#undef {name}\n#define {name} {value}\n{text[at:]}"


def _build(module: str, name: str, value: str) -> Path:
    """The library of a core with another constant."""
    folder = Path(mkdtemp(prefix="mutant-"))
    sources = (*ROOT.glob("core/*.*"), *ROOT.glob("core/*/*.[ch]"), *ROOT.glob("aircraft/*/*.[ch]"))
    for file in (path.relative_to(ROOT) for path in sources if not path.name.startswith("CMakeC")):
        (folder / file).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / file, folder / file)
    (folder / module).write_text(changed((folder / module).read_text("utf-8"), name, value), "utf-8")
    for command in (["cmake", "-S", "core", "-B", "core"], ["cmake", "--build", "core"]):
        subprocess.run(command, cwd=folder, check=True, capture_output=True)
    return next((folder / "polytopes").glob("_core.*"))


def _load_instead(library: Path) -> None:
    """Whoever loads the core gets this one."""
    load: Any = ctypes.CDLL

    def redirected(name: str, *arguments: Any, **options: Any) -> Any:
        return load(str(library) if Path(name).name.startswith("_core.") else name, *arguments, **options)

    assert "polytopes.native" not in sys.modules
    ctypes.CDLL = redirected  # type: ignore[assignment,misc]
    try:
        import_module("polytopes.native")
    finally:
        ctypes.CDLL = load  # type: ignore[misc]


if "/" in os.environ.get(VARIABLE, ""):
    _load_instead(_build(*_asked()))
