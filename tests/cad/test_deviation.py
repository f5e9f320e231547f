"""The distance of triangles from the faces in a file, against closed forms."""

import numpy as np
import pytest
from solids import box, cylinder, occ, written

from pneumorph.cad.deviation import between, deviations
from pneumorph.cad.read import read_faces
from pneumorph.cad.shells import quarters

RADIUS = 6.0


def dense(faces):
    return between(faces.points, faces.triangles, 16).reshape(-1, 3)


@pytest.mark.parametrize("size", [4.0, 2.5])
def test_of_a_ball(tmp_path, size):
    data = written(occ().Sphere(occ().Pnt(0, 0, 0), RADIUS), tmp_path / "ball.step").read_bytes()
    exact = np.abs(np.linalg.norm(dense(read_faces(data, "step", 1.0, size)), axis=1) - RADIUS).max()
    assert exact > 1e-4
    assert exact <= deviations(data, "step", 1.0, size).max() <= 1.3 * exact


def test_of_an_arc_on_two_cylinders(tmp_path):
    """An edge over an angle 2 θ is R (s sin θ, cos θ + (1 − cos θ)(1 − s²)), which is off by R (1 − cos θ)² / 8."""
    lower, upper = cylinder(RADIUS, 0, 6), cylinder(RADIUS, 6, 12)
    data = written(occ().Compound([lower, upper]), tmp_path / "two.step").read_bytes()
    faces = read_faces(data, "step", 2.0, 6.0)
    assert len(faces.between)
    a, b = np.moveaxis(faces.points[faces.triangles[:, :2]], 1, 0)
    around = np.abs(a[:, 2] - b[:, 2]) < 1e-9
    on = np.abs(np.linalg.norm(np.stack([a, b])[:, around, :2], axis=2) - 2.0 * RADIUS).max(axis=0) < 1e-9
    half = np.linalg.norm((a - b)[around][on], axis=1).max() / 2.0
    arc = 2.0 * RADIUS * (1.0 - np.sqrt(1.0 - (half / (2.0 * RADIUS)) ** 2)) ** 2 / 8.0
    own = dense(faces)
    inside = (own[:, 2] > 1e-6) & (own[:, 2] < 24.0 - 1e-6)
    side = inside & (np.linalg.norm(own[:, :2], axis=1) > 1.9 * RADIUS)
    exact = np.abs(np.linalg.norm(own[side, :2], axis=1) - 2.0 * RADIUS).max()
    assert exact >= 0.9 * arc
    assert max(arc, exact) <= deviations(data, "step", 2.0, 6.0).max() <= 1.5 * max(arc, exact)


def test_plane_faces_have_none(tmp_path):
    data = written(box((0, 0, 0), (3, 4, 5)) - box((1, 1, 1), (2, 2, 2)), tmp_path / "box.step").read_bytes()
    assert not deviations(data, "step", 1.0, 2.0).any()


def test_of_remeshed_triangles(tmp_path):
    """Chords of a fine polygon are farther from a remeshed coarse one by no less than its sagitta allows."""
    fine = read_faces(written(cylinder(RADIUS, 0, 12), tmp_path / "rod.step").read_bytes(), "step", 1.0, 1.5)
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in fine.points.tolist()]
    lines += [f"f {a} {b} {c}" for a, b, c in (quarters(fine.triangles) + 1).tolist()]
    data = "\n".join(lines).encode()
    coarse = read_faces(data, "obj", 1.0, 4.0)
    middle = coarse.points[coarse.triangles[:, :3]].mean(axis=1)
    sunk = RADIUS - np.linalg.norm(middle[:, :2], axis=1)
    sunk = sunk[(middle[:, 2] > 0.1) & (middle[:, 2] < 11.9)]
    found = deviations(data, "obj", 1.0, 4.0).max()
    assert found >= 0.8 * sunk.max()
    assert found <= 1.25 * RADIUS * (1.0 - np.cos(4.0 / RADIUS))


def test_plane_faces_of_a_round_body_have_none(tmp_path):
    """One badly curved face costs nothing where triangles are on others."""
    data = written(box((-9, -9, 0), (9, 9, 20)) - cylinder(3, 4, 16), tmp_path / "block.step").read_bytes()
    faces = read_faces(data, "step", 1.0, 4.0)
    found = deviations(data, "step", 1.0, 4.0)
    radii = np.hypot(*faces.points[:, :2].T)[faces.triangles]
    heights = faces.points[faces.triangles, 2]
    curved = (np.abs(radii - 3.0).max(axis=1) < 1e-6) & (np.ptp(heights, axis=1) > 1e-6)
    assert found[curved].min() > 1e-5
    assert not found[~curved].any()
