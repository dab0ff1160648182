from palpate.modeling.attributes.choice import DEFAULT, choice, fusion


def row(method, mae, seconds=1.0, best_chance=False, ours_chance=False):
    told = {"best_chance": best_chance, "ours_chance": ours_chance}
    return {"method": method, "title": method.upper(), "mae": mae, "train_s": seconds, **told}


def test_the_least_mae_is_the_default_and_of_equals_the_faster():
    assert choice([row("ridge", 9.0), row("boosting", 8.0), row("visuo_tactile", 8.5)]).method == "boosting"
    assert choice([row("ridge", 8.0, 3.0), row("boosting", 8.0, 2.0)]).method == "boosting"


def test_a_method_that_was_refused_is_no_default():
    assert choice([row("ridge", 9.0), row("boosting", None)]).method == "ridge"
    found = choice([row("ridge", None)])
    assert found.method == DEFAULT
    assert "shipped default stays" in found.why


def test_where_the_proposed_network_is_not_the_best_the_report_says_which_is_and_whether_that_is_chance():
    (told,) = choice([row("ridge", 8.0), row("visuo_tactile", 9.5)]).of_ours
    assert told == "The MAE of the thesis' network is not the lowest: 9.50, 1.50 more than that of RIDGE."
    (told,) = choice([row("ridge", 8.0), row("visuo_tactile", 9.5, best_chance=True)]).of_ours
    assert told.endswith("RIDGE, which may be chance.")
    assert "not evaluated" in choice([row("ridge", 8.0)]).of_ours[0]


def test_where_it_is_the_best_its_lead_is_weighed():
    rows = [row("visuo_tactile", 5.0), row("ridge", 6.0, best_chance=True), row("mean", 20.0)]
    assert choice(rows).of_ours == (
        "The MAE of the thesis' network is the lowest.",
        "Its lead over RIDGE may be chance.",
    )
    assert choice([row("visuo_tactile", 5.0), row("mean", 20.0)]).of_ours[1] == "No interval of its leads holds 0."


def test_fusion_is_told_as_reached_or_not():
    both = [row("visuo_tactile", 5.0), row("hv_net", 8.0), row("ht_net", 6.0, ours_chance=True)]
    label, told = fusion(both)
    assert label == "Fusion"
    assert told.endswith("(MAE; wanted: less than each branch by itself): reached.")
    assert "HT_NET 6.00 (a difference that may be chance)" in told
    assert fusion([row("visuo_tactile", 7.0), *both[1:]])[1].endswith("not reached.")
    assert fusion(both[:2]) is None
    assert fusion([row("visuo_tactile", None), *both[1:]]) is None
