"""Figures of the door plant: integrators against a converged reference, passivity, rendered stops, profile playback."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import cached_property, partial
from pathlib import Path

from benchmarks.plant.explicit import FIXED, Stepper, solve_fixed
from benchmarks.plant.passivity import Throw, by_default, by_stepper, excess, grid
from benchmarks.plant.playback import Playback, as_torque, play
from benchmarks.plant.problems import Problem, largest_difference_rad, problems, solve
from benchmarks.plant.rendered_stop import Wall, by_semi_implicit_euler, heavy, light, stiffest
from benchmarks.plant.rendered_stop import by_default as arm_by_default
from palpate.devices.door.plant.hand import constant_velocity, human
from palpate.devices.door.plant.machine import Machine
from palpate.devices.door.plant.parameters import PlantError
from palpate.protocols.bench import Case
from palpate.signals.doors.profile_file import read_profile

AREA = "plant"
OURS = "palpate, implicit"
STEPS_S = (4e-3, 2e-3, 1e-3, 5e-4, 2.5e-4)
TOLERANCES = (1e-3, 1e-4, 1e-6, 1e-8, 1e-10)
RACE_STEPS_S = (2e-2, 1e-2, 5e-3, 4e-3, 2e-3, 1e-3, 5e-4, 2.5e-4, 1e-4)
RACE_TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
GOOD_RAD = 1e-4
DOORS = ("BC3", "FORD", "G90", "K3", "K8", "MQ4")
PROFILES = Path(__file__).parents[2] / "studies" / "door_ratings" / "profiles"
Run = Callable[[Problem], list[float] | None]
State = tuple[float, float, float]


class Solved:
    """A problem with its converged solution, which is computed on first use."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem

    @cached_property
    def reference(self) -> list[float]:
        """Return SciPy's Radau solution at a relative tolerance of 1e-12, with every event located."""
        from benchmarks.plant.reference import solve_adaptive

        return solve_adaptive(self.problem, "Radau", 1e-12)

    def error_rad(self, angles_rad: list[float] | None) -> float | None:
        """Return the largest difference of the angle; None where the method gave up."""
        return None if angles_rad is None else largest_difference_rad(angles_rad, self.reference)


def cases(quick: bool) -> Iterator[Case]:
    """Yield every figure of this area; `quick` uses two of the five problems."""
    chosen = problems()
    for problem in (chosen[1], chosen[3]) if quick else chosen:
        solved = Solved(problem)
        yield from _integrators(solved)
        yield from _races(solved)
    yield from _passive()
    yield from _walls()
    yield from _doors()
    yield from _control_period()


def figures(out: Path, quick: bool) -> list[Path]:
    """Draw the stable region of a rendered stop and the six doors as rendered."""
    from benchmarks.plant.figures import doors_figure, walls_figure

    return [walls_figure(out, quick), doors_figure(out, {door: _door(door) for door in DOORS})]


def _integrators(solved: Solved) -> Iterator[Case]:
    """Yield the cases of every method at five step sizes or tolerances."""
    problem, kind = solved.problem, "rad, largest difference from Radau at rtol 1e-12"
    by_method = _settings(STEPS_S, TOLERANCES)
    settings = [(setting, method, run) for method, runs in by_method.items() for setting, run in runs]
    for setting in dict.fromkeys(setting for setting, _, _ in settings):
        for method, run in ((method, run) for other, method, run in settings if other == setting):
            repeats = 1 if "events" in method else 3
            yield Case(
                AREA, f"arm: {problem.name}", method, setting, problem.samples, kind, partial(run, problem),
                solved.error_rad, repeats,
            )  # fmt: skip


def _races(solved: Solved) -> Iterator[Case]:
    """Yield the cases of every method at the coarsest setting within 1e-4 rad; without one, the case is refused."""
    problem, kind = solved.problem, "rad, at the coarsest setting within 1e-4 rad"
    for method, settings in _settings(RACE_STEPS_S, RACE_TOLERANCES).items():
        racer = Racer(solved, tuple(run for _, run in settings))
        yield Case(
            AREA, "to 1e-4 rad", method, problem.name, problem.samples, kind, racer.run, solved.error_rad,
            1 if "events" in method else 3,
        )  # fmt: skip


class Racer:
    """A runner of a problem at the coarsest sufficient setting, which is found in the first run."""

    def __init__(self, solved: Solved, settings: tuple[Run, ...]) -> None:
        self.solved, self.settings = solved, settings

    @cached_property
    def chosen(self) -> Run | None:
        """The first setting within the required error."""
        return next((run for run in self.settings if self._good(run(self.solved.problem))), None)

    def run(self) -> list[float] | None:
        """Return the solution; None if even the finest setting is not sufficient."""
        angles_rad = (self.chosen or self.settings[-1])(self.solved.problem)
        return angles_rad if self.chosen else None

    def _good(self, angles_rad: list[float] | None) -> bool:
        error = self.solved.error_rad(angles_rad)
        return error is not None and error <= GOOD_RAD


