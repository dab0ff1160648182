"""Errors of the system, of databases and of parsers become one sentence that names the file and hides passwords."""

import errno
import json
import os
import shutil
from pathlib import Path

import pytest
import yaml
from sqlalchemy import create_engine, text

from palpate.studies.messages import describe_error, hide_passwords

pytestmark = pytest.mark.needs("linux")
URLS = (
    "postgresql+psycopg://joe:s3cret@127.0.0.1/x", "postgresql+psycopg//joe:s3cret@127.0.0.1/x",
    "postgresql+psycopg:/joe:s3cret@h/x", "postgresql://joe:/s3cret@h/x", "postgresql://joe:s3cret:@@h/x",
    "postgresql://:s3cret@h/x", "joe:s3cret@h", "postgresql://h/x?password=s3cret&sslmode=require",
    "postgresql://h/x?sslpassword = s3cret", "host=h password='s3cret'", "postgresql://joe:s3cret@[::1/x",
    "https://h:8321/?token=s3cret",
)  # fmt: skip


@pytest.mark.parametrize("url", URLS)
def test_no_password_is_printed_whatever_the_urls_shape(url):
    hidden = hide_passwords(f"{url}: cannot be reached ({url!r})")
    assert "s3cret" not in hidden and hidden.count("***") >= 2


@pytest.mark.parametrize("plain", ["joe@h", "postgresql://joe@h:5432/x", "C:/data/a@b.csv", "a: joe@h.org", "[::1]:80"])
def test_what_is_no_password_is_left(plain):
    assert hide_passwords(plain) == plain


def test_a_part_of_a_password_that_a_driver_reports_is_hidden_too():
    message = 'could not translate host name "cret@h" and s3'
    assert "cret" not in hide_passwords(message, "postgresql://joe:s3@cret@h/x")


def error_of(call):
    try:
        call()
    except Exception as error:
        return error
    raise AssertionError("no error")


def test_an_error_of_read_which_names_no_file_is_described_with_its_file():
    assert describe_error(error_of(Path("/proc/self/mem").read_bytes)) == (
        "/proc/self/mem: the device reports an input/output error"
    )

    def read():
        with Path("/proc/self/mem").open("rb") as file:
            return file.read()

    assert describe_error(error_of(read)).startswith("/proc/self/mem: ")


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EIO, errno.EROFS, errno.EDQUOT, errno.EMFILE, errno.ELOOP])
def test_every_error_of_the_system_is_described_without_its_number(number):
    described = describe_error(OSError(number, os.strerror(number), "a.csv"))
    assert described.startswith("a.csv: ") and "Errno" not in described


def test_a_tree_that_cannot_be_copied_is_described_by_its_first_file(tmp_path):
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "link").symlink_to(tmp_path / "nothing")
    with pytest.raises(shutil.Error) as caught:
        shutil.copytree(tmp_path / "a", tmp_path / "b")
    assert describe_error(caught.value) == f"{tmp_path / 'b' / 'link'}: no such file or folder"


def test_databases_and_parsers_are_described(tmp_path):
    engine = create_engine(f"sqlite:///{tmp_path}/none/x.db")
    described = describe_error(error_of(engine.connect))
    assert "unable to open database file" in described and "sqlalche.me" not in described
    assert str(tmp_path) in described
    engine.dispose()
    with create_engine("sqlite://").connect() as connection:
        assert "no such table: a" in describe_error(error_of(lambda: connection.execute(text("select * from a"))))
    connection.engine.dispose()
    path = tmp_path / "a.json"
    path.write_bytes(b"\xff{")
    assert describe_error(error_of(lambda: path.read_text("utf-8"))) == (
        f"{path}: byte 0 is not UTF-8; save the file as UTF-8"
    )
    assert "not valid JSON" in describe_error(error_of(lambda: json.loads("{")))
    assert "not valid YAML" in describe_error(error_of(lambda: yaml.safe_load("a: [")))


@pytest.mark.parametrize("fault", [ValueError("x"), TypeError("x"), KeyError("x"), OSError("no number")])
def test_a_fault_of_the_program_is_not_described(fault):
    assert describe_error(fault) is None
