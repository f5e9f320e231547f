"""Build the mechanical model of a mesh, and models that differ from another in some terms or supports."""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.linalg import block_diag

from pneumorph.mechanics.assembly.model import Model
from pneumorph.mechanics.assembly.potential import Group, Potential, grouped
from pneumorph.mechanics.assembly.sparsity import build_sparsity, touching
from pneumorph.mechanics.assembly.tip import Tied, Tip
from pneumorph.mechanics.contact.contact import Contact
from pneumorph.mechanics.contact.free import Carried, Resting, resting
from pneumorph.mechanics.elements import element
from pneumorph.mechanics.elements.energy import Term
from pneumorph.mechanics.elements.loading import CapPressure, ChamberPressure, Plate, Weight
from pneumorph.mechanics.elements.reinforcement import Reinforcement, connect_covered
from pneumorph.mechanics.elements.seal import SealPressure
from pneumorph.mechanics.elements.solid import Solid
from pneumorph.mechanics.elements.terms import Connectivity, connect
from pneumorph.mechanics.material.rubber import Rubber
from pneumorph.mesh.tets import TetMesh, chambers_of
from pneumorph.symmetry.operations import NORMALS
from pneumorph.symmetry.part import Part, even_of, odd_of, onwards, turns_of


def build_model(
    mesh: TetMesh,
    rubber: Rubber | Mapping[str, Rubber],
    plate: bool = True,
    supports: np.ndarray | None = None,
    mixed: bool = False,
    weight: bool = True,
    contact: Contact | None = None,
    reinforcements: Mapping[str, Reinforcement] | None = None,
    seals: Mapping[str, SealPressure] | None = None,
) -> Model:
    """Build the model of a mesh.

    Parameters
    ----------
    mesh : TetMesh
        Faces "base" (clamped), "tip" (bonded to the plate) and "chamber <name>" (pressurised), as far as present. Nodes
        on "mirror <plane>" stay in that plane, and those of a sector on the axis stay there.
    rubber : Rubber, or dict of them by the mesh's regions
    plate : bool
        False leaves the tip face free.
    supports : (N, 3) bool, optional
        Displacement components fixed at zero; by default all three on the face "base".
    mixed : bool
        Elements with hydrostatic unknowns π, linear in each element and continuous in each region, for nearly
        incompressible rubbers.
    weight : bool
        Whether accelerations act; without them the term is left out, which saves time.
    contact : Contact, optional
        What the surface may touch.
    reinforcements : dict of Reinforcement, optional
        What lies under the covers of the mesh, by their names.
    seals : dict of SealPressure, optional
        The planes on which the rims of chambers lie, by the names of these, which then have no caps.

    Raises
    ------
    ValueError
        If the rubbers do not match the regions of the mesh, or the regions do not cover each element exactly once, or
        the reinforcements do not match the covers.
    """
    count = len(mesh.points)
    rubbers, regions = _regions(mesh, rubber)
    reinforced = dict(reinforcements or {})
    if set(reinforced) != set(mesh.covers):
        raise ValueError(
            f"reinforcements {', '.join(reinforced) or 'none'}, but the mesh has {', '.join(mesh.covers) or 'none'}"
        )
    if supports is None:
        supports = np.zeros((count, 3), bool)
        supports[np.unique(mesh.faces["base"])] = True
    supports = supports.copy()
    for plane in mesh.mirrors:
        supports[mesh.mirror_nodes(plane), NORMALS[plane]] = True
    supports[mesh.axis, :2] = True
    on_tip = np.zeros(count, bool)
    if plate:
        on_tip[np.unique(mesh.faces["tip"])] = True
    images, sources = mesh.tied
    source = np.arange(count)
    source[images] = sources
    off = ~on_tip[images]
    tied = Tied(images[off], sources[off], onwards(turns_of(mesh.part)))
    own = ~on_tip & (source == np.arange(count))
    number = np.where(own, np.cumsum(own) - 1, -1)
    number[tied.nodes] = number[tied.sources]
    chambers = tuple(chamber for face in mesh.faces for chamber in chambers_of(face))
    sealed = dict(seals or {})
    rims = [(connect(mesh.caps[name][:, 1:], data=_shares(mesh, chambers, [name])), sealed[name]) for name in sealed]
    tets, cavities, caps = connect(mesh.tets), _cavities(mesh), _caps(mesh, chambers, sealed)
    terms = []
    for row, (name, solid) in enumerate(rubbers.items()):
        tets_of = mesh.tets[regions[name]]
        places = row * count + source[tets_of[:, :4]] if mixed else None
        connectivity = connect(tets_of, places)
        energy_density = element.mixed(solid.isochoric) if mixed else solid.energy
        terms.append(Term(connectivity, Solid(energy_density, np.array(solid.parameters, dtype=float))))
        if weight:
            terms.append(Term(connectivity, Weight(np.asarray(solid.density))))
    if cavities.count:
        terms.append(Term(cavities, ChamberPressure()))
    if caps.count:
        terms.append(Term(caps, CapPressure()))
    on_planes = tuple(Term(rim, energy) for rim, energy in rims)
    terms += on_planes
    if plate:
        terms.append(Term(connect(np.zeros((1, 0), int), plate=True), Plate()))
    if contact is not None:
        terms += _obstacles(contact)
    terms += [
        Term(connect_covered(mesh.covers[name]), replace(energy, number=row))  # pyright: ignore[reportArgumentType]
        for row, (name, energy) in enumerate(reinforced.items())
    ]
    tip = Tip(np.flatnonzero(on_tip), mesh.faces.get("tip", np.zeros((0, 6), int)), even_of(mesh.part), tied)
    return Model(
        rubbers=rubbers,
        regions=regions,
        reinforcements=reinforced,
        chambers=chambers,
        plate=plate,
        mixed=mixed,
        weight=weight,
        nodes=count,
        tets=tets,
        cavities=cavities,
        caps=caps,
        seals=on_planes,
        face=connect(tip.triangles),
        part=mesh.part,
        supports=supports,
        independent=np.flatnonzero(own),
        source=source,
        **_assembled(terms, tip, contact, number, len(rubbers) * count if mixed else 0, supports, plate, mesh.part),
    )


