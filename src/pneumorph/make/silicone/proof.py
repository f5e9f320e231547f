"""Proof of silicone moulds: checks of the pieces, of the space that they leave, and of how parts fit together."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from pneumorph.make.checks import Check, closure, distances
from pneumorph.make.mould.proof import VOLUME, Part, curved, openings, overlap, room, sizes
from pneumorph.make.silicone.frame import frame_of
from pneumorph.make.silicone.pieces import PLATE
from pneumorph.make.silicone.plan import SiliconePlan, Slab
from pneumorph.make.triangles import together


def proof(plan: SiliconePlan, parts: Sequence[Part], chord: float) -> Iterator[Check]:
    """All checks of silicone moulds; those of single pieces first.

    Parameters
    ----------
    parts : sequence of Part
        All pieces.
    chord : float
        Chord error of their triangles, mm.
    """
    for each in parts:
        yield closure(each.name, each.mesh.triangles, each.solid)
    yield from sizes(plan, parts)
    named = {each.name: each for each in parts}
    boxes = [each for each in parts if each.role == "mould"]
    for slab in plan.slabs:
        part = named[f"part-{slab.number}"]
        negatives = [named[f"negative-{slab.number}-{side}"] for side in "ab"]
        yield from room(f"mould {slab.number}", part, negatives, chord)
        # Boxes are at their place in the first mould.
        around = [*negatives, *(boxes if slab.number == 1 else [])]
        yield overlap([part, *around], part.solid.volume())
        masters = [
            each for each in parts if each.role == "master" and f"{each.name}-".startswith(f"master-{slab.number}-")
        ]
        yield from _cast(plan, slab, masters, negatives, part.solid.volume(), chord)
        yield Check(part.name, "closed spaces inside", len(part.solid.decompose()) - 1, 0)
    for name, release in plan.releases.items():
        most = plan.spec.release_stretch
        yield Check(f"negative-{name}", "stretch of the silicone when pulled off", release.stretch, most)
    for chamber, high in plan.trapped.items():
        yield Check(f"chamber {chamber}", "high points below it that trap air", len(high), 0)
    product = named["body"]
    yield from _glued(product, [each for each in parts if each.role == "part"], chord)
    yield from openings(product, 0)


def _cast(
    plan: SiliconePlan, slab: Slab, masters: Sequence[Part], negatives: Sequence[Part], volume: float, chord: float
) -> Iterator[Check]:
    """Negatives are what silicone around the master becomes; negative b is cast below the master's plate."""
    master = together([each.mesh.triangles for each in masters])
    for negative, down in zip(negatives, (0.0, PLATE), strict=True):
        shift = -down * frame_of(slab, plan).up
        away = distances(master, curved(negative) + shift)
        yield Check(negative.name, "distance of its curved surfaces from the master", float(away.max()), chord, "mm")
        moved = negative.solid.translate(shift.tolist())
        shared = sum((moved ^ each.solid).volume() for each in masters)
        yield Check(negative.name, "volume that the master takes up, relative to the part", shared / volume, VOLUME)


def _glued(product: Part, parts: Sequence[Part], chord: float) -> Iterator[Check]:
    """The parts together are the body."""
    away = distances(together([each.mesh.triangles for each in parts]), curved(product))
    back = distances(product.mesh.triangles, np.concatenate([curved(each) for each in parts]))
    yield Check("body", "distance of its curved surfaces from the glued parts", float(away.max()), chord, "mm")
    yield Check("body", "distance of the parts' curved surfaces from it", float(back.max()), chord, "mm")
    whole = product.solid.volume()
    missing = abs(sum(each.solid.volume() for each in parts) / whole - 1.0)
    yield Check("body", "difference between its volume and that of the glued parts, relative", missing, VOLUME)
    yield overlap(parts, whole)
