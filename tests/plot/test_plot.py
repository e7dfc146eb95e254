"""Pictures show what they should, where they should, whatever paints them, and twice the same."""

import numpy as np
import pytest
from nightly import at_night
from pictures import near
from PIL import Image
from tents import tent

import pcmc
from generators import spherical_cap, two_caps, two_squares
from pcmc import plot
from pcmc.explore.page_data import fields as page_fields
from pcmc.explore.session import SessionState
from pcmc.plot import colours as colors
from pcmc.plot import pictures
from pcmc.plot import scene as raster
from pcmc.plot.scene import FIXED_DOT, SLIDING_DOT, view_of
from pcmc.project.writing import draw_picture
from pcmc.surface.colours import WALLS, patch_colors, rgb

RENDERERS = [
    pytest.param("matplotlib"),
    pytest.param("pyvista", marks=pytest.mark.skipif(not raster.opengl(), reason="the system has no OpenGL")),
]


def flat_square(z=0.0, wall=False):
    """A unit square on Π, or one that stands on it."""
    X = np.array([[0, 0, z], [1, 0, z], [1, 1, z], [0, 1, z]], dtype=float)
    return pcmc.Surface(
        X, [[0, 1, 2], [0, 2, 3]], [0, 0], [pcmc.Patch("a", 1.0, 0.0 if wall else 1.0)], fixed=range(4)
    )


@pytest.mark.parametrize("renderer", RENDERERS)
def test_lengths_are_to_scale(renderer):
    image = plot.draw(flat_square(), view="plan", width=420, supports=False, edges=False, renderer=renderer)
    assert image.shape == (420, 420, 3)
    covered = (image < 250).any(axis=2)
    rows, columns = np.flatnonzero(covered.any(axis=1)), np.flatnonzero(covered.any(axis=0))
    assert np.ptp(rows) == pytest.approx(400, abs=3)  # 10 pixels of margin on each side
    assert np.ptp(columns) == pytest.approx(400, abs=3)
    assert covered[30:-30, 30:-30].all()


@pytest.mark.parametrize("renderer", RENDERERS)
def test_patches_and_supports_are_where_they_should_be(renderer):
    surface = two_squares(4)
    left, right, _ = patch_colors(surface)
    image = plot.draw(surface, view="plan", width=600, renderer=renderer, supports=False)
    blue, orange = near(image, left, 0.2), near(image, right, 0.2)
    assert np.flatnonzero(blue.any(axis=0)).max() <= 302
    assert np.flatnonzero(orange.any(axis=0)).min() >= 298
    assert blue.mean() > 0.3
    assert orange.mean() > 0.3
    image = plot.draw(surface, view=(-90.0, -20.0), width=600, renderer=renderer)
    assert near(image, rgb(FIXED_DOT)).sum() > 50
    assert near(image, rgb(SLIDING_DOT)).sum() > 20
    image = plot.draw(surface, view=(-90.0, -20.0), width=600, renderer=renderer, supports=False)
    assert not near(image, rgb(FIXED_DOT)).any()
    assert not near(image, rgb(SLIDING_DOT)).any()


@pytest.mark.parametrize("renderer", RENDERERS)
def test_what_is_behind_is_hidden(renderer):
    surface = two_squares(4)
    wall = rgb(WALLS[0])
    above = plot.draw(surface, view="plan", width=500, supports=False, renderer=renderer)
    assert near(above, wall, 0.05).mean() < 0.002
    alone = plot.draw(
        surface, view=(0.0, 0.0), patches=["wall"], width=500, supports=False, renderer=renderer
    )
    grey = np.ptp(alone.astype(int), axis=2) < 10
    assert (grey & (alone[..., 0] < 245)).mean() > 0.3


def test_light_falls_on_both_sides_alike():
    surface = two_squares(4)
    under = surface.rebuilt(faces=surface.faces[:, ::-1])
    one, other = plot.draw(surface).astype(int), plot.draw(under).astype(int)
    assert np.abs(one - other).max() <= 1  # rounding of colours


def test_patches_left_out_leave_no_lines_or_dots():
    surface = two_squares(4)
    image = plot.draw(surface, view="plan", patches=["left"], width=600)
    assert (image[:, 310:] == 255).all()
    assert (image[:, :290] < 250).any()


