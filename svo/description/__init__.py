"""Plants described in a TOML file: a model, its columns in a log, and what to run on it."""

from svo.description.find import find_plant, keep_description
from svo.description.plant import DescribedPlant, read_description

__all__ = ["DescribedPlant", "find_plant", "keep_description", "read_description"]
