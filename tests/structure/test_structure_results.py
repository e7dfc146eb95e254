"""Results of a structural analysis: what is read back, and what is refused."""

import numpy as np
from refusals import refused
from structures import LOADS, dat_text, model_of, pyramid, square

import pcmc
from pcmc.base.errors import FileError, OptionError
from pcmc.certificate.forces import support_forces


def test_results_are_read_exactly(tmp_path):
    model = model_of(pyramid(), loads=LOADS)
    text, steps = dat_text(model)
    path = tmp_path / "model.dat"
    path.write_text(text)
    results = pcmc.read_results(path, model)
    assert [result.name for result in results] == [step.name for step in model.steps]
    for result, step, expected in zip(results, model.steps, steps, strict=True):
        np.testing.assert_array_equal(result.displacements, expected["displacements"])
        np.testing.assert_array_equal(result.deflections, expected["displacements"][:, 2])
        own = model.nodal_loads(step, result.displacements)[:4]
        np.testing.assert_allclose(result.reactions[:4], expected["forces"][:4] - own, atol=1e-12)
        assert not result.reactions[4].any()
        xx, yy, zz, xy, xz, yz = expected["stresses"].reshape(4, 2, 6).mean(axis=1).T
        tensors = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]).transpose(2, 0, 1)
        np.testing.assert_allclose(result.stresses, tensors, atol=1e-12)


def test_principal_stresses_lie_in_the_faces():
    """Of α/t in the plane of each face and anything across it they are α/t."""
    model = model_of(pyramid())
    P = model.surface.vertices[model.surface.faces]
    normal = np.cross(P[:, 1] - P[:, 0], P[:, 2] - P[:, 0])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    across = normal[:, :, None] * normal[:, None, :]
    stresses = 7.0 * (np.eye(3) - across) - 100.0 * across
    result = pcmc.structure.StepResults(
        "form", model, np.zeros((5, 3)), np.zeros((5, 3)), stresses, {}, model.steps[0]
    )
    np.testing.assert_allclose(result.principal_stresses, 7.0)


def test_strains_that_leave_no_thickness_are_refused():
    """All alike in the plane: t √(1 - 2 ν/(1 - ν) (λ² - 1)) is none at λ² = 1.611 for ν = 0.45."""
    model = model_of(pyramid(), material=pcmc.Material(1e6, 0.45))
    X, stresses = model.surface.vertices, np.zeros((4, 3, 3))
    for stretch, left in ((1.2, (1.0 - 0.88 * 0.45 / 0.55) ** 0.5), (1.268, None), (1.3, None)):
        moved = (stretch - 1.0) * X
        found = pcmc.structure.StepResults(
            "form", model, moved, np.zeros((5, 3)), stresses, {}, model.steps[0]
        )
        if left is not None:
            np.testing.assert_allclose(found.thicknesses, 1e-3 * left)
            continue
        with refused(OptionError, what="Material.young") as caught:
            found.thicknesses  # noqa: B018
        assert "\n" not in str(caught.value)


def test_damaged_results_are_refused_in_one_line(tmp_path):
    model, path = model_of(pyramid(), loads=LOADS), tmp_path / "model.dat"
    text = dat_text(model)[0]
    lines = text.splitlines()
    numbers = [k for k, line in enumerate(lines) if line.count("E") >= 3]
    last = lines[numbers[-1]]
    wrong = [
        "",
        "nonsense\n" * 9,
        "\n".join(lines[: len(lines) // 2]),
        text.replace(last, last[:-14]),
        text.replace(last, last[:-12] + "         NaN"),
        text.replace(last, last.replace("E", "?")),
        "\n".join(line for k, line in enumerate(lines) if k != numbers[6]),
    ]
    for content in wrong:
        path.write_text(content)
        with refused(FileError, what=str(path)) as caught:
            pcmc.read_results(path, model)
        assert "\n" not in str(caught.value)
    path.write_bytes(b"\xff" + text.encode())
    with refused(FileError, what=str(path), where=0):
        pcmc.read_results(path, model)


def test_results_with_a_damaged_increment_before_the_last_are_refused(tmp_path):
    """Else the share at which a face gets slack was one of other places, or an error of a library."""
    model, path = model_of(pyramid()), tmp_path / "model.dat"
    text = dat_text(model)[0]
    half = text.replace(f"{1.0:.7E}", f"{0.5:.7E}")
    path.write_text(half + text)
    assert pcmc.read_results(path, model)[0].share == 1.0
    lines = half.splitlines(keepends=True)
    rows = [k for k, line in enumerate(lines) if line.count("E") >= 3]
    lost = {4: [rows[0]], 3: rows[-2:]}  # a displacement; the stresses of an element
    for left, gone in lost.items():
        path.write_text("".join(line for k, line in enumerate(lines) if k not in gone) + text)
        with refused(FileError, found=left, expected=left + 1):
            pcmc.read_results(path, model)
    path.write_text(half + text[: text.index(" stresses")])
    with refused(FileError, where=1):
        pcmc.read_results(path, model)


def test_results_of_another_surface_or_analysis_are_refused(tmp_path):
    path = tmp_path / "model.dat"
    path.write_text(dat_text(model_of(pyramid()))[0])
    with refused(FileError, found=5, expected=25):
        pcmc.read_results(path, model_of(square(), anyway=True))
    with refused(FileError, found=1, expected=4) as caught:
        pcmc.read_results(path, model_of(pyramid(), loads=LOADS))
    assert "self-weight" in str(caught.value)
    path.write_text(dat_text(model_of(pyramid(), loads=LOADS))[0])
    with refused(FileError, found=4, expected=1):
        pcmc.read_results(path, model_of(pyramid()))


def test_numbers_with_long_exponents_are_read():
    text = " displacements (vx,vy,vz) for set NALL and time  0.1000000E+01\n\n 1 -1.5-120 0. 2.0E+00\n"
    found = pcmc.structure.results.read_tables(text)[0]["displacements"][-1]
    assert found.values.tolist() == [[-1.5e-120, 0.0, 2.0]]


def test_reactions_of_an_exact_answer_are_ours(tmp_path):
    """The elements' force at a held node, Σ α ∂A, less the load on the node itself is the reaction."""
    surface = pyramid()
    model, ours = model_of(surface), support_forces(surface)
    blocks = ours + model.nodal_loads(model.steps[0])
    text = dat_text(model)[0]
    head, tail = text.index(" forces"), text.index(" stresses")
    rows = "".join(f"{v + 1:10d}" + "".join(f" {c:13.6E}" for c in blocks[v]) + "\n" for v in range(4))
    text = text[:head] + text[head:].split("\n", 1)[0] + "\n\n" + rows + "\n" + text[tail:]
    start = text.index("\n\n") + 2
    still = "".join(f"{v:10d}  0.000000E+00  0.000000E+00  0.000000E+00\n" for v in range(1, 6))
    text = text[:start] + still + "\n" + text[text.index(" forces") :]
    (tmp_path / "model.dat").write_text(text)
    (result,) = pcmc.read_results(tmp_path / "model.dat", model)
    np.testing.assert_allclose(result.reactions, ours, atol=1e-6)
