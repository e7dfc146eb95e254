"""The command as a process of its own, and Ctrl-C at every moment of it."""

from __future__ import annotations

import signal
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from pcmc import cli

HOME = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize("kind", ["SIGINT", "SIGTERM"])
def test_ctrl_c_while_writing_clears_away(folder, monkeypatch, capsys, kind):
    def pressed(path, *_, **__):
        path.write_text("half of it", encoding="utf-8")
        signal.raise_signal(getattr(signal, kind))

    monkeypatch.setattr("pcmc.io.write", pressed)
    before = signal.getsignal(getattr(signal, kind))
    assert cli.main(["solve", "roof.toml"]) == 130
    assert signal.getsignal(getattr(signal, kind)) == before
    assert capsys.readouterr() == ("", "pcmc: stopped\n")
    assert [p.name for p in folder.iterdir()] == ["roof.toml"]


def test_interrupted_is_130(folder, monkeypatch, capsys):
    def stop(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("pcmc.project.solving.solve", stop)
    assert cli.main(["solve", "roof.toml"]) == 130
    assert capsys.readouterr().err.strip().endswith("pcmc: stopped")
    assert [p.name for p in folder.iterdir()] == ["roof.toml"]


def test_as_a_process(folder):
    run = [sys.executable, "-m", "pcmc", "certify", "none.obj"]
    done = subprocess.run(run, capture_output=True, text=True, timeout=120, check=False)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "pcmc: error: none.obj: cannot be read (No such file or directory)\n"


def begun(code, *arguments):
    """The command run as its installed script does, after some code; exit code, output, errors."""
    settings = tomllib.loads((HOME / "pyproject.toml").read_text(encoding="utf-8"))
    assert settings["project"]["scripts"]["pcmc"] == "pcmc.cli:main"
    start = f"""
import signal
import sys
signal.signal(signal.SIGINT, signal.default_int_handler)  # the parent may ignore it
{code}
from pcmc.cli import main
heavy = {{"numpy", "scipy", "pandas", "numba", "typer", "rich"}} & set(sys.modules)
assert not heavy, f"imported before Ctrl-C is handled: {{heavy}}"
sys.exit(main())
"""
    run = [sys.executable, "-c", start, *arguments]
    done = subprocess.run(run, capture_output=True, text=True, timeout=120, check=False)
    return done.returncode, done.stdout, done.stderr


@pytest.mark.parametrize("module", ["pcmc.cli.running", "numpy", "scipy", "numba", "typer", "pcmc.cli.app"])
def test_ctrl_c_while_a_module_is_imported_is_one_line(folder, module):
    press = f"""
class Press:
    def find_spec(name, *_):
        if name == {module!r}:
            signal.raise_signal(signal.SIGINT)

sys.meta_path.insert(0, Press)
"""
    assert begun(press, "certify", "none.obj") == (130, "", "pcmc: stopped\n")


def test_ctrl_c_while_python_ends_is_one_line(folder):
    press = "import atexit; atexit.register(signal.raise_signal, signal.SIGINT)"
    code, out, err = begun(press, "--help")
    assert (code, err) == (130, "pcmc: stopped\n")
    assert "solve" in out


def test_ctrl_c_stays_ignored_where_it_was(folder):
    ignore = "signal.signal(signal.SIGINT, signal.SIG_IGN)"
    press = ignore + "; import atexit; atexit.register(signal.raise_signal, signal.SIGINT)"
    code, _, err = begun(press, "certify", "none.obj")
    assert (code, err.count("\n")) == (2, 1)
    assert "none.obj" in err


@pytest.mark.parametrize(
    "command", [["solve", "roof.toml"], ["remesh", "roof.toml", "--edge-length", "0.8", "-o", "a.obj"]]
)
def test_ctrl_c_while_solving_is_130_and_writes_nothing(folder, monkeypatch, capsys, command):
    def pressed(say):
        def report(state):
            raise KeyboardInterrupt  # solvers keep it and return their best surface

        return report

    monkeypatch.setattr("pcmc.project.solving.reporter", pressed)
    assert cli.main(command) == 130
    assert capsys.readouterr() == ("", "pcmc: stopped\n")
    assert [p.name for p in folder.iterdir()] == ["roof.toml"]
