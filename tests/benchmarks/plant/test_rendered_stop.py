"""A stop that is sampled and held, on arms that are simulated: stable where Colgate's condition and the poles say."""

import numpy as np
import pytest

from benchmarks.plant.rendered_stop import Wall, by_default, dies_away, heavy, light, stiffest


def exact(wall):
    """The largest stable stiffness from the poles of the exactly discretised arm (zero-order hold), by bisection."""
    j, b, t, held = wall.inertia_kg_m2, wall.arm_damping_Nm_s_rad, wall.period_s, wall.wall_damping_Nm_s_rad
    decay = np.exp(-b * t / j)
    glide = j / b * (1 - decay)
    move, push = np.array([[1, glide], [0, decay]]), np.array([(t - glide) / b, (1 - decay) / b])

    def stable(k):
        matrix = np.zeros((3, 3))
        matrix[:2, :2], matrix[2, 0] = move, 1.0
        matrix[:2] -= np.outer(push, [k + held / t, 0.0, -held / t])
        return max(abs(np.linalg.eigvals(matrix))) < 1.0

    low, high = 0.25 * wall.theory_Nm_rad, 8 * b / t
    for _ in range(40):
        middle = (low * high) ** 0.5
        low, high = (middle, high) if stable(middle) else (low, middle)
    return low


@pytest.mark.parametrize(
    "wall", [light(1000.0), light(1000.0, 0.5), heavy(1.0), heavy(1.0, -0.5), Wall(0.01, 10.0), Wall(0.25, 100.0)]
)
def test_the_simulated_limit_is_that_of_the_exact_poles(wall):
    assert stiffest(wall, by_default) == pytest.approx(exact(wall), rel=5e-3)


@pytest.mark.parametrize("wall", [light(1000.0), light(1000.0, 0.6), heavy(1.0), heavy(1.0, -0.6)])
def test_colgates_condition_is_tight_for_the_arm_that_is_worst_for_it(wall):
    worst = stiffest(wall, by_default)
    assert 0.997 * wall.theory_Nm_rad < worst < 1.06 * wall.theory_Nm_rad


@pytest.mark.parametrize("wall", [light(1000.0, -0.5), heavy(1.0, 0.5), Wall(0.01, 30.0, 10.0), Wall(0.25, 5.0, -2.0)])
def test_no_arm_is_unstable_within_colgates_condition(wall):
    assert dies_away(wall, 0.98 * wall.theory_Nm_rad, by_default)
