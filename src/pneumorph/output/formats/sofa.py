"""A scene for SOFA with its plugin SoftRobots, as one Python file that has the mesh too.

SOFA solves for interaction rather than accuracy: the scene has four-node tetrahedra of linear elasticity that turn with
the body, whose shear modulus is that of the rubber at rest. Units are mm, kg and s, thus mN and kPa.
"""

from __future__ import annotations

import json

import numpy as np

from pneumorph.errors import ProblemError
from pneumorph.mechanics import Configuration
from pneumorph.mesh.tets import TetMesh
from pneumorph.output.formats.abaqus import as_whole

POISSON = 0.45
"""Poisson's ratio of the scene: four-node tetrahedra of one near 1/2 hardly bend."""

_SCENE = '''"""A pneumatic soft robot, written by pneumorph for SOFA and its plugins SofaPython3 and SoftRobots.

    runSofa -l SofaPython3 THIS_FILE

Units are mm, kg, s, thus mN and kPa. PRESSURES are raised over RISE seconds; change them here, or by the value of
the component "pressure" of a cavity. SOFA 24.06 or later.
"""

import Sofa

PRESSURES = {pressures}  # kPa
RISE = 1.0  # s
YOUNGS_MODULUS = {youngs_modulus}  # kPa: of the rubber, or of every tetrahedron
POISSON = {poisson}
MASS = {mass}  # kg
GRAVITY = {gravity}  # mm/s^2
DT = 0.01  # s

POSITION = {position}
TETRAHEDRA = {tetrahedra}
FIXED = {fixed}  # points of the base
CAVITIES = {cavities}  # triangles, whose normals point out of the cavity
SURFACE = {surface}

PLUGINS = [
    "SoftRobots",
    "Sofa.Component.AnimationLoop",
    "Sofa.Component.Constraint.Lagrangian.Correction",
    "Sofa.Component.Constraint.Lagrangian.Solver",
    "Sofa.Component.Constraint.Projective",
    "Sofa.Component.LinearSolver.Direct",
    "Sofa.Component.Mapping.Linear",
    "Sofa.Component.Mass",
    "Sofa.Component.ODESolver.Backward",
    "Sofa.Component.SolidMechanics.FEM.Elastic",
    "Sofa.Component.StateContainer",
    "Sofa.Component.Topology.Container.Constant",
    "Sofa.Component.Topology.Container.Dynamic",
    "Sofa.Component.Visual",
    "Sofa.GL.Component.Rendering3D",
]


class Inflation(Sofa.Core.Controller):
    """Raises the pressures."""

    def __init__(self, *args, **kwargs):
        Sofa.Core.Controller.__init__(self, *args, **kwargs)
        self.root, self.actuators = kwargs["root"], kwargs["actuators"]

    def onAnimateBeginEvent(self, event):
        share = min(1.0, (self.root.time.value + DT) / RISE)
        for name, actuator in self.actuators.items():
            # The plugin's pressures are impulses: those in kPa times the time step.
            actuator.value = [PRESSURES[name] * share * DT]


def createScene(root):
    root.gravity = GRAVITY
    root.dt = DT
    plugins = root.addChild("plugins")
    for plugin in PLUGINS:
        plugins.addObject("RequiredPlugin", name=plugin)
    root.addObject("VisualStyle", displayFlags="showVisualModels hideBehaviorModels")
    root.addObject("FreeMotionAnimationLoop")
    try:
        root.addObject("BlockGaussSeidelConstraintSolver", tolerance=1e-7, maxIterations=1000)
    except Exception:  # its name before SOFA 25.12
        root.addObject("GenericConstraintSolver", tolerance=1e-7, maxIterations=1000)

    body = root.addChild("body")
    body.addObject("EulerImplicitSolver", rayleighStiffness=0.1, rayleighMass=0.1)
    body.addObject("SparseLDLSolver", name="solver", template="CompressedRowSparseMatrixMat3x3d")
    body.addObject("TetrahedronSetTopologyContainer", name="mesh", position=POSITION, tetrahedra=TETRAHEDRA)
    body.addObject("TetrahedronSetGeometryAlgorithms", template="Vec3")
    body.addObject("MechanicalObject", name="nodes", template="Vec3")
    body.addObject("UniformMass", totalMass=MASS)
    body.addObject(
        "TetrahedronFEMForceField",
        template="Vec3",
        method="large",
        youngModulus=YOUNGS_MODULUS,
        poissonRatio=POISSON,
    )
    body.addObject("FixedProjectiveConstraint", indices=FIXED)
    body.addObject("LinearSolverConstraintCorrection", linearSolver="@solver")

    actuators = {{}}
    for name, triangles in CAVITIES.items():
        cavity = body.addChild("cavity_" + name)
        cavity.addObject("MeshTopology", name="mesh", position=POSITION, triangles=triangles)
        cavity.addObject("MechanicalObject", template="Vec3")
        actuators[name] = cavity.addObject(
            "SurfacePressureConstraint",
            name="pressure",
            template="Vec3",
            triangles="@mesh.triangles",
            value=[0.0],
            valueType="pressure",
        )
        cavity.addObject("IdentityMapping")
    root.addObject(Inflation(name="inflation", root=root, actuators=actuators))

    visual = body.addChild("visual")
    visual.addObject("OglModel", position=POSITION, triangles=SURFACE, color=[0.9, 0.6, 0.3, 1.0])
    visual.addObject("IdentityMapping")
'''


