import numpy as np
import pytest

from palpate.signals.models.errors import ModelFileError
from palpate.signals.textures.gate import HELD_STEPS, RAMP
from palpate.signals.textures.guard import MOST
from palpate.signals.textures.sounds import RenderError
from palpate.signals.textures.voice import open_voice, play
from tests.devices.render.made import M, innovation, model, resonance, spectra, write
from tests.signals.models.cards import feeling

STROKE = 100.0, 1.0
NAN, INF = float("nan"), float("inf")


def felt(voice, count, speed=100.0, force=1.0):
    return np.array([voice.step(speed, force) for _ in range(count)])


def level(samples):
    return float(np.sqrt(np.mean(np.square(samples))))


class Cheap:
    """Answers as the model does, for one resonance, without the way through arrays; `spoil` changes an answer."""

    runtime = "by hand"

    def __init__(self, texture, spoil=lambda _n, answer: answer):
        self.card, self.spoil, self.n = texture.card, spoil, 0
        self.weights, self.log_sd = texture.tensors["w"][0, :M], float(texture.tensors["b"][1])

    def run(self, given):
        self.n += 1
        return self.spoil(self.n, (float(self.weights @ given[:M]), self.log_sd))


def test_continues_the_start_sequence_with_speed_and_force_of_the_last_steps():
    weights = np.arange(1.0, M + 1) / 100
    start = np.linspace(-1, 1, M)
    texture = model(weights=weights, outputs=1, start=start)
    texture.tensors["w"][0, 2 * M - 1] = 1e-4  # the newest speed
    voice, window, want = open_voice(texture, seed=0), list(start), []
    speeds = [100.0 + n for n in range(RAMP + 3)]
    for n, _ in enumerate(speeds):
        want.append(float(np.dot(weights, window[-M:])) + 1e-4 * speeds[max(0, n - 1)])
        window.append(want[-1])
    played = [voice.step(speed, 1.0) for speed in speeds]
    np.testing.assert_allclose(played[RAMP - 1 :], want[RAMP - 1 :], rtol=1e-5)


def test_equal_seeds_and_inputs_give_equal_bits_and_other_seeds_do_not():
    texture, n = model(), 3000
    speed, force = 100 + 90 * np.sin(np.arange(n) / 300), 1 + 0.9 * np.cos(np.arange(n) / 500)
    first = play(texture, speed, force, seed=3)
    assert first.tobytes() == play(texture, speed, force, seed=3).tobytes()
    assert first.tobytes() != play(texture, speed, force, seed=4).tobytes()


def test_sampled_it_keeps_the_level_of_its_training_and_by_its_mean_it_dies_away():
    texture, n = model(), 10_000
    sampled = play(texture, np.full(n, 100.0), np.full(n, 1.0), seed=1)
    mean = play(texture, np.full(n, 100.0), np.full(n, 1.0), seed=1, sampled=False)
    assert level(sampled) == pytest.approx(1.0, rel=0.1)
    assert level(mean[1000:]) < 1e-6


def test_a_conditional_scale_follows_the_speed():
    texture = model(by_speed=0.01, sd=innovation(resonance()) * np.exp(-1.0))
    slow, quick = (play(texture, np.full(8000, speed), np.full(8000, 1.0), seed=1) for speed in (50.0, 150.0))
    assert level(quick) / level(slow) == pytest.approx(np.e, rel=0.1)


@pytest.mark.parametrize(("speed", "force"), [(0.0, 0.0), (10.0, 1.0), (100.0, 0.15), (0.0, 3.0), (-50.0, 1.0)])
def test_at_rest_it_is_exactly_silent(speed, force):
    voice = open_voice(model(), seed=1)
    assert not felt(voice, 100, speed, force).any()
    felt(voice, 100)
    assert not felt(voice, 100, speed, force)[RAMP:].any()


def test_it_begins_and_stops_along_a_raised_cosine():
    texture = model(weights=np.zeros(M), outputs=1, bias=1.0, rms_m_s2=1.0)
    voice = open_voice(texture, seed=1)
    ramp = 0.5 - 0.5 * np.cos(np.pi * np.arange(1, RAMP + 1) / RAMP)
    np.testing.assert_allclose(felt(voice, RAMP), ramp, atol=1e-12)
    np.testing.assert_allclose(felt(voice, RAMP, 0.0, 0.0), [*ramp[-2::-1], 0.0], atol=1e-12)


def test_every_touch_begins_with_the_start_sequence():
    voice = open_voice(model(outputs=1), seed=1)
    first = felt(voice, 50)
    felt(voice, 20, 0.0, 0.0)
    np.testing.assert_array_equal(felt(voice, 50), first)


