import pytest

from palpate.protocols.yaml_text import LARGEST_BYTES, YamlError, load


def test_values_and_their_lines():
    document = load(b"a: 1\nb:\n  - x: no\n  - 12:30\n", "f.yaml")
    assert document.data == {"a": 1, "b": [{"x": "no"}, "12:30"]}
    assert document.lines[("b", 0, "x")] == 3
    assert document.lines[("b", 1)] == 4


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("no", "no"), ("yes", "yes"), ("on", "on"), ("2024-01-01", "2024-01-01"), ("1_000", "1_000"), ("010", 10),
        ("0x1f", "0x1f"), ("true", True), ("null", None), ("~", None), ("1.5", 1.5), ("-3", -3), ("1e3", 1000.0),
        (".5", 0.5), ("None", "None"), (".nan", ".nan"), (".inf", ".inf"), ("", None),
    ],
)  # fmt: skip
def test_a_scalar_is_what_it_looks_like(text, value):
    loaded = load(f"a: {text}\n".encode(), "f.yaml").data["a"]
    assert loaded == value and type(loaded) is type(value)


BOMB = "a: &a [x, x]\nb: &b [*a, *a]\nc: &c [*b, *b]\nd: [*c, *c]\n"


@pytest.mark.parametrize(
    ("text", "why"),
    [
        (BOMB.encode(), "line 1, column 4: anchors and aliases"),
        (b"a: *nowhere\n", "line 1, column 4: anchors and aliases"),
        (b"a: !!python/object/apply:os.system [ls]\n", "line 1: the tag .*python.* is not read here"),
        (b"a: !mine 3\n", "line 1: the tag !mine is not read here"),
        (b"a: !!binary aGk=\n", "the tag .*binary is not read here"),
        (b"a: !!set {x}\n", "the tag .*set is not read here"),
        (b"a: 1\nb: 2\na: 3\n", "line 3: the key 'a' appears twice"),
        (b"a: 1\n'a': 2\n", "line 2: the key 'a' appears twice"),
        (b"1: x\n01: y\n", "line 2: the key '01' appears twice"),
        (b"1: x\n'1': y\n", "line 2: the key '1' appears twice"),
        (b"a: " + b"9" * 5000, "line 1, column 4: a number of 5000 digits"),
        (b"? [x]\n: 1\n", "line 1: a key must be plain text"),
        (b"a: [1\n", "line 2, column 1: while parsing a flow sequence, expected"),
        (b"a: {text: Are you well?, answer: no}\n", "line 1, column 23: .*but got '.'; close it, or quote a text that"),
        (b"a: 1\n--- \nb: 2\n", "expected a single document in the stream, but found another"),
        (b"caf\xe9: 1\n", "line 1: byte 0xe9 is not UTF-8"),
        (b"x: 1\ny: \xff\n", "line 2: byte 0xff is not UTF-8"),
        (b"", "the file is empty"),
        (b"# only a comment\n", "the file is empty"),
        (b"a: \x07\n", "not allowed in YAML"),
        (b"x" * (LARGEST_BYTES + 1), "at most 1,000,000 bytes"),
        (b"[" * 60 + b"]" * 60, "nested deeper than 40 levels"),
        (b"[" * 20000, "nested deeper than 40 levels"),
    ],
)
def test_tricks_are_refused_with_file_line_and_reason(text, why):
    with pytest.raises(YamlError, match=why) as caught:
        load(text, "f.yaml")
    assert str(caught.value).startswith("f.yaml:")
    assert len(str(caught.value)) < 300


def test_a_byte_order_mark_is_no_part_of_the_text():
    assert load(b"\xef\xbb\xbfa: 1\n", "f.yaml").data == {"a": 1}


@pytest.mark.untraced
def test_many_keys_are_read_in_one_pass():
    text = "".join(f"k{i}: {i}\n" for i in range(4_000)).encode()
    assert len(load(text, "f.yaml").data) == 4_000
