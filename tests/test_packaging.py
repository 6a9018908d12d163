"""Wheel and source archive: built, installed into an empty environment, and used from there (`make test-packaging`)."""

from __future__ import annotations

import ctypes
import hashlib
import os
import shutil
import subprocess
import sys
import tarfile
import venv
import zipfile
from fnmatch import fnmatch
from pathlib import Path

import pytest

from polytopes.native import PATH
from tests.core.disassembly import fused_instructions

pytestmark = pytest.mark.packaging

ROOT = Path(__file__).parent.parent
PACKAGES = ("aircraft", "polytopes", "svo")
EXAMPLES = ROOT / "docs" / "examples"
LIBRARY = PATH.name
COMPILERS = ("cc", "c89*", "c99*", "*gcc*", "*g++*", "c++", "clang*", "tcc")

TYPED = """
from polytopes import HPolytope
from svo import UncertainModel, WindowObserver

model = UncertainModel([[0.9]], [[1.0]], [[1.0]], n=[0.1], Ts=0.1)
observer = WindowObserver(model, HPolytope.box([-1.0], [1.0]))
wrong: int = HPolytope.box([-1.0], [1.0]).emptiness().status
"""


def run(*command: str | Path, cwd: Path, env: dict[str, str] | None = None) -> str:
    done = subprocess.run([str(part) for part in command], cwd=cwd, capture_output=True, text=True, env=env)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def archives(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The source archive, and the wheel that is built from it."""
    out = tmp_path_factory.mktemp("dist")
    run(sys.executable, "-m", "build", "--outdir", out, ROOT, cwd=out)
    return next(out.glob("*.tar.gz")), next(out.glob("*.whl"))


@pytest.fixture(scope="module")
def no_compiler(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """This environment without a C compiler: a PATH of links to every program but those, and no CC."""
    programs = tmp_path_factory.mktemp("programs")
    for folder in map(Path, os.environ["PATH"].split(os.pathsep)):
        for program in folder.iterdir() if folder.is_dir() else ():
            link = programs / program.name
            if not any(fnmatch(program.name, pattern) for pattern in COMPILERS) and not link.is_symlink():
                link.symlink_to(program)
    return {name: value for name, value in os.environ.items() if name != "CC"} | {"PATH": str(programs)}


@pytest.fixture(scope="module")
def installed(
    archives: tuple[Path, Path], no_compiler: dict[str, str], tmp_path_factory: pytest.TempPathFactory
) -> Path:
    """Programs of a new environment that has the wheel and what it asks for, installed where there is no compiler."""
    home = tmp_path_factory.mktemp("fresh")
    venv.create(home / "venv", with_pip=True)
    programs = home / "venv" / ("Scripts" if sys.platform == "win32" else "bin")
    run(programs / "python", "-m", "pip", "install", "--quiet", archives[1], cwd=home, env=no_compiler)
    return programs


def kept() -> set[str]:
    """Every file of the packages that the repository keeps."""
    return set(run("git", "ls-files", *PACKAGES, cwd=ROOT).split())


def test_the_wheel_has_every_file_of_the_packages_the_library_and_nothing_else(archives: tuple[Path, Path]) -> None:
    names = {n for n in zipfile.ZipFile(archives[1]).namelist() if ".dist-info/" not in n}
    sources = {name for name in kept() if name.endswith((".c", ".h"))}
    assert names == kept() - sources | {f"polytopes/{LIBRARY}"}
    page = {f"svo/pages/templates/{name}" for name in ("report.js", "report.css", "page.html.j2", "log.html.j2")}
    assert page | {f"{p}/py.typed" for p in PACKAGES} <= names


def test_the_source_archive_builds_by_itself(archives: tuple[Path, Path]) -> None:
    with tarfile.open(archives[0]) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    core = set(run("git", "ls-files", "core", cwd=ROOT).split())
    assert kept() | core | {"README.md", "LICENSE", "pyproject.toml"} <= names


def test_one_wheel_serves_all_pythons_of_a_platform(archives: tuple[Path, Path]) -> None:
    assert "-py3-none-" in archives[1].name


@pytest.mark.skipif(sys.platform != "linux", reason="auditwheel checks wheels for Linux")
def test_the_wheel_asks_for_no_library_that_a_machine_may_lack(archives: tuple[Path, Path]) -> None:
    assert "manylinux" in run(sys.executable, "-m", "auditwheel", "show", archives[1], cwd=ROOT)


def test_without_a_compiler_the_package_index_gives_one(no_compiler: dict[str, str], tmp_path: Path) -> None:
    for name in ("cc", "gcc", "clang", "c99", "tcc"):
        assert shutil.which(name, path=no_compiler["PATH"]) is None
    home = tmp_path / "clone"
    run("git", "clone", "--quiet", ROOT, home, cwd=tmp_path)
    run(sys.executable, "-m", "build", "--wheel", "--outdir", tmp_path, home, cwd=tmp_path, env=no_compiler)
    with zipfile.ZipFile(next(tmp_path.glob("*.whl"))) as wheel:
        library = Path(wheel.extract(f"polytopes/{LIBRARY}", tmp_path))
    assert not fused_instructions(library)
    assert ctypes.CDLL(str(library)).fdi_window_layout


def test_an_edited_file_of_the_core_is_built_by_the_next_make(tmp_path: Path) -> None:
    home = tmp_path / "clone"
    run("git", "clone", "--quiet", ROOT, home, cwd=tmp_path)
    run("make", ".venv/.library", cwd=home)
    library = home / "polytopes" / LIBRARY
    before = library.stat().st_mtime_ns
    assert "up to date" in run("make", ".venv/.library", cwd=home)
    header = home / "core" / "core.h"
    header.write_text(header.read_text("utf-8") + "/* edited */\n", encoding="utf-8")
    run("make", ".venv/.library", cwd=home)
    assert library.stat().st_mtime_ns > before


def test_two_builds_of_one_source_are_equal(tmp_path: Path) -> None:
    digests = set()
    for clone in ("one", "two"):
        home, out = tmp_path / clone, tmp_path / f"dist-{clone}"
        run("git", "clone", "--quiet", ROOT, home, cwd=tmp_path)
        for i, path in enumerate(sorted(home.glob("svo/*.py"))):
            os.utime(path, (i, i if clone == "one" else 2 * i))
            path.chmod(0o600 if clone == "one" else 0o664)
        run(sys.executable, "-m", "build", "--outdir", out, home, cwd=tmp_path)
        digests.add(tuple(hashlib.sha256(path.read_bytes()).hexdigest() for path in sorted(out.iterdir())))
    assert len(digests) == 1
    assert len(digests.pop()) == 2


def test_the_installed_package_works(installed: Path, tmp_path: Path) -> None:
    assert "eclipse" in run(installed / "svo", "plants", cwd=tmp_path)
    code = (
        "from importlib.resources import files; from polytopes import HPolytope; import svo; "
        "assert files('svo.pages').joinpath('templates', 'report.js').read_text(); "
        "print(svo.__file__, HPolytope.empty(2).emptiness().status)"
    )
    where, status = run(installed / "python", "-c", code, cwd=tmp_path).split()
    assert Path(where).is_relative_to(installed.parent)
    assert status == "empty"


def test_the_installed_package_detects_and_proves(installed: Path, tmp_path: Path) -> None:
    found = run(
        installed / "svo", "detect", EXAMPLES / "cart.toml", EXAMPLES / "cart.csv", "--out", "found", cwd=tmp_path
    )
    assert "Fault isolated at 5.0 s: sensor." in found
    assert "2 of 2 alarms proven" in run(installed / "svo", "verify", "found/alarms.jsonl", cwd=tmp_path)


def test_what_an_extra_is_needed_for_says_so(installed: Path, tmp_path: Path) -> None:
    command = [installed / "svo", "study", "eclipse", "--out", "study"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode != 0
    assert "svo-fdi[study]" in done.stdout + done.stderr
    assert "Traceback" not in done.stderr


def test_types_reach_the_user(installed: Path, tmp_path: Path) -> None:
    (tmp_path / "script.py").write_text(TYPED, encoding="utf-8")
    check = [sys.executable, "-m", "mypy", "--python-executable", str(installed / "python"), "script.py"]
    done = subprocess.run(check, cwd=tmp_path, capture_output=True, text=True)
    errors = [line for line in done.stdout.splitlines() if ": error:" in line]
    assert len(errors) == 1, done.stdout
    assert errors[0].startswith("script.py:7: error: Incompatible types in assignment")
