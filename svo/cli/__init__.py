"""The command line. Whatever is slow to import is imported inside the command that needs it."""

from svo.cli import studies, detection, logs, proofs, analysis  # noqa: F401, I001 - in the order of the help page
from svo.cli.frame import app

__all__ = ["app"]
