"""Every term of the potential: energy, residual, tangent, product, shape and load derivatives are of one function."""

from dataclasses import dataclass, replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.tree_util import register_dataclass
from scipy import sparse

from pneumorph.mechanics import Model, Rubber, Tangent, build_loads, build_model, configure, neo_hookean_rubber
from pneumorph.mechanics.assembly import potential as kernels
from pneumorph.mechanics.assembly import products
from pneumorph.mechanics.assembly.build import with_terms
from pneumorph.mechanics.assembly.displacement import displacement
from pneumorph.mechanics.assembly.hessian import contact_in_pairs, tangent
from pneumorph.mechanics.contact.contact import Contact
from pneumorph.mechanics.contact.free import Carried, Free, Resting
from pneumorph.mechanics.contact.friction import Friction, Grip
from pneumorph.mechanics.contact.implicit import Barrier, Implicit
from pneumorph.mechanics.contact.pairs import Pairs
from pneumorph.mechanics.contact.samples import sample_places, surface_of
from pneumorph.mechanics.contact.shapes import Box, Cylinder, Plane, RigidMesh, Sphere
from pneumorph.mechanics.contact.triangulated import Triangulated
from pneumorph.mechanics.elements.energy import ElementEnergy, Term
from pneumorph.mechanics.elements.loading import CapPressure, ChamberPressure, Plate, Weight
from pneumorph.mechanics.elements.reinforcement import Fibres, Membrane
from pneumorph.mechanics.elements.several import TOGETHER
from pneumorph.mechanics.elements.solid import Solid
from pneumorph.mechanics.elements.terms import connect
from pneumorph.mechanics.material import energies
from pneumorph.mechanics.material.memory import Memory, Past, Softening
from pneumorph.mechanics.solve.memory_sweep import with_memory
from pneumorph.mesh import Covered
from pneumorph.mesh.tets import RULE
from pneumorph.verify.solids import tube

pytestmark = pytest.mark.usefixtures("unoptimised")

SOFT, STIFF = neo_hookean_rubber(0.49, 4.80, 1.1e-9), neo_hookean_rubber(1.3, 9.0, 1.4e-9)
NEARLY_INCOMPRESSIBLE = {
    "inner": neo_hookean_rubber(0.49, 490.0, 1.1e-9),
    "outer": neo_hookean_rubber(1.3, 520.0, 1.4e-9),
}
OGDEN = Rubber(energies.ogden, (0.3, 1.7, 0.2, -2.3, 4.8), 1.1e-9)


@partial(register_dataclass, data_fields=["stiffness"], meta_fields=[])
@dataclass(frozen=True, eq=False)
class Bonds(ElementEnergy):
    """½ k (|x_b − x_a| − s)² + ½ k |u_a − c|² of pairs of nodes, s their data: a term that is not in the package."""

    stiffness: jax.Array

    def energies(self, local, loads):
        x = local.X + local.u
        length = jnp.sqrt(jnp.sum((x[:, 1] - x[:, 0]) ** 2, axis=1))
        pulled = jnp.sum((local.u[:, 0] - local.plate[:3]) ** 2, axis=1)
        return 0.5 * self.stiffness * ((length - local.data[:, 0]) ** 2 + pulled)


def bonds(pairs) -> Term:
    return Term(connect(np.array(pairs), data=np.full((len(pairs), 1), 2.0), plate=True), Bonds(jnp.asarray(3.0)))


def layered(counts=(2, 6, 2)):
    """A short tube of two layers, 4 to 6 and 6 to 8 mm."""
    mesh = tube(4, 8, 8, counts)
    outside = np.linalg.norm(mesh.points[mesh.tets[:, :4]].mean(axis=1)[:, :2], axis=1) > 5.9
    return replace(mesh, regions={"inner": np.flatnonzero(~outside), "outer": np.flatnonzero(outside)})


MESH = layered()
FREE = np.zeros(MESH.points.shape, bool)


KINDS = (Solid, Weight, ChamberPressure, Plate, Barrier, Membrane, Fibres)


def built(rubbers, mixed=False, kinds=KINDS, more=(), plate=True, contact=None, laid=None) -> Model:
    """A tube without supports whose potential has terms of these kinds alone, and more."""
    mesh = replace(MESH, covers=dict.fromkeys(laid or {}, COVER))
    whole = build_model(mesh, rubbers, supports=FREE, mixed=mixed, plate=plate, contact=contact, reinforcements=laid)
    chosen = [term for term in whole.terms if isinstance(term.energy, kinds)]
    return with_terms(whole, [*chosen, *more])


