"""Folders of results that survive kills, copies and damage; they know nothing of what is stored in them."""

from svo.store.clear import clear_results
from svo.store.csv_file import write_csv
from svo.store.identity import Identity
from svo.store.joined import Joined
from svo.store.lock import locked
from svo.store.parts import Parts, Survey
from svo.store.software import versions
from svo.store.whole import digest_of, file_name, make_folder, write_text, write_whole

__all__ = [
    "Identity",
    "Joined",
    "Parts",
    "Survey",
    "clear_results",
    "digest_of",
    "file_name",
    "locked",
    "make_folder",
    "versions",
    "write_csv",
    "write_text",
    "write_whole",
]