def test_each_surface_may_show_patches_of_its_own():
    surface = two_squares(4)
    image = plot.panel([surface] * 2, views="plan", patches=[["left"], None], width=800)
    left, right = image[:, :400], image[:, 400:]
    assert (left[:, 210:] == 255).all()
    assert (right[:, 210:390] < 250).any()
    assert (left[:, :190] == right[:, :190]).all()
    larger = plot.panel([surface] * 2, views="plan", patches=[["left"], None], width=800, one_scale=False)
    assert (larger[:, 210:390] < 250).any()


def test_legend_names_what_is_seen(monkeypatch):
    surface, shown = two_squares(4, alpha_aux=1.0), []
    entries = colors.legend_entries
    monkeypatch.setattr(
        colors, "legend_entries", lambda pictures: shown.append(entries(pictures)) or shown[-1]
    )
    plot.draw(surface, legend=True)
    plot.draw(surface, legend=True, patches=["wall"])  # which the sheets hide
    plot.draw(surface, legend=True, scalars=pcmc.mean_curvature(surface))
    plot.draw(surface, legend=True, scalars=np.ones(surface.m), supports=False)
    assert [(list(colors), list(dots)) for colors, dots in shown] == [
        (["left", "right"], ["fixed"]),
        (["wall"], ["fixed", "sliding"]),
        (["no value"], ["fixed"]),
        ([], []),
    ]
    assert shown[1][1] == {"fixed": FIXED_DOT, "sliding": SLIDING_DOT}


def test_legend_has_dots_of_a_few_pixels(monkeypatch):
    """Four sliding vertices below a wall, as small as in a picture of four."""
    surface, shown = two_caps(1.2), []
    entries = colors.legend_entries
    monkeypatch.setattr(
        colors, "legend_entries", lambda pictures: shown.append(entries(pictures)) or shown[-1]
    )
    for width in (900, 1500):
        views = ["diagonal", "elevation", (-165.0, 15.0)]
        patches = [None, None, ["wall"]]
        plot.panel([surface] * 3, views=views, patches=patches, legend=True, one_scale=False, width=width)
    assert [list(dots) for _, dots in shown] == [["fixed", "sliding"]] * 2


def test_names_are_drawn_as_written_and_not_as_mathematics():
    """Between two signs $ matplotlib reads mathematics: another name, or an error."""
    pictures = []
    for name in ("$x$", "$\\frac{$", "x"):
        surface = tent(names=(name, "50 $", "a" * 100))
        pictures.append(plot.draw(surface, legend=True, width=600))
    assert pictures[0].shape != pictures[2].shape or (pictures[0] != pictures[2]).any()
    roof, titles = two_squares(3), ["$x$", "$\\frac{$"]
    assert plot.panel([roof, roof], titles=titles, width=600).any()


def test_no_text_of_a_full_panel_lies_on_another(monkeypatch):
    """Titles, scale and legend each have a place of their own, and the pictures keep their height."""
    finished = []
    keep = plot.pictures.finish
    monkeypatch.setattr(
        plot.pictures, "finish", lambda figure, path: finished.append(figure) or keep(figure, path)
    )
    surface = two_squares(4)
    H = pcmc.mean_curvature(surface)
    plot.panel([surface] * 4, titles=list("abcd"), scalars=[H] * 3 + [None], label="H", legend=True)
    plain = plot.draw(surface, width=600)  # as wide as a column of the panel
    (figure, _) = finished
    *pictures, bar = figure.axes
    boxes = [axes.get_window_extent() for axes in pictures]
    assert [round(box.height) for box in boxes] == [len(plain)] * 4
    boxes += [axes.title.get_window_extent() for axes in pictures]
    boxes += [bar.get_tightbbox(), *(text.get_window_extent() for text in figure.legends[0].texts)]
    for k, one in enumerate(boxes):
        assert figure.bbox.x0 <= one.x0 <= one.x1 <= figure.bbox.x1
        assert figure.bbox.y0 - 1 <= one.y0 <= one.y1 <= figure.bbox.y1 + 1
        for two in boxes[:k]:
            assert min(one.x1, two.x1) - max(one.x0, two.x0) < 1 or (
                min(one.y1, two.y1) - max(one.y0, two.y0) < 1
            )