SURFACE = surface_of(MESH)
SHAPES = {
    "plane": Plane(np.array([9.0, 0, 0]), np.array([-1.0, 0, 0])),
    "sphere": Sphere(np.array([0.0, 1.0, 13.0]), 4.0),
    "cylinder": Cylinder(np.array([11.0, 0, 5.0]), np.array([0.0, 0.6, 0.8]), 1.5, 3.0),
    "box": Box(np.array([9.0, 9.0, 4.0]), np.array([3.0, 2.5, 3.0])),
    "wedge": Sphere(np.array([0.0, 0.0, 99.0]), 1.0),
}


def touching(*shapes, own=None, **guards) -> Contact:
    return Contact(
        SURFACE, {name: Implicit(SURFACE, SHAPES[name], 2.5, 0.3) for name in (*shapes, *guards)}, guards, own
    )


def crowded(*rigid, own=True) -> Pairs:
    """Contact whose activation distance is long enough for neighbours to touch; the mesh was made much larger."""
    return Pairs(SURFACE, 5.0 * MESH.points, own, rigid, 0.9, 0.3)


def cover() -> Covered:
    """All of the exterior, with a direction that is a constant of each face."""
    faces = MESH.faces["exterior"]
    along = np.random.default_rng(1).uniform(0.2, 1.0, (len(faces), 1, 2))
    points = np.concatenate([RULE, np.full((3, 1), 1 / 6)], axis=1)
    parts = np.broadcast_to(points, (len(faces), 3, 3)), np.broadcast_to(along, (len(faces), 3, 2))
    return Covered(faces, np.concatenate(parts, axis=-1))


COVER = cover()
LAID = {"sheet": Membrane(40.0, 0.3, 0.05), "braid": Fibres(30.0, 0.7, 0.05, (1, -1))}
WEDGE = RigidMesh(
    np.array([[8.6, -9, 3], [8.6, 9, 4], [15.0, 0, 30], [2.0, -20, 8.3], [2.0, 20, 8.5], [-9.0, 0, 30]]),
    np.array([[0, 1, 2], [3, 4, 5]]),
)


def lobed() -> Contact:
    """A closed surface of triangles with hollows, beside the end and the side of the tube."""
    found = SHAPES["sphere"].mesh(0.8)
    away = found.points - SHAPES["sphere"].center
    angle = np.arctan2(away[:, 1], away[:, 0])
    lobes = RigidMesh(away * (1.0 + 0.35 * np.cos(3.0 * angle))[:, None] + np.array([4.0, 1.0, 13.0]), found.triangles)
    return Contact(SURFACE, {"lobes": Triangulated(SURFACE, lobes, 2.5, 0.3)}, {}, None)


def loose() -> Contact:
    """Free obstacles of every kind of contact, with points above a plane that moves, and a lever of their weight."""
    rng, lobes = np.random.default_rng(5), lobed().obstacles["lobes"]

    def free(x, z) -> Free:
        springs, above = np.array([0.1, 0.2, 0.3, 4, 5, 6]), rng.uniform(-0.3, 0.3, (4, 3)) + np.array([x, 0.0, z])
        return Free(2e-5, springs, np.zeros(6, bool), np.array([0.3, -0.2, 0.5]), 2 * np.eye(3), above, np.ones(4), 0.1)

    obstacles = {name: Implicit(SURFACE, SHAPES[name], 2.5, 0.3) for name in ("plane", "cylinder", "wedge")}
    assert isinstance(lobes, Triangulated)
    obstacles["lobes"] = Triangulated(SURFACE, lobes.mesh, 2.5, 0.3, (4.0, 1.0, 13.0))
    guards = {"wedge": crowded(WEDGE, own=False)}
    return Contact(
        SURFACE,
        obstacles,
        guards,
        None,
        {"cylinder": free(7.5, 5.0), "lobes": free(7.5, 13.0), "wedge": free(6.0, 99.0)},
    )


