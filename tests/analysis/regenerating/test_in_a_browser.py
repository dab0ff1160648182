"""Figures looked at closer in a real browser, from a file, without a network."""

import base64
import json

import pytest

from tests.analysis.monitoring.browser import chromium, emulate
from tests.analysis.regenerating.small_lab import HOSTILE

pytestmark = pytest.mark.needs("selenium", "chromium")

TIP = "const tip = document.querySelector('.tip'); return tip && !tip.hidden ? tip.innerText : ''"
CHOSEN = """return [...document.querySelectorAll('.chosen')].map((each) =>
  [each.tagName.toLowerCase(), each.closest('figure')?.id ?? each.closest('section').id, each.dataset.key])"""


@pytest.fixture(scope="module")
def started(tmp_path_factory):
    with chromium(tmp_path_factory.mktemp("profile")) as one:
        one.execute_cdp_cmd("Network.enable", {})
        yield one


@pytest.fixture(scope="module")
def address(page, tmp_path_factory):
    file = tmp_path_factory.mktemp("report") / "report.html"
    file.write_text(page, encoding="utf-8")
    return file.as_uri()


@pytest.fixture
def browser(started, address):
    """The page as it is when it is opened, and no complaint of the test before."""
    emulate(started, 1100, 900)
    started.get("about:blank")
    started.get_log("browser")
    started.get(address)
    yield started
    assert started.get_log("browser") == []


def mark(browser, figure, key, place=0):
    """The place of a mark on the screen, in its middle, after scrolling to it."""
    element = browser.execute_script(
        "const own = [...document.querySelectorAll(`#${arguments[0]} .mark`)]"
        "  .filter((each) => each.dataset.key === arguments[1]);"
        "own[arguments[2]].scrollIntoView({ block: 'center' }); return own[arguments[2]]",
        *(figure, key, place),
    )
    box = browser.execute_script("const b = arguments[0].getBoundingClientRect(); return b.toJSON()", element)
    return element, box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def mouse(browser, kind, x, y, **more):
    browser.execute_cdp_cmd("Input.dispatchMouseEvent", {"type": kind, "x": x, "y": y, **more})


def click(browser, x, y):
    for kind in ("mouseMoved", "mousePressed", "mouseReleased"):
        mouse(browser, kind, x, y, **({} if kind == "mouseMoved" else {"button": "left", "clickCount": 1}))


def press(browser, key):
    from selenium.webdriver import ActionChains

    ActionChains(browser).send_keys(key).perform()


def mean_of(small, figure, level):
    data = next(drawing.data for drawing in small.figures if drawing.settings.name == figure)
    return next(row["mean"] for row in data.rows if row["level"] == level and row["attribute"] == "Soft")


def test_pointing_at_a_bar_tells_its_numbers(browser, small):
    _, x, y = mark(browser, "figure-means", HOSTILE)
    mouse(browser, "mouseMoved", x, y)
    lines = browser.execute_script(TIP).splitlines()
    assert HOSTILE in lines and "Soft" in lines
    assert f"{mean_of(small, 'means', HOSTILE):.2f}" in lines
    mouse(browser, "mouseMoved", 5, 5)
    assert browser.execute_script(TIP) == ""


def test_a_click_marks_the_same_in_two_figures_and_its_rows(browser):
    from selenium.webdriver.common.keys import Keys

    _, x, y = mark(browser, "figure-means", HOSTILE)
    click(browser, x, y)
    chosen = browser.execute_script(CHOSEN)
    assert {("g", "figure-means"), ("g", "figure-people"), ("tr", "figure-means"), ("tr", "tests")} <= {
        tuple(mark[:2]) for mark in chosen
    }
    assert all(HOSTILE in mark[2].split("\t") for mark in chosen)
    assert browser.execute_script("return document.querySelector('.chosen-bar').innerText").startswith(HOSTILE)
    dimmed = "return getComputedStyle(document.querySelector('#figure-means .mark:not(.chosen)')).opacity"
    assert float(browser.execute_script(dimmed)) < 0.5
    press(browser, Keys.ESCAPE)
    assert browser.execute_script(CHOSEN) == [] and browser.execute_script(TIP) == ""
    assert float(browser.execute_script(dimmed)) == 1


def test_a_pair_of_levels_is_found_by_both(browser):
    for key in ("g2", "g10"):
        _, x, y = mark(browser, "figure-means", key)
        click(browser, x, y)
        assert any({"g2", "g10"} == set(mark[2].split("\t")) for mark in browser.execute_script(CHOSEN))


