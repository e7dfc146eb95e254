"""Files with flipped bits, cut off, or almost right in their structure: a surface, or an error of one line.

Whatever a file holds, nothing but a PcmcError may come out of a reader, and nothing may be printed.
"""

from __future__ import annotations

import json
import os
import random
import tempfile
import warnings
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import pcmc
from pcmc.base.errors import FileError, FileWarning, FreeSurfaceWarning, PcmcError, PlanWarning
from pcmc.io import FORMATS
from pcmc.io.metadata import metadata_text
from pcmc.project import load
from tests.io.test_io_foreign import X, expected

for library in ("pyvista", "rhino3dm", "trimesh"):
    pytest.importorskip(library)

READABLE = [suffix for suffix, form in FORMATS.items() if form.reads]
FLIPS = int(os.environ.get("PCMC_FLIPS", "100"))  # PCMC_FLIPS=2000 for a long run
OWN = (".obj", ".ply", ".fe")  # read by readers of our own, which check all themselves: no net below them
NET = "not a readable ."  # how an error of the net begins


def attempt(read, path, net=True):
    """Whether the file is read; anything but a surface or a PcmcError of one line fails the test."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for kind in (FileWarning, FreeSurfaceWarning, PlanWarning):
            warnings.simplefilter("ignore", kind)
        message = ""
        try:
            read(path)
        except PcmcError as error:
            message = str(error)
    assert "\n" not in message
    assert net or NET not in message, message
    return not message


def damaged(whole, chance):
    """The bytes with one to eight bits flipped; some also cut off, or with two parts swapped."""
    data = bytearray(whole)
    for _ in range(chance.choice((1, 1, 1, 2, 8))):
        data[chance.randrange(len(data))] ^= 1 << chance.randrange(8)
    kind = chance.random()
    a, b, c = sorted(chance.randrange(len(data)) for _ in range(3))
    if kind < 0.05:
        return data[:a]
    return data[:a] + data[b:c] + data[a:b] + data[c:] if kind < 0.1 else data


@pytest.mark.parametrize("suffix", READABLE)
def test_flipped_bits(tmp_path, suffix, capfd):
    whole, path, chance = tmp_path / f"whole{suffix}", tmp_path / f"damaged{suffix}", random.Random(1)
    pcmc.write(whole, expected())
    data, read = whole.read_bytes(), 0
    for _ in range(FLIPS):
        path.write_bytes(damaged(data, chance))
        read += attempt(pcmc.read, path, net=suffix not in OWN)
    assert 0 < read < FLIPS
    assert capfd.readouterr() == ("", "")


def test_flipped_bits_of_a_project(tmp_path, capfd):
    path, chance, read = tmp_path / "a.toml", random.Random(1), 0
    for _ in range(FLIPS):
        path.write_bytes(damaged(PROJECT.encode(), chance))
        read += attempt(load, path)
    assert 0 < read < FLIPS
    assert capfd.readouterr() == ("", "")


PROJECT = """[plan]
edge_length = 1.0
outline = [[0, 0], [8, 0], [8, 4], [0, 4]]
dividers = [{curve = [[4, 0], [4, 4]], bottom = "held"}]
[plan.patches]
west = {tension = 3.0, at = [2, 2]}
east = {tension = 3.0, at = [6, 2]}
[solve]
tolerance = 1e-9
[targets]
meet = [{quantity = "apex", of = "west", value = 1.0}]
vary = ["west"]
[output]
files = ["a.obj", "b.pcmc"]
"""


# ---- structure that is almost right

CHECKS = list(HealthCheck)
SLOW = settings(max_examples=FLIPS // 2, deadline=None, derandomize=True, suppress_health_check=CHECKS)
NUMBERS = st.one_of(
    st.integers(-3, 8).map(str),
    st.sampled_from(
        ["nan", "inf", "-inf", "1e999", "1e300", "-0", "+1", "0x1", "1_0", "1/2", "", "\u0663", "2" * 23]
    ),
    st.floats().map(repr),
)
WORDS = st.lists(NUMBERS, min_size=0, max_size=6).map(" ".join)
LINES = st.lists(
    st.tuples(st.sampled_from(["v", "f", "g", "o", "usemtl", "p", "l", "#", "\\", ""]), WORDS), max_size=8
)


def through(suffix, text, net=False):
    """Read a text as the file of a format."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"a{suffix}"
        path.write_bytes(text if isinstance(text, bytes) else text.encode("utf-8", "surrogateescape"))
        attempt(pcmc.read, path, net)


@SLOW
@given(LINES, st.sampled_from(["\n", "\r\n", "\r"]))
def test_lines_of_obj(lines, end):
    start = [f"v {x} {y} {z}" for x, y, z in X.tolist()]
    through(".obj", end.join([*start, "f 1 2 5", *(" ".join(line) for line in lines)]))


KINDS = st.sampled_from(
    ["float", "uchar", "int", "int64", "uint64", "double", "list uchar int", "list float int"]
)
PROPERTY = st.tuples(KINDS, st.sampled_from(["x", "y", "z", "vertex_indices", "support", "patch", "a"]))
ELEMENT = st.tuples(st.sampled_from(["vertex", "face", "other"]), NUMBERS, st.lists(PROPERTY, max_size=5))


