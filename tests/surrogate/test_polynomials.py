"""Chebyshev polynomials with Hermite data, domains with holes, and the reader: exact where they have to be."""

import json

import numpy as np
import pytest

from pneumorph.surrogate.build import Built, Fit, groups_of
from pneumorph.surrogate.domain import whole
from pneumorph.surrogate.file import write
from pneumorph.surrogate.polynomials import chosen, fitted, slopes_of, values_of
from pneumorph.surrogate.reader import Model, ModelError
from pneumorph.surrogate.states import Sample

BOUNDS = np.array([[0.0, 0.06], [-0.02, 0.04]])


def smooth(x):
    """Two values (n, 2) and their slopes (n, 2, 2) by x."""
    a, b = x.T
    values = np.stack([np.exp(0.7 * a) * np.cos(b), np.sin(a + 2 * b)], axis=-1)
    by_a = np.stack([0.7 * np.exp(0.7 * a) * np.cos(b), np.cos(a + 2 * b)], axis=-1)
    by_b = np.stack([-np.exp(0.7 * a) * np.sin(b), 2 * np.cos(a + 2 * b)], axis=-1)
    return values, np.stack([by_a, by_b], axis=1)


def test_slopes_are_those_of_the_values():
    rng = np.random.default_rng(0)
    x, index = rng.uniform(-0.9, 0.9, (5, 2)), np.array([[0, 0], [3, 1], [2, 5], [0, 4]])
    for c in range(2):
        step = 1e-6 * np.eye(2)[c]
        by = (values_of(x + step, index) - values_of(x - step, index)) / 2e-6
        np.testing.assert_allclose(slopes_of(x, index)[:, c], by, atol=1e-7)


def test_errors_fall_quickly_with_samples_and_slopes_help():
    rng = np.random.default_rng(0)
    test = rng.uniform(-1, 1, (50, 2))
    errors = []
    for count in (8, 16, 32):
        x = np.cos(np.pi * rng.random((count, 2)))
        values, slopes = smooth(x)
        index = chosen(x, values, slopes)
        errors.append(np.abs(values_of(test, index) @ fitted(x, values, slopes, index) - smooth(test)[0]).max())
    assert errors[1] < 0.5 * errors[0] and errors[2] < 0.05 * errors[1], errors
    index = chosen(x, values, None)
    assert np.abs(values_of(test, index) @ fitted(x, values, None, index) - smooth(test)[0]).max() > 10 * errors[2]


def test_a_domain_without_what_is_beyond_a_missing_state():
    domain = whole(BOUNDS)
    assert sorted(map(tuple, domain.corners)) == [(0.06, -0.02), (0.06, 0.04)]
    cut = domain.cut(np.array([0.03, 0.02]), np.array([0.036, 0.024]))
    inside = [(0.03, 0.04), (0.06, 0.02), (0.06, -0.02), (0.0, 0.0)]
    outside = [(0.04, 0.03), (0.06, 0.04), (0.07, 0.0)]
    assert cut.holds(np.array(inside)).all() and not cut.holds(np.array(outside)).any()
    drawn = cut.drawn(200, np.random.default_rng(0))
    assert not np.any((drawn[:, 0] > 0.03) & (drawn[:, 1] > 0.02))


@pytest.fixture
def path(tmp_path):
    """A file of a known function: shift_x and shift_y as above, the rest constant; with a hole in its domain."""
    domain = whole(BOUNDS).cut(np.array([0.05, 0.03]), np.array([0.052, 0.032]))
    x = np.cos(np.pi * np.random.default_rng(0).random((60, 2)))
    two, slopes = smooth(x)
    values, by = np.zeros((60, 8)), np.zeros((60, 2, 8))
    values[:, :2], by[..., :2] = two, slopes
    index = chosen(x, values, by)
    soft = np.eye(6)[np.tril_indices(6)][None]
    fit = Fit(domain, index, fitted(x, values, by, index), np.zeros((1, 2), int), soft)
    sample = Sample(np.zeros(2), np.zeros(8), np.zeros((8, 2)), np.eye(6))
    errors = {"translation_mm": 1e-5, "rotation_rad": 1e-6, "volume_mm3": 1.0, "compliance": 0.0}
    built = Built(fit, errors, dict.fromkeys(errors, 1.0), [sample], [sample])
    assert [group.rows.stop for group in groups_of(2, 1)] == [3, 6, 8, 11, 14]
    about = {"title": "T", "task": "t", "body": "b", "made_with": "0"}
    write(tmp_path / "m.npz", built, ("A", "B"), 0, about, 0.005)
    return tmp_path / "m.npz"