def with_terms(model: Model, terms: Iterable[Term]) -> Model:
    """The model with other terms, whose elements may couple other unknowns than before: its sparsity is rebuilt.

    Unknowns, states and supports stay the same. It needs a new `Tangent`, which repeats the symbolic analysis.
    """
    hydrostatics, number = len(model.sparsity.rank), model.sparsity.number
    contact, supports = model.potential.contact, model.supports
    return replace(
        model, **_assembled(terms, model.tip, contact, number, hydrostatics, supports, model.plate, model.part)
    )


def with_more(model: Model, terms: Iterable[Term], like: Connectivity) -> Model:
    """The model with more terms, over connectivities with the nodes of `like`: its sparsity stays.

    Every element of that has nodes of a single element of the model, as a face has those of a tetrahedron.
    A `Tangent` of the model serves the other one too.
    """
    terms, number = tuple(terms), model.sparsity.number
    groups, potential = grouped(terms), model.potential
    return replace(
        model,
        terms=(*model.terms, *terms),
        potential=potential._replace(
            groups=(*potential.groups, *groups), near_tip=(*potential.near_tip, *near_tip(groups, number))
        ),
        like=(*model.like, *[like for _ in groups]),
    )


def with_groups(model: Model, groups: Sequence[Group]) -> Model:
    """The model with other groups over connectivities with the same nodes; a `Tangent` of the model serves it too."""
    return replace(
        model,
        terms=tuple(Term(group.connectivity, energy) for group in groups for energy in group.energies),
        potential=model.potential._replace(groups=tuple(groups), near_tip=near_tip(groups, model.sparsity.number)),
    )


def with_fixed(model: Model, fixed: np.ndarray) -> Model:
    """The model with other unknowns (n,) bool fixed at zero; a `Tangent` of the model serves it too."""
    return replace(model, fixed=fixed)


def _assembled(
    terms: Iterable[Term],
    tip: Tip,
    contact: Contact | None,
    number: np.ndarray,
    hydrostatics: int,
    supports: np.ndarray,
    plate: bool,
    part: Part,
) -> dict[str, Any]:
    """The fields of a model that follow from its terms."""
    terms = tuple(terms)
    groups = grouped(terms)
    held = [] if contact is None else [free.held for free in contact.free.values()]
    connectivities = tuple(group.connectivity for group in groups)
    common = build_sparsity(connectivities, number, tip.tied.nodes, hydrostatics, len(held))
    still = odd_of(part) if plate else np.ones(6, bool)
    own = number >= 0
    own[tip.tied.nodes] = False
    fixed = np.concatenate([supports[own].ravel(), np.zeros(len(common.corners), bool), *held, still])
    return {
        "terms": terms,
        "potential": Potential(groups, near_tip(groups, number), tip, contact),
        "sparsity": common,
        "like": connectivities,
        "fixed": fixed,
    }


