"""Sentences of the report of an evaluation of textures, which hold for any data."""

from __future__ import annotations

TITLE = "Texture models side by side"
LEAD = (
    "Every method on the same recordings, in the same parts. First run on its own output, as a hand feels it; then one "
    "step ahead, as the thesis has it; then the time that it takes."
)
SIMULATED = "Simulated surfaces: no person touched anything. They bear the names of the thesis' textures."
QUICK = (
    "A quick run, to see that everything works: networks saw the data for few epochs, and models ran for ten seconds. "
    "Its numbers, and the default that they lead to, are nothing to go by."
)
PRIVATE = (
    "The thesis' numbers rest on private recordings of other surfaces with the same names; its means are over its six."
)
SEEN = (
    "{textures}: too short for a test part of 2 s. Models ran free under the hand of the whole recording, which they "
    "were trained on."
)
FREE = (
    "The model runs through the renderer's own player from its file, on its own output, under the speed and force of "
    "{origin}, for {seconds:g} s. So what is evaluated is what is played: with the renderer's limits, and its silence "
    "where the hand rests (below 10 mm/s or 0.15 N)."
)
ORIGINS = {
    "another exploration": "another exploration of the same surface, which no model has seen",
    "test part": "the recording's own test part, there and back",
    "whole recording": "the whole recording, there and back",
}
MEASURES = (
    "Level: RMS over the truth's. Smoothed GFC: equation 4.11 over the square roots of Welch spectra (Hann windows of "
    "256 ms, half overlapped: 5.9 Hz of bandwidth); it is blind to level. Envelope: correlation with the truth's, of "
    "RMS in windows of 250 ms. Repeats: the greatest autocorrelation at lags of 0.3 to 1 s within windows of 2 s, over "
    "the truth's; a limit cycle shows here. Felt: RMS over third octaves (25 to 400 Hz) of the difference of levels "
    "above the vibrotactile threshold (Verrillo 1963; Bolanowski et al. 1988; Gescheider et al. 2001)."
)
WORST = "Limits are checked for each texture; the columns show the worst texture, felt and one step ahead the mean."
SAME_HAND = (
    "Another realisation is the same hand's movement elsewhere on the surface: what even a perfect model could reach."
)
OTHER_HAND = (
    "Another realisation is {what}: it says how far level, spectrum and repetition of the truth differ from itself. "
    "Its envelope follows another hand, so there is no ceiling of the envelope correlation."
)
HALVES = "the recording's first half against its second"
VALIDATION = "the validation part"
ONE_STEP = (
    "The next sample is predicted from true ones: no error can build up. MAE is in standard deviations of the training "
    "part's acceleration (the thesis does not say in which unit its own is; the tables also have m/s²), GFC is "
    "equation 4.11 over the raw DFT amplitudes of the whole test part. All methods predict the same samples: the first "
    "40 of each stretch are no one's."
)
BLIND = (
    "One step ahead hides whether a model lives: nearly all of the next sample follows from the last ones, so methods "
    "that die on their own output stand beside those that do not."
)
BLOCKS = (
    "{titles}: makes spectra and does not look at the past, so there is no step to predict. Its MAE is of what it "
    "makes for the test part's hand against the truth: two independent noises of one level are 1.13 apart."
)
TIMES = (
    "A step is one sample from the exported file, one thread, for each runtime that this machine has, timed after all "
    "else was done; its error is the largest difference from the float64 reference, in standard deviations of the "
    "answers. At 1 kHz a step has 1000 µs. Training ran while other jobs ran. The thesis' times are of its machines: "
    "TFLite on a CPU."
)
FIGURE_4_5 = "Mean MAE of the test part over {count} textures, for each window and loss of FoTEN. Lower is better."
FIGURE_4_6 = (
    "The first 400 samples of the test part (the first 40 of a stretch are not predicted) and what {title} predicts "
    "for each from the true ones before it. In brackets the MAE in standard deviations."
)
FIGURE_4_6_FREE = (
    "The same method on its own output alone: the first 400 samples from where the hand touches and moves, its "
    "beginning included, and the truth for the same hand ({hand}). No model sees the truth here, so waves differ, and "
    "level and character should not. In brackets the level against the truth's in the first 100 samples, and in the "
    "300 after these: the thesis says that a model is accurate after fewer than 100."
)
FIGURE_4_7 = "Power spectral density of the whole test part and of what {title} says of it, one step ahead."
FREE_SPECTRA = "Power spectral density of the truth and of what each model made on its own output."
FREE_WAVES = (
    "A quarter of a second in m/s², where the hand moves, of the truth and of what models made on their own output "
    "under the same hand: no model sees the truth, so waves differ, and level and character should not."
)
ENVELOPES = (
    "RMS in windows of 250 ms of the truth and of what each model made on its own output, over the first 20 s; the "
    "correlations in the tables are over the whole."
)
WORK_PRECISION = (
    "How far off the felt levels are (mean over the textures, dB) against the time of a step (filled: the fastest "
    "runtime; open: the others) and of a texture's training. Lower and farther left is better."
)
CURVES = "Loss against seconds of training, a colour for each texture; the point is the epoch whose weights were used."
UNROUNDED = "Every number is unrounded in evaluation.json and in the folder tables."
NO_GRID = "Figure 4.5, five windows by five losses, is drawn where it is asked for (--figure-4-5): it takes hours."
