"""Sentences of the report of an evaluation, which hold for any data."""

from __future__ import annotations

TITLE = "How textures feel, predicted"
LEAD = (
    "Every method is fitted without each texture in turn, and asked how that one is rated. The folds are the same for "
    "all of them. Errors are on 0 to 100; 0 is the first adjective of a pair, 100 the second."
)
SIMULATED = (
    "Simulated: no person rated anything and no material was recorded. Surfaces, sensors and raters are models, and "
    "what predicts them well need not predict people."
)
QUICK = (
    "A quick run, to see that everything works: {count} textures were left out, and networks learned for few epochs. "
    "Its numbers, and the default that they lead to, are nothing to go by."
)
FEW_EPOCHS = "Networks learned for at most {epochs} epochs, as requested."
EARLY = "The thesis' network and its halves watched a tenth of the textures to stop early, as requested."
FEW_FOLDS = (
    "{count} of {textures} textures were left out, in turn from each class, as it was asked for; each was predicted "
    "from all others. `palpate train attributes` does not go by the default that this leads to."
)
WEIGHTS = "Weights of ResNet-50: {weights}."
FOLDS = (
    "Leave one texture out: a texture with all its segments and pictures stands on one side. Textures that share a "
    "recording, a picture or a row of features are one group, and the whole group is kept from learning. Baselines "
    "that stop early (ANN, CNNs, CNN-LSTM) watch a tenth of the other textures, drawn in turn from the classes; the "
    "thesis' network, unless it is asked to, and all others learn from these too. A texture's prediction is the mean "
    "over its segments and pictures, cut at the ends of the scale."
)
APART = "Textures that share content, and were never divided: {groups}."
MAE_NOTE = "Equation 3.1, over {count} textures. Bold: the least. The thesis' numbers rest on private data."
RMSE_NOTE = "Equation 3.2, over {count} textures. Bold: the least. The thesis' numbers rest on private data."
SAME = (
    "RMSE of the single-sense methods on the features of this study: ResNet-50 and co-occurrence for vision, MFCC and "
    "the hand's statistics for touch. So what is compared is the method alone."
)
KINDS = (
    "RMSE by kind of feature: each branch of the thesis' network on one kind at a time, and ridge regression on the "
    "same kinds, which has no chance of its own. The hand's statistics go with each kind of touch."
)
DIFFERENCES = (
    "More than: the mean over textures of the difference of MAE from the best method and from the thesis' network, so "
    "it is the difference of the MAEs themselves. Textures that share content may err together: the intervals' errors "
    "are taken over groups of them. All intervals of both columns hold together with 95 % (Bonferroni over every pair "
    "of methods that is shown). An interval that holds 0 says that the difference may be chance. The best is chosen on "
    "these very textures: its own error is a little flattered."
)
INTERVALS = (
    "Intervals of 90 %: as wide as the k-th smallest of n absolute errors of textures that were left out, k the least "
    "whole number of at least 0.9 (n + 1). Coverage is counted with each group's own errors left out. A new texture is"
    " within them nine times of ten if it is drawn like these, and by a model that was fitted to one texture more."
)
TIMES = (
    "Features: seconds from what the sensors and the camera gave of one texture (60 s, ten pictures) to what a method "
    "looks at, on one core; ResNet-50 is asked about seven patches, and the other 483 are taken to be like them. "
    "Training: of one fold, on one core beside others at work, the median. Answer: of one texture, features given, "
    "the median."
)
NO_FEATURE_TIMES = "Features were not timed here."
CLASSES = "MAE of {title} by class of material, 0 to 100."
FIGURE_3_8 = (
    "What people said of each texture, with their SD, and what {title} predicted without having seen that texture; "
    "-100 is the first adjective, 100 the second."
)
WORK_PRECISION = (
    "MAE (0 to 100) against the time of a fold's training, and of one answer. Lower and farther left is better. Times "
    "were taken while other jobs ran."
)
CURVES = (
    "Loss against seconds of training, a colour for each texture left out (the first eight); the point is the epoch "
    "that was kept."
)
UNROUNDED = (
    "Every number is unrounded in evaluation.json and in the folder tables; every prediction is in predictions.csv."
)
BRANCHES = (
    "What each sense is worth here is shown by the branches, each by itself, beside both together. In the simulated "
    "study, vision sees neither friction nor compliance, and touch feels no large bumps."
)
