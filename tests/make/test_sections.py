"""Files of tubes of every kind of section."""

import pytest
from netgen.occ import OCCGeometry
from sections import SECTIONS, problem

from pneumorph.geometry.tube.start import starting_body
from pneumorph.geometry.tube.surface import enclosed_volume

make = pytest.importorskip("pneumorph.make", reason="needs the extra cad")


@pytest.mark.parametrize("kind", SECTIONS)
def test_a_solid_of_the_exact_volume(kind, tmp_path):
    body = starting_body(problem(kind, taper=0.9, ends="pole").tubes)
    make.write_body_step(body, tmp_path / "body.step")
    read = OCCGeometry(str(tmp_path / "body.step")).shape
    assert len(read.solids) == 1
    volume = enclosed_volume(body.exterior) - enclosed_volume(body.chambers[0])
    assert read.mass == pytest.approx(volume, rel=1e-6)
