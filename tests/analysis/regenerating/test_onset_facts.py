from palpate.analysis.ratings.session_choice import SessionRow
from palpate.analysis.regenerating.page import onset_facts
from palpate.protocols.canonical import canonical
from palpate.studies.sessions.tables import certificates_in

CERTIFIED = {
    "date": "2026-11-20", "sensor": "acc", "bursts": 100, "p50_ms": 5.001, "p99_ms": 5.4, "most_ms": 6.25,
    "late_ms": 0.1, "level_dB": -0.05, "settings": "0" * 64,
}  # fmt: skip


def session(certificates):
    return SessionRow(
        "s", "d", "P001", None, 0, False, "complete", 1, 1, "", "", "", certificates=canonical(certificates).decode()
    )


def test_the_report_says_what_was_certified_of_each_device_and_in_how_many_sessions():
    facts = onset_facts([session({"shaker": CERTIFIED}), session({"shaker": CERTIFIED}), session({})])
    line = "shaker: p50 5.0 ms, p99 5.4 ms, maximum 6.2 ms, level -0.05 dB; 2026-11-20 (2 sessions)"
    assert facts == [("Command to onset, certified", line)]


def test_certificates_are_those_of_the_rig_s_settings():
    header = {"rig": {"settings": {"shaker": {"kind": "vibrator", "certificate": CERTIFIED}, "noise": {"level": 1}}}}
    assert certificates_in(header) == {"shaker": CERTIFIED}
    assert certificates_in({"rig": {"kind": "simulated"}}) == {}
