from protocols.wording import count


def test_one_thing_is_in_the_singular_and_thousands_are_set_apart():
    assert [count(n, "event") for n in (0, 1, 2, 12600)] == ["0 events", "1 event", "2 events", "12,600 events"]
    assert count(1, "stimulus", "stimuli") == "1 stimulus" and count(3, "stimulus", "stimuli") == "3 stimuli"
