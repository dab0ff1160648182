from palpate.protocols.wording import count, some, some_lines


def test_one_thing_is_in_the_singular_and_thousands_are_set_apart():
    assert [count(n, "event") for n in (0, 1, 2, 12600)] == ["0 events", "1 event", "2 events", "12,600 events"]
    assert count(1, "stimulus", "stimuli") == "1 stimulus" and count(3, "stimulus", "stimuli") == "3 stimuli"


def test_of_many_names_the_first_stand_and_how_many_more_there_are():
    assert some(["a", "b"]) == "a, b" and some([]) == ""
    assert some(range(2000), 3) == "0, 1, 2 and 1,997 more"
    assert some(("x: 1", "y: 2"), 1, "; ") == "x: 1 and 1 more"
    assert some_lines(["a", "b"], 2) == ["a", "b"] and some_lines(["a", "b"], 1) == ["a", "... and 1 more"]
