"""The stand-in for the perception-to-force model, judged by the simulated raters of door_ratings."""

import itertools

import numpy as np
import pytest
from click.testing import CliRunner

from devices.door.commands import doors
from devices.door.features import describe
from devices.door.grid import POINTS, DoorDataError
from devices.door.sets import differences, make
from devices.door.wished import LIMIT_N, STEEPEST_N_DEG, TURNS, bounded, hardest, wished_profile
from protocols.perceiver import Perceiver
from protocols.plan import ParticipantRow, compile_plan
from protocols.study import Stimulus
from studies.catalogue import SHIPPED, read_study

MADE = ("door_adjectives", "door_capture", "door_matching")
NEUTRAL = dict.fromkeys(TURNS, 50.0)


class Raters:
    """What everybody in door_ratings would feel at a new profile: z-scored over the study's ninety."""

    def __init__(self):
        self.study = read_study(SHIPPED / "door_ratings" / "study.yaml").study

    def feel(self, attribute, force_N):
        columns = {name: repr(value) for name, value in describe(force_N).items()}
        felt = Stimulus(id="felt", columns=columns)
        person = Perceiver(compile_plan(self.study, ParticipantRow("P001", "1", 0)))
        weights = self.study.simulation.latents[attribute]
        standing = {name: scores(self.study.stimuli, name) for name in weights if name != "intercept"}
        person.__dict__["z_scores"] = {
            name: {"felt": (float(columns[name]) - mean) / sd} for name, (mean, sd) in standing.items()
        }
        return person.latent(attribute, felt)


def scores(stimuli, column):
    values = np.array([float(stimulus.columns[column]) for stimulus in stimuli])
    return values.mean(), values.std()


@pytest.fixture(scope="module")
def raters():
    return Raters()


@pytest.mark.parametrize("attribute", TURNS)
def test_raising_a_wish_raises_what_the_raters_feel(raters, attribute):
    felt = [raters.feel(attribute, wished_profile({**NEUTRAL, attribute: float(wish)})) for wish in range(0, 101, 10)]
    assert np.diff(felt).min() > 0
    assert felt[9] - felt[1] > 4


def test_a_wish_moves_its_own_attribute_most(raters):
    """Averaged over the seven; the single others may follow, as a heavy door is also an uncomfortable one."""
    own, others = [], []
    for wished, rated in itertools.product(TURNS, TURNS):
        low, high = (raters.feel(rated, wished_profile({**NEUTRAL, wished: value})) for value in (10.0, 90.0))
        (own if wished == rated else others).append(abs(high - low))
    assert np.mean(own) > 2 * np.mean(others)


def test_the_neutral_door_is_felt_near_the_middle(raters):
    assert all(abs(raters.feel(attribute, wished_profile(NEUTRAL))) < 2 for attribute in TURNS)


def test_no_wish_leaves_the_bounds():
    for corner in itertools.product((0.0, 100.0), repeat=len(TURNS)):
        force_N = wished_profile(dict(zip(TURNS, corner, strict=True)))
        assert force_N.shape == (POINTS,) and np.isfinite(force_N).all()
        assert np.abs(force_N).max() <= LIMIT_N
        assert np.abs(np.diff(force_N)).max() <= STEEPEST_N_DEG / 10 + 1e-9


def test_a_jump_is_followed_as_fast_as_may_be():
    wild = np.r_[np.zeros(300), np.full(20, 500.0), np.full(301, -500.0)]
    tamed = bounded(wild)
    assert np.abs(tamed).max() <= LIMIT_N and np.abs(np.diff(tamed)).max() <= STEEPEST_N_DEG / 10 + 1e-9
    assert tamed[309] == LIMIT_N and tamed[-1] == -LIMIT_N
    calm = np.sin(np.arange(POINTS) / 20) * 30
    assert (bounded(calm) == calm).all()


@pytest.mark.parametrize(
    ("wish", "said"),
    [
        ({}, "found none"),
        ({**NEUTRAL, "Loud": 50.0}, "are expected"),
        ({**NEUTRAL, "New": 101.0}, "the wish for New is 101.0"),
        ({**NEUTRAL, "New": float("nan")}, "the wish for New is nan"),
    ],
)
def test_another_wish_is_refused(wish, said):
    with pytest.raises(DoorDataError, match=said):
        wished_profile(wish)


@pytest.mark.parametrize("study", MADE)
def test_the_stimuli_of_a_study_are_what_the_program_makes(study, tmp_path):
    folder = SHIPPED / study
    assert differences(study, folder) == []
    written = make(study, tmp_path)
    assert all(path.read_bytes() == (folder / path.relative_to(tmp_path)).read_bytes() for path in written)


def test_a_changed_missing_or_foreign_file_is_named(tmp_path):
    make("door_matching", tmp_path)
    (tmp_path / "profiles" / "New_10.csv").write_text("angle_deg,force_N\n")
    (tmp_path / "profiles" / "New_90.csv").unlink()
    (tmp_path / "profiles" / "mine.csv").touch()
    told = [line.removeprefix(str(tmp_path / "profiles")) for line in differences("door_matching", tmp_path)]
    assert told == ["/New_10.csv: differs", "/New_90.csv: missing", "/mine.csv: not a file of this study"]
    with pytest.raises(DoorDataError, match="'toy' has no made stimuli"):
        make("toy", tmp_path)


def test_the_six_doors_are_those_of_door_ratings():
    for study, car in itertools.product(("door_adjectives", "door_capture"), ("BC3", "K8")):
        same = SHIPPED / "door_ratings" / "profiles" / f"{car}_g0.csv"
        assert (SHIPPED / study / "profiles" / f"{car}.csv").read_bytes() == same.read_bytes()


def test_a_studys_profiles_are_compared_and_remade_by_its_name(tmp_path):
    made = CliRunner().invoke(doors, ["make", "--study", "door_matching", "--out", str(tmp_path)])
    assert made.exit_code == 0 and len(list((tmp_path / "profiles").glob("*.csv"))) == 14
    compared = ["make", "--study", "door_matching", "--check", str(tmp_path)]
    assert CliRunner().invoke(doors, compared).output.endswith(": equal\n")
    changed = next((tmp_path / "profiles").glob("*.csv"))
    changed.write_text(changed.read_text().replace("0.0,", "0.0,-", 1))
    answer = CliRunner().invoke(doors, compared)
    assert answer.exit_code == 1 and f"{changed}: differs" in answer.output


def test_the_hardest_door_lies_at_the_bounds_of_every_wish():
    made = np.array(hardest())
    assert (len(made), made.min(), made.max()) == (621, -LIMIT_N, LIMIT_N)
    assert np.abs(np.diff(made)).max() == pytest.approx(STEEPEST_N_DEG / 10)
