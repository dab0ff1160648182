import os
import stat
import subprocess
import sys

import pytest

from palpate.studies.lab import ParticipantError
from palpate.studies.participants.identities import Identity, erase, identify, identities, store

HANA = Identity("Kim Hana", "hana@example.org", "2026-03-31", "left-handed mouse")


def bytes_in(folder):
    return b"".join(path.read_bytes() for path in folder.rglob("*") if path.is_file())


def test_identities_are_stored_and_corrected_by_pseudonym(tmp_path):
    assert identities(tmp_path) == {} and list(tmp_path.iterdir()) == []
    identify(tmp_path, "P001", HANA)
    identify(tmp_path, "P002", Identity(name="Lee"))
    identify(tmp_path, "P001", Identity(contact="new@example.org"))
    assert identities(tmp_path) == {
        "P001": Identity("Kim Hana", "new@example.org", "2026-03-31", "left-handed mouse"),
        "P002": Identity("Lee"),
    }


def test_an_empty_identity_creates_nothing(tmp_path):
    identify(tmp_path, "P001", Identity())
    assert not erase(tmp_path, "P001")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.needs("posix")
def test_only_the_owner_can_look_into_the_store_whatever_the_umask(tmp_path):
    code = (
        "import os, pathlib, sys; os.umask(0)\n"
        "from palpate.studies.participants.identities import Identity, identify\n"
        "identify(pathlib.Path(sys.argv[1]), 'P001', Identity(name='Lee'))\n"
    )
    subprocess.run([sys.executable, "-c", code, str(tmp_path)], check=True)
    modes = [stat.S_IMODE(path.stat().st_mode) for path in (store(tmp_path).parent, store(tmp_path))]
    assert modes == [0o700, 0o600]
    assert (store(tmp_path).parent / ".gitignore").read_text() == "*\n"


@pytest.mark.needs("posix")
@pytest.mark.parametrize(("which", "mode"), [("folder", 0o750), ("folder", 0o701), ("file", 0o640), ("file", 0o604)])
def test_a_store_that_others_can_look_into_is_not_used(tmp_path, which, mode):
    identify(tmp_path, "P001", HANA)
    path = store(tmp_path).parent if which == "folder" else store(tmp_path)
    before = bytes_in(tmp_path)
    path.chmod(mode)
    right = "700" if which == "folder" else "600"
    for act in (lambda: identities(tmp_path), lambda: erase(tmp_path, "P001"), lambda: identify(tmp_path, "P2", HANA)):
        with pytest.raises(ParticipantError, match=f"others than its owner can look into it.*chmod {right} "):
            act()
    assert bytes_in(tmp_path) == before


def test_an_erased_person_leaves_no_byte_in_the_store(tmp_path):
    many = {f"P{n:03d}": Identity(f"Person Number{n}", f"n{n}@example.org", None, "note " * 40) for n in range(1, 60)}
    for who, identity in many.items():
        identify(tmp_path, who, identity)
    identify(tmp_path, "P030", HANA)
    assert b"Kim Hana" in bytes_in(tmp_path)
    assert erase(tmp_path, "P030") and not erase(tmp_path, "P030")
    left = bytes_in(tmp_path)
    assert all(part not in left for part in (b"Kim Hana", b"hana@example.org", b"left-handed", b"Number30", b"P030"))
    assert sorted(path.name for path in store(tmp_path).parent.iterdir()) == [".gitignore", "identities.sqlite"]
    assert identities(tmp_path) == {who: identity for who, identity in many.items() if who != "P030"}


def test_the_journal_of_an_erasure_is_overwritten_before_it_goes(tmp_path, monkeypatch):
    identify(tmp_path, "P001", HANA)
    from palpate.studies.participants import identities as module

    seen = []
    wipe = module._wipe

    def looking(journal):
        seen.append(journal.read_bytes())
        keep = journal.with_name("kept")
        os.link(journal, keep)
        wipe(journal)
        seen.append(keep.read_bytes())

    monkeypatch.setattr(module, "_wipe", looking)
    erase(tmp_path, "P001")
    assert len(seen[0]) == len(seen[1]) > 0
    assert set(seen[1]) == {0}


@pytest.mark.parametrize(
    ("identity", "message"),
    [
        (Identity(name=" "), "name: found ' ', a text of one line"),
        (Identity(contact="a\nb"), r"contact: found 'a\\nb'"),
        (Identity(consented="31.3.2026"), "consented: found '31.3.2026', a date as 2026-03-31 is expected"),
        (Identity(consented="2026-02-30"), "a date as"),
        (Identity(consented="20260331"), "a date as"),
    ],
)
def test_an_invalid_identity_is_refused_and_nothing_is_created(tmp_path, identity, message):
    with pytest.raises(ParticipantError, match=message):
        identify(tmp_path, "P001", identity)
    assert list(tmp_path.iterdir()) == []


def test_a_store_that_is_no_database_is_refused(tmp_path):
    identify(tmp_path, "P001", HANA)
    store(tmp_path).write_bytes(b"torn" * 1000)
    with pytest.raises(ParticipantError, match=r"identities\.sqlite: file is not a database"):
        identities(tmp_path)