@pytest.mark.skipif(not raster.opengl(), reason="the system has no OpenGL")
@pytest.mark.parametrize("view", ["diagonal", *at_night("elevation", "plan", ((20.0, -35.0),))])
def test_both_painters_agree(view):
    surface = two_squares(6)
    H = pcmc.mean_curvature(surface)
    one, two = (
        plot.draw(surface, view=view, width=500, scalars=H, renderer=r).astype(float)
        for r in ("pyvista", "matplotlib")
    )
    assert one.shape == two.shape
    assert np.abs(one - two).mean() < 5.0  # of 255; lines differ by fractions of a pixel


def test_same_picture_same_bytes(tmp_path):
    surface = tent()
    for name in ("a.png", "b.png"):
        plot.draw(surface, tmp_path / name, numbers=pcmc.mean_curvature(surface), legend=True)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.png", "b.png"]


@pytest.mark.parametrize(("suffix", "head"), [(".svg", b"<?xml"), *at_night((".pdf", b"%PDF"))])
def test_pictures_are_written_as_svg_and_pdf_too(tmp_path, suffix, head):
    for name in ("a", "b"):
        plot.lines({"height": ([1, 2], [3, 4])}, tmp_path / f"{name}{suffix}", y="apex")
        plot.draw(tent(), tmp_path / f"{name} tent{suffix}", legend=True)
    for pair in (("a", "b"), ("a tent", "b tent")):
        one, other = ((tmp_path / f"{name}{suffix}").read_bytes() for name in pair)
        assert one == other
        assert one.startswith(head)


def test_pictures_stay_small(tmp_path):
    surface = two_squares(24)
    plot.draw(surface, tmp_path / "a.png", scalars=pcmc.mean_curvature(surface), label="H")
    assert (tmp_path / "a.png").stat().st_size < 600_000


def test_up_is_the_normal_of_the_plane():
    surface = tent()
    view = view_of(surface, "elevation")
    np.testing.assert_allclose(view.axes @ view.axes.T, np.eye(3), atol=1e-14)
    assert np.linalg.det(view.axes) == pytest.approx(1.0)
    np.testing.assert_allclose(view.axes[1], surface.plane.normal, atol=1e-14)
    height = view.project(surface.vertices - surface.plane.point)[:, 1]
    np.testing.assert_allclose(height, surface.plane.height(surface.vertices), atol=1e-13)


def test_scalars_take_their_colours_and_nothing_is_grey():
    surface = two_squares(4)
    values = np.full(surface.n, np.nan)
    inner = surface.topology.interior & (surface.vertices[:, 0] < 0)
    values[inner] = 1.0
    options = {"view": "plan", "width": 500, "supports": False, "cmap": "viridis"}
    image = plot.draw(surface, scalars=values, limits=(0.0, 1.0), **options)[:250]
    yellow = near(image, rgb("#FDE725"), 0.2)
    assert yellow[:, :250].mean() > 0.3
    assert not yellow[:, 255:].any()
    by_face = (surface.patch_of_face == 1).astype(float)
    image = plot.draw(surface, scalars=by_face, limits=(0.0, 1.0), **options)[:250]
    assert near(image, rgb("#FDE725"), 0.2)[:, 255:].mean() > 0.6
    constant = plot.draw(surface, scalars=np.ones(surface.n), **options)
    nothing = plot.draw(surface, scalars=np.full(surface.n, np.nan), **options)
    assert constant.shape == nothing.shape


def test_the_name_of_a_scale_is_not_cut_at_the_foot_of_a_picture():
    surface = spherical_cap(0.3)
    image = plot.draw(surface, scalars=surface.vertices[:, 2], label="gypq, length", width=800)
    assert (image[-4:] == 255).all()


def test_signed_values_get_a_symmetric_scale():
    from pcmc.plot.colours import color_scale

    scale = color_scale([np.array([-1.0, np.nan, 3.0]), None], None, None)
    assert (scale.low, scale.high, scale.cmap.name) == (-3.0, 3.0, "RdBu_r")
    assert np.isnan(scale.rgb(np.array([np.nan]))).all()
    scale = color_scale([np.array([1.0, 3.0])], None, None)
    assert (scale.low, scale.high, scale.cmap.name) == (1.0, 3.0, "viridis")
    assert color_scale([None], None, None) is None


