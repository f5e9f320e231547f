import pytest

from pneumorph.problem import BodySpec


@pytest.fixture
def spec():
    """Bodies with two chambers, one flat and one with poles, the ripple optional."""

    def make(ripple=None, length=80.0, radius=8.0, chambers="AB", aside=("1 mm", "2 mm")):
        flat = {"radius": f"{radius / 2} mm", "center": ["0 mm", "0 mm"], "span": ["3 mm", f"{length - 3} mm"]}
        pole = {"radius": "3 mm", "center": [*aside], "span": ["10 mm", f"{length - 30} mm"], "ends": "pole"}
        table = {
            "length": f"{length} mm",
            "radius": f"{radius} mm",
            "chamber": [
                {"name": name} | kind for name, kind in zip("AB", (flat, pole), strict=True) if name in chambers
            ],
        }
        if ripple:
            table["ripple"] = {"amplitude": f"{ripple[0]} mm", "period": f"{ripple[1]} mm"}
        return BodySpec.model_validate(table)

    return make