def sliding() -> Term:
    """Friction of points that have slipped by less and by more than what mobilises all of it."""
    random, points = np.random.default_rng(3), sample_places(SURFACE, MESH.points)
    normal = random.standard_normal(points.shape)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    anchor = points + 0.1 * random.standard_normal(points.shape)
    grip = Grip(random.uniform(0.0, 0.1, points.shape[:2]), anchor, normal)
    return Term(replace(SURFACE, data=grip.data()), Friction(0.4, 0.15, 0))


def capped() -> Term:
    """Parts of a cap between nodes of the tube."""
    nodes = np.array([[0, 7, 40, 12], [0, 40, 90, 31], [0, 3, 90, 55]])
    return Term(connect(nodes, data=-np.ones((3, 1))), CapPressure())


def remembering(rubber: Rubber, mixed: bool) -> Model:
    """A solid in a step after a past at random, some of whose points are stretched more than before."""
    memory = Memory(rubber.isochoric, rubber.parameters, (0.2, 0.1), (1.0, 9.0), Softening(0.5, 0.02, 0.1))
    of = built(replace(rubber, memory=memory), mixed, kinds=Solid)
    random, count = np.random.default_rng(7), of.elements
    stress, parts = 0.05 * random.standard_normal((6, 4, count)), 0.05 * random.standard_normal((2, 6, 4, count))
    return with_memory(of, {"": Past(random.uniform(0.0, 0.1, (4, count)), stress, parts)}, 2.0)


TWO = {"inner": SOFT, "outer": STIFF}
CASES = {
    "solid": partial(built, SOFT, kinds=Solid),
    "solid by stretches": partial(built, OGDEN, kinds=Solid),
    "mixed solid": partial(built, NEARLY_INCOMPRESSIBLE["inner"], True, kinds=Solid),
    "two rubbers": partial(built, TWO, kinds=Solid),
    "two mixed rubbers": partial(built, NEARLY_INCOMPRESSIBLE, True, kinds=Solid),
    "solid that remembers": partial(remembering, SOFT, False),
    "mixed solid that remembers": partial(remembering, OGDEN, True),
    "weight": partial(built, TWO, kinds=Weight),
    "pressure": partial(built, SOFT, kinds=ChamberPressure),
    "cap of a port": partial(built, SOFT, kinds=(), more=[capped()]),
    "plate": partial(built, SOFT, kinds=Plate),
    "bonds": partial(built, SOFT, kinds=(), more=[bonds([[0, 40], [7, 90]])]),
    "obstacles": partial(built, SOFT, kinds=Barrier, contact=touching("plane", "sphere", "cylinder", "box")),
    "free obstacles": partial(built, SOFT, kinds=(Barrier, Carried, Resting), contact=loose()),
    "self-contact": partial(built, SOFT, kinds=Plate, contact=touching(own=crowded())),
    "contact with rigid meshes": partial(built, SOFT, kinds=Plate, contact=touching(wedge=crowded(WEDGE, own=False))),
    "obstacle of triangles": partial(built, SOFT, kinds=Plate, contact=lobed()),
    "taut sheet": partial(built, SOFT, kinds=Membrane, laid={"sheet": Membrane(40.0, 0.3, 1.0)}),
    "wrinkled sheet": partial(built, SOFT, kinds=Membrane, laid={"sheet": LAID["sheet"]}),
    "braid": partial(built, SOFT, kinds=Fibres, laid={"braid": LAID["braid"]}),
    "helix": partial(built, SOFT, kinds=Fibres, laid={"helix": Fibres(30.0, -0.4, 1.0, (1,))}),
    "friction": partial(built, SOFT, kinds=Plate, more=[sliding()], contact=touching("plane")),
    "everything": partial(
        built,
        NEARLY_INCOMPRESSIBLE,
        True,
        more=[bonds([[0, 40], [7, 90]])],
        contact=touching("plane", own=crowded(), wedge=crowded(WEDGE, own=False)),
        laid=LAID,
    ),
}


MOVED = (0.02, -0.03, 0.04, 0.02, -0.015, 0.06)