def _settings(steps_s: tuple[float, ...], tolerances: tuple[float, ...]) -> dict[str, list[tuple[str, Run]]]:
    """Return each method's settings from coarse to fine, with their labels."""
    settings: dict[str, list[tuple[str, Run]]] = {OURS: [(_step_name(h), partial(_ours, h)) for h in steps_s]}
    for name, method in FIXED.items():
        settings[name] = [(_step_name(h), partial(_fixed, method, h)) for h in steps_s]
    for name in ("Radau", "LSODA"):
        settings[f"{name}, events"] = [(f"rtol {rtol:g}", partial(_adaptive, name, rtol)) for rtol in tolerances]
    return settings


def _step_name(step_s: float) -> str:
    return f"step {1e3 * step_s:g} ms"


def _ours(step_s: float, problem: Problem) -> list[float]:
    return solve(problem, step_s)


def _fixed(method: Stepper, step_s: float, problem: Problem) -> list[float]:
    return solve_fixed(problem, method, step_s)


def _adaptive(method: str, rtol: float, problem: Problem) -> list[float] | None:
    """Solve by SciPy; return None for a method that does not get past an event."""
    from benchmarks.plant.reference import solve_adaptive

    try:
        return solve_adaptive(problem, method, rtol)
    except PlantError:
        return None


def _passive() -> Iterator[Case]:
    """Yield the cases of the largest energy that a stop returns over the whole range, by each method at 1 kHz."""
    throws = tuple(grid())[::-1]  # the stiffest first: what is unbounded there need not go through the rest
    input_name = "1e2 to 1e8 N m/rad, 1 ms"
    kind = "relative, most energy that a stop returned beyond what it took"
    methods = {OURS: by_default} | {name: partial(by_stepper, method=method) for name, method in FIXED.items()}
    for name, states in methods.items():
        run = partial(_worst, throws, states)
        yield Case(AREA, "stop's energy", name, input_name, len(throws), kind, run, float, 1)


def _worst(throws: tuple[Throw, ...], states: Callable[[Throw], Iterator[State]]) -> float:
    """Return the largest excess; the first unbounded throw counts as the largest."""
    worst = 0.0
    for throw in throws:
        worst = max(worst, excess(throw, states(throw)))
        if math.isinf(worst):
            break
    return worst


def _walls() -> Iterator[Case]:
    """Yield the cases of the largest stable stiffness of a rendered stop, beside Colgate's condition."""
    kind = "relative, largest stable stiffness against Colgate's"
    walls = {
        "light, B = 0": light(1000.0), "light, B = b/4": light(1000.0, 0.25), "heavy, B = 0": heavy(1.0),
        "heavy, B = -b/4": heavy(1.0, -0.25),
    }  # fmt: skip
    methods = {OURS: arm_by_default, "semi-implicit Euler": by_semi_implicit_euler(1)}
    for wall_name, wall in walls.items():
        for name, start in methods.items():
            run = partial(stiffest, wall, start)
            yield Case(AREA, "rendered stop", name, wall_name, 1, kind, run, partial(_stiffness_error, wall), 1)


def _stiffness_error(wall: Wall, stiffness_Nm_rad: float) -> float:
    return abs(stiffness_Nm_rad / wall.theory_Nm_rad - 1)


def _doors() -> Iterator[Case]:
    """Yield the cases of rendered against commanded torque of six doors, pulled by a person and at constant speed."""
    for door in DOORS:
        torque, end_rad = _door(door)
        hands = {"a person": human(end_rad), "0.5 rad/s": constant_velocity(0.5, end_rad)}
        for hand_name, hand in hands.items():
            run = partial(play, torque, end_rad, hand)
            yield Case(AREA, "playback, RMSE", OURS, f"{door}, {hand_name}", 3300, "N m, RMSE", run, _rmse, 1)
            yield Case(AREA, "playback, 1 - r", OURS, f"{door}, {hand_name}", 3300, "1 - r", run, _one_minus_r, 1)
    torque, end_rad = _door("BC3")
    for hand_name, k, b in (("soft arm", 300.0, 12.0), ("firm arm", 600.0, 25.0), ("damped arm", 400.0, 50.0)):
        hand = human(end_rad, stiffness_Nm_rad=k, damping_Nm_s_rad=b)
        run = partial(play, torque, end_rad, hand)
        yield Case(AREA, "playback, other arms", OURS, f"BC3, {hand_name}", 3300, "N m, RMSE", run, _rmse, 1)


def _rmse(playback: Playback) -> float:
    return playback.rmse_Nm


def _one_minus_r(playback: Playback) -> float:
    return 1.0 - playback.r


def _door(door: str) -> tuple[tuple[float, ...], float]:
    return as_torque(read_profile(PROFILES / f"{door}_g0.csv"))


def _control_period() -> Iterator[Case]:
    """Yield the case of a thousand milliseconds of the whole machine, which shows the reserve to real time."""
    torque, end_rad = _door("BC3")

    def run() -> float:
        machine = Machine(hand=human(end_rad))
        machine.load(torque, end_rad)
        machine.mode = "play"
        return max(machine.step().t_us for _ in range(1000)) / 1e6

    yield Case(
        AREA, "one second of the machine", OURS, "BC3", 1000, "s of its clock lost", run, lambda s: abs(s - 1.0), 5
    )
