"""Where a study writes: tables, meshes and figures, each file whole or not at all."""

from __future__ import annotations

import hashlib
import json
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from io import BytesIO, StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

import pcmc
from pcmc import Surface
from pcmc.base.errors import FileError, FreeSurfaceWarning
from pcmc.base.files import atomic_write
from pcmc.io import load

FLOATS = "%.10g"  # enough to compare with what is printed, few enough to read
MESH = ".pcmc"
LARGE = 100_000  # bytes of a figure: a repository keeps every version


@dataclass(frozen=True)
class Folder:
    """The folder ``path`` of one study.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as temporary:
    ...     folder = Folder(Path(temporary) / "study")
    ...     folder.write_table("numbers", pd.DataFrame({"x": [1.5]}))
    ...     folder.read_table("numbers").x.tolist()
    [1.5]
    """

    path: Path

    def write_table(self, name: str, frame: pd.DataFrame) -> None:
        """``name.csv``, a line per row of the frame, without index; the same bytes each time."""
        text = StringIO()
        frame.to_csv(text, index=False, float_format=FLOATS, lineterminator="\n")
        write_bytes(self.path / f"{name}.csv", text.getvalue().encode())

    def read_table(self, name: str) -> pd.DataFrame:
        """What ``write_table`` wrote under this name."""
        path = self._existing(f"{name}.csv")
        return pd.read_csv(path)

    def write_mesh(self, name: str, stages: Mapping[str, Surface]) -> None:
        """``name.pcmc``: one surface at several stages of its motion, exactly.

        The file is the surface at its first stage, which must be a sound mesh. The positions at every
        stage, whose triangles may have collapsed, are scalars "<stage> x", "<stage> y", "<stage> z".
        """
        first = next(iter(stages.values()))
        positions = {
            f"{stage} {axis}": surface.vertices[:, k]
            for stage, surface in stages.items()
            for k, axis in enumerate("xyz")
        }
        self.path.mkdir(parents=True, exist_ok=True)
        pcmc.write(self.path / f"{name}{MESH}", first, scalars=positions)

    def read_mesh(self, name: str) -> dict[str, Surface]:
        """The stages that ``write_mesh`` wrote under this name."""
        path = self._existing(f"{name}{MESH}")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FreeSurfaceWarning)  # closed surfaces are free
            first, positions = pcmc.read(path), load(path).scalars
        stages = dict.fromkeys(key[:-2] for key in positions)
        return {
            stage: first.moved(np.stack([positions[f"{stage} {axis}"] for axis in "xyz"], axis=1))
            for stage in stages
        }

    def meshes(self) -> list[Path]:
        """The files that ``write_mesh`` wrote."""
        return sorted(self.path.glob(f"*{MESH}"))

    def figure(self, name: str) -> Path:
        """Where the figure ``name`` goes: a PNG in this folder."""
        self.path.mkdir(parents=True, exist_ok=True)
        return self.path / f"{name}.png"

    def shrink_figures(self) -> None:
        """Bring figures of more than LARGE bytes to a palette of 256 colours."""
        for path in sorted(self.path.glob("*.png")):
            if path.stat().st_size > LARGE:
                from PIL import Image

                data = BytesIO()
                with Image.open(path) as image:
                    # this palette covers all colours, also those of a few pixels, such as a legend's
                    few = image.convert("RGB").quantize(256, method=Image.Quantize.MAXCOVERAGE, kmeans=1)
                few.save(data, "PNG", optimize=True)
                write_bytes(path, data.getvalue())

    def mesh_hashes(self) -> dict[str, str]:
        """16 hexadecimal digits of each mesh's faces and positions, by mesh and stage."""
        return {
            f"{path.stem} {stage}": mesh_hash(surface)
            for path in self.meshes()
            for stage, surface in self.read_mesh(path.stem).items()
        }

    def _existing(self, name: str) -> Path:
        path = self.path / name
        if not path.is_file():
            raise FileError(
                f"{path} does not exist; run the step that writes it: python -m studies run {self.path.name}",
                what=str(path),
            )
        return path


def mesh_hash(surface: Surface) -> str:
    """16 hexadecimal digits that change with any position, face or patch."""
    digest = hashlib.sha256()
    for array, kind in ((surface.vertices, "<f8"), (surface.faces, "<i8"), (surface.patch_of_face, "<i8")):
        digest.update(np.ascontiguousarray(array, dtype=kind).tobytes())
    return digest.hexdigest()[:16]


def write_bytes(path: Path, data: bytes) -> None:
    """Write a file so that at every instant the old or the new one is there, whole."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic_write(path) as temporary:
        temporary.write_bytes(data)


def write_json(path: Path, values: Any) -> None:
    """A readable JSON file."""
    write_bytes(path, (json.dumps(values, indent=2, ensure_ascii=False) + "\n").encode())