class Place:
    """A model at a state that is no equilibrium, and directions to go in."""

    def __init__(self, of: Model):
        random = np.random.default_rng(0)
        self.model = of
        self.loads = build_loads(
            of,
            {"A": 0.04},
            acceleration=np.array([9810.0, -4000.0, 2000.0]),
            spring=np.array([0.1, 0.2, 0.5, 3, 20, 7]),
            wrench=np.array([0.01, 0.02, 0.1, 0.1, 0.3, 0.5]),
            moves=dict.fromkeys(of.contact.obstacles if of.contact else (), MOVED),
        )
        self.at = configure(of, MESH.points, self.loads)
        self.vector = 0.05 * random.standard_normal(of.size)
        self.change, self.adjoint = random.standard_normal((2, of.size))
        # The tangent of contact in pairs jumps where the nearest parts of surfaces are others.
        self.step = 5e-5 if of.potential.has_pairs else 2e-4 if of.contact else 2e-3
        self.dX = random.standard_normal(MESH.points.shape)
        self.dloads = jax.tree.map(lambda load: random.standard_normal(load.shape), self.loads)

    def evaluate(self, h=0.0, X=0.0, acting=0.0):
        """Π, R after steps along the directions of state, nodes and loads."""
        state = self.model.state(self.vector + h * self.change)
        given = jax.tree.map(lambda load, change: load + acting * change, self.loads, self.dloads)
        value, residual = kernels.value_and_residual(self.model.potential, self.at.X + X * self.dX, state, given)
        return float(value), self.model.vector(residual)

    def arguments(self):
        return self.model.potential, self.at.X, self.model.state(self.vector), self.loads

    def assembled(self):
        """The tangent as a whole sparse matrix."""
        of, common = self.model, self.model.sparsity
        data = tangent(of, self.at.X, of.state(self.vector), self.loads, np.zeros(6, bool))
        upper = sparse.csr_array((data, common.indices, common.indptr), shape=(of.size, of.size))
        upper = upper + sparse.csr_array(
            contact_in_pairs(of, self.at.X, of.state(self.vector), self.at.loads, of.fixed)
        )
        return upper + sparse.triu(upper, 1).T


def falls_with_the_square(function, slope, step):
    """Whether function(h) − function(0) − h·slope falls as h², by Taylor remainders; or is none at all."""
    start = function(0.0)
    steps = step * 0.5 ** np.arange(4)
    remainders = np.array([np.abs(function(h) - start - h * slope).max() for h in steps])
    if remainders.max() < 1e-9 * step * np.abs(slope).max() + 1e-15:
        return True
    rates = np.log2(remainders[:-1] / remainders[1:])
    return bool(np.all(np.abs(rates - 2) < 0.2))


@pytest.fixture(scope="module", params=CASES)
def place(request):
    return Place(CASES[request.param]())


def test_the_residual_is_the_slope_of_the_energy(place):
    slope = float(place.evaluate()[1] @ place.change)
    assert slope != 0
    assert falls_with_the_square(lambda h: place.evaluate(h)[0], slope, place.step)


def test_the_assembled_tangent_is_the_slope_of_the_residual(place):
    slope = place.assembled() @ place.change
    assert falls_with_the_square(lambda h: place.evaluate(h)[1], slope, place.step)
    product = products.tangent_product(*place.arguments(), place.model.state(place.change))
    assert np.abs(slope - place.model.vector(product)).max() <= 1e-11 * np.abs(slope).max()


def test_shape_and_load_derivatives_are_those_of_the_residual(place):
    w = place.adjoint
    ((by_nodes, by_loads),) = products.pullback(*place.arguments(), [place.model.state(w)])
    slope = float(np.sum(np.asarray(by_nodes) * place.dX))
    assert falls_with_the_square(lambda h: w @ place.evaluate(X=h)[1], slope, place.step)
    pushed = place.model.vector(products.shape_product(*place.arguments(), place.dX))
    assert w @ pushed == pytest.approx(slope, rel=1e-9, abs=1e-12)

    slope = sum(float(np.sum(a * b)) for a, b in zip(by_loads, place.dloads, strict=True))
    assert falls_with_the_square(lambda h: w @ place.evaluate(acting=h)[1], slope, place.step)
    pushed = place.model.vector(products.load_product(*place.arguments(), place.dloads))
    assert w @ pushed == pytest.approx(slope, rel=1e-9, abs=1e-12)


def test_several_adjoints_have_the_derivatives_of_each(place):
    adjoints = [place.model.state(factor * place.adjoint) for factor in (1.0, -2.0)]
    each = [products.pullback(*place.arguments(), [w])[0] for w in adjoints]
    for (by_nodes, by_loads), (own, of_loads) in zip(
        products.pullback(*place.arguments(), adjoints), each, strict=True
    ):
        assert by_nodes == pytest.approx(own, rel=1e-9, abs=1e-11 * np.abs(own).max())
        for one, other in zip(by_loads, of_loads, strict=True):
            np.testing.assert_array_equal(one, other)


