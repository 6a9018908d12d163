"""A program that writes a log and rotates it in every way that logs are rotated."""

from __future__ import annotations

import os
import shutil
from pathlib import Path


class Logger:
    """Writes rows under a header to a file; ``rows`` are all that there are to write."""

    def __init__(self, path: Path, lines: list[str], end: str = "\n") -> None:
        self.path, self.header, self._end = path, lines[0] + end, end
        self._left = [line + end for line in lines[1:]]
        self._text = self.header
        self._is_half = False
        path.write_text(self.header, newline="")

    @property
    def is_done(self) -> bool:
        return not self._left

    def write(self, rows: int, half: int = 0) -> None:
        """Append rows, and so many characters of the one that follows."""
        text = "".join(self._left[:rows])
        self._left = self._left[rows:]
        if self._left and half:
            half = min(half, len(self._left[0]) - 1)
            text += self._left[0][:half]
            self._left[0] = self._left[0][half:]
            self._is_half = True
        else:
            self._is_half = False
        self._text += text
        with self.path.open("a", newline="") as file:
            file.write(text)

    def end_half(self) -> None:
        """Write the rest of a row that is written in part."""
        if self._is_half:
            self.write(1)

    def rename(self) -> None:
        """Move the file away and begin a new one."""
        self._shift()
        os.rename(self.path, self._old(1))
        self._begin()

    def rename_late(self) -> None:
        """Make the new file first, and go on in the old one for a while."""
        self._shift()
        os.rename(self.path, self._old(1))
        self.path.touch()
        with self._old(1).open("a", newline="") as file:
            file.write("".join(self._left[:1]))
        self._left = self._left[1:]
        self._begin()

    def copytruncate(self) -> None:
        """Copy the file and cut it to nothing; no header follows."""
        self._shift()
        shutil.copyfile(self.path, self._old(1))
        self._text = ""
        os.truncate(self.path, 0)

    def copytruncate_and_fill(self, rows: int) -> None:
        """Copy the file, cut it, and write more than it had at once, the header again first."""
        self._shift()
        shutil.copyfile(self.path, self._old(1))
        self.truncate_and_fill(rows)

    def truncate_and_fill(self, rows: int) -> None:
        """Cut the file and write the header and rows at once."""
        self._text = self.header + "".join(self._left[:rows])
        self._left = self._left[rows:]
        with self.path.open("r+", newline="") as file:
            file.truncate(0)
            file.write(self._text)

    def replace(self, rows: int) -> None:
        """Put another file in the place of this one: the header and the next rows."""
        self._text = self.header + "".join(self._left[:rows])
        self._left = self._left[rows:]
        self._put()

    def write_anew(self, rows: int) -> None:
        """Put a file with the same content and more rows in the place of this one."""
        self._text += "".join(self._left[:rows])
        self._left = self._left[rows:]
        self._put()

    def keep_the_last(self, lines: int, rows: int) -> None:
        """Put a file with the last rows and some more in the place of this one."""
        kept = self._text.splitlines(keepends=True)[1:][-lines:]
        self._text = self.header + "".join(kept) + "".join(self._left[:rows])
        self._left = self._left[rows:]
        self._put()

    def delete(self) -> None:
        """Remove the file."""
        self.path.unlink()
        self._text = self.header

    def _begin(self) -> None:
        self._text = self.header
        self.path.write_text(self.header, newline="")

    def _put(self) -> None:
        new = self.path.with_name("new")
        new.write_text(self._text, newline="")
        os.replace(new, self.path)

    def _old(self, number: int) -> Path:
        return self.path.with_name(f"{self.path.name}.{number}")

    def _shift(self) -> None:
        if self._old(1).exists():
            os.replace(self._old(1), self._old(2))