def test_what_no_sensor_can_mean_is_held_for_a_while_and_then_counts_as_rest():
    texture = model(outputs=1, weights=np.zeros(M), bias=0.5)
    texture.tensors["w"][0, 2 * M - 1] = 1e-3
    voice = open_voice(texture, seed=1)
    felt(voice, 50)
    for bad in (NAN, INF, -INF, 1e6, -1e6):
        np.testing.assert_allclose(felt(voice, HELD_STEPS, bad, 1.0), 0.6)
        assert voice.step(*STROKE) == pytest.approx(0.6)
        np.testing.assert_allclose(felt(voice, HELD_STEPS, 100.0, bad), 0.6)
        assert voice.step(*STROKE) == pytest.approx(0.6)
    longer = felt(voice, 100, NAN, NAN)
    np.testing.assert_allclose(longer[:HELD_STEPS], 0.6)
    assert not longer[HELD_STEPS + RAMP :].any()
    assert voice.tally.held == 10 * HELD_STEPS + 100


def test_speed_and_force_reach_the_model_within_its_training_and_a_little_more():
    seen = []

    class Listens(Cheap):
        def run(self, given):
            seen.append((given[2 * M - 1], given[-1]))
            return super().run(given)

    voice = open_voice(model(), seed=1, runs=Listens)
    for speed, force in [(12.0, 0.2), (4000.0, 90.0), *[STROKE] * 2]:
        voice.step(speed, force)
    assert seen[0] == pytest.approx((12.0, 0.2))
    assert seen[2] == pytest.approx((218.0, 3.27))  # 10 % of the span beyond 200 mm/s and 3 N


@pytest.mark.parametrize("wrong", [NAN, INF, -INF, 1e6, -1e6])
@pytest.mark.parametrize("everywhere", [True, False])
def test_a_spoilt_window_is_mended_within_100_ms(wrong, everywhere):
    voice = open_voice(model(), seed=1)
    felt(voice, 500)
    window = voice.sounding_model.window
    window[: None if everywhere else M] = wrong
    after = felt(voice, 100)
    assert np.isfinite(after).all()
    assert np.abs(after).max() <= voice.peak
    played = felt(voice, 4000)
    assert level(played) == pytest.approx(1.0, rel=0.15)
    assert level(played[:100]) < 1.6
    assert np.isfinite(window).all()


@pytest.mark.parametrize(
    "start",
    [np.full(M, NAN), np.full(M, 1e6), np.full(M + 1, 0.1), np.full(M, 5.9)],
    ids=["nan", "1e6", "long", "loud"],
)
def test_a_corrupted_start_sequence_is_not_used_and_the_voice_says_so(start):
    voice = open_voice(model(start=start), seed=1)
    assert "start sequence is not used" in voice.notes[0]
    played = felt(voice, 5000)
    assert level(played) == pytest.approx(1.0, rel=0.15)
    assert np.abs(played).max() <= voice.peak


def test_a_card_without_a_start_sequence_starts_with_noise():
    texture = model()
    bare = texture.card.model_copy(update={"texture": texture.card.texture.model_copy(update={"start": None})})
    voice = open_voice(type(texture)(bare, texture.tensors), seed=1)
    assert level(felt(voice, 3000)) == pytest.approx(1.0, rel=0.15)


@pytest.mark.parametrize("answer", [(NAN, 0.0), (0.0, NAN), (INF, 0.0), (0.0, INF), (-INF, -INF)])
def test_a_model_that_fails_for_a_moment_is_restarted_and_never_clicks_out_of_bounds(answer):
    texture = model()
    voice = open_voice(texture, seed=1, runs=lambda m: Cheap(m, lambda n, right: answer if n == 400 else right))
    played = felt(voice, 5000)
    assert np.isfinite(played).all()
    assert np.abs(played).max() <= voice.peak
    assert level(played[500:]) == pytest.approx(1.0, rel=0.15)


def test_a_model_that_left_its_level_is_back_within_100_ms():
    texture = model()

    def runs_away(n, right):
        return (6.1 * (-1) ** n, -5.0) if 300 <= n < 340 else right

    voice = open_voice(texture, seed=1, runs=lambda m: Cheap(m, runs_away))
    played = felt(voice, 3000)
    assert voice.tally.restarts >= 1
    assert level(played[440:]) == pytest.approx(1.0, rel=0.2)


def test_a_model_stuck_at_an_end_is_restarted():
    texture = model()
    voice = open_voice(texture, seed=1, runs=lambda m: Cheap(m, lambda n, ok: (3.4, -9.0) if 300 < n < 360 else ok))
    felt(voice, 300)
    assert voice.tally.restarts == 0
    felt(voice, 100)
    assert voice.tally.restarts >= 1


