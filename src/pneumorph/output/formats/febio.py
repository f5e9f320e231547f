"""Write a model as an input file for FEBio 4: mesh, rubbers, base, plate, pressures, weight and solver control.

Rubbers are FEBio's uncoupled materials with its pressure model "Abaqus", U = κ/2 (J − 1)², or its "polynomial", which
has that energy too. The model of Arruda and Boyce is written as Yeoh's, which it is exactly: its series is a polynomial
of Ī₁. Names are those of FEBio's user manual.
"""

from __future__ import annotations

from math import comb
from xml.etree import ElementTree

import numpy as np

from pneumorph.errors import ProblemError
from pneumorph.mechanics import Configuration
from pneumorph.mechanics.material import energies
from pneumorph.mechanics.material.rubber import Rubber
from pneumorph.mesh.tets import TetMesh
from pneumorph.output.formats.abaqus import as_whole, tip_centre
from pneumorph.problem.regions import REST

PLATE = "plate"
"""The rigid body at the tip."""

STEPS = 20
"""Steps in which the loads are raised from nothing; FEBio cuts them where it must."""

_ABAQUS = 2
"""The number of the pressure model κ/2 (J − 1)² among FEBio's."""

_FORCE, _TURN = ("Rx", "Ry", "Rz"), ("Ru", "Rv", "Rw")
"""Degrees of freedom of rigid bodies."""

Element = ElementTree.Element


def febio_input(mesh: TetMesh, at: Configuration) -> bytes:
    """The input file of a mesh under the loads and blocked plate components of a configuration.

    Parameters
    ----------
    mesh : TetMesh
        As for `abaqus_input`; nodes, elements and faces are numbered as there.
    at : Configuration
        Loads and blocks, on the model of this mesh. Obstacles are not written.

    Raises
    ------
    ProblemError
        For springs of the plate, sheets and fibres.
    """
    mesh, at = as_whole(mesh, at)
    if at.model.reinforcements:
        raise ProblemError("format: FEBio files cannot hold sheets and fibres; export inp, or vtu")
    if at.model.plate and np.any(at.loads.spring):
        raise ProblemError("format: FEBio files cannot hold springs of the plate; export inp, or vtu")
    root = Element("febio_spec", version="4.0")
    _add(root, "Module", type="solid")
    _control(root)
    _materials(root, mesh, at)
    _mesh(root, mesh)
    _supports(root, at)
    _loads(root, at)
    curve = _add(_add(root, "LoadData"), "load_controller", id="1", name="rise", type="loadcurve")
    _values(curve, interpolate="LINEAR", extend="CONSTANT")
    points = _add(curve, "points")
    _add(points, "pt", "0,0")
    _add(points, "pt", "1,1")
    plot = _add(_add(root, "Output"), "plotfile", type="febio")
    for variable in ("displacement", "stress"):
        _add(plot, "var", type=variable)
    ElementTree.indent(root, " ")
    return ElementTree.tostring(root, encoding="ISO-8859-1", xml_declaration=True)


def material_of(rubber: Rubber) -> tuple[str, dict[str, float]]:
    """FEBio's name of a rubber's model, and the parameters of it.

    Raises
    ------
    ProblemError
        If FEBio has no such model.
    """
    *own, bulk = (float(value) for value in rubber.parameters)
    uncoupled = {"k": bulk, "pressure_model": _ABAQUS}
    match rubber.isochoric:
        case energies.neo_hookean:
            return "Mooney-Rivlin", {"c1": own[0] / 2, "c2": 0.0, **uncoupled}
        case energies.mooney_rivlin:
            return "Mooney-Rivlin", {"c1": own[0], "c2": own[1], **uncoupled}
        case energies.polynomial:
            return "polynomial", dict(zip(("c10", "c01", "c20", "c11", "c02"), own, strict=True)) | {"D1": bulk / 2}
        case energies.yeoh:
            return "Yeoh", {f"c{i}": c for i, c in enumerate(own, 1)} | uncoupled
        case energies.arruda_boyce:
            return "Yeoh", {f"c{i}": c for i, c in enumerate(yeoh_of_arruda_boyce(*own), 1)} | uncoupled
        case energies.gent:
            return "Gent", {"G": own[0], "Jm": own[1], **uncoupled}
        case energies.ogden:
            terms = enumerate(zip(own[::2], own[1::2], strict=True), 1)
            ogden = {}
            for i, (modulus, exponent) in terms:
                ogden |= {f"c{i}": 2 * modulus, f"m{i}": exponent}
            return "Ogden", ogden | uncoupled
    raise ProblemError('material: FEBio has no model of softened rubber; export with state = "first pull"')


def yeoh_of_arruda_boyce(shear: float, locking: float) -> list[float]:
    """Yeoh's coefficients c₁…c₅ of the same energy, from Ī₁ⁱ − 3ⁱ = Σ binom(i, k) 3^(i − k) (Ī₁ − 3)ᵏ.

    `shear` is in MPa, and `locking` the stretch λ_m.
    """
    series = [(i, C * locking ** (2 - 2 * i)) for i, C in enumerate(energies.ARRUDA_BOYCE, 1)]
    return [shear * sum(C * comb(i, k) * 3 ** (i - k) for i, C in series if i >= k) for k in range(1, len(series) + 1)]