def test_the_reader_gives_the_function_its_slopes_and_its_inverse(path):
    model, rng = Model(path), np.random.default_rng(1)
    for p in BOUNDS[:, 0] + rng.random((20, 2)) * np.ptp(BOUNDS, axis=1):
        (value,), (slope,) = smooth(((p - BOUNDS[:, 0]) / np.ptp(BOUNDS, axis=1) * 2 - 1)[None])
        pose = model.pose(dict(zip("AB", p, strict=True)))
        assert pose.inside == (p[0] <= 0.05 or p[1] <= 0.03)
        np.testing.assert_allclose(pose.translation[:2], value, atol=1e-5)
        by = (slope * 2 / np.ptp(BOUNDS, axis=1)[:, None]).T
        np.testing.assert_allclose(model.jacobian(p)[:2], by, atol=1e-3 * np.abs(by).max())
        if pose.inside:
            found = model.pressures_for(dict(zip(("shift_x", "shift_y"), value, strict=True)))
            assert found.reached and found.pose.inside
            np.testing.assert_allclose(found.pose.translation[:2], value, atol=1e-4)
    far = model.pressures_for({"shift_x": 9.0})
    assert not far.reached and far.missed == pytest.approx(9.0 - np.exp(0.7), rel=1e-3)
    assert far.pressures["A"] == pytest.approx(0.06)
    np.testing.assert_allclose(model.compliance([0.01, 0.0]), np.eye(6), atol=1e-12)


def test_mistakes_are_one_line(path, tmp_path):
    model = Model(path)
    wrong = [
        (lambda: model.pose({"C": 0.01}), "C: "),
        (lambda: model.pose([0.01]), "the model has 2: A, B"),
        (lambda: model.pose({"A": 0.07}), "A: 70 kPa"),
        (lambda: model.pose({"A": float("nan")}), "A: nan"),
        (lambda: model.pressures_for({"shift_x": float("nan")}), "shift_x: "),
        (lambda: model.pressures_for({"jump": 1.0}), "jump: "),
        (lambda: model.pressures_for([1.0]), "motion"),
        (lambda: model.pressures_for({"shift_x": 1e300}), "shift_x: 1e.300"),
        (lambda: model.pressures_for({"shift_x": 1.0}, near="ab"), "give a number for each of A, B"),
        (lambda: model.pose({"A": "x"}), "give a number for each of A, B"),
        (lambda: model.pose(None), "give a number for each of A, B"),
        (lambda: model.pressures_for({}), "motion"),
        (lambda: Model(tmp_path / "none.npz"), "none.npz"),
    ]
    stored = dict(np.load(path))
    header = json.loads(bytes(stored["header"]))
    damaged = "damaged, its parts do not fit together"

    def said(**changes):
        return {"header": np.frombuffer(json.dumps(header | changes).encode(), np.uint8)}

    changes = [
        (said(version=3), "pneumorph-model 3"),
        (said(chambers=["A"]), damaged),
        (said(chambers=[1, 2]), damaged),
        (said(loads=["force_x"]), damaged),
        (said(outputs=[]), damaged),
        (said(errors={}), "no model file, or damaged"),
        (said(errors={"translation_mm": "small", "rotation_rad": 0.0}), "no model file, or damaged"),
        ({"coefficients": np.nan * stored["coefficients"]}, damaged),
        ({"coefficients": stored["coefficients"].astype(str)}, "no model file, or damaged"),
        ({"index": -stored["index"]}, damaged),
        ({"index": stored["index"] + 1}, damaged),
        ({"index": stored["index"][:, :1]}, damaged),
        ({"bounds": stored["bounds"][:, ::-1]}, damaged),
        ({"corners": stored["corners"][:0]}, damaged),
        ({"soft_coefficients": stored["soft_coefficients"][:, :5]}, damaged),
        ({"header": np.array([1, 2], np.uint8)}, "no model file"),
        ({"header": np.array([{"format": 1}], object)}, "no model file"),
    ]
    for number, (change, words) in enumerate(changes):
        np.savez(tmp_path / f"{number}.npz", **{**stored, **change})
        wrong.append((lambda number=number: Model(tmp_path / f"{number}.npz"), words))
    (tmp_path / "text.npz").write_text("text")
    (tmp_path / "cut.npz").write_bytes(path.read_bytes()[:500])
    wrong += [(lambda name=name: Model(tmp_path / name), name) for name in ("text.npz", "cut.npz")]
    for call, words in wrong:
        with pytest.raises(ModelError, match=words) as error:
            call()
        assert "\n" not in str(error.value)


def test_a_model_whose_pressures_are_never_zero(path, tmp_path):
    """Bounds that leave out zero: the inverse has nothing to do with a state without pressure."""
    stored = dict(np.load(path))
    stored["bounds"] = BOUNDS + np.array([[0.01, 0.0], [0.03, 0.0]])
    stored["corners"] = stored["bounds"][:, 1][None]
    np.savez(tmp_path / "above.npz", **stored)
    model = Model(tmp_path / "above.npz")
    wanted = model.pose([0.04, 0.02]).translation
    found = model.pressures_for({"shift_x": wanted[0], "shift_y": wanted[1]})
    assert found.reached and list(found.pressures.values()) == pytest.approx([0.04, 0.02], abs=1e-5)
    assert not model.all_inside(np.array([[0.0, 0.02], [0.04, 0.0]])).any()
