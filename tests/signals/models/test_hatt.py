"""A texture in the format of the Penn Haptic Texture Toolkit plays as there; a damaged one is refused."""

from __future__ import annotations

import re
import shutil

import numpy as np
import pytest

from palpate.signals.models.errors import ModelFileError
from palpate.signals.models.file import read_model
from palpate.signals.models.hatt import read_hatt_file
from tests.signals.models.make_hatt import AR, FILE, GAIN, MA, POINTS, VARIANCE, polynomial, text

BAND = slice(20, 500)


def without_average(written):
    """The same texture as an AR model."""
    written = re.sub(r" *<MA(coeff|lsf)>.*?</MA\1>\n", "", written, flags=re.DOTALL)
    return re.sub(r" *<gain>.*</gain>\n", "", written).replace("<numMACoeff>2<", "<numMACoeff>0<")


def saved(folder, written):
    path = folder / "Models_x.xml"
    path.write_text(written)
    return path


def predictor_at(model, speed, force):
    """The predictor's weights of the past, newest first, and the SD of its innovations."""
    window = model.card.texture.window
    hand = np.repeat([speed, force], window)
    answers = model.run(np.concatenate([np.eye(window), np.tile(hand, (window, 1))], axis=1))
    return answers[::-1, 0], np.exp(answers[0, 1])


def spectrum(model, speed, force):
    weights, sd = predictor_at(model, speed, force)
    return sd**2 / np.abs(np.fft.rfft(np.append(1.0, -weights), 1000)) ** 2


def toolkits(shares, average=True):
    """The spectrum that the toolkit plays: frequencies, variance and gain interpolated."""

    def mixed(rows):
        return shares @ np.array(rows)

    level = mixed(VARIANCE) / np.abs(np.fft.rfft(polynomial(mixed(AR)), 1000)) ** 2
    return level * mixed(GAIN) ** 2 * np.abs(np.fft.rfft(polynomial(mixed(MA)), 1000)) ** 2 if average else level


def test_the_small_file_is_as_the_format_says():
    assert FILE.read_text() == text()
    table, _ = read_hatt_file(FILE)
    assert (table.material, table.rate_hz, table.friction) == ("Small Sample", 1000.0, 0.4)
    np.testing.assert_allclose(table.points, POINTS)
    np.testing.assert_allclose(table.ar, AR)
    np.testing.assert_allclose(table.ma, MA)
    np.testing.assert_allclose(table.variance, VARIANCE)
    assert table.triangles.tolist() == [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]


HANDS = [
    (60.0, 1.0, [0, 0, 0, 0, 1.0]), (120.0, 2.0, [0, 0, 1.0, 0, 0]), (90.0, 0.5, [0, 0.5, 0, 0, 0.5]),
    (100.0, 1.0, [0, 1 / 3, 1 / 3, 0, 1 / 3]), (300.0, 9.0, [0, 0, 1.0, 0, 0]), (40.0, 1.7, None),
]  # fmt: skip


def shares_at(speed, force):
    """Within the upper triangle (points 3, 4, 5)."""
    corners = np.array([POINTS[2], POINTS[3], POINTS[4]]).T
    shares = np.zeros(5)
    shares[2:] = np.linalg.solve(np.vstack([corners, np.ones(3)]), [speed, force, 1])
    return shares


@pytest.mark.parametrize(("speed", "force", "shares"), HANDS)
def test_an_ar_model_plays_exactly_as_in_the_toolkit(tmp_path, speed, force, shares):
    model = read_model(saved(tmp_path, without_average(text())))
    shares = np.array(shares) if shares is not None else shares_at(speed, force)
    weights, sd = predictor_at(model, speed, force)
    assert sd == pytest.approx(np.sqrt(shares @ np.array(VARIANCE)), rel=1e-9)
    at_point = shares.max() == 1
    expected = -np.array(polynomial(shares @ np.array(AR)))[1:]
    np.testing.assert_allclose(weights, expected, atol=1e-9 if at_point else 5e-3)


@pytest.mark.parametrize(("speed", "force", "shares"), HANDS)
def test_a_moving_average_keeps_its_spectrum(speed, force, shares):
    model = read_model(FILE)
    shares = np.array(shares) if shares is not None else shares_at(speed, force)
    expected, actual = toolkits(shares)[BAND], spectrum(model, speed, force)[BAND]
    apart = 10 * np.log10(actual / expected)
    assert np.sqrt(np.mean(apart**2)) < 0.5
    assert abs(10 * np.log10(actual.sum() / expected.sum())) < 0.3


def test_where_the_variance_is_0_it_is_silent_and_fades_in_between():
    model = read_model(FILE)
    assert predictor_at(model, 0.0, 0.0)[1] < 1e-4
    levels = [predictor_at(model, speed, 0.0)[1] ** 2 for speed in (0.0, 20.0, 40.0)]
    assert levels[1] == pytest.approx((levels[0] + levels[2]) / 2, rel=1e-6)


