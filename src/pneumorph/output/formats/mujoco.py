"""A model for MuJoCo: a chain of rigid links, driven by pressures in kPa. Units are m, kg, s, N and rad."""

from __future__ import annotations

from math import sqrt
from xml.sax.saxutils import quoteattr

import numpy as np

from pneumorph.surrogate.chain import Chain

DECAY = 0.05
"""s: the dampers are those of the springs times this. How rubber damps is not in a problem."""
STEPS = 5.0
"""Time steps in a radian of the fastest motion of a link on its spring."""
JOINTS = ("along", "about_x", "about_y", "about_z")
AXES = ("0 0 1", "1 0 0", "0 1 0", "0 0 1")


def mujoco_model(chain: Chain, title: str, mass: float, radius: float) -> str:
    """The text of a file in MuJoCo's format MJCF.

    Parameters
    ----------
    chain : Chain
    title : of the problem.
    mass : of the body, t.
    radius : of what is shown, mm.
    """
    lines = [
        f"<mujoco model={quoteattr(title or 'robot')}>",
        f"  <!-- {_said(chain)} -->",
        '  <compiler angle="radian" autolimits="true"/>',
        f"  <!-- Dampers are stiffness times {DECAY:g} s, an assumption. Joints rest where weight and loads bring "
        "them, so that gravity is not added. -->",
        f'  <option gravity="0 0 0" integrator="implicitfast" timestep="{_step(chain, mass):.2g}"/>',
        "  <default>",
        '    <geom type="capsule" rgba="0.85 0.75 0.65 1" contype="0" conaffinity="0"/>',
        "  </default>",
        "  <worldbody>",
        '    <light pos="0 -1 1" dir="0 1 -1"/>',
        f"    {_link(chain, 0, mass, radius)}",
        *_bodies(chain, mass, radius),
        "  </worldbody>",
        "  <tendon>",
        *_tendons(chain),
        "  </tendon>",
        "  <actuator>",
        *(
            f'    <motor name={quoteattr(name)} tendon={quoteattr(name)} ctrlrange="{1e3 * low:.6g} {1e3 * high:.6g}"/>'
            for name, (low, high) in zip(chain.chambers, chain.bounds, strict=True)
        ),
        "  </actuator>",
        "</mujoco>",
        "",
    ]
    return "\n".join(lines)


def _said(chain: Chain) -> str:
    mm, rad = chain.off.max(axis=0)
    return (
        f"Written by pneumorph. Controls are pressures in kPa. At {len(chain.off)} exact states the tip is off by at "
        f"most {mm:.2g} mm of {chain.spans[0]:.3g} and {np.degrees(rad):.2g} of {np.degrees(chain.spans[1]):.3g} deg."
    )


def _ends(chain: Chain) -> np.ndarray:
    """Heights (k + 2,) in m of the joints at rest, and of the ends of the chain."""
    middles = (chain.stations[1:] + chain.stations[:-1]) / 2
    return 1e-3 * np.array([chain.stations[0], *middles, chain.stations[-1]])


def _masses(chain: Chain, mass: float) -> np.ndarray:
    """Of the links (k + 1,), kg."""
    lengths = np.diff(_ends(chain))
    return 1e3 * mass * lengths / lengths.sum()


def _link(chain: Chain, number: int, mass: float, radius: float) -> str:
    length = np.diff(_ends(chain))[number]
    return (
        f'<geom fromto="0 0 0 0 0 {length:.6g}" size="{1e-3 * radius:.6g}" mass="{_masses(chain, mass)[number]:.6g}"/>'
    )


def _bodies(chain: Chain, mass: float, radius: float) -> list[str]:
    """A body within the one before it for every joint, and the tip."""
    ends, opened, closed = _ends(chain), list[str](), list[str]()
    for number in range(len(chain.rest)):
        pad = "  " * (number + 2)
        opened.append(f'{pad}<body name="link_{number + 1}" pos="0 0 {ends[number + 1] - ends[number]:.6g}">')
        for name, axis, rest, stiff in zip(
            JOINTS, AXES, _si(chain.rest)[number], _stiffness(chain)[number], strict=True
        ):
            kind = "slide" if name == "along" else "hinge"
            opened.append(
                f'{pad}  <joint name="{name}_{number + 1}" type="{kind}" axis="{axis}" stiffness="{stiff:.6g}" '
                f'springref="{rest:.6g}" damping="{DECAY * stiff:.6g}"/>'
            )
        opened.append(f"{pad}  {_link(chain, number + 1, mass, radius)}")
        closed.insert(0, f"{pad}</body>")
    opened.append(f'{"  " * (len(chain.rest) + 2)}<site name="tip" pos="0 0 {ends[-1] - ends[-2]:.6g}" size="0.001"/>')
    return opened + closed


def _tendons(chain: Chain) -> list[str]:
    """For every chamber, by how much a kPa pushes and turns every joint, N and N·m."""
    pushed = (
        1e-3 * _stiffness(chain)[:, :, None] * np.stack([_si(each) for each in np.moveaxis(chain.by_pressure, 2, 0)], 2)
    )
    lines = []
    for chamber, name in enumerate(chain.chambers):
        lines.append(f"    <fixed name={quoteattr(name)}>")
        lines += [
            f'      <joint joint="{JOINTS[kind]}_{number + 1}" coef="{pushed[number, kind, chamber]:.6g}"/>'
            for number, kind in np.ndindex(pushed.shape[:2])
        ]
        lines.append("    </fixed>")
    return lines


def _si(q: np.ndarray) -> np.ndarray:
    """Coordinates (k, 4) in m and rad."""
    return q * [1e-3, 1.0, 1.0, 1.0]


def _stiffness(chain: Chain) -> np.ndarray:
    """Of the joints (k, 4), N/m and N·m/rad."""
    return chain.stiffness * [1e3, 1e-3, 1e-3, 1e-3]


def _step(chain: Chain, mass: float) -> float:
    """A time step, s, in which no link moves far on its spring."""
    return min(1e-3, sqrt(_masses(chain, mass).min() / _stiffness(chain)[:, 0].max()) / STEPS)
