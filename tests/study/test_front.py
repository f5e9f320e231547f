"""The Pareto front of a study that varies weights."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from tiny import tiny

from pneumorph.output.front import undominated
from pneumorph.problem import loads
from pneumorph.study import load_study, run_member, write_front


@given(arrays(float, st.tuples(st.integers(1, 12), st.just(2)), elements=st.integers(0, 4).map(float)))
def test_nothing_beats_a_design_of_the_front_and_every_other_is_beaten(values):
    best = undominated(values)
    assert best.any()
    for one, front in zip(values, best, strict=True):
        beaten = any((each <= one).all() and (each < one).any() for each in values)
        assert beaten is not bool(front)


def test_a_study_of_weights_has_a_picture_and_others_have_none(tmp_path):
    table = loads(tiny(iterations="1", pressure='{ A = "20 kPa" }')).model_dump(mode="json", exclude_none=True)
    light = {"name": "light", "pressure": {"A": "20 kPa"}, "objective": {"kind": "minimize", "of": "mass"}}
    table["task"].append(light)
    (tmp_path / "base.toml").write_text(loads(tiny()).model_validate(table).to_toml())
    path = tmp_path / "study.toml"
    path.write_text('base = "base.toml"\n[grid]\n"task[1].weight" = [0.001, 100.0]\n')
    asked, out = load_study(path), tmp_path / "out"
    seen = {}
    for member in asked.members:
        run_member(member.name, member.problem, str(out / member.name), seen.__setitem__, drawn=False)
    names = [member.name for member in asked.members]
    masses, extensions = np.array(
        [[seen[name].tasks["light"].objective, seen[name].tasks["extend"].objective] for name in names]
    ).T
    assert masses[1] < masses[0] and extensions[0] < extensions[1]
    picture = write_front(asked, out, names)
    assert picture == out / "pareto.png" and picture.stat().st_size > 1000
    assert write_front(asked, out, names[:1]) is None
    path.write_text('base = "base.toml"\n[grid]\n"body.length" = ["24 mm", "25 mm"]\n')
    assert write_front(load_study(path), out, names) is None
