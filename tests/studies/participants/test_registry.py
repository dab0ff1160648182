import json

import pytest
from sqlalchemy import insert, select, text, update
from sqlalchemy.exc import IntegrityError

from palpate.protocols.yaml_text import YamlError
from palpate.studies.lab import ParticipantError
from palpate.studies.participants import schema
from palpate.studies.participants.people import add, status_of
from palpate.studies.participants.registry import TRIES, find_registry, open_registry, reading, withdrawn, write
from tests.studies.participants.labs import filled, record_session


def audit_of(registry):
    with reading(registry) as connection:
        lines = connection.execute(select(schema.audit).order_by(schema.audit.c.n)).all()
    return [(line.what, json.loads(line.body)) for line in lines]


def row(participant, number=0, group="", status="active"):
    return {"study": "toy", "participant": participant, "group_name": group, "row": number, "status": status, "at": "-"}


def test_the_next_pseudonym_is_one_that_nobody_ever_had(registry):
    assert [add(registry), add(registry, "P003"), add(registry, "X7"), add(registry)] == ["P001", "P003", "X7", "P002"]
    record_session(registry.lab, "P004")
    assert add(registry) == "P005"
    assert status_of(registry, "P005") == "active" and status_of(registry, "P004") is None
    assert audit_of(registry)[-1] == ("added", {"participant": "P005"})


def test_a_pseudonym_that_looks_like_another_is_refused_and_never_given(registry):
    add(registry, "P0001")
    record_session(registry.lab, "Q07")
    for new, other in (("P001", "P0001"), ("p1", "P0001"), ("Q7", "Q07")):
        with pytest.raises(ParticipantError, match=f"{new} looks like {other}, .*leave --pseudonym out"):
            add(registry, new)
    assert add(registry) == "P002"


def test_a_pseudonym_is_given_once_whatever_its_capitals(registry):
    filled(registry, 1)
    for same in ("P001", "p001"):
        with pytest.raises(ParticipantError, match="P001 is known already"):
            add(registry, same)
    with pytest.raises(ParticipantError, match="tried"):
        write(registry, lambda c: c.execute(insert(schema.participants), {"participant": "p001", "status": "active",
                                                                          "added_at": "-"}))  # fmt: skip


@pytest.mark.parametrize("name", ["Hana", "Kim Hana", "P", "1", "P_001", "", "P" * 20 + "1", "P001\n", "Ｐ００１"])
def test_a_name_is_no_pseudonym(home, name):
    with pytest.raises(ParticipantError, match="a pseudonym as P001 is expected"):
        add(home, name)


def test_the_database_itself_lets_no_row_be_held_twice(registry):
    filled(registry, 3)

    def hold(*rows):
        write(registry, lambda connection: connection.execute(insert(schema.allocations), list(rows)))

    hold(row("P001"))
    for second in (row("P002"), row("P002", status="finished")):
        with pytest.raises(ParticipantError, match=r"(?i)unique"):
            hold(second)
    hold(row("P002", status="released"), row("P003", group="x"))
    with pytest.raises(ParticipantError, match=r"(?i)foreign"):
        hold(row("P009", 5))


def test_a_write_that_meets_a_conflict_is_tried_anew_and_leaves_nothing_half_done(registry):
    filled(registry, 2)
    write(registry, lambda connection: connection.execute(insert(schema.allocations), row("P001")))
    rows = iter([0, 0, 1])

    def act(connection):
        connection.execute(update(schema.participants).values(added_at=schema.participants.c.added_at + "!"))
        connection.execute(insert(schema.allocations), row("P002", next(rows)))

    write(registry, act)
    with reading(registry) as connection:
        held = connection.execute(select(schema.allocations.c.row).order_by(schema.allocations.c.row)).scalars().all()
        marks = connection.execute(select(schema.participants.c.added_at)).scalars().all()
    assert held == [0, 1]
    assert [mark.count("!") for mark in marks] == [1, 1]


def test_a_lasting_conflict_is_reported_after_a_number_of_tries(home):
    tries = []

    def act(connection):
        tries.append(1)
        raise IntegrityError("", {}, Exception("no such luck"))

    with pytest.raises(ParticipantError, match="no such luck; tried 20 times"):
        write(home, act)
    assert len(tries) == TRIES


