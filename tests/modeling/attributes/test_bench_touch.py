"""The bench from sensors to features: what was felt comes back."""

from modeling.attributes.bench_touch import cases


def test_what_was_felt_comes_back_within_half_a_percent():
    found = {each.method: each.error(each.run()) for each in cases(quick=True)}
    assert set(found) == {"as shipped", "hum not looked for"}
    assert all(0 < error < 0.5 for error in found.values())