def _control(root: Element) -> None:
    control = _add(root, "Control")
    _values(control, analysis="STATIC", time_steps=STEPS, step_size=1 / STEPS)
    solver = _add(control, "solver", type="solid")
    _values(solver, max_refs=30, dtol=1e-3, etol=1e-2, rtol=0)
    # No updates: Newton's method.
    _values(_add(solver, "qn_method", type="BFGS"), max_ups=0)
    stepper = _add(control, "time_stepper", type="default")
    _values(stepper, max_retries=10, opt_iter=15, dtmin=1e-4 / STEPS, dtmax=1 / STEPS)


def _materials(root: Element, mesh: TetMesh, at: Configuration) -> None:
    materials = _add(root, "Material")
    rubbers = at.model.rubbers
    for number, name in enumerate(mesh.regions or rubbers, 1):
        kind, parameters = material_of(rubbers[name])
        rubber = _add(materials, "material", id=str(number), name=_part(name), type=kind)
        _values(rubber, density=rubbers[name].density, **parameters)
    if at.model.plate:
        plate = _add(materials, "material", id=str(len(materials) + 1), name=PLATE, type="rigid body")
        _values(plate, density=1e-12, center_of_mass=_numbers(tip_centre(mesh)))


def _mesh(root: Element, mesh: TetMesh) -> None:
    geometry = _add(root, "Mesh")
    nodes = _add(geometry, "Nodes", name="nodes")
    for number, point in enumerate(mesh.points, 1):
        _add(nodes, "node", _numbers(point), id=str(number))
    domains = _add(root, "MeshDomains")
    for name, own in (mesh.regions or {REST: np.arange(len(mesh.tets))}).items():
        part = _add(geometry, "Elements", type="tet10", name=_part(name))
        for number in np.sort(own):
            _add(part, "elem", ",".join(map(str, mesh.tets[number] + 1)), id=str(number + 1))
        _add(domains, "SolidDomain", name=_part(name), mat=_part(name))
    for name, faces in mesh.faces.items():
        surface = _add(geometry, "Surface", name=name)
        for number, face in enumerate(faces, 1):
            _add(surface, "tri6", ",".join(map(str, face + 1)), id=str(number))
        if name in ("base", "tip"):
            _add(geometry, "NodeSet", ",".join(map(str, np.unique(faces) + 1)), name=name)


def _supports(root: Element, at: Configuration) -> None:
    boundary = _add(root, "Boundary")
    base = _add(boundary, "bc", name="base", node_set="base", type="zero displacement")
    _values(base, x_dof=1, y_dof=1, z_dof=1)
    if not at.model.plate:
        return
    _values(_add(boundary, "bc", name=PLATE, node_set="tip", type="rigid"), rb=PLATE)
    rigid = _add(root, "Rigid")
    if np.any(at.blocked):
        held = {f"{name}_dof": int(blocked) for name, blocked in zip(_FORCE + _TURN, at.blocked, strict=True)}
        _values(_add(rigid, "rigid_bc", name="held", type="rigid_fixed"), rb=PLATE, **held)
    for name, value in zip(_FORCE + _TURN, np.asarray(at.loads.wrench), strict=True):
        if value:
            kind = "rigid_force" if name in _FORCE else "rigid_moment"
            load = _add(rigid, "rigid_load", name=f"{kind} {name}", type=kind)
            _values(load, rb=PLATE, dof=name)
            _add(load, "value", f"{value:.12e}", lc="1")


def _loads(root: Element, at: Configuration) -> None:
    loads = _add(root, "Loads")
    for name, pressure in zip(at.model.chambers, np.asarray(at.loads.pressure), strict=True):
        load = _add(loads, "surface_load", name=f"pressure {name}", surface=f"chamber {name}", type="pressure")
        _add(load, "pressure", f"{pressure:.12e}", lc="1")
    acceleration = np.asarray(at.loads.acceleration)
    if acceleration.any():
        # FEBio's residual has the body force with a minus.
        weight = _add(loads, "body_load", name="weight", type="body force")
        _add(weight, "force", _numbers(-acceleration), lc="1")


def _part(name: str) -> str:
    """The name of a region's elements and material; a body of one rubber is `REST`."""
    return name or REST


def _numbers(values: np.ndarray) -> str:
    return ",".join(f"{value:.12e}" for value in values)


def _add(parent: Element, tag: str, text: str | None = None, **attributes: str) -> Element:
    child = ElementTree.SubElement(parent, tag, attributes)
    child.text = text
    return child


def _values(parent: Element, **values: object) -> None:
    """Children that have a value each."""
    for tag, value in values.items():
        _add(parent, tag, f"{value:.12g}" if isinstance(value, float) else str(value))