def test_an_act_that_fails_leaves_nothing(registry):
    def act(connection):
        connection.execute(insert(schema.participants), {"participant": "P1", "status": "active", "added_at": "-"})
        raise ParticipantError("on second thoughts")

    with pytest.raises(ParticipantError, match="second thoughts"):
        write(registry, act)
    assert status_of(registry, "P1") is None


def test_a_newer_registry_is_refused(registry):
    write(registry, lambda connection: connection.execute(update(schema.registry).values(version=2)))
    for opened in (open_registry, find_registry, withdrawn):
        with pytest.raises(ParticipantError, match="written in version 2, this Palpate reads 1: update"):
            opened(registry.lab)


def test_looking_for_a_registry_makes_none(tmp_path):
    assert find_registry(tmp_path) is None and withdrawn(tmp_path) == set()
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_is_no_registry_is_refused_and_left_as_it_is(tmp_path):
    file = tmp_path / "participants" / "registry.sqlite"
    file.parent.mkdir()
    file.write_bytes(b"not a database" * 100)
    with pytest.raises(ParticipantError, match=r"registry\.sqlite: file is not a database"):
        open_registry(tmp_path)
    assert file.read_bytes() == b"not a database" * 100


def test_a_relative_sqlite_file_lies_in_the_lab_wherever_one_stands(tmp_path, monkeypatch):
    (tmp_path / "lab").mkdir()
    monkeypatch.chdir("/")
    (tmp_path / "lab" / "lab.yaml").write_text("registry: sqlite:///people.sqlite\n")
    add(open_registry(tmp_path / "lab"))
    assert [path.name for path in (tmp_path / "lab").iterdir() if path.suffix == ".sqlite"] == ["people.sqlite"]


@pytest.mark.parametrize(
    ("yaml", "message"),
    [
        ("registri: sqlite:///x\n", r"lab\.yaml: line 1: registri: unknown key; did you mean 'registry'\?"),
        ("\nregistry: 3\n", r"lab\.yaml: line 2: registry: found 3, a text is expected"),
        ("registry: nonsense\n", r"lab\.yaml: registry: not a database URL; use a SQLite file, .*postgresql\+psycopg"),
        ("registry: mysql://host/x\n", "registry: found mysql; expected postgresql"),
        ("registry: postgresql+pg8000://h/x\n", "the driver pg8000 is not installed; .*palpate.postgres"),
        ("registry: 'sqlite://'\n", "in memory is lost when the command ends"),
        ("registry: 'sqlite:///:memory:'\n", "in memory is lost when the command ends"),
        ("[1]\n", "keys and values are expected"),
        ("registry: postgresql+psycopg://me:secret@127.0.0.1:1/x\n", r"registry postgresql\+psycopg://me:\*\*\*@127.*"),
        ("registry: sqlite:////no/such/folder/x.sqlite\n", "registry /no/such/folder/x.sqlite: unable to open"),
    ],
)
def test_errors_of_unusable_settings_do_not_show_a_password(tmp_path, yaml, message):
    (tmp_path / "lab.yaml").write_text(yaml)
    with pytest.raises(ParticipantError, match=message) as caught:
        open_registry(tmp_path)
    assert "secret" not in str(caught.value)


def test_settings_are_plain_yaml(tmp_path):
    (tmp_path / "lab.yaml").write_text("registry: &x sqlite:///x\n")
    with pytest.raises(YamlError, match="anchors"):
        open_registry(tmp_path)


def test_a_registry_shares_a_server_with_what_was_collected_and_its_own_file_with_nothing(registry):
    from palpate.studies.collecting.collect import CollectError, open_database

    url = registry.engine.url
    if url.get_backend_name() == "sqlite":  # the lab's own file, not a database that stations share
        with pytest.raises(CollectError, match="holds the table registry"):
            open_database(url)
        return
    collected = open_database(url)
    assert add(open_registry(registry.lab)) == "P001"
    with collected.begin() as connection:
        assert connection.execute(text("SELECT count(*) FROM participants")).scalar() == 0
    collected.dispose()
