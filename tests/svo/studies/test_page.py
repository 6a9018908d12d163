"""The one template of pages: whatever a study's names are, they stay text."""

from __future__ import annotations

import base64
from html.parser import HTMLParser
from pathlib import Path

from markupsafe import Markup

from svo.pages.tables import TextTable
from svo.studies.page import Picture, Report, write_page

EVIL = "</script><img src=x onerror=\"alert('1')\"> & {{ 7 * 7 }} {% raw %}"


class Reader(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.text, self.tags = "", list[tuple[str, dict[str, str | None]]]()

    def handle_data(self, data: str) -> None:
        self.text += data

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))


def test_no_text_of_a_study_becomes_markup(tmp_path: Path) -> None:
    picture = tmp_path / "picture.png"
    picture.write_bytes(b"\x89PNG")
    report = Report(
        subtitle=EVIL,
        findings=[f"a{EVIL}"],
        tables=[TextTable(EVIL, (f"one\ntwo {EVIL}", "b"), ((EVIL, EVIL),), labels=1)],
        paper=EVIL,
        pictures=[Picture(picture, EVIL, EVIL)],
        glossary={EVIL: EVIL},
        command=EVIL,
        configuration={"noise": [EVIL, EVIL], "runs": 3, EVIL: None},
        versions={"numpy": EVIL},
        interactive=Markup("<b id='own'>kept</b>"),
    )
    write_page(tmp_path / "page.html", EVIL, report=report)
    reader = Reader()
    reader.feed((tmp_path / "page.html").read_text(encoding="utf-8"))
    assert reader.text.count(EVIL) == 18  # each place but the alternative text of the picture, an attribute
    assert f"A{EVIL}." in reader.text
    images = [attributes for tag, attributes in reader.tags if tag == "img"]
    inside = base64.b64encode(picture.read_bytes()).decode()
    assert images == [{"src": f"data:image/png;base64,{inside}", "alt": EVIL}]
    assert ("b", {"id": "own"}) in reader.tags
    names = [tag for tag, _ in reader.tags]
    assert "script" not in names
    assert (names.count("table"), names.count("th"), names.count("td"), names.count("br")) == (3, 2 + 1 + 4, 1 + 4, 1)
