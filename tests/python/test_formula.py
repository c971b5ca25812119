"""Formulas: every ufunc against numpy itself, and one typed error for each way to get it wrong."""

import warnings

import numpy as np
import pytest

import sdfrs

UNARY = [
    np.negative, np.absolute, np.fabs, np.sqrt, np.square, np.floor, np.sin, np.cos, np.tan, np.exp, np.log,
    np.arcsin, np.arccos, np.arctan, np.sign, np.positive, np.reciprocal,
]  # fmt: skip
BINARY = [
    np.add, np.subtract, np.multiply, np.divide, np.minimum, np.maximum, np.arctan2, np.hypot, np.remainder, np.fmin,
    np.fmax, np.floor_divide,
]  # fmt: skip


def values(function, points, precision="f64"):
    return sdfrs.shape(lipschitz=1.0)(function)(points, precision=precision)


@pytest.fixture
def points(rng):
    return rng.uniform(0.05, 0.95, (2000, 3))


@pytest.mark.parametrize("ufunc", UNARY, ids=lambda u: u.__name__)
@pytest.mark.parametrize("precision,tolerance", [("f64", 1e-14), ("f32", 1e-6)])
def test_unary_ufuncs_equal_numpy(ufunc, precision, tolerance, points):
    shift = 0.0 if ufunc in (np.sqrt, np.log) else 0.5
    got = values(lambda p: ufunc(p.x - shift), points, precision)
    x = points[:, 0].astype(got.dtype) - got.dtype.type(shift)
    np.testing.assert_allclose(got, ufunc(x), rtol=8 * tolerance, atol=8 * tolerance)


@pytest.mark.parametrize("ufunc", BINARY, ids=lambda u: u.__name__)
def test_binary_ufuncs_equal_numpy(ufunc, points):
    got = values(lambda p: ufunc(p.x - 0.5, p.y), points)
    np.testing.assert_allclose(got, ufunc(points[:, 0] - 0.5, points[:, 1]), rtol=1e-13, atol=1e-13)
    for one_sided, want in (
        (lambda p: ufunc(p.x, 0.25), ufunc(points[:, 0], 0.25)),
        (lambda p: ufunc(0.25, p.x), ufunc(0.25, points[:, 0])),
        (lambda p: ufunc(np.float64(0.25), p.x), ufunc(0.25, points[:, 0])),
    ):
        np.testing.assert_allclose(values(one_sided, points), want, rtol=1e-13, atol=1e-13)