def _obstacles(contact: Contact) -> Iterator[Term]:
    """The terms of obstacles, and of those that are free."""
    rows = {name: row for row, name in enumerate(contact.free)}
    for number, (name, obstacle) in enumerate(contact.obstacles.items()):
        for energy in obstacle.energies(number, rows.get(name)):
            yield Term(contact.surface, energy)
    alone = connect(np.zeros((1, 0), int), objects=True)
    for number, (name, free) in zip(contact.rows, contact.free.items(), strict=True):
        yield Term(alone, Carried(free.mass, free.spring, free.lever, free.spin, number, rows[name]))
    for name, number, row, under, plane in resting(contact.obstacles, contact.free):
        free, center = contact.free[name], np.asarray(contact.obstacles[name].center)
        yield Term(alone, Resting(free.points, free.area, free.radius, center, number, row, plane, under))


def _regions(mesh: TetMesh, rubber: Rubber | Mapping[str, Rubber]) -> tuple[dict[str, Rubber], dict[str, np.ndarray]]:
    """Rubbers and element numbers by region."""
    if isinstance(rubber, Rubber):
        return {"": rubber}, {"": np.arange(len(mesh.tets))}
    if set(rubber) != set(mesh.regions):
        raise ValueError(f"rubbers for {', '.join(rubber)}, but the mesh has {', '.join(mesh.regions) or 'no regions'}")
    regions = {name: np.sort(mesh.regions[name]) for name in rubber}
    if not np.array_equal(np.sort(np.concatenate([*regions.values()])), np.arange(len(mesh.tets))):
        raise ValueError("every element of the mesh must be in one region, and in no other")
    return dict(rubber), regions


def _cavities(mesh: TetMesh) -> Connectivity:
    """The chambers' triangles, with their shares in the chambers' volumes.

    A share is −1 in the column of its chamber (normals point into the cavity), or −1/k in those of k chambers that are
    images of each other, of which the mesh has one; else 0.
    """
    triangles = [(chambers_of(face), nodes) for face, nodes in mesh.faces.items() if chambers_of(face)]
    chamber = np.concatenate([*(nodes for _, nodes in triangles), np.zeros((0, 6), int)])
    shares = [np.full((len(names), len(nodes)), -1.0 / len(names)) for names, nodes in triangles]
    return connect(chamber, data=np.asarray(block_diag(*shares)).T if shares else np.zeros((0, 0)))


def _caps(mesh: TetMesh, chambers: tuple[str, ...], sealed: Container[str]) -> Connectivity:
    """The parts of the caps on ports, but for sealed ones, with their shares in the chambers' volumes."""
    names = [name for name in mesh.caps if name not in sealed]
    nodes = np.concatenate([np.zeros((0, 4), int), *(mesh.caps[name] for name in names)])
    return connect(nodes, data=_shares(mesh, chambers, names))


def _shares(mesh: TetMesh, chambers: tuple[str, ...], names: Sequence[str]) -> np.ndarray:
    """Shares (c, C) of the parts of caps in the volumes of all chambers, see `_cavities`; a cap has their names."""
    shares = np.zeros((len(names), len(chambers)))
    for row, name in enumerate(names):
        own = name.split()
        shares[row, [chambers.index(each) for each in own]] = -1.0 / len(own)
    return np.repeat(shares, [len(mesh.caps[name]) for name in names], axis=0)


def near_tip(groups: Iterable[Group], number: np.ndarray) -> tuple[Group, ...]:
    """The groups, restricted to elements that depend on the plate."""
    near = []
    for elements, energies in groups:
        nodes, hydrostatics, data = (
            rows[: elements.count] for rows in (elements.nodes, elements.hydrostatics, elements.data)
        )
        chosen = np.flatnonzero(touching(nodes, number, elements.plate))
        if len(chosen):
            near.append(
                Group(
                    connect(nodes[chosen], hydrostatics[chosen], data[chosen], elements.plate, elements.objects),
                    energies,
                )
            )
    return tuple(near)