def test_the_card_says_what_a_renderer_needs():
    model = read_model(FILE)
    texture = model.card.texture
    assert (model.card.name, texture.label, texture.rate_hz) == ("hatt-small_sample", "Small Sample", 1000.0)
    assert (texture.speed_mm_s, texture.force_N) == ((0.0, 120.0), (0.0, 2.0))
    assert (model.card.takes.size, model.card.gives.size) == (3 * texture.window, 2)
    start = model.tensors[texture.start]
    weights, sd = predictor_at(model, 45.0, 0.8)
    steady = sd * np.sqrt(np.sum(np.fft.irfft(1 / np.abs(np.fft.rfft(np.append(1, -weights), 2**14)) ** 2)[0]))
    assert start.shape == (texture.window,)
    assert 0.3 < start.std() / steady < 3
    assert 0 < texture.rms_m_s2 < texture.peak_m_s2


def test_poles_that_lie_too_far_out_are_drawn_in(tmp_path):
    edge = text().replace("<value>0.620000</value>", "<value>0.300010</value>")
    model = read_model(saved(tmp_path, without_average(edge)))
    for speed in np.linspace(0, 120, 13):
        for force in np.linspace(0, 2, 7):
            weights, _ = predictor_at(model, speed, force)
            assert np.abs(np.roots([1.0, *-weights])).max() < 0.999


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("<modelSet", "<models", "it is not XML"),
        ("modelSet", "models", "it begins with <models>; <modelSet> is expected"),
        ("<modelSet", "<!DOCTYPE x [<!ENTITY a 'b'>]><modelSet", "declares entities"),
        ("mm/s", "m/s", "SpeedUnits is 'm/s'; 'mm/s' is expected"),
        ("<numMod>5<", "<numMod>6<", "numMod is 6, and there are 5 models"),
        ("<modNum>2<", "<modNum>1<", "modNum does not count the models from 1 to 5"),
        ("<ARlsf>", "<ARxxx>", "it is not XML"),
        ("<value>0.300000</value>", "", "ARlsf has .3, 4. values; as many for all models"),
        ("<value>0.300000</value>", "<value>0.7</value>", "ARlsf does not rise .* not stable"),
        ("<value>2.200000</value>", "<value>3.2</value>", "ARlsf does not rise"),
        ("<value>1.900000</value>", "<value>0.8</value>", "MAlsf does not rise"),
        ("<value>0.300000</value>", "<value>nan</value>", "ARlsf of model 1 holds nan"),
        ("<value>0.300000</value>", "<value>x</value>", "ARlsf of model 1 holds 'x'; a number"),
        ("<var>0.020000</var>", "", "there is no var in a model"),
        ("<var>0.020000</var>", "<var>-1</var>", "a variance, speed or force lies below 0"),
        ("<gain>2.000000</gain>", "", "there is no gain in a model"),
        ("<gain>2.000000</gain>", "<gain>1e200</gain>", r"a speed, force, variance or gain is 1e\+200; at most 1e\+09"),
        ("<SampleRate>1000<", "<SampleRate>0<", "SampleRate is 0"),
        ("<value>5</value>", "<value>6</value>", "a triangle names a model that is not there; there are 1 to 5"),
        ("      <value>5</value>\n", "", "4 triangles .* found; one at least, of three model numbers each"),
    ],
)  # fmt: skip
def test_a_damaged_file_is_refused(tmp_path, old, new, words):
    written = text()
    assert old in written
    count = -1 if old == "modelSet" else 1
    path = saved(tmp_path, written.replace(old, new, count))
    with pytest.raises(ModelFileError, match=words) as refused:
        read_model(path)
    assert str(refused.value).startswith(str(path))


def test_poles_that_lie_on_each_other_are_not_converted(tmp_path):
    tiny = "".join(f"<value>{place}e-300</value>" for place in (1, 2, 3, 4))
    written = re.sub("<ARlsf>.*?</ARlsf>", f"<ARlsf>{tiny}</ARlsf>", text(), count=1, flags=re.S)
    with pytest.raises(ModelFileError, match="Models_x.xml: ARlsf and MAlsf .* too near the edge of what is stable"):
        read_model(saved(tmp_path, written))
    assert np.isfinite(predictor_at(read_model(saved(tmp_path, without_average(written))), 45.0, 0.8)[0]).all()


@pytest.mark.parametrize(
    ("content", "words"),
    [(b"", "not XML"), (b"\xff\xfe<", "not UTF-8 text"), (text().encode()[:2000], "not XML"), (b"<a/>", "<a>"),
     (b"<modelSet/>", "0 models found")],
)  # fmt: skip
def test_a_foreign_file_is_refused(tmp_path, content, words):
    path = tmp_path / "Models_x.xml"
    path.write_bytes(content)
    with pytest.raises(ModelFileError, match=words):
        read_model(path)
    path.unlink()
    with pytest.raises(ModelFileError, match="there is no such file"):
        read_model(path)


def test_it_is_read_where_it_lies(tmp_path, monkeypatch):
    from palpate.devices.models.lookup import find_model

    shutil.copy(FILE, tmp_path)
    monkeypatch.chdir(tmp_path)
    assert read_model(find_model("Models_Small.xml", tmp_path)).card.method == "hatt"
