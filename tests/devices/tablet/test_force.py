"""The force of a pressure, and the fit; scipy's curve_fit is the other software."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import curve_fit

from palpate.devices.device import DeviceError
from palpate.devices.rig.tablet_calibration import force_rows
from palpate.devices.tablet.force import Force, fit_force, read_pairs

PRESSURES = [k / 10 for k in range(1, 11)]


def measured(noise, seed=4):
    force, chance = Force(), np.random.default_rng(seed)
    return [max(0.01, force.newtons(y) + noise * chance.standard_normal()) for y in PRESSURES]


def test_the_curve_is_that_of_equation_4_10():
    force = Force()
    assert force.newtons(1.0) == pytest.approx(3.596, abs=1e-3)
    assert force.newtons(1e-9) == pytest.approx(0.13)
    assert force.newtons(0.0) == 0
    for y in PRESSURES:
        assert force.pressure(force.newtons(y)) == pytest.approx(y)
    assert (force.pressure(0.1), force.pressure(9.0)) == (0, 1)


def test_pairs_from_the_curve_give_the_curve():
    fit = fit_force(PRESSURES, measured(0))
    assert (fit.force.a_N, fit.force.b) == pytest.approx((0.13, 3.32), rel=1e-12)
    assert fit.worst_N < 1e-12
    assert fit.r_squared == pytest.approx(1)


@pytest.mark.parametrize("noise", [0.001, 0.02, 0.2])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_fit_is_scipys(noise, seed):
    forces = measured(noise, seed)
    fit = fit_force(PRESSURES, forces)
    expected, covariance = curve_fit(
        lambda y, a, b: a * np.exp(b * y), PRESSURES, forces, p0=(0.13, 3.3), ftol=1e-15, xtol=1e-15
    )
    assert (fit.force.a_N, fit.force.b) == pytest.approx(tuple(expected), rel=1e-6)
    assert (fit.a_error_N, fit.b_error) == pytest.approx(tuple(np.sqrt(np.diag(covariance))), rel=1e-4)
    left = np.array(forces) - expected[0] * np.exp(expected[1] * np.array(PRESSURES))
    assert fit.rms_N == pytest.approx(np.sqrt(np.mean(left**2)), rel=1e-6)
    assert fit.worst_N == pytest.approx(np.abs(left).max(), rel=1e-5)


@pytest.mark.parametrize("b", [0.05, 1.0, 20.0, 49.0])
def test_flat_and_steep_curves_are_found(b):
    force = Force(0.2, b)
    fitted = fit_force(PRESSURES, [force.newtons(y) for y in PRESSURES]).force
    assert (fitted.a_N, fitted.b) == pytest.approx((0.2, b), rel=1e-9)


@pytest.mark.parametrize(
    ("pressures", "forces", "message"),
    [
        ([0.1, 0.2, 0.3], [1, 2, 3], "3 pressures and 3 forces"),
        (PRESSURES, [1.0] * 9, "10 pressures and 9 forces"),
        ([0.1, 0.2, 0.3, 1.4], [1, 2, 3, 4], "pair 4: pressure 1.4"),
        ([0.1, 0.2, 0.3, 0.4], [1, 2, -3, 4], "pair 3.*force -3 N"),
        ([0.1, 0.2, 0.3, 0.4], [1, 2, math.nan, 4], "pair 3"),
        ([0.1, 0.2, 0.2, 0.1], [1, 2, 2, 1], "fewer than 3 different pressures"),
        (PRESSURES, PRESSURES[::-1], "does not rise"),
        (PRESSURES, [1.0] * 10, "does not rise"),
    ],
)
def test_pairs_that_show_no_curve_are_refused(pressures, forces, message):
    with pytest.raises(DeviceError, match=message):
        fit_force(pressures, forces)


def test_pairs_are_read_from_a_table(tmp_path):
    (tmp_path / "pairs.csv").write_text("pressure,force_N\n0.1,0.18\n0.2,0.25\n")
    assert read_pairs(tmp_path / "pairs.csv") == ([0.1, 0.2], [0.18, 0.25])
    for content, message in (("y,F\n1,2\n", "column 'pressure' is missing"), ("pressure,force_N\n0.1,x\n", "line 2")):
        (tmp_path / "bad.csv").write_text(content)
        with pytest.raises(DeviceError, match=message):
            read_pairs(tmp_path / "bad.csv")
    with pytest.raises(DeviceError, match="none.csv"):
        read_pairs(tmp_path / "none.csv")


def test_the_figure_shows_pairs_what_the_fit_leaves_over_and_both_curves():
    rows = force_rows([0.5, 0.1], [1.0, 0.2], Force(0.2, 3.0))
    pairs = [row for row in rows if row["shows"] == "pair"]
    assert [(row["pressure"], row["force_N"]) for row in pairs] == [(0.1, 0.2), (0.5, 1.0)]
    expected = [0.2 - 0.2 * math.exp(0.3), 1.0 - 0.2 * math.exp(1.5)]
    assert [row["residual_N"] for row in pairs] == pytest.approx(expected)
    ends = {row["shows"]: row["force_N"] for row in rows if row["pressure"] == 1.0}
    assert ends == {"fit": pytest.approx(0.2 * math.exp(3)), "thesis": pytest.approx(0.13 * math.exp(3.32))}
