"""Files of tubes of every kind of section."""

import pytest
from netgen.occ import OCCGeometry
from sections import SECTIONS, problem

from pneumorph.geometry.tube.start import starting_body
from pneumorph.geometry.tube.surface import enclosed_volume

make = pytest.importorskip("pneumorph.make", reason="needs the extra cad")
from pneumorph.make.mould.pieces import pieces  # noqa: E402
from pneumorph.make.mould.plan import plan  # noqa: E402
from pneumorph.make.mould.proof import part, proof  # noqa: E402
from pneumorph.make.mould.tessellation import tessellated  # noqa: E402
from pneumorph.problem.fabrication import MakeSpec  # noqa: E402

DENSITY = 1.1e-9
CHORD = 0.1


@pytest.mark.parametrize("kind", SECTIONS)
def test_a_solid_of_the_exact_volume(kind, tmp_path):
    body = starting_body(problem(kind, taper=0.9, ends="pole").tubes)
    make.write_body_step(body, tmp_path / "body.step")
    read = OCCGeometry(str(tmp_path / "body.step")).shape
    assert len(read.solids) == 1
    volume = enclosed_volume(body.exterior) - enclosed_volume(body.chambers[0])
    assert read.mass == pytest.approx(volume, rel=1e-6)


@pytest.mark.parametrize("kind", ["half-round", "points"])
def test_a_mould_passes_its_proof(kind):
    body = starting_body(problem(kind).tubes)
    planned = plan(body, MakeSpec.model_validate({"tube": "3 mm"}), 1.0, DENSITY)
    parts = [part(piece.name, piece.role, tessellated(piece.shape, CHORD)) for piece in pieces(planned)]
    assert not [check for check in proof(planned, parts, CHORD) if not check.passed]
    assert {"body", "base", "lid", "core-A", "outer-1", "outer-2"} <= {each.name for each in parts}
