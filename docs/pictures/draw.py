"""Draw the pictures of this folder: ``python docs/pictures/draw.py [NAME ...]``.

Each other file here is a script to paste and run: NAME.py writes NAME.png, and perhaps NAME.csv, into the
folder in which it runs. Pictures are stored at most 900 pixels wide and in 96 colours, to stay light.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

HERE = Path(__file__).resolve().parent
NAMES = sorted(path.stem for path in HERE.glob("*.py") if path != Path(__file__).resolve())
WIDTH = 900  # pixels
COLOURS = 96


def run(name: str, folder: Path) -> None:
    """Run a script in the folder; CalledProcessError if it fails."""
    environment = os.environ | {"MPLBACKEND": "Agg", "PCMC_CACHE": "off"}
    subprocess.run([sys.executable, HERE / f"{name}.py"], cwd=folder, check=True, env=environment)


def light(source: Path, target: Path) -> None:
    """Copy a picture with fewer pixels and colours."""
    picture = Image.open(source).convert("RGB")
    if picture.width > WIDTH:
        height = round(picture.height * WIDTH / picture.width)
        picture = picture.resize((WIDTH, height), Image.Resampling.LANCZOS)
    # this palette covers all colours, also those of a few pixels, such as a scale's
    few = picture.quantize(COLOURS, method=Image.Quantize.MAXCOVERAGE, kmeans=1, dither=Image.Dither.NONE)
    few.save(target, optimize=True)


def main(names: list[str]) -> None:
    """Run the scripts and keep what they wrote."""
    for name in names or NAMES:
        with tempfile.TemporaryDirectory() as folder:
            run(name, Path(folder))
            light(Path(folder, f"{name}.png"), HERE / f"{name}.png")
            table = Path(folder, f"{name}.csv")
            if table.exists():
                shutil.copy(table, HERE)
        print(name)


if __name__ == "__main__":
    main(sys.argv[1:])
