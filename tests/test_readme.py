"""What README and pages say is so: the README's study and commands run in its order, and no link leads nowhere."""

import re
import shlex
from pathlib import Path

import pytest

import palpate

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
            palpate.main(words)
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
