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
    result, record = replay(LEDGERS[who]), read(LEDGERS[who])
    assert result.complete and result.events == len(record.events)
    assert LEDGERS[who].read_bytes() == before
    because = [entry.value.get("because") for entry in record.run_notes if entry.kind == "closed"]
    assert because == (["complete"] if STOPPED[who] is None else ["interrupted by SIGTERM", "complete"])


@pytest.mark.parametrize("who", LEDGERS)
def test_every_texture_is_on_record_with_its_model_seed_and_digests(who):
    record = read(LEDGERS[who])
    stimuli = {stimulus["id"]: stimulus["columns"] for stimulus in record.header["study"]["stimuli"]}
    rendered = pairs(record)
    assert sorted(name for name, _, _ in rendered) == sorted(stimuli) and len(rendered) == 24
    for name, metadata, _ in rendered:
        assert metadata["model"] == f"texture-{stimuli[name]['texture']}-{stimuli[name]['model']}"
        assert len(metadata["sha256"]) == len(metadata["weights_sha256"]) == 64 and metadata["runtime"]
        assert metadata["seed"] == SEED and set(metadata["met"]) == set(MET) and metadata["met"]["sounding"] > 1000
        assert metadata["deadlines"]["steps"] == 4000


def rated(plan, feels):
    """What a simulated person answers, by stimulus."""
    person = Perceiver(plan, feels=feels)
    return {t.stimulus.id: person.rate(Ask(t.form, t), t.form)[0].value["answers"] for t in plan.trials}


@pytest.mark.parametrize("who", LEDGERS)
def test_the_ratings_follow_from_what_is_on_record_as_rendered(who):
    record = read(LEDGERS[who])
    plan, compared = recompiled(record), {name: metadata["compared"] for name, metadata, _ in pairs(record)}
    answers = {name: answered for name, _, answered in pairs(record)}
    assert rated(plan, lambda stimulus: compared[stimulus.id]) == answers
    assert (rated(plan, None) != answers) == (who == OWN), "the shipped models alone are felt as the table says"
