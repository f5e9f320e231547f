"""Obstacles that turn: an obstacle at a pose is one that was made there."""

from dataclasses import replace

import numpy as np
import pytest

from pneumorph.mechanics import rotation
from pneumorph.mechanics.contact.contact import Contact
from pneumorph.mechanics.contact.implicit import Implicit
from pneumorph.mechanics.contact.obstacle import FORCE
from pneumorph.mechanics.contact.pairs import Pairs
from pneumorph.mechanics.contact.pose import View, pose_of
from pneumorph.mechanics.contact.pressing import pressed, pulled_back
from pneumorph.mechanics.contact.samples import surface_of
from pneumorph.mechanics.contact.shapes import Box, Cylinder, Plane, RigidMesh
from pneumorph.mechanics.contact.triangulated import Triangulated
from pneumorph.verify.solids import tube

MESH = tube(4, 8, 8, (1, 6, 2))
SURFACE = surface_of(MESH)
REACH, STIFF = 2.5, 0.3
POSE = np.array([0.1, -0.2, 0.15, 0.2, -0.1, 0.4])
R = np.asarray(rotation(POSE[3:]))
CYLINDER = Cylinder(np.array([11.0, 0.0, 5.0]), np.array([0.0, 0.6, 0.8]), 1.5, 3.0)
PLANE = Plane(np.array([9.5, 0.0, 0.0]), np.array([-1.0, 0.0, 0.0]))
BLOCK = Box(np.array([11.0, 1.0, 4.0]), np.array([1.5, 2.0, 2.5])).mesh(0.1)
ABOUT = np.array([11.0, 0.0, 4.0])


def moved(mesh: RigidMesh, center) -> RigidMesh:
    return replace(mesh, points=center + POSE[:3] + (mesh.points - center) @ R.T)


def contact(obstacle, guard: RigidMesh | None = None) -> Contact:
    # The guard's own distance is found in a mesh that was made much larger.
    guards = {} if guard is None else {"it": Pairs(SURFACE, 5.0 * MESH.points, False, [guard], 0.9, STIFF)}
    return Contact(SURFACE, {"it": obstacle}, guards, None)


HERE_AND_THERE = {
    "plane": (
        contact(Implicit(SURFACE, PLANE, REACH, STIFF)),
        contact(Implicit(SURFACE, Plane(PLANE.point + POSE[:3], R @ PLANE.normal), REACH, STIFF)),
    ),
    "cylinder with its guard": (
        contact(Implicit(SURFACE, CYLINDER, REACH, STIFF), CYLINDER.mesh(0.1)),
        contact(
            Implicit(
                SURFACE, replace(CYLINDER, center=CYLINDER.center + POSE[:3], axis=R @ CYLINDER.axis), REACH, STIFF
            ),
            moved(CYLINDER.mesh(0.1), CYLINDER.center),
        ),
    ),
    "triangles": (
        contact(Triangulated(SURFACE, BLOCK, REACH, STIFF, ABOUT)),
        contact(Triangulated(SURFACE, moved(BLOCK, ABOUT), REACH, STIFF)),
    ),
}


@pytest.mark.parametrize("name", HERE_AND_THERE)
def test_an_obstacle_at_a_pose_is_pressed_as_one_made_there(name):
    here, there = HERE_AND_THERE[name]
    posed, made = pressed(here, MESH.points, POSE[None]), pressed(there, MESH.points, np.zeros((1, 6)))
    assert np.linalg.norm(made[0, FORCE]) > 0.01
    assert posed == pytest.approx(made, rel=1e-9)
    bars = np.random.default_rng(0).standard_normal((2, 1, 5))
    slopes, _ = pulled_back(here, MESH.points, POSE[None], bars)
    assert slopes == pytest.approx(pulled_back(there, MESH.points, np.zeros((1, 6)), bars)[0], rel=1e-8, abs=1e-10)


def test_derivatives_by_the_pose_are_those_of_differences():
    rng, x = np.random.default_rng(1), MESH.points[:5]
    view, other = (View(ABOUT, POSE + sign * 1e-6 * np.eye(6)[4]) for sign in (1, -1))
    by_y = rng.standard_normal(x.shape)
    expected = np.sum(by_y * (view.in_frame(x) - other.in_frame(x))) / 2e-6
    assert View(ABOUT, POSE).by_pose(x, by_y)[4] == pytest.approx(expected, rel=1e-7)


def test_what_an_obstacle_sees_is_put_back_where_it_is():
    view = View(ABOUT, POSE)
    assert view.placed(view.in_frame(MESH.points)) == pytest.approx(MESH.points, abs=1e-12)
    assert view.directed(view.drawn(MESH.points)) == pytest.approx(MESH.points, abs=1e-12)
    assert pose_of((1.0, 2.0, 3.0)).tolist() == [1, 2, 3, 0, 0, 0] and pose_of(()).tolist() == [0] * 6
