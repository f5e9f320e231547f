"""Write a model as an input file for CalculiX and Abaqus.

The file is complete: ten-node tetrahedra (C3D10), rubbers (`abaqus_rubber`), clamped base, rigid plate, springs, dead
and follower loads, gravity, and sheets that carry compression as thin shells (S6): in CalculiX membranes do not
converge.
Abaqus does not know one keyword, ``ROT NODE`` of the rigid plate (a node whose displacements are the rotations in
CalculiX); for Abaqus, delete it and use degrees of freedom 4 to 6 of the reference node.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from pneumorph.errors import ProblemError
from pneumorph.mechanics import Configuration, whole_of
from pneumorph.mechanics.elements.reinforcement import Membrane
from pneumorph.mechanics.material import energies
from pneumorph.mesh.tets import Covered, TetMesh, area_vectors
from pneumorph.output.formats.abaqus_rubber import can_hold, hyperelastic
from pneumorph.problem.regions import REST

FACES = np.array([[0, 1, 2], [0, 1, 3], [1, 2, 3], [0, 2, 3]])
"""Corners of the faces P1 to P4 of a C3D10 element (Abaqus and CalculiX manuals), ascending."""


_MOST_SPRINGS = 6
"""Elements that are left free before those of sheets."""

THICKNESS = 0.1
"""Of sheets in the file, mm; their modulus is the stiffness over it."""

LINEAR = 0.5
"""Least wrinkling strain of a sheet that counts as linear in compression, as shells of the file are."""


def abaqus_input(mesh: TetMesh, at: Configuration, increment: float = 0.2, tolerance: float = 5e-3) -> str:
    """The input file of a mesh under the loads and blocked plate components of a configuration.

    Parameters
    ----------
    mesh : TetMesh
        With faces "base", "tip" and "chamber <name>". Node and element k of the mesh are k + 1 in the file. For half a
        body the whole is written, whose first nodes and elements are those of the half.
    at : Configuration
        Loads and blocks, on the model of this mesh; supports other than the clamped base are not written.
    increment : float
        Fraction of the load in the first increment.
    tolerance : float
        Largest residual over the mean force at which an increment has converged. The default is that of CalculiX:
        with 1e-6 it reduces its increments to 0.003 of the load.

    Raises
    ------
    ProblemError
        If a rubber is of a model that neither program has, for fibres, and for sheets that wrinkle.
    """
    mesh, at = as_whole(mesh, at)
    parts = (body_lines(mesh), _supports(mesh, at), rubber_lines(mesh, at), _sheet_lines(mesh, at))
    return "\n".join([*(line for part in parts for line in part), *_step(mesh, at, increment, tolerance), ""])


def as_whole(mesh: TetMesh, at: Configuration) -> tuple[TetMesh, Configuration]:
    """The mesh and configuration of the whole body from those of a part of it; whole ones are returned unchanged."""
    if not mesh.part:
        return mesh, at
    whole = whole_of(at.model, mesh)
    return whole.image.mesh, whole.configuration(at)


def body_lines(mesh: TetMesh) -> Iterator[str]:
    """Nodes (set ALL), elements (set BODY, and one for each region), and the nodes of the sets BASE and TIP."""
    yield "*HEADING"
    yield "pneumorph: units mm, N, MPa, t, s"
    yield "*NODE, NSET=ALL"
    yield from (f"{k}, {x:.12e}, {y:.12e}, {z:.12e}" for k, (x, y, z) in enumerate(mesh.points, 1))
    yield "*ELEMENT, TYPE=C3D10, ELSET=BODY"
    yield from (", ".join(map(str, [k, *(tet + 1)])) for k, tet in enumerate(mesh.tets, 1))
    for number, (name, elements) in enumerate(mesh.regions.items(), 1):
        yield f"** the region {name}"
        yield f"*ELSET, ELSET={_part(mesh, number)}"
        yield from _rows(np.sort(elements) + 1)
    yield "*NSET, NSET=BASE"
    yield from _rows(np.unique(mesh.faces["base"]) + 1)
    if "tip" in mesh.faces:
        yield "*NSET, NSET=TIP"
        yield from _rows(np.unique(mesh.faces["tip"]) + 1)


def _supports(mesh: TetMesh, at: Configuration) -> Iterator[str]:
    """The clamped base; the rigid plate with its springs and blocks."""
    centre, turn = plate_nodes(mesh)
    if at.model.plate:
        where = ", ".join(f"{x:.12e}" for x in tip_centre(mesh))
        yield "*NODE, NSET=PLATE"
        yield f"{centre}, {where}"
        yield f"{turn}, {where}"
        yield f"*RIGID BODY, NSET=TIP, REF NODE={centre}, ROT NODE={turn}"
        for element, (component, stiffness) in enumerate(_nonzero(np.asarray(at.loads.spring)), len(mesh.tets) + 1):
            node, freedom = (centre, turn)[component // 3], component % 3 + 1
            yield f"*ELEMENT, TYPE=SPRING1, ELSET=SPRING{component + 1}"
            yield f"{element}, {node}"
            yield f"*SPRING, ELSET=SPRING{component + 1}"
            yield f"{freedom}"
            yield f"{stiffness:.12e}"
    yield "*BOUNDARY"
    yield "BASE, 1, 3"
    for component in np.flatnonzero(at.blocked) if at.model.plate else ():
        held = float(at.loads.held[component])
        value = f", {held:.12e}" if held else ""
        yield f"{(centre, turn)[component // 3]}, {component % 3 + 1}, {component % 3 + 1}{value}"


def rubber_lines(mesh: TetMesh, at: Configuration) -> Iterator[str]:
    """The materials, and which elements are made of them.

    Raises
    ------
    ProblemError
        If a rubber is of a model that neither program has.
    """
    rubbers = at.model.rubbers
    for name, rubber in rubbers.items():
        if not can_hold(rubber):
            softened = rubber.isochoric is not energies.gent
            what = "softened rubber" if softened else "Gent's model"
            fix = 'export with state = "first pull"' if softened else "fit one of the others by pneumorph material fit"
            raise ProblemError(
                f"input files for Abaqus and CalculiX cannot hold {what}, which {name or REST} has: {fix}, or export "
                f"{'vtu' if softened else 'feb'}"
            )
    for number, name in enumerate(mesh.regions or rubbers, 1):
        material = f"RUBBER{number if mesh.regions else ''}"
        yield f"*MATERIAL, NAME={material}"
        yield from hyperelastic(rubbers[name])
        yield "*DENSITY"
        yield f"{rubbers[name].density:.12e}"
        yield f"*SOLID SECTION, ELSET={_part(mesh, number)}, MATERIAL={material}"


def _sheet_lines(mesh: TetMesh, at: Configuration) -> Iterator[str]:
    """Sheets as thin shells of isotropic elastic material; a face that is covered in part has a thinner one."""
    first = len(mesh.tets) + _MOST_SPRINGS + 1
    for number, (name, sheet) in enumerate(at.model.reinforcements.items(), 1):
        if not isinstance(sheet, Membrane) or sheet.wrinkling < LINEAR:
            raise ProblemError(
                f'input files for Abaqus and CalculiX cannot hold "{name}": their shells have no fibres and do not '
                "wrinkle; write wrinkling = 1 for a sheet that carries compression, or export vtu instead"
            )
        changed = np.asarray(at.loads.reinforcement)[number - 1]
        stiffness, coverage = sheet.stiffness + changed[0], sheet.coverage + changed[1]
        yield f"** the sheet {name}"
        yield f"*MATERIAL, NAME=SHEET{number}"
        yield "*ELASTIC"
        yield f"{stiffness / THICKNESS:.12e}, {float(sheet.poisson):.12e}"
        faces, shares = covered_faces(mesh.covers[name])
        for group, share in enumerate(np.unique(shares), 1):
            own, part = faces[shares == share], f"SHEET{number}P{group}"
            yield f"*ELEMENT, TYPE=S6, ELSET={part}"
            yield from (", ".join(map(str, [k, *(face + 1)])) for k, face in enumerate(own, first))
            yield f"*SHELL SECTION, ELSET={part}, MATERIAL=SHEET{number}"
            yield f"{THICKNESS * coverage * share:.12e}"
            first += len(own)


def covered_faces(cover: Covered) -> tuple[np.ndarray, np.ndarray]:
    """Faces (nf, 6) under a cover, each once, and the covered share (nf,) of each, to six digits."""
    faces, which = np.unique(cover.nodes, axis=0, return_inverse=True)
    # The weights of a whole triangle add up to its area in its own coordinates, 1/2.
    shares = 2 * np.bincount(which.ravel(), cover.points[..., 2].sum(axis=1), len(faces))
    kept = shares.round(6) > 0
    return faces[kept], shares[kept].round(6)


def _part(mesh: TetMesh, number: int) -> str:
    """The name of the set of elements of a region, numbered from 1; a body of one rubber is one."""
    return f"REGION{number}" if mesh.regions else "BODY"


def _step(mesh: TetMesh, at: Configuration, increment: float, tolerance: float) -> Iterator[str]:
    yield "*STEP, NLGEOM, INC=1000"
    yield "*STATIC"
    yield f"{increment:g}, 1., 1e-4, 1."
    if at.model.reinforcements:
        # With shells CalculiX converges slowly: more iterations are allowed before it cuts an increment.
        yield "*CONTROLS, PARAMETERS=TIME INCREMENTATION"
        yield "40, 60, 9, 200, 10, 4, , 15, , "
    yield "*CONTROLS, PARAMETERS=FIELD"
    yield f"{tolerance:g}, 1e30"
    for name, pressure in zip(at.model.chambers, np.asarray(at.loads.pressure), strict=True):
        if pressure:
            if at.enclosed is not None and name in at.enclosed.chambers:
                yield f"** chamber {name} is filled or sealed: its pressure here is the one found, and stays as it is"
            yield "*DLOAD"
            elements, faces = element_faces(mesh, mesh.faces[f"chamber {name}"])
            yield from (f"{e + 1}, P{f + 1}, {pressure:.12e}" for e, f in zip(elements, faces, strict=True))
    acceleration = np.asarray(at.loads.acceleration)
    if acceleration.any():
        size = float(np.linalg.norm(acceleration))
        direction = ", ".join(f"{part:.12e}" for part in acceleration / size)
        yield "*DLOAD"
        yield f"BODY, GRAV, {size:.12e}, {direction}"
    if at.model.plate and np.any(at.loads.wrench):
        yield "*CLOAD"
        for component, load in _nonzero(np.asarray(at.loads.wrench)):
            yield f"{plate_nodes(mesh)[component // 3]}, {component % 3 + 1}, {load:.12e}"
    for part in ("ALL", "PLATE") if at.model.plate else ("ALL",):
        yield f"*NODE PRINT, NSET={part}"
        yield "U"
    yield "*END STEP"


def plate_nodes(mesh: TetMesh) -> tuple[int, int]:
    """Numbers, in the file, of the plate's reference node and of the node for its rotation."""
    return len(mesh.points) + 1, len(mesh.points) + 2


