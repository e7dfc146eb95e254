"""Running the notebooks. ``python tests/support/running.py`` runs them all and stores what they show."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).resolve().parents[2] / "notebooks"
NAMES = sorted(path.name for path in FOLDER.glob("*.ipynb"))
NUMBER = re.compile(r"-?\b\d+(?:\.\d+)?(?:e[+-]?\d+)?\b")


def load(name: str) -> Any:
    """A notebook as it is stored."""
    import nbformat  # here: its schemas take seconds to import, and every test process collects this file

    return nbformat.read(FOLDER / name, as_version=4)


def executed(name: str) -> Any:
    """A copy of a notebook with the outputs of running it now, in its folder."""
    from nbclient import NotebookClient

    notebook = load(name)
    client = NotebookClient(
        notebook,
        timeout=300,
        kernel_name="python3",
        resources={"metadata": {"path": str(FOLDER)}},
        record_timing=False,
        coalesce_streams=True,
    )
    client.execute()
    return tidy(notebook)


def tidy(notebook: Any) -> Any:
    """Without what changes from run to run or machine to machine, and each picture once."""
    notebook.metadata = {
        "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
        "language_info": {"name": "python"},
    }
    for number, cell in enumerate(notebook.cells, start=1):
        cell.id = f"cell-{number}"
        cell.metadata = {}
        for output in cell.get("outputs", []):
            output.pop("metadata", None)
            if output.output_type in ("display_data", "execute_result"):
                output.metadata = {}
                if "image/png" in output.data:
                    output.data = {"image/png": output.data["image/png"]}
    return notebook


def outputs(notebook: Any) -> list[Any]:
    """All outputs in order; what a cell prints may reach us in pieces, and counts as one."""
    found: list[Any] = []
    for cell in notebook.cells:
        last = None
        for output in cell.get("outputs", []):
            printed = output.output_type == "stream"
            if printed and last is not None and last.get("name") == output.name:
                last["text"] += output.text
                continue
            last = output.copy() if printed else None
            found.append(output if last is None else last)
    return found


def text(output: Any) -> str:
    """What an output says in words."""
    if output.output_type == "stream":
        return str(output.text)
    return str(output.get("data", {}).get("text/plain", ""))


def words_and_numbers(said: str) -> tuple[list[str], list[float]]:
    """A text cut into its numbers and what is between them, without the width of columns."""
    words = [" ".join(part.split()) for part in NUMBER.split(said)]
    return words, [float(found) for found in NUMBER.findall(said)]


def main() -> None:
    """Run every notebook and store it."""
    import nbformat

    for name in NAMES:
        notebook = executed(name)
        nbformat.write(notebook, FOLDER / name)
        print(name, f"{(FOLDER / name).stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
