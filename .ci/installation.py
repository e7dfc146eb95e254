"""What an installation takes: ``python .ci/installation.py`` writes ``results/installation/sets.csv``.

Each set of parts goes into an environment of its own, from the wheel of this checkout; the least set that
designs a roof also on the other versions of Python. A row has the size of the installed files, the number of
packages, and the processor time until the README's roof is solved and certified: the first command, which
compiles, and the same one again. On one thread that is about the time by the clock where nothing else runs.
"""

import argparse
import csv
import os
import re
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

HOME = Path(__file__).resolve().parent.parent
SETS = ("", "plan,cli", "design", "all")
LEAST = "plan,cli"
COLUMNS = ("python", "parts", "size", "packages", "first", "again", "triangles", "proved")
ONE = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL", "NUMBA")}


def row(python: str, parts: str, wheel: Path, scratch: Path) -> dict[str, object]:
    """Install a set, measure it, and solve, certify and prove the roof with it where it has the command."""
    place = Path(tempfile.mkdtemp(dir=scratch))
    subprocess.run([python, "-m", "venv", place], check=True)
    before = size(place)
    what = f"{wheel}[{parts}]" if parts else str(wheel)
    own = place / "bin" / "python"
    pip = [own, "-m", "pip", "--disable-pip-version-check"]
    subprocess.run([*pip, "install", "-q", "--no-compile", "-c", HOME / "constraints.txt", what], check=True)
    listed = subprocess.run(
        [*pip, "list", "--format=freeze"], check=True, capture_output=True, text=True
    ).stdout
    packages = [line for line in listed.split() if not re.match("(pip|setuptools)==", line)]
    version = subprocess.run([own, "--version"], check=True, capture_output=True, text=True).stdout.split()[1]
    found: dict[str, object] = {"python": version, "parts": parts or "none", "packages": len(packages)}
    found["size"] = round((size(place) - before) / 1e9, 3)
    if "cli" in parts or parts in ("design", "all"):
        (place / "roof.toml").write_text(roof(), encoding="utf-8")
        solve = [place / "bin" / "pcmc", "solve", "roof.toml", "-o", "roof.pcmc"]
        prove = [place / "bin" / "pcmc", "certify", "roof.pcmc", "--verify"]
        (found["first"], _), (found["again"], text) = command(solve, place), command(solve, place)
        found["triangles"] = int(re.findall(r"([\d,]+) triangles", text)[0].replace(",", ""))
        found["proved"] = "proved: " in command(prove, place)[1]
    return found


def command(words: list[object], place: Path) -> tuple[float, str]:
    """Seconds of the processor that a command took in a folder, and what it printed."""
    environment = (
        os.environ | ONE | {"NUMBA_CACHE_DIR": str(place / "numba"), "PCMC_CACHE": str(place / "cache")}
    )
    environment.pop("PYTHONPATH", None)
    start = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(
        list(map(str, words)), cwd=place, env=environment, check=True, capture_output=True, text=True
    )
    end = resource.getrusage(resource.RUSAGE_CHILDREN)
    return round(end.ru_utime + end.ru_stime - start.ru_utime - start.ru_stime, 1), done.stdout


def size(folder: Path) -> int:
    """Bytes of all files below a folder but those that Python compiled."""
    files = (path for path in folder.rglob("*") if path.is_file() and path.suffix != ".pyc")
    return sum(path.stat().st_size for path in files if not path.is_symlink())


def roof() -> str:
    """The project file of the README."""
    found = re.search(
        r"<!-- file: roof.toml -->\n```toml\n(.*?)```", (HOME / "README.md").read_text("utf-8"), re.S
    )
    assert found, "README.md has no roof.toml"
    return found[1]


def main() -> None:
    """Measure and write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sets", nargs="*", default=SETS, help="of the first Python; e.g. plan,cli design")
    parser.add_argument("--pythons", nargs="*", default=[sys.executable], help="the least set on each")
    asked = parser.parse_args()
    first, *others = asked.pythons
    with tempfile.TemporaryDirectory() as folder:
        scratch = Path(folder)
        build = [first, "-m", "pip", "wheel", "-q", "--no-deps", "-w", scratch, HOME]
        subprocess.run(build, check=True)
        (wheel,) = scratch.glob("*.whl")
        rows = [row(first, parts, wheel, scratch) for parts in asked.sets]
        rows += [row(python, LEAST, wheel, scratch) for python in others]
    path = HOME / "results" / "installation" / "sets.csv"
    path.parent.mkdir(exist_ok=True)
    with path.open("w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        table.writeheader()
        table.writerows(rows)
    print(path.read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