def test_python_operators(points):
    x, y, z = points.T
    cases = {
        "arithmetic": (lambda p: (2 * p.x - p.y / 3 + 1 - -p.z) * 0.5, (2 * x - y / 3 + 1 + z) * 0.5),
        "reversed": (lambda p: 1 - p.x + 2 / p.y, 1 - x + 2 / y),
        "modulo": (lambda p: p.x % 0.3 + 7 % (p.y + 1), x % 0.3 + 7 % (y + 1)),
        "floor division": (lambda p: p.x // 0.3 + 1 // p.y, x // 0.3 + 1 // y),
        "powers": (lambda p: p.x**3 + p.y**0.5 + p.z**-2 + p.x**0, x**3 + y**0.5 + z**-2.0 + 1),
        "power ufunc": (lambda p: np.power(p.x, 8), x**8),
        "abs": (lambda p: abs(p.x - 0.5), abs(x - 0.5)),
        "clip": (lambda p: np.clip(p.x, 0.2, 0.7) + sdfrs.clamp(p.y, 0.3, p.z), np.clip(x, 0.2, 0.7) + np.minimum(np.maximum(y, 0.3), z)),
        "min max": (lambda p: sdfrs.min(p.x, p.y, 0.5) + sdfrs.max(p), np.minimum(np.minimum(x, y), 0.5) + points.max(axis=1)),
        "mix": (lambda p: sdfrs.mix(p.x, p.y, p.z), x + (y - x) * z),
        "length": (lambda p: sdfrs.length(p) + sdfrs.length(p.x, p.y), np.linalg.norm(points, axis=1) + np.hypot(x, y)),
        "norm and dot": (lambda p: np.linalg.norm(p) + np.dot(p, (1, 2, 3)), np.linalg.norm(points, axis=1) + points @ [1, 2, 3]),
    }  # fmt: skip
    for name, (function, want) in cases.items():
        np.testing.assert_allclose(values(function, points), want, rtol=1e-12, atol=1e-12, err_msg=name)


def test_points_are_vectors(points):
    half = np.array([0.5, 0.25, 0.125])
    want = np.abs(points * 2 - half) / 3
    for made in (
        lambda p: sdfrs.length(np.abs(p * 2 - (0.5, 0.25, 0.125)) / 3),
        lambda p: sdfrs.length(np.abs(2 * p - half) / 3),
        lambda p: sdfrs.length(np.abs(half - p * 2) / 3),
        lambda p: sdfrs.length(abs(-(half - p - p)) / (3, 3, 3)),
    ):
        np.testing.assert_allclose(values(made, points), np.linalg.norm(want, axis=1), rtol=1e-13)


def test_where_takes_all_four_comparisons():
    points = np.array([[-1, 0, 0], [0, 0, 0], [1, 0, 0]], float)
    x = points[:, 0]
    for made, want in (
        (lambda p: sdfrs.where(p.x < 0, p.x + 10, p.x + 20), np.where(x < 0, x + 10, x + 20)),
        (lambda p: sdfrs.where(p.x <= 0, p.x + 10, p.x + 20), np.where(x <= 0, x + 10, x + 20)),
        (lambda p: sdfrs.where(p.x > 0, p.x + 10, p.x + 20), np.where(x > 0, x + 10, x + 20)),
        (lambda p: sdfrs.where(p.x >= 0, p.x + 10, p.x + 20), np.where(x >= 0, x + 10, x + 20)),
        (lambda p: np.where(0 < p.x, p.x + 10, p.x + 20), np.where(x > 0, x + 10, x + 20)),
    ):
        np.testing.assert_array_equal(values(made, points), want)


def test_decorator_forms():
    @sdfrs.shape
    def bare(p):
        return sdfrs.length(p) - 1.0

    @sdfrs.shape(lipschitz=2.0, bounds=((-1, -1, -1), (1, 1, 1)))
    def full(p):
        return 2 * sdfrs.length(p) - 2.0

    assert bare.lipschitz == pytest.approx(1.0) and full.lipschitz == 2.0
    assert full.bounds == ((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0))
    assert isinstance(bare | full, sdfrs.Shape)


def test_derived_bounds_hold():
    for made in (
        lambda p: sdfrs.length(p) - 1.0 + 0.05 * np.sin(12.0 * p.x),
        lambda p: sdfrs.max(abs(p.x) - 1, p.y * 2, np.cos(p.z * 3)),
        lambda p: np.arctan(p.x) + 0.3 * np.sin(p.y + p.z),
    ):
        found = sdfrs.shape(made).check(samples=4000)
        assert found.ok and np.isfinite(found.bound), found


def test_star_import_leaves_min_and_max_alone():
    assert sdfrs.min([3, 1, 2]) == 1 and sdfrs.max(3, 1) == 3


def raising(p):
    raise RuntimeError("a fault of the user's")


WRONG = {
    "constant": (lambda p: 1.0, "constant"),
    "hidden constant": (lambda p: sdfrs.length(1, 1) - 3, "constant"),
    "raises": (raising, "RuntimeError: a fault of the user's"),
    "none": (lambda p: None, "NoneType"),
    "point": (lambda p: p, "Point"),
    "text": (lambda p: "sphere", "str"),
    "array": (lambda p: np.array([1.0, 2.0]), "ndarray"),
    "tuple": (lambda p: (p.x, p.y), "tuple"),
    "condition": (lambda p: p.x < 1, "Condition"),
    "if": (lambda p: p.x if p.x < 0 else p.y, "sdfrs.where"),
    "equality": (lambda p: sdfrs.where(p.x == 0, p.x, p.y), "=="),
    "math": (lambda p: __import__("math").sin(p.x), "numpy"),
    "unknown ufunc": (lambda p: np.cbrt(p.x), "cbrt"),
    "unknown function": (lambda p: np.cross(p, p), None),
    "stacked": (lambda p: np.sum(np.array([p.x, p.y])), "numpy"),
    "odd power": (lambda p: p.x**0.3, "0.5"),
    "power of expression": (lambda p: p.x**p.y, "exponent"),
    "nan": (lambda p: p.x + float("nan"), "finite"),
    "wrong arity": (lambda p, q: p.x, "TypeError"),
    "length of four": (lambda p: sdfrs.length(p.x, p.y, p.z, p.x), "2 or 3"),
    "where without comparison": (lambda p: sdfrs.where(p.x, p.y, p.z), "compare"),
    "point of two": (lambda p: sdfrs.length(p + (1, 2)), "three"),
    "changed": (lambda p: setattr(p, "x", 3) or p.x, "change"),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_formulas_are_scene_errors(name):
    function, words = WRONG[name]
    with pytest.raises(sdfrs.SceneError) as caught:
        sdfrs.shape(lipschitz=1.0)(function)
    assert words is None or words in str(caught.value), str(caught.value)


def test_the_users_own_exception_is_kept_as_the_cause():
    with pytest.raises(sdfrs.SceneError) as caught:
        sdfrs.shape(raising)
    assert isinstance(caught.value.__cause__, RuntimeError)


def test_interrupts_pass_through():
    def stop(p):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sdfrs.shape(stop)


@pytest.mark.parametrize("bad", [0, -1, float("nan"), float("inf"), "x", True])
def test_declared_bounds_must_be_positive(bad):
    with pytest.raises((sdfrs.SceneError, TypeError)):
        sdfrs.shape(lipschitz=bad)(lambda p: p.x)


def test_no_bound_given_and_none_derived_is_an_error():
    with pytest.raises(sdfrs.SceneError, match="lipschitz"):
        sdfrs.shape(lambda p: p.x * p.y)


def test_formulas_are_deep_without_recursion():
    with warnings.catch_warnings():
        warnings.simplefilter("error")

        @sdfrs.shape(lipschitz=1.0)
        def deep(p):
            value = p.x
            for _ in range(100_000):
                value = value + 1e-5
            return value

        assert deep([[0, 0, 0]], precision="f64")[0] == pytest.approx(1.0)
