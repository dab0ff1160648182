from palpate.modeling.textures.evaluation.evaluate import better, choice


def row(method, plausible_runs, felt, ran=6):
    return {"method": method, "title": method.upper(), "kept": plausible_runs, "ran": ran, "felt_dB": felt}


def on(texture, method, beyond, felt):
    return {"texture": texture, "method": method, "beyond": beyond, "felt_dB": felt}


def test_the_limits_count_before_the_distance_and_then_the_distance():
    rows = [row("dstn", 2, 0.1), row("foten_generative", 5, 1.0), row("hapinf", 5, 0.9)]
    assert choice(rows, []).method == "hapinf"


def test_a_method_that_refuses_most_textures_is_no_default():
    assert choice([row("foten_generative", 3, 1.0, ran=6), row("ar", 2, 0.5, ran=2)], []).method == "foten_generative"
    assert choice([row("foten_generative", 0, 1.0, ran=6), row("ar", 0, 0.5, ran=2)], []).method == "foten_generative"
    assert choice([row("foten_generative", 2, 1.0), row("ar", 2, 0.5)], []).method == "ar"


def test_a_baseline_that_wins_is_named_as_such():
    lines = choice([row("ar", 6, 0.5), row("foten_generative", 4, 1.0)], []).of_ours
    assert any(line.startswith("A baseline wins: AR beats FOTEN_GENERATIVE") for line in lines)
    assert not any("baseline wins" in line for line in choice([row("foten_generative", 6, 0.5)], []).of_ours)


def test_where_the_shipped_default_was_not_evaluated_it_stays_and_that_is_reported():
    assert "foten_generative, was not evaluated" in choice([row("ar", 6, 0.5)], []).of_ours[-1]
    assert not any(
        "not evaluated" in line for line in choice([row("ar", 6, 0.5), row("foten_generative", 1, 1)], []).of_ours
    )


def test_one_step_errors_alone_choose_nothing():
    default = choice([{"method": "ar", "title": "AR", "kept": 0, "ran": 0, "felt_dB": None, "mae": 0.01}], [])
    assert default.method == "foten_generative"
    assert "shipped default stays" in default.why


def test_nearer_is_fewer_limits_broken_and_then_less_off():
    rows = [
        on("a", "x", "", 2.0), on("a", "y", "level", 0.1),
        on("b", "x", "level", 1.0), on("b", "y", "envelope", 2.0),
        on("c", "x", "", 2.0), on("c", "y", "", 1.0),
        on("d", "x", "", 1.0),
    ]  # fmt: skip
    assert better(rows, "x", "y") == (3, 4)  # on d the other one did not run
    assert better(rows, "y", "x") == (1, 4)
