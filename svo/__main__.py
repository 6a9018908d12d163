"""``python -m svo`` is ``svo``."""

from svo.cli import app

app(prog_name="svo")