def test_an_unstable_model_stays_bounded_and_is_silent_for_longer_and_longer():
    voice = open_voice(model(weights=resonance(1.2), sd=0.1), seed=1)
    played = felt(voice, 5000)
    assert np.abs(played).max() <= voice.peak
    assert voice.tally.restarts > MOST
    assert np.count_nonzero(played[-1280:]) < 300
    felt(voice, 20, 0.0, 0.0)
    assert felt(voice, 20).any()


def test_a_stable_model_is_never_restarted_by_hand_movements():
    rng = np.random.default_rng(5)
    voice = open_voice(model(), seed=1, runs=Cheap)
    ends = [(11.0, 0.16), (300.0, 3.6), (11.0, 3.6), (300.0, 0.16), (0.0, 0.0), (1e6, 1.0), (NAN, NAN), (100.0, 1.0)]
    played = np.concatenate([felt(voice, 250, *ends[rng.integers(len(ends))]) for _ in range(240)])
    assert np.isfinite(played).all()
    assert np.abs(played).max() <= voice.peak
    assert voice.tally.restarts == 0
    assert voice.tally.steps == len(played) == 60_000


def test_a_silent_model_is_counted_and_not_restarted():
    voice = open_voice(model(), seed=1, sampled=False)
    felt(voice, 3000)
    assert voice.tally.restarts == 0
    assert voice.tally.quiet > 2000


def test_what_cannot_be_rendered_is_refused(tmp_path):
    with pytest.raises(RenderError, match=r"takes a force_profile and gives ratings: no model of a texture"):
        open_voice(feeling(tmp_path), seed=1)
    with pytest.raises(RenderError, match=r"made for 500 Hz"):
        open_voice(model(rate_hz=500.0), seed=1)
    with pytest.raises(RenderError, match=r"3 x 9"):
        open_voice(model(window=9), seed=1)
    with pytest.raises(RenderError, match=r"seed is -1"):
        open_voice(model(), seed=-1)
    with pytest.raises(RenderError, match=r"two rows of one length"):
        play(model(), np.zeros(3), np.zeros(4), seed=1)
    card = write(tmp_path, model())
    card.with_suffix(".safetensors").write_bytes(b"\0" * 10)
    with pytest.raises(ModelFileError, match=r"truncated"):
        open_voice(card, seed=1)


def test_blocks_keep_the_level_of_their_spectrum_without_a_seam():
    for texture in (spectra(), spectra(frames=1, size=64, hop=32), spectra(frames=4, size=48, hop=10, level=0.5)):
        played = play(texture, np.full(20_000, 100.0), np.full(20_000, 1.0), seed=2)
        expected = np.exp(texture.tensors["b"][0]) / np.sqrt(3 / 8 * texture.card.texture.window)
        assert level(played[RAMP:]) == pytest.approx(expected, rel=0.05)
        hop = texture.card.texture.hop * (texture.card.gives.size // (texture.card.texture.window // 2 + 1))
        folded = played[: len(played) // hop * hop].reshape(-1, hop)
        np.testing.assert_allclose(folded[10:].std(axis=0), expected, rtol=0.25)
        turns = np.abs(np.diff(played))[100:]
        assert turns[hop - 1 :: hop].mean() == pytest.approx(turns.mean(), rel=0.25)


def test_blocks_are_the_same_for_a_seed_and_never_repeat():
    texture = spectra()
    first = play(texture, np.full(4000, 100.0), np.full(4000, 1.0), seed=2)
    assert first.tobytes() == play(texture, np.full(4000, 100.0), np.full(4000, 1.0), seed=2).tobytes()
    later = first[1000:]
    correlation = np.correlate(later, later, "full")[len(later) - 1 :] / (later @ later)
    assert np.abs(correlation[32:2000]).max() < 0.1


def test_a_spectrum_that_explodes_is_bounded():
    texture = spectra()
    texture.tensors["b"][:] = 700.0
    assert np.abs(play(texture, np.full(500, 100.0), np.full(500, 1.0), seed=2)).max() <= 6.0


def test_blocks_whose_numbers_contradict_each_other_are_refused():
    with pytest.raises(RenderError, match=r"a hop of 20 samples between frames of 32; 1 to 16"):
        open_voice(spectra(hop=20), seed=1)
    texture = spectra()
    odd = texture.card.model_copy(update={"texture": texture.card.texture.model_copy(update={"window": 30})})
    with pytest.raises(RenderError, match=r"are no spectrum"):
        open_voice(type(texture)(odd, texture.tensors), seed=1)