def test_nothing_rides_on_a_free_tip():
    test_shape_and_load_derivatives_are_those_of_the_residual(Place(built(SOFT, plate=False)))


@pytest.mark.parametrize("name", ["solid", "solid by stretches", "two mixed rubbers", "solid that remembers"])
def test_the_fast_way_of_the_solid_is_the_general_one(name):
    """An energy that hides that it is a solid has its blocks made by JAX."""
    fast = Place(CASES[name]())
    state = fast.model.state(fast.vector)
    slow = Place(with_terms(fast.model, [Term(seen, Hidden(energy)) for seen, energy in fast.model.terms]))
    assert abs(fast.assembled() - slow.assembled()).max() < 1e-12 * abs(fast.assembled()).max()
    (seen, one), (_, other) = fast.model.terms[0], slow.model.terms[0]
    at = seen.local(fast.at.X, displacement(fast.model.tip, fast.at.X, state), state)
    for few, every in zip(*(each.node_blocks(seen, at, fast.loads) for each in (one, other)), strict=True):
        np.testing.assert_allclose(few, every, atol=1e-12 * abs(fast.assembled()).max())


@pytest.mark.parametrize("rubber, mixed", [(SOFT, False), (OGDEN, False), (NEARLY_INCOMPRESSIBLE["inner"], True)])
def test_more_elements_than_a_chunk_holds(rubber, mixed):
    """Whatever the solid's fast way gives, the general one gives too, over several chunks and their padding."""
    mesh = tube(4, 8, 8, (1, 8, 6))
    fast = build_model(mesh, rubber, mixed=mixed)
    assert len(fast.tets.chunks()) == 2
    slow = with_terms(fast, [Term(seen, Hidden(energy)) for seen, energy in fast.terms])
    random = np.random.default_rng(0)
    acting = build_loads(fast, {"A": 0.04}, acceleration=np.array([9810.0, 0, 0]))
    vector, change = 0.05 * random.standard_normal(fast.size), random.standard_normal(fast.size)
    dX = random.standard_normal(mesh.points.shape)
    state, along = fast.state(vector), fast.state(change)

    def everything(of: Model):
        arguments = of.potential, mesh.points, state, acting
        value, residual = kernels.value_and_residual(*arguments)
        yield value
        yield of.vector(residual)
        yield of.vector(products.tangent_product(*arguments, along))
        yield of.vector(products.shape_product(*arguments, dX))
        ((alone, _),) = products.pullback(*arguments, [along])
        several = products.pullback(*arguments, [of.state(factor * change) for factor in range(1, TOGETHER + 2)])
        yield from (alone, *(by_X for by_X, _ in several))

    for one, other in zip(everything(fast), everything(slow), strict=True):
        assert one == pytest.approx(other, rel=1e-9, abs=1e-11 * np.abs(other).max())


@partial(register_dataclass, data_fields=["inside"], meta_fields=[])
@dataclass(frozen=True, eq=False)
class Hidden(ElementEnergy):
    inside: ElementEnergy

    def energies(self, local, loads):
        return self.inside.energies(local, loads)


def test_a_term_may_see_other_unknowns_from_one_solve_to_the_next():
    """As contact does: the sparsity and the symbolic analysis are made again, state and unknowns stay."""
    before = built(SOFT, more=[bonds([[0, 90]])])
    after = with_terms(before, [*before.terms[:-1], bonds([[3, 50], [11, 100], [0, 60]])])
    assert after.size == before.size
    assert len(after.sparsity.indices) > len(before.sparsity.indices)
    place = Place(after)
    rhs = place.assembled() @ place.change
    solver = Tangent(after)
    found = solver.solve_at(place.at, after.state(place.vector), rhs)
    assert found == pytest.approx(place.change, abs=1e-8)
    with pytest.raises(ValueError, match="another model"):
        Tangent(before).factorise(place.at, after.state(place.vector))


def test_regions_must_share_the_elements_among_them():
    with pytest.raises(ValueError, match="inner, outer"):
        build_model(MESH, {"inner": SOFT})
    twice = replace(MESH, regions=MESH.regions | {"outer": np.arange(len(MESH.tets))})
    with pytest.raises(ValueError, match="in no other"):
        build_model(twice, TWO)
