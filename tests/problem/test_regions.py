"""Regions in problem files: what is read, and every refusal in one line."""

import pytest
from tiny import tiny

from pneumorph.errors import ProblemError
from pneumorph.geometry import build_linings
from pneumorph.mechanics import mirrors_of
from pneumorph.problem import loads

MATERIAL = {"name": "Dragon Skin 30"}


def region(name="skin", **shape):
    return {"name": name, "material": MATERIAL, **shape}


def layer(**keys):
    return {"layer": {"thickness": "1 mm", **keys}}


def sleeve(thickness="1 mm", *chambers):
    return {"sleeve": {"thickness": thickness, "chambers": list(chambers or ("A",))}}


def asked(*regions, **changes):
    return loads(tiny(length='"30 mm"', span='["3 mm", "27 mm"]')).with_changes({"region": list(regions)} | changes)


def test_a_file_is_read_and_written():
    problem = asked(
        region(**layer(span=["6 mm", "24 mm"], angles=["-90 deg", "90 deg"])), region("liner", **sleeve("0.5 mm"))
    )
    assert loads(problem.to_toml()) == problem
    assert problem.region[0].material.name == "Dragon Skin 30"
    outside, inside = build_linings(problem.body, problem.region)
    assert (outside.surface, inside.surface) == ("exterior", "A")
    assert outside.r == pytest.approx((0.2, 0.8)) and outside.q == pytest.approx((-0.25, 0.25))


@pytest.mark.parametrize(
    ("regions", "key", "said"),
    [
        ([region()], "region[0].layer", "give one of them"),
        ([region(**layer(), **sleeve())], "region[0].layer", "give one of them"),
        ([region(**layer(thickness="2 mm"))], "region[0].layer.thickness", "less than limits.wall"),
        ([region(**sleeve("1 mm", "B"))], "region[0].sleeve.chambers", 'no chamber "B"'),
        (
            [region("a", **sleeve()), region("b", **sleeve("0.5 mm"))],
            "region[1].sleeve.chambers",
            "has a sleeve already",
        ),
        ([region(**layer(span=["20 mm", "10 mm"]))], "region[0].layer.span", "does not rise"),
        ([region(**layer(span=["20 mm", "40 mm"]))], "region[0].layer.span", "beyond the body"),
        ([region(**layer(span=["1 mm", "20 mm"]))], "region[0].layer.span", "mesh.size"),
        ([region(**layer(angles=["0 deg", "360 deg"]))], "region[0].layer.angles", "less than 360 deg"),
        ([region(**layer(angles=["0 deg", "4 deg"]))], "region[0].layer.angles", "mesh.size"),
        ([region("a", **layer()), region("a", **sleeve("0.5 mm"))], "region[1].name", "is taken"),
        ([region("body", **layer())], "region[0].name", "is taken"),
        ([region("a", **layer()), region("b", **layer())], "region[1].layer", "move them apart"),
        ([region("a", **layer()), region("b", **sleeve("1 mm"))], "region[1].sleeve.thickness", "thinner"),
        ([region(beyond="14 mm", **layer())], "region[0].layer", "give one of them"),
        ([region(beyond="29 mm")], "region[0].beyond", "leaves less than mesh.size"),
        ([region(beyond="-3 mm")], "region[0].beyond", "not above zero"),
        ([region("a", beyond="12 mm"), region("b", beyond="13 mm")], "region[0].beyond", 'the plane of "b"'),
        ([region("a", beyond="12 mm"), region("b", beyond="12 mm")], "region[0].beyond", 'the plane of "b"'),
        ([region("a", beyond="12 mm"), region("b", **layer())], "region[0].beyond", 'in the layer "b"'),
        ([region("a", beyond="12 mm"), region("b", **sleeve("1 mm"))], "region[0].beyond", 'in the sleeve "b"'),
        ([region(**layer(depth="1 mm"))], "region[0].layer.depth", "unknown key"),
    ],
)
def test_refusals(regions, key, said):
    with pytest.raises(ProblemError) as refusal:
        asked(*regions)
    assert key in str(refusal.value) and said in str(refusal.value)
    assert "\n" not in str(refusal.value)


def test_a_plane_is_not_near_an_end_of_a_chamber():
    ending = {"body.chamber[0].span": ["3 mm", "17 mm"]}
    with pytest.raises(ProblemError, match=r'region\[0\].beyond: 16 mm is nearer .* chamber "A" \(z = 17 mm\); move'):
        asked(region(beyond="16 mm"), **ending)
    assert asked(region(beyond="19 mm"), **ending).region[0].beyond == 19.0


def test_half_a_body_is_enough_where_the_plane_keeps_its_regions():
    mirrored = {"body.symmetry": {"mirror": ["xz", "yz"]}}
    assert mirrors_of(asked(region(**layer()), **mirrored)) == ("xz", "yz")
    assert mirrors_of(asked(region(beyond="12 mm"), **mirrored)) == ("xz", "yz")
    assert mirrors_of(asked(region(**layer(angles=["-60 deg", "60 deg"])), **mirrored)) == ("xz",)
    assert mirrors_of(asked(region(**layer(angles=["30 deg", "150 deg"])), **mirrored)) == ("yz",)
    assert mirrors_of(asked(region(**layer(angles=["0 deg", "120 deg"])), **mirrored)) == ()
