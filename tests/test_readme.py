"""What README and pages say is so: the README's study and commands run in its order, and no link leads nowhere."""

import re
import shlex
from pathlib import Path

import click
import pytest

from palpate import command_line

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text("utf-8")
PAGES = [
    path
    for top in (ROOT, ROOT / "docs", ROOT / "studies")
    for path in sorted(top.glob("**/*.md" if top != ROOT else "*.md"))
]


def blocks(kind):
    """The README's code blocks of a kind, "" where none is said."""
    fenced = re.findall(r"^```(\w*)\n(.*?)^```$", README, flags=re.DOTALL | re.MULTILINE)
    return [text for named, text in fenced if named == kind]


def test_the_readme_s_study_has_twelve_lines_and_its_commands_run_as_they_stand(tmp_path, monkeypatch, capsys):
    [study] = blocks("yaml")
    assert len(study.splitlines()) == 12
    file = tmp_path / re.search(r"Write this as `(.*?)`", README)[1]
    file.parent.mkdir(parents=True)
    file.write_text(study, "utf-8")
    monkeypatch.chdir(tmp_path)
    commands = [shlex.split(line, comments=True)[1:] for line in blocks("")[-1].splitlines()]
    assert [words[0] for words in commands] == ["check", "run", "replay", "collect", "report"]
    for words in commands:
        with pytest.raises(SystemExit) as ended:
            command_line.main(words)
        assert ended.value.code in {0, None}, f"{words}: {capsys.readouterr().err}"
    came_out = README.split("## What comes out")[1].split("## ")[0]
    files = re.findall(r"`([\w./]+\.(?:sqlite|html))`", came_out)
    assert len(files) == 3 and [name for name in files if not (tmp_path / name).is_file()] == []


def anchors(page):
    """The names by which the headings of a page can be linked to."""
    heads = re.findall(r"^#+ (.*)$", page.read_text("utf-8"), flags=re.MULTILINE)
    return {
        re.sub(r"[^\w -]", "", re.sub(r"\[(.*?)\]\(.*?\)", r"\1", head).lower()).strip().replace(" ", "-")
        for head in heads
    }


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_every_link_of_a_page_leads_somewhere(page):
    text = re.sub(r"^```.*?^```$|`[^`\n]*`", "", page.read_text("utf-8"), flags=re.DOTALL | re.MULTILINE)
    lost = []
    for link in re.findall(r"\]\(([^)\s]+)\)", text):
        path, _, heading = link.partition("#")
        target = (page.parent / path).resolve() if path else page
        if re.match(r"\w+:", link):
            continue
        if not target.exists() or (heading and target.suffix == ".md" and heading not in anchors(target)):
            lost.append(link)
    assert lost == []


def commands_of(text):
    """The command lines in a page's code blocks."""
    for _kind, block in re.findall(r"^```(\w*)\n(.*?)^```$", text, flags=re.DOTALL | re.MULTILINE):
        yield from re.findall(r"^(?:\$ )?palpate (.*)$", block.replace("\\\n", " "), flags=re.MULTILINE)


LINES = [
    pytest.param(line, id=f"{page.relative_to(ROOT).as_posix()}-{number}")
    for page in PAGES
    for number, line in enumerate(commands_of(page.read_text("utf-8")))
]


@pytest.mark.parametrize("line", LINES)
def test_every_command_of_a_page_has_the_verbs_arguments_and_options_that_it_names(line):
    words = shlex.split(re.split(r" && | \| | > ", line)[0], comments=True)
    context, command = click.Context(command_line.cli, obj=command_line.texture_simulator), command_line.cli
    try:
        while isinstance(command, click.Group):
            name, command, words = command.resolve_command(context, words)
            context = command.make_context(name, words, parent=context)
            words = [*context._protected_args, *context.args]
    except click.exceptions.Exit as ended:  # --help
        assert ended.exit_code == 0
    except click.BadParameter as error:  # a file of the reader's
        assert "does not exist" in error.message, error.message


def test_the_sample_files_are_what_the_how_to_shows_and_commands_run_on_them(tmp_path, monkeypatch, capsys):
    page = (ROOT / "docs" / "how-to" / "import-a-table.md").read_text("utf-8")
    monkeypatch.chdir(tmp_path)
    lines = ["init LAB", *commands_of(page), *commands_of((ROOT / "analysis" / "samples" / "README.md").read_text())]
    by_files = [line for line in dict.fromkeys(lines) if "samples" in line or line.startswith("init")]
    assert [line.split()[0] for line in by_files] == ["init", "samples", "import", "import", "predict", "doors"]
    for number, line in enumerate(by_files):
        again = ["--replace"] if number == 3 else []
        assert command_line._status([*shlex.split(line, comments=True), *again]) == 0, capsys.readouterr().err
    assert (tmp_path / "samples" / "chairs.yaml").read_text("utf-8") in page


def test_the_source_archive_holds_what_the_readme_links_to_and_no_tests():
    lines = [line.split() for line in (ROOT / "MANIFEST.in").read_text("utf-8").splitlines()]
    named = {name for words in lines if words[0] == "include" for name in words[1:]}
    patterns = {(words[1], pattern) for words in lines if words[0] == "recursive-include" for pattern in words[2:]}
    assert ["prune", "tests"] in lines
    assert {"CHANGELOG.md", "CONTRIBUTING.md", "constraints.txt"} <= named
    files = [path for path in (ROOT / "docs").rglob("*") if path.is_file()]
    assert files and all(("docs", f"*{path.suffix}") in patterns for path in files)
