"""Plants described in a TOML file: a model, its columns in a log, and what to run on it."""

from svo.plant.description.find import check_kept_description, description_digest, find_plant, keep_description
from svo.plant.description.plant import DescribedPlant, read_description

__all__ = [
    "DescribedPlant", "check_kept_description", "description_digest", "find_plant", "keep_description",
    "read_description",
]  # fmt: skip