def test_panel_has_one_scale_of_length_or_fills():
    small, large = flat_square(), flat_square().moved(4.0 * flat_square().vertices)
    options = {"views": "plan", "width": 800, "supports": False, "titles": ["small", "large"]}

    def widths(image):
        halves = (image[:, :400], image[:, 400:])
        return [np.ptp(np.flatnonzero((h[60:] < 240).any(axis=(0, 2)))) for h in halves]

    one, four = widths(plot.panel([small, large], **options))
    assert four == pytest.approx(4 * one, rel=0.05)
    one, four = widths(plot.panel([small, large], one_scale=False, **options))
    assert four == pytest.approx(one, abs=2)
    assert plot.panel([small] * 5, views=["plan"] * 5, columns=5, width=800).shape[0] < 200


def test_vectors_point_and_are_thinned():
    surface = two_squares(4)
    field = np.zeros((surface.n, 3))
    plain = plot.vectors(surface, field, view="elevation")
    field[surface.topology.interior] = [0.0, 0.0, 1.0]
    image = plot.vectors(surface, field, view="elevation", label="force", title="up")
    assert image.shape[0] > plain.shape[0]
    assert near(image, rgb("#B2182B")).sum() > 200
    many = two_squares(40)
    assert plot.vectors(many, pcmc.gradient(many), most=50).shape[1] == 900


def test_reactions_are_those_of_the_certificate_per_length(monkeypatch, tmp_path):
    """Half of each boundary edge to either end; the same numbers as the page for exploring has."""
    surface = two_squares(6)
    found, drawn = pcmc.certify(surface), []
    vectors = pictures.vectors
    monkeypatch.setattr(
        pictures, "vectors", lambda s, field, *_, **__: drawn.append(field) or vectors(s, field)
    )
    draw_picture(surface, tmp_path / "a.png", ["diagonal"], "reactions")
    shown = page_fields(SessionState(surface, found, surface), np.zeros(3))["reactions"]
    np.testing.assert_allclose(drawn[0], np.nan_to_num(shown), atol=1e-12)
    most = np.linalg.norm(drawn[0], axis=1).max()
    assert most == pytest.approx(found.boundaries["per_length_max"].max(), rel=1e-12)


def test_reactions_are_arrows(tmp_path):
    draw_picture(two_squares(6), tmp_path / "r.png", ["elevation"], "reactions")
    image = np.asarray(Image.open(tmp_path / "r.png").convert("RGB"))
    assert near(image, rgb("#B2182B")).sum() > 500


@pytest.mark.nightly
def test_a_million_triangles_are_drawn(tmp_path):
    surface = two_squares(460)
    assert surface.m > 900_000
    plot.draw(surface, tmp_path / "a.png", scalars=pcmc.mean_curvature(surface), label="H")
    assert 10_000 < (tmp_path / "a.png").stat().st_size < 600_000


def test_a_written_picture_has_all_its_colours(tmp_path):
    surface = two_squares(6)
    image = plot.draw(surface, tmp_path / "p.png", scalars=pcmc.mean_curvature(surface), width=400)
    with Image.open(tmp_path / "p.png") as picture:
        assert np.array_equal(np.asarray(picture), image)


def test_powers_of_ten_at_an_axis_stay_short():
    """Unread mathematics, $\\mathdefault{10^{3}}$, would take a third of the width."""
    values = {"residual": (np.arange(9.0), 10.0 ** -np.arange(9.0))}
    picture = np.asarray(plot.lines(values, x="step", y="residual", yscale="log", width=900))
    ink = (picture < 128).any(axis=2)
    frame = int(ink[: len(ink) // 2].sum(axis=0).argmax())  # the vertical axis
    assert frame < 0.15 * picture.shape[1]


def test_long_titles_do_not_run_into_each_other_or_over_the_edge(monkeypatch):
    """ "drift in the valley, at 50 % of it, slack from 39 %" was cut at both ends."""
    found, cap = [], spherical_cap(0.5)
    monkeypatch.setattr("pcmc.plot.pictures.finish", lambda figure, _: found.append(figure))
    plot.panel([cap, cap], titles=["a title that is far too long for its picture", "cap"], width=300)
    long, short = (axes.title for axes in found[0].axes[:2])
    assert long.get_window_extent().width <= 150.0
    assert long.get_fontsize() < short.get_fontsize()
