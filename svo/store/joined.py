"""One packed file of the runs' own, joined when all runs are done, and taken apart to go on.

Each run's file is a gzip member, so that the joined one is read as any other packed file.

Beside it stands its SHA-256 in the form of ``sha256sum``. A file without its digest is somebody else's: it is never
read, overwritten or removed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

from svo.store.packed_lines import members_of
from svo.store.parts import part_name
from svo.store.whole import digest_of, write_text, write_whole


@dataclass(frozen=True)
class Joined:
    """A file that is joined of the files of a folder.

    Parameters
    ----------
    path : Path
    folder : Path
        Of the runs' files.
    run_of : function of what a member unpacks to
        The run that it is from.
    """

    path: Path
    folder: Path
    run_of: Callable[[bytes], int]

    def part(self, run: int) -> Path:
        return self.folder / f"{part_name(run)}{''.join(self.path.suffixes)}"

    def is_own(self) -> bool:
        """Whether the joined file is there, as it was written."""
        try:
            recorded = self._digest.read_text(encoding="utf-8").split()[:1]
            return not self.path.is_symlink() and recorded == [digest_of(self.path)]
        except (OSError, UnicodeDecodeError):
            return False

    def check(self) -> None:
        """Raise a ValueError if something else stands in the joined file's place."""
        if (self.path.exists() or self.path.is_symlink()) and not self.is_own():
            raise ValueError(
                f"{self.path} is not what this study wrote: another command wrote it, or it was changed; move it out "
                "of the folder and go on with --resume (alarms of the study that it replaced are computed again)"
            )

    def missing(self, digests: Mapping[int, str]) -> set[int]:
        """Runs whose lines are at hand neither in a file of their own nor joined, by the digests of their files."""
        if self.is_own():
            return set()
        return {run for run, digest in digests.items() if not _is(self.part(run), digest)}

    def join(self, digests: Mapping[int, str]) -> None:
        """Join the runs' files in the order of the runs, and remove them.

        Raises
        ------
        ValueError
            If something else stands in the joined file's place, or a run's file is damaged.
        """
        self.check()
        if not self.is_own():
            runs = sorted(digests)
            for run in runs:
                if not _is(self.part(run), digests[run]):
                    raise ValueError(f"{self.part(run)} is missing or damaged; go on with --resume to make it again")
            write_whole(self.path, lambda file: self._concatenate(runs, file))
        for run in digests:
            self.part(run).unlink(missing_ok=True)
        if self.folder.is_dir() and not any(self.folder.iterdir()):
            self.folder.rmdir()

    def take_apart(self, digests: Mapping[int, str]) -> None:
        """Give each run its own file back and remove the joined one; those of other runs are dropped."""
        if not self.is_own():
            return
        for run, members in groupby(members_of(self.path), lambda member: self.run_of(member[1])):
            if run in digests:
                _write_bytes(self.part(run), b"".join(raw for raw, _ in members))
        self.path.unlink()

    def _concatenate(self, runs: list[int], target: Path) -> None:
        with target.open("wb") as out:
            for run in runs:
                out.write(self.part(run).read_bytes())
        # Before the rename: a kill in between leaves a digest without a file, and the files of the runs.
        write_text(self._digest, f"{digest_of(target)}  {self.path.name}\n")

    @property
    def _digest(self) -> Path:
        return self.path.with_name(self.path.name.partition(".")[0] + ".sha256")


def _write_bytes(path: Path, content: bytes) -> None:
    write_whole(path, lambda file: file.write_bytes(content))


def _is(path: Path, digest: str) -> bool:
    try:
        return digest_of(path) == digest
    except OSError:
        return False
