"""CI replays recorded sessions of rendered textures: what was rated is what was rendered, whatever is shipped today."""

import pytest

from palpate.protocols.events import Ask
from palpate.protocols.simulated_participants.perceiver import Perceiver
from palpate.studies.sessions.record import read
from palpate.studies.sessions.replay import recompiled, replay
from palpate.studies.stimuli.renderings import MET, SEED
from tests.recorded.make_rendered import OWN, RENDERED, STOPPED, STUDY

LEDGERS = {who: RENDERED / f"{STUDY}_{who}_s1.sqlite" for who in STOPPED}


def pairs(record):
    """(stimulus' id, what was rendered, the answers) of each trial."""
    trials = [event.value for event in record.events if event.trial is not None and event.kind == "reply"]
    ids = [event.value["stimulus"] for event in record.events if event.kind == "trial_started"]
    return [(name, trials[2 * n]["rendered"], trials[2 * n + 1]["answers"]) for n, name in enumerate(ids)]


def test_nothing_else_lies_there_and_all_is_small():
    assert sorted(RENDERED.iterdir()) == sorted(LEDGERS.values())
    assert sum(path.stat().st_size for path in LEDGERS.values()) < 160_000


@pytest.mark.parametrize("who", LEDGERS)
def test_a_recorded_session_repeats_event_by_event(who):
    before = LEDGERS[who].read_bytes()
    found, record = replay(LEDGERS[who]), read(LEDGERS[who])
    assert found.complete and found.events == len(record.events)
    assert LEDGERS[who].read_bytes() == before
    because = [sitting.value.get("because") for sitting in record.sittings if sitting.kind == "closed"]
    assert because == (["complete"] if STOPPED[who] is None else ["interrupted by SIGTERM", "complete"])


@pytest.mark.parametrize("who", LEDGERS)
def test_every_texture_is_on_record_with_its_model_seed_and_digests(who):
    record = read(LEDGERS[who])
    stimuli = {each["id"]: each["columns"] for each in record.header["study"]["stimuli"]}
    found = pairs(record)
    assert sorted(name for name, _, _ in found) == sorted(stimuli) and len(found) == 24
    for name, told, _ in found:
        assert told["model"] == f"texture-{stimuli[name]['texture']}-{stimuli[name]['model']}"
        assert len(told["sha256"]) == len(told["weights_sha256"]) == 64 and told["runtime"]
        assert told["seed"] == SEED and set(told["met"]) == set(MET) and told["met"]["sounding"] > 1000
        assert told["deadlines"]["steps"] == 4000


def rated(plan, feels):
    """What a simulated person answers, by stimulus."""
    person = Perceiver(plan, feels=feels)
    return {t.stimulus.id: person.rate(Ask(t.form, t), t.form)[0].value["answers"] for t in plan.trials}


@pytest.mark.parametrize("who", LEDGERS)
def test_the_ratings_follow_from_what_is_on_record_as_rendered(who):
    record = read(LEDGERS[who])
    plan, compared = recompiled(record), {name: told["compared"] for name, told, _ in pairs(record)}
    answers = {name: answered for name, _, answered in pairs(record)}
    assert rated(plan, lambda stimulus: compared[stimulus.id]) == answers
    assert (rated(plan, None) != answers) == (who == OWN), "the shipped models alone are felt as the table says"
