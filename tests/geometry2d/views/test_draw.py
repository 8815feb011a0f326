import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from geometry2d.anatomy.head import head_section
from geometry2d.anatomy.muscles import muscle_regions
from geometry2d.mesh import LEVELS, section_mesh
from geometry2d.neck import neck_section
from geometry2d.rigid import RigidPlacement
from geometry2d.views.draw import PALETTE, draw_head, draw_mesh, draw_muscles, draw_neck

WINDOW = (60.0, 130.0, -115.0, 0.0)


@pytest.fixture
def axes():
    mpl.use("Agg")
    figure = Figure(figsize=(7.0, 11.5), dpi=20)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_xlim(*WINDOW[:2])
    axes.set_ylim(*WINDOW[2:])
    axes.axis("off")
    return axes


def colour_at(axes, point):
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    canvas = FigureCanvasAgg(axes.figure)
    canvas.draw()
    x, y = axes.transData.transform(point)
    picture = np.asarray(canvas.buffer_rgba())
    return picture[int(picture.shape[0] - 1 - y), int(x), :3] / 255.0


def test_head_shows_tissue_where_tissue_is(axes):
    head = head_section()
    axes.set_xlim(*WINDOW[:2])
    draw_head(axes, head)
    axes.set_xlim(*WINDOW[:2])
    axes.set_ylim(*WINDOW[2:])
    inside = head.landmarks["upper_lip"] - [6.0, 0.0]
    np.testing.assert_allclose(colour_at(axes, inside), to_rgb(PALETTE.bulk), atol=0.02)
    np.testing.assert_allclose(colour_at(axes, (128.0, -60.0)), 1.0)


def test_muscles_are_drawn_where_they_lie_and_named(axes):
    head = head_section()
    muscles = muscle_regions(head)
    draw_muscles(axes, muscles.values())
    axes.set_xlim(*WINDOW[:2])
    axes.set_ylim(*WINDOW[2:])
    written = {text.get_text() for text in axes.texts}
    assert written == {name.replace("_", " ") for name in muscles}
    for patch, muscle in zip(axes.patches, muscles.values(), strict=True):
        np.testing.assert_array_equal(patch.get_xy()[:-1], muscle.polygon)
    red, green, blue = colour_at(axes, muscles["mentalis"].polygon.mean(axis=0))
    assert red > green + 0.1
    assert red > blue + 0.1


def test_neck_is_drawn_where_it_is_placed(axes):
    neck = neck_section()
    placement = RigidPlacement(-0.4, (100.0, -60.0))
    draw_neck(axes, neck, placement, package=False)
    wall = placement.apply(neck.upper_wall.start.mean(axis=0))
    np.testing.assert_allclose(colour_at(axes, wall), to_rgb(PALETTE.neck), atol=0.25)
    assert colour_at(axes, placement.apply([0.0, 7.0])) == pytest.approx(np.ones(3))


def test_mesh_moves_with_its_displacement(axes):
    head = head_section()
    mesh = section_mesh([head.upper, head.lower], LEVELS["coarse"])
    inside = head.landmarks["upper_lip"] - [6.0, 0.0]
    draw_mesh(axes, mesh, displacement=np.full(mesh.p.T.shape, [-20.0, 0.0]), lines=False)
    axes.set_xlim(*WINDOW[:2])
    axes.set_ylim(*WINDOW[2:])
    assert colour_at(axes, inside) == pytest.approx(np.ones(3))
    # Neighbouring triangles are blended with white where they meet: up to 0.05.
    np.testing.assert_allclose(
        colour_at(axes, inside - [20.0, 0.0]), to_rgb(PALETTE.bulk), atol=0.06
    )