@SLOW
@given(
    st.sampled_from(["ascii", "binary_little_endian", "binary_big_endian"]),
    st.lists(ELEMENT, max_size=4),
    st.one_of(st.lists(NUMBERS, max_size=40).map(" ".join).map(str.encode), st.binary(max_size=200)),
)
def test_headers_and_bodies_of_ply(form, elements, body):
    lines = ["ply", f"format {form} 1.0"]
    for name, count, properties in elements:
        lines += [f"element {name} {count}", *(f"property {kind} {key}" for kind, key in properties)]
    through(".ply", "\n".join([*lines, "end_header\n"]).encode() + body)


@SLOW
@given(
    st.lists(
        st.tuples(st.sampled_from(["VERTICES", "EDGES", "FACES", "BODIES", "READ", ""]), WORDS), max_size=8
    ),
    st.sampled_from(
        ["", "fixed", "constraint 1", "tension -1", "tension 2*(3", "tension sqrt(-1)", "/*", "\\"]
    ),
)
def test_sections_of_evolver(sections, tail):
    start = "VERTICES\n1 0 0 0\n2 1 0 0\n3 0 1 0\nEDGES\n1 1 2\n2 2 3\n3 3 1\nFACES\n1 1 2 3 "
    through(".fe", start + tail + "\n" + "\n".join(f"{name}\n{words}" for name, words in sections))


JSON = st.recursive(
    st.none() | st.booleans() | st.integers(-5, 10**20) | st.floats() | st.text(max_size=5),
    lambda values: st.lists(values, max_size=3) | st.dictionaries(st.text(max_size=5), values, max_size=3),
    max_leaves=6,
)


@SLOW
@given(st.lists(st.sampled_from(["patches", "plane", "counts", 0, 1, 2]), max_size=4), JSON)
def test_metadata_with_other_values(place, value):
    tree = table = json.loads(metadata_text(expected()))
    for step in place[:-1]:
        try:
            table = table[step]
        except (KeyError, IndexError, TypeError):
            return
    kind = dict if place and isinstance(place[-1], str) else list
    if place and isinstance(table, kind) and (kind is dict or place[-1] < len(table)):
        table[place[-1]] = value
    faces = "g left\nf 1 2 5\nf 1 5 4\ng right\nf 2 3 5\nf 3 6 5\n"
    vertices = "".join(f"v {x} {y} {z}\n" for x, y, z in X.tolist())
    through(".obj", f"# pcmc {json.dumps(tree)}\n{vertices}{faces}")


STEPS = [
    *("accessors", "bufferViews", "buffers", "meshes", "nodes", "scenes", "scene", "extras", "count", "type"),
    *("componentType", "byteOffset", "byteLength", "byteStride", "bufferView", "primitives", "attributes"),
    *("indices", "POSITION", "children", "mesh", "matrix", "uri", 0, 1, 2),
]


@SLOW
@given(st.lists(st.sampled_from(STEPS), min_size=1, max_size=5), JSON)
def test_gltf_with_other_values(place, value):
    tree = json.loads(GLTF)
    within, last, here = tree, "asset", tree
    for step in place:
        if isinstance(step, str) and isinstance(here, dict):
            within, last, here = here, step, here.get(step)
        elif isinstance(step, int) and isinstance(here, list) and step < len(here):
            within, last, here = here, step, here[step]
    within[last] = value
    through(".gltf", json.dumps(tree), net=True)


with tempfile.TemporaryDirectory() as _folder:
    pcmc.write(Path(_folder) / "a.gltf", expected())
    GLTF = (Path(_folder) / "a.gltf").read_text(encoding="utf-8")


def toml(value):
    """A value as TOML writes it."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(key)} = {toml(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    return '"none"' if value is None else json.dumps(value).replace("NaN", "nan").replace("Infinity", "inf")


VALUES = [
    *("edge_length = 1.0", "[[0, 0], [8, 0], [8, 4], [0, 4]]", "[[4, 0], [4, 4]]", '"held"', "[2, 2]"),
    *("1e-9", '"apex"', '["west"]', '["a.obj", "b.pcmc"]', "1.0"),
]


@SLOW
@given(st.sampled_from(VALUES), JSON)
def test_projects_with_other_values(old, value):
    new = f"edge_length = {toml(value)}" if old.startswith("edge") else toml(value)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.toml"
        path.write_bytes(PROJECT.replace(old, new, 1).encode("utf-8", "surrogatepass"))
        attempt(load, path)


def test_the_net_is_seen_when_a_reader_believes_a_file(tmp_path, monkeypatch):
    """These tests would see a reader of our own that raises anything else."""

    def broken(path):
        raise KeyError("a\nb")

    monkeypatch.setattr("pcmc.io.obj.read", broken)
    (tmp_path / "a.obj").write_text("", encoding="utf-8")
    with pytest.raises(FileError, match=NET):
        pcmc.read(tmp_path / "a.obj")
    with pytest.raises(AssertionError):
        attempt(pcmc.read, tmp_path / "a.obj", net=False)
