"""Formats that a date may have, for messages and proposals: nothing is read with them."""

from __future__ import annotations

import re
from datetime import datetime

_DAYS = (
    "%d.%m.%Y", "%d/%m/%Y", "%m/%d/%Y", "%d-%m-%Y", "%m-%d-%Y", "%Y/%m/%d", "%Y.%m.%d", "%d-%b-%y", "%d-%b-%Y",
    "%d %b %Y", "%d/%b/%Y", "%b %d %Y", "%d.%m.%y", "%d/%m/%y", "%m/%d/%y", "%Y%m%d",
)  # fmt: skip
_CLOCKS = ("", " %H:%M", " %H:%M:%S", " %I:%M %p", " %I:%M:%S %p", "T%H:%M:%S", " %H.%M.%S", " %H%M%S")
_FRACTION = re.compile(r"(?<=:\d\d)[.,](\d+)|(?<=\d\d:\d\d:\d\d):(\d+)")


def suggested(text: str) -> list[tuple[str, datetime]]:
    """Formats that fit a text and the date that it then is; two where day and month are undecided."""
    fraction = _FRACTION.search(text)
    bare = text[: fraction.start()] + text[fraction.end() :] if fraction else text
    try:
        date = datetime.fromisoformat(bare)
        if len(bare) > 8:
            return [("iso", date)]
    except ValueError:
        pass
    if re.fullmatch(r"\d+:\d{2}:\d{2}|\d{1,2}:\d{2}|[\d.]+ ?(s|sec|ms|min)", bare):
        return [("duration", datetime(1970, 1, 1))]
    found: list[tuple[str, datetime]] = []
    for day in _DAYS:
        for clock in _CLOCKS:
            form = day + clock
            try:
                date = datetime.strptime(bare, form)
            except ValueError:
                continue
            shown = form.replace("%S", f"%S{fraction.group()[0]}%f") if fraction else form
            if date not in [known for _, known in found]:
                found.append((shown, date))
    return found
