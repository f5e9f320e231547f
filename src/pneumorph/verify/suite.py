"""All verification cases."""

from __future__ import annotations

from functools import partial

from pneumorph.verify import (
    beams,
    contact,
    element,
    homogeneous,
    inflation,
    memory,
    ring,
    rubbers,
    solvers,
    work,
    wound,
)
from pneumorph.verify.actuator import bellows, linear_actuator, several_rubbers
from pneumorph.verify.verdict import Case

_RADIAL = "radial boundary-value problem, by SciPy's collocation to 1e-10 (verify/radial.py)"

_WOUND = "infinite tube in cylindrical coordinates, by polynomials of degree 6 (verify/wound.py)"

_UNIAXIAL = "uniaxial tension of each rubber, as in the cases of homogeneous tension"

_INCOMPRESSIBLE = "closed form of the incompressible neo-Hookean solid (Ogden 1984, ch. 5)"


def cases() -> tuple[Case, ...]:
    """All cases, in the order in which they are reported."""
    return (
        Case("patch test", element.patch_test, "exact for any sound element (Irons & Razzaque 1972)"),
        Case("rigid rotation", element.rigid_rotation, "frame indifference: exactly zero"),
        *homogeneous.cases(),
        Case("radial references", inflation.radial_references, "the same problem solved independently, to 1e-8"),
        Case("thick sphere", inflation.thick_sphere, _RADIAL),
        Case("plane-strain tube", inflation.plane_strain_tube, _RADIAL),
        Case("incompressible sphere and tube", inflation.incompressible, _INCOMPRESSIBLE),
        Case("limit points of spheres", inflation.limit_points, f"maximum of the {_INCOMPRESSIBLE}"),
        Case("small load", inflation.lame_limit, "Lamé's solutions (Timoshenko & Goodier 1970, arts. 28 and 142)"),
        Case("order of convergence", inflation.convergence, f"order 3 of quadratic elements; field by {_RADIAL}"),
        Case("elastica references", beams.elastica_reference, "Mattiasson 1981, table I"),
        Case("cantilever under a moment", beams.moment, "Euler's elastica: an arc of a circle"),
        Case("cantilever under a force", beams.force, "Euler's elastica, by SciPy's collocation to 1e-9"),
        Case("energy balance", work.energy_balance, "first law: ∫p dV by Gauss quadrature with six points"),
        Case("blocked force and springs", work.blocked_force, "first law: ∫d dF by Gauss quadrature with six points"),
        Case("relaxation, held stretch", memory.held, "Prony series times the elastic stress (Simo 1987)"),
        Case(
            "relaxation, cycles", memory.cycled, "hereditary integral of an incompressible pull, by adaptive quadrature"
        ),
        Case("softening, cycles", memory.softened, "Ogden and Roxburgh 1999, of an incompressible pull"),
        Case("contact, patch test", contact.patch_test, "a homogeneous state with the stress of uniaxial tension"),
        Case("contact, sphere on plane", contact.hertz, "Hertz (Johnson 1985, ch. 4)"),
        Case("contact, energy balance", contact.energy_balance, "first law: ∫p dV by Gauss quadrature with six points"),
        Case("contact, free ball", contact.free_ball, "statics: the weight of the ball, and of ball and tube"),
        Case("contact, ring on itself", ring.self_contact, "CalculiX's contact face to face, C3D10 on the same nodes"),
        Case("two rubbers in series", rubbers.in_series, _UNIAXIAL),
        Case("two rubbers side by side", rubbers.side_by_side, _UNIAXIAL),
        Case("fibres, magic angle", wound.magic_angle, _WOUND),
        Case("fibres, one family", wound.one_family, _WOUND),
        Case("tube in a sheet", wound.covered_tube, _WOUND),
        Case("bar with a sheet on one face", beams.layered, "beam of two materials (Timoshenko & Gere 1972, ch. 5)"),
        Case(
            "tube with a sheet on one side", wound.half_covered, "beam of two materials (Timoshenko & Gere 1972, ch. 5)"
        ),
        *(
            Case(f"{solver}, {word}", partial(compare, body, problem=problem), source)
            for word, body, problem in (
                ("starting tube", solvers.start, linear_actuator),
                ("bellows", bellows, linear_actuator),
                ("tube of three rubbers", solvers.start, several_rubbers),
            )
            for solver, compare, source in (
                ("NGSolve", solvers.ngsolve, "NGSolve's symbolic forms on the same curved elements and points"),
                ("CalculiX", solvers.calculix, "CalculiX's C3D10 on the same nodes, with its own quadrature"),
            )
        ),
    )