def sofa_scene(mesh: TetMesh, at: Configuration) -> str:
    """The scene of a mesh under the pressures and the weight of a configuration.

    Parameters
    ----------
    mesh : TetMesh
        With faces "base" and "chamber <name>"; its mid-side nodes are left out. For part of a body the whole is
        written.
    at : Configuration
        On the model of this mesh. The scene's tip is free: plate, springs, forces and obstacles are left out.

    Raises
    ------
    ProblemError
        For sheets and fibres.
    """
    mesh, at = as_whole(mesh, at)
    if at.model.reinforcements:
        raise ProblemError("format: scenes for SOFA cannot hold sheets and fibres; export inp, or vtu")
    corners, inverse = np.unique(mesh.tets[:, :4], return_inverse=True)
    number = np.full(len(mesh.points), -1)
    number[corners] = np.arange(len(corners))
    faces = {name: number[triangles[:, :3]] for name, triangles in mesh.faces.items()}
    position = mesh.points[corners]
    tets = inverse.reshape(-1, 4)
    volume = np.linalg.det(position[tets[:, 1:]] - position[tets[:, :1]]) / 6
    density, shear = np.empty(len(tets)), np.empty(len(tets))
    for name, rubber in at.model.rubbers.items():
        own = mesh.regions.get(name, slice(None))
        density[own], shear[own] = rubber.density, rubber.shear_modulus
    young = 1e3 * 2 * (1 + POISSON) * shear
    return _SCENE.format(
        pressures=_text(
            {name: 1e3 * float(p) for name, p in zip(at.model.chambers, np.asarray(at.loads.pressure), strict=True)}
        ),
        youngs_modulus=_text(young.round(6).tolist() if mesh.regions else round(float(young[0]), 6)),
        poisson=POISSON,
        mass=f"{1e3 * float(density @ volume):.9g}",
        gravity=_text(np.asarray(at.loads.acceleration).tolist()),
        position=_text(position.round(6).tolist()),
        tetrahedra=_text(tets.tolist()),
        fixed=_text(np.unique(faces["base"]).tolist()),
        cavities=_text({name: faces[f"chamber {name}"][:, ::-1].tolist() for name in at.model.chambers}),
        surface=_text(np.concatenate(list(faces.values())).tolist()),
    )


def _text(value: object) -> str:
    """Numbers, lists and dictionaries are the same in JSON and in Python."""
    return json.dumps(value, ensure_ascii=True)
