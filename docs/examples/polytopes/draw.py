"""Draw the gallery into a folder: ``python docs/examples/polytopes/draw.py docs/images``."""

import runpy
import sys
from pathlib import Path

import matplotlib

HERE = Path(__file__).parent
EXAMPLES = sorted(path for path in HERE.glob("*.py") if path != Path(__file__))

if __name__ == "__main__":
    matplotlib.use("Agg")
    for path in EXAMPLES:
        figure = runpy.run_path(str(path))["figure"]
        target = Path(sys.argv[1]) / f"gallery_{path.stem}.png"
        figure.savefig(target, dpi=72, bbox_inches="tight", metadata={"Software": None})
