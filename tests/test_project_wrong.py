"""Project files made to hang a reader, to fill the memory, or to write where they may not."""

from __future__ import annotations

import os

import pytest
from refusals import refused
from small_project import SMALL

from pcmc import cli
from pcmc.base.errors import FileError, PlanError
from pcmc.project import load, run


def project(folder, text):
    """A project file with a text."""
    path = folder / "a.toml"
    path.write_text(text, encoding="utf-8")
    return path


def with_output(line):
    return SMALL.split("[output]")[0] + f"[output]\n{line}\n"


@pytest.mark.parametrize(
    "text",
    [
        f"[plan]\noutline = {'[' * 100_000}{']' * 100_000}\n",
        f"a = {'{a=' * 100_000}1{'}' * 100_000}\n",
        f"a{'.a' * 100_000} = 1\n",
        f"[a{'.a' * 100_000}]\n",
        f"""a{'."b c"' * 1000} = 1\n""",
        f"[plan]\nedge_length = {'9' * 5000}\n",
        f"[plan]\nedge_length = {'9' * 400}\n",
        f"[plan]\noutline = [[0, {'9' * 400}]]\n",
        "#" * 5_000_000,
    ],
)
def test_absurd_projects_are_refused(tmp_path, text, capsys):
    path = project(tmp_path, text)
    with refused(FileError) as caught:
        load(path)
    assert str(caught.value).count(str(path)) == 1
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 300 + len(str(path))
    assert cli.main(["solve", str(path)]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_a_number_out_of_range_is_named_with_its_line(tmp_path):
    path = project(tmp_path, SMALL.replace("[solve]", f"[solve]\niterations = {'9' * 400}"))
    line = 1 + path.read_text(encoding="utf-8").split("\n").index("[solve]")
    with refused(FileError, what="solve.iterations", where=line + 1):
        load(path)


@pytest.mark.parametrize("edge", ["1e-300", "1e-9", "1e300"])
def test_edge_lengths_whose_square_is_no_float_are_refused(tmp_path, edge):
    path = project(tmp_path, SMALL.replace("edge_length = ", f"edge_length = {edge} #"))
    with refused(PlanError, what="edge_length"):
        run(path)


@pytest.mark.parametrize(
    "name", ["../x.obj", "a/../../x.obj", "/x.obj", "C:\\\\x.obj", "\\\\\\\\host\\\\x.obj", "..\\\\x.obj"]
)
@pytest.mark.parametrize("key", ["files", "picture"])
def test_output_outside_the_projects_folder_is_refused(tmp_path, name, key):
    name = name if key == "files" else name.replace(".obj", ".png")
    line = f'files = ["{name}"]' if key == "files" else f'picture = "{name}"'
    with refused(FileError, what="output") as caught:
        load(project(tmp_path, with_output(line)))
    assert "--folder" in str(caught.value)


def test_a_link_may_not_lead_output_out_of_the_folder(tmp_path):
    inside, outside = tmp_path / "inside", tmp_path / "outside"
    inside.mkdir()
    outside.mkdir()
    (inside / "link").symlink_to(outside)
    path = project(inside, with_output('files = ["link/x.obj"]'))
    with refused(FileError, what="output"):
        run(path)
    assert os.listdir(outside) == []


def test_a_file_that_is_a_link_is_replaced_and_not_followed(tmp_path):
    (tmp_path / "precious.obj").write_text("mine", encoding="utf-8")
    inside = tmp_path / "inside"
    inside.mkdir()
    (inside / "x.obj").symlink_to(tmp_path / "precious.obj")
    run(project(inside, with_output('files = ["x.obj"]')))
    assert (tmp_path / "precious.obj").read_text(encoding="utf-8") == "mine"
    assert not (inside / "x.obj").is_symlink()


def test_output_in_another_folder_is_the_users_to_choose(tmp_path):
    path = project(tmp_path, with_output('files = ["x.obj"]'))
    run(path, tmp_path / "elsewhere")
    assert (tmp_path / "elsewhere" / "x.obj").is_file()


@pytest.mark.parametrize("name", ["a\\u0000.obj", f"{'a' * 300}.obj"])
def test_output_names_that_no_file_can_have(tmp_path, name):
    with refused(FileError):
        run(project(tmp_path, with_output(f'files = ["{name}"]')))
