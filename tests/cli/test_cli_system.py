"""The command and its system: letters of the terminal, libraries that are missing, memory, errors."""

from __future__ import annotations

import os
import platform
import subprocess
import sys
from types import SimpleNamespace

import pytest
from nightly import at_night
from small_project import SMALL

import pcmc
from generators import two_squares
from pcmc import cli


@pytest.mark.parametrize("encoding", ["ascii", *at_night("cp1252")])
def test_letters_that_the_terminal_lacks_are_written_otherwise(folder, encoding):
    text = SMALL.replace("roof = ", '"größe, ō" = ')
    (folder / "roof.toml").write_text(text, encoding="utf-8")
    commands = [["solve", "roof.toml", "-o", "ō.obj", "--no-mesh-check"], ["certify", "ō.obj"]]
    done = subprocess.run(
        [sys.executable, "-c", f"from pcmc import cli; assert not any(map(cli.main, {commands!a}))"],
        capture_output=True,
        timeout=120,
        check=False,
        env=os.environ | {"PYTHONIOENCODING": encoding},
    )
    assert (done.stderr, done.returncode) == (b"", 0)
    name = "größe, \\u014d" if encoding == "cp1252" else "gr\\xf6\\xdfe, \\u014d"
    solved, _, certified = done.stdout.decode(encoding).partition("stable: at rest")
    assert solved
    assert name in certified
    assert pcmc.read("ō.obj").patches[0].name == "größe, ō"


def test_an_error_of_the_system_names_the_file(folder, monkeypatch, capsys):
    def broken(*_, **__):
        raise OSError(28, "No space left on device", "roof.pcmc")

    monkeypatch.setattr("pcmc.project.solving.solve", broken)
    assert cli.main(["solve", "roof.toml"]) == 2
    assert capsys.readouterr().err == "pcmc: error: roof.pcmc: No space left on device\n"


def test_without_typer_the_extra_is_named(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "typer", None)
    assert cli.main(["--help"]) == 2
    err = capsys.readouterr().err
    assert "pcmc-surfaces[cli]" in err
    assert err.count("\n") == 1


def test_without_shapely_plans_alone_are_refused(folder):
    """A surface needs no plan. Before, every command was refused, its help, too."""
    pcmc.write("mesh.pcmc", two_squares(2, alpha_aux=1.0))
    commands = [["convert", "mesh.pcmc", "mesh.obj"], ["solve", "roof.toml"]]
    blocked = "import sys; sys.modules['shapely'] = None; from pcmc import cli; "
    code = f"{blocked}print(*map(cli.main, {commands}))"
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert ran.stdout.splitlines()[-1] == "0 2"
    assert "shapely is not installed" in ran.stderr
    assert "pcmc-surfaces[plan]" in ran.stderr
    assert ran.stderr.count("\n") == 1


@pytest.mark.parametrize(
    ("library", "command", "extra"),
    [
        ("trimesh", ["solve", "roof.toml", "-o", "roof.glb"], "files"),
        ("ezdxf", ["draw", "roof.toml", "-o", "roof.dxf"], "cad"),
        ("reportlab", ["draw", "roof.toml", "-o", "roof.pdf"], "report"),
        ("matplotlib", ["report", "roof.toml", "-o", "roof.pdf"], "plot"),
        ("matplotlib", ["plot", "roof.toml", "roof.svg"], "plot"),
        ("matplotlib", ["sweep", "roof.toml", "roof.tension=2,3", "--plot", "roof.svg"], "plot"),
    ],
)
def test_a_library_of_the_output_is_missed_before_the_work(
    folder, monkeypatch, capsys, library, command, extra
):
    """Before, the roof was solved, and what was found was lost."""
    monkeypatch.setitem(sys.modules, library, None)
    for name in ("pcmc.project.solving.solve", "pcmc.cli.solving.run"):
        monkeypatch.setattr(name, lambda *_, **__: pytest.fail("it was solved"))
    assert cli.main(command) == 2
    assert f"{library} is not installed; install it with: python -m pip install 'pcmc-surfaces[{extra}]'" in (
        capsys.readouterr().err
    )


def test_a_mistake_of_our_own_is_not_hidden(folder, monkeypatch):
    def broken(*_, **__):
        raise ZeroDivisionError

    monkeypatch.setattr("pcmc.project.solving.solve", broken)
    with pytest.raises(ZeroDivisionError):
        cli.main(["solve", "roof.toml"])


def test_where_large_arrays_cannot_reuse_memory_no_option_is_set(monkeypatch):
    """glibc before 2.35 refuses the first option, and with the second alone every array is mapped anew."""
    asked = []
    monkeypatch.setattr("ctypes.CDLL", lambda _: SimpleNamespace(mallopt=lambda *given: asked.append(given)))
    monkeypatch.setattr("sys.platform", "linux")
    cli.keep_freed_memory()
    assert asked == [(cli.M_MMAP_THRESHOLD, 2**31 - 1)]


@pytest.mark.skipif(
    platform.libc_ver()[0] != "glibc" or tuple(map(int, platform.libc_ver()[1].split("."))) < (2, 35),
    reason="the system's C library keeps no freed memory when asked: glibc does from 2.35 on",
)
def test_the_command_keeps_the_memory_of_large_arrays_for_the_next():
    program = """
import resource, sys
from pcmc import cli
sys.argv = ["pcmc", "--version"]
cli.main()
first = b"x" * 2**26
del first
before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
second = b"x" * 2**26
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""
    run = [sys.executable, "-c", program]
    done = subprocess.run(run, capture_output=True, text=True, timeout=120, check=True)
    assert int(done.stdout.split()[-1]) < 1000  # pages; 16 384 where the system takes them back