def tip_centre(mesh: TetMesh) -> np.ndarray:
    """Centroid (3,) of the tip face, mm."""
    places, normals = area_vectors(mesh.points, mesh.faces["tip"])
    area = np.linalg.norm(normals, axis=-1)
    return np.einsum("fg,fgd->d", area, places) / area.sum()


def element_faces(mesh: TetMesh, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Elements and their faces (0…3, see `FACES`) for triangles (nf, 6); triangles without an element are left out."""
    count = len(mesh.points)

    def keys(corners: np.ndarray) -> np.ndarray:
        a, b, c = np.moveaxis(np.sort(corners.astype(np.int64), axis=-1), -1, 0)
        return (a * count + b) * count + c

    of_elements = keys(mesh.tets[:, FACES]).ravel()
    order = np.argsort(of_elements)
    wanted = keys(triangles[:, :3])
    place = np.searchsorted(of_elements, wanted, sorter=order).clip(max=len(order) - 1)
    owner = order[place][of_elements[order[place]] == wanted]
    return owner // 4, owner % 4


def _rows(numbers: np.ndarray) -> Iterator[str]:
    """Lines of numbers, sixteen per line, the most that the format allows."""
    for start in range(0, len(numbers), 16):
        yield ", ".join(map(str, numbers[start : start + 16]))


def _nonzero(components: np.ndarray) -> Iterable[tuple[int, float]]:
    return [(index, float(value)) for index, value in enumerate(components) if value]
