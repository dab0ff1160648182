import json
from collections import Counter
from itertools import pairwise
from pathlib import Path

import pytest

from palpate.protocols.balance import certificate
from palpate.protocols.orders import latin_row, rows_of, square, williams_row

CROSSDES = json.loads((Path(__file__).parent / "data" / "williams_crossdes.json").read_text())["designs"]


@pytest.mark.parametrize("n", range(2, 61))
def test_a_williams_design_is_balanced_for_position_and_carry_over(n):
    rows = square("williams", n)
    assert len(rows) == (n if n % 2 == 0 else 2 * n)
    assert all(sorted(row) == list(range(n)) for row in rows)
    positions = Counter((item, place) for row in rows for place, item in enumerate(row))
    assert set(positions.values()) == {len(rows) // n}
    assert len(positions) == n * n
    follows = Counter(pair for row in rows for pair in pairwise(row))
    assert set(follows.values()) == {1 if n % 2 == 0 else 2}
    assert len(follows) == n * (n - 1)


@pytest.mark.parametrize("n", range(2, 13))
def test_a_williams_design_is_the_one_of_r_crossdes(n):
    """Expected designs: R package crossdes 1.1-2, crossdes::williams(n)."""
    assert [list(row) for row in square("williams", n)] == CROSSDES[str(n)]


@pytest.mark.parametrize("n", range(1, 61))
def test_a_latin_square_has_every_item_once_per_row_and_position(n):
    rows = square("latin", n)
    assert len(rows) == n
    assert all(sorted(row) == list(range(n)) for row in (*rows, *zip(*rows, strict=True)))


def test_one_item_has_one_order():
    assert williams_row(1, 0) == latin_row(1, 0) == (0,)
    assert [rows_of(d, 1) for d in ("williams", "latin", "random", "as_listed")] == [1, 1, 1, 1]


def test_the_certificate_counts():
    counts = certificate([["a", "b", "c"], ["b", "a", "c"]])
    assert counts.positions == {"a": (1, 1, 0), "b": (1, 1, 0), "c": (0, 0, 2)}
    assert counts.carry_over == {("a", "b"): 1, ("b", "c"): 1, ("b", "a"): 1, ("a", "c"): 1}
    assert (counts.position_range, counts.carry_over_range, counts.balanced) == ((0, 2), (0, 1), False)
    assert "not balanced" in counts.text() and "0 to 2 times" in counts.text()


def test_a_full_williams_design_is_certified():
    counts = certificate([[f"s{item}" for item in row] for row in square("williams", 5)])
    assert counts.balanced and counts.text().startswith("10 sequences of 5 items: balanced.")
    assert "at each position 2 times and followed each other item 2 times" in counts.text()


def test_a_certificate_of_nothing_and_of_one():
    assert certificate([]).position_range == (0, 0)
    assert certificate([["a"]]).carry_over_range == (0, 0)


def test_parts_of_all_items_are_balanced_if_all_came_equally_often():
    parts = [["a", "b"], ["b", "c"], ["c", "a"]]
    counts = certificate(parts, part=True)
    assert counts.balanced and counts.items == ("a", "b", "c") and counts.times_range == (2, 2)
    assert counts.text() == "3 sequences of a part of 3 items: balanced. Each item came 2 times."
    assert certificate(parts[:2], part=True).times_range == (1, 2) and not certificate(parts[:2], part=True).balanced
    with pytest.raises(ValueError, match="sequence 1"):
        certificate([["a", "b"], ["c"]], part=True)


@pytest.mark.parametrize("rows", [[["a", "b"], ["a", "c"]], [["a", "b"], ["a", "b", "a"]]])
def test_sequences_of_different_items_have_no_certificate(rows):
    with pytest.raises(ValueError, match="sequence 1 does not hold the same items"):
        certificate(rows)