def test_a_row_chooses_as_a_mark_does(browser):
    browser.execute_script("document.querySelector('#figure-means details:last-of-type').open = true")
    box = browser.execute_script(
        "const row = document.querySelector('#figure-means tr[data-key=g2]'); row.scrollIntoView({ block: 'center' });"
        "return row.getBoundingClientRect().toJSON()"
    )
    click(browser, box["x"] + 40, box["y"] + box["height"] / 2)
    assert ("g", "figure-people", "g2") in set(map(tuple, browser.execute_script(CHOSEN)))
    browser.execute_script("document.querySelector('.chosen-bar button').click()")
    assert browser.execute_script(CHOSEN) == []


def test_keys_alone_do_the_same(browser, small):
    from selenium.webdriver.common.keys import Keys

    for _ in range(12):
        press(browser, Keys.TAB)
        if browser.execute_script("return document.activeElement.matches('#figure-means .mark')"):
            break
    first = browser.execute_script("return document.activeElement.dataset.key")
    assert browser.execute_script("return getComputedStyle(document.activeElement).outlineStyle") == "solid"
    assert f"{mean_of(small, 'means', first):.2f}" in browser.execute_script(TIP).splitlines()
    press(browser, Keys.ARROW_RIGHT)
    second = browser.execute_script("return document.activeElement.dataset.key")
    assert second != first and f"{mean_of(small, 'means', second):.2f}" in browser.execute_script(TIP).splitlines()
    press(browser, Keys.ENTER)
    assert {"figure-means", "figure-people"} <= {mark[1] for mark in browser.execute_script(CHOSEN)}
    assert browser.execute_script("return document.activeElement.getAttribute('aria-pressed')") == "true"
    press(browser, Keys.ESCAPE)
    assert browser.execute_script(CHOSEN) == []
    press(browser, Keys.END)
    press(browser, Keys.ARROW_RIGHT)
    assert browser.execute_script("return document.activeElement.dataset.key") == first


def test_a_small_mark_is_hit_from_a_little_way_off(browser):
    small = browser.execute_script(
        "const dot = document.querySelector('#figure-cloud .mark'); dot.scrollIntoView({ block: 'center' });"
        "return [dot.dataset.key, dot.getBoundingClientRect().toJSON()]"
    )
    key, box = small
    assert box["width"] < 12
    mouse(browser, "mouseMoved", box["x"] + box["width"] / 2, box["y"] - 3)
    assert browser.execute_script(TIP) != "" and key.startswith("P")
    mouse(browser, "mouseMoved", box["x"] + box["width"] / 2, 2)
    assert browser.execute_script(TIP) == ""


def test_a_finger_reads_and_chooses(browser):
    emulate(browser, 390, 800)
    browser.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", {"enabled": True})
    try:
        _, x, y = mark(browser, "figure-means", "g2")
        for kind, points in (("touchStart", [{"x": x, "y": y}]), ("touchEnd", [])):
            browser.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
        assert "g2" in browser.execute_script(TIP)
        assert len(browser.execute_script(CHOSEN)) > 2
    finally:
        browser.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", {"enabled": False})


@pytest.mark.parametrize("width", [390, 1100])
def test_the_page_is_never_wider_than_the_screen(browser, width):
    emulate(browser, width, 800)
    browser.execute_script("document.querySelectorAll('details').forEach((each) => { each.open = true; })")
    assert browser.execute_script("return document.documentElement.scrollWidth") <= width


def test_no_name_becomes_an_element(browser):
    browser.execute_script("document.querySelectorAll('details').forEach((each) => { each.open = true; })")
    assert browser.execute_script("return document.scripts.length") == 1
    assert browser.execute_script("return document.querySelector('h1').textContent").startswith("Soft & <i>hard</i>")
    label = "return document.querySelector('.mark').getAttribute('aria-label')"
    assert HOSTILE in browser.execute_script(label)


def test_no_network_request_is_made(browser, address):
    log = "return performance.getEntriesByType('resource').map((each) => each.name)"
    assert [name for name in browser.execute_script(log) if not name.startswith("data:")] == []
    blocked = browser.execute_async_script(
        "const done = arguments[0]; document.addEventListener('securitypolicyviolation', (e) => done(e.blockedURI));"
        "const image = new Image(); image.src = 'http://127.0.0.1:9/x.png';"
    )
    assert blocked.startswith("http://127.0.0.1:9")
    assert all("Content Security Policy" in json.dumps(entry) for entry in browser.get_log("browser"))


def test_paper_shows_the_figures_as_they_are(browser):
    _, x, y = mark(browser, "figure-means", "g2")
    click(browser, x, y)
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
    shown = (
        "const style = (each) => getComputedStyle(document.querySelector(each));"
        "return [style('.tip').display, style('.chosen-bar').display,"
        " style('#figure-means .mark:not(.chosen)').opacity]"
    )
    assert browser.execute_script(shown) == ["none", "none", "1"]
    printed = browser.execute_cdp_cmd("Page.printToPDF", {})
    assert base64.b64decode(printed["data"]).startswith(b"%PDF")
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": ""})
