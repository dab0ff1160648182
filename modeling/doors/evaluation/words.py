"""Sentences of the report of an evaluation, which hold for any data."""

from __future__ import annotations

SPLITS = {
    "grouped": "grouped folds",
    "leave_one_door_out": "one door left out",
    "leaky": "leaky folds",
}
LEAD = (
    "Every method on the same folds, error and time side by side; each stimulus predicted by a model that had not "
    "seen it."
)
LINEAR = (
    "Simulated ratings: no person gave them. The simulated people are linear in columns of the stimulus table, and "
    "the methods on engineered features compute just such columns from a profile. The comparison favours these "
    "methods."
)
QUICK = (
    "A quick run, to see that everything works: three folds; networks saw the stimuli alone, for four epochs (the one "
    "from feeling to force: two); the generator had a small recipe; other splits, the search and (unless asked "
    "for) the figures are left out. Its numbers, and the default that they lead to, are nothing to go by."
)
LEAKY = "Leaky folds: variants of one stimulus lie on both sides. These errors say nothing about new doors."
PRIVATE = "The thesis' numbers rest on private data of other people: its doors bear the same labels, but are others."
RULES = {
    "grouped": (
        "Every stimulus is tested once, in one of the folds, by a model that saw neither it nor anything made from "
        "the same source, nor a profile that is nearly the same. Doors and variants are spread evenly over the "
        "folds."
    ),
    "leave_one_door_out": "Every door is tested by a model that saw the other doors only.",
    "leaky": (
        "Stimuli and their training variants are dealt out as they come, as in the thesis: what is tested was seen "
        "in training, but for a small change."
    ),
}
BY_SPLIT = (
    "Grouped folds count. With one door left out, a model meets a door that it never saw. In leaky folds, training "
    "variants of a tested stimulus lie in the training side: small errors there are no sign of a good model. "
    "Methods that take minutes are evaluated on another split only when it is asked for (--split)."
)
CEILING = (
    "The mean of a few people's ratings is noisy, so even the truth would miss it by this much. A model that is "
    "trained on the same people's other ratings lies between the two lines."
)
TIMES = (
    "Training is the sum over the folds; other jobs ran at the same time. An answer is one profile through the "
    "exported file with the rig's NumPy runtime, without torch. Off is the largest difference of the file's answers "
    "from those of the trained model, in percent of the range."
)
WISHES = (
    "A wish is the mean ratings of a stimulus that was held out, so it can be had. A made profile is evaluated twice: "
    "by how it feels (the loop: wish, profile, ratings again), and by how near it comes to the very waveform that "
    "got those ratings. Many doors feel alike, so the second error can stay large where the first is small."
)
FRESH = (
    "Their mean is noisy too: each person has a bias, a gain and noise. Without these, the same people are at the "
    "error in the last table; the difference is one that no profile could mend."
)
ATTAINABLE = (
    "A wish can be had where the profile of some method comes within 10 of it (the JND) in every attribute, as the "
    "forward model of the training side says, which knows neither the wished door nor what people say of the made one. "
    "The other wishes ask for more than the doors of the training side have."
)
JUDGE = (
    "The default forward method, trained on the same training side alone. The generator was trained through a model of "
    "that kind on that side: here it is evaluated by its own teacher."
)
SLIDERS = (
    "Attributes hang together: what is hard to pull is seldom comfortable. One slider alone cannot move as far as "
    "it is asked to."
)
FLOORS = (
    "Waveform MAE in percent of the range of forces. The thesis reports {theirs:.2f} % over folds in which variants "
    "of one profile fall on both sides; the leaky column, where it was evaluated, shows what that does. The floors "
    "use the held-out waveform itself, which no method is given: what they leave, no use of the ratings can mend."
)
LIMITS = (
    "A made profile may have at most {force:g} N and {slope:g} N/deg. Some measured doors break away more steeply "
    "than that: the nearest rated profile is counted as beyond the limits where it is one of them, though the door "
    "does play it."
)
CORNERS = (
    "Most corners ask for what no door has, such as a pull that is hard and comfortable. There the nearest "
    "profile that was found is made, and it is said how far its ratings lie from the wish (thesis 5.8.3). "
    "The corners are asked of the first fold's model."
)
MEASURED = (
    "The measured door and four edits that its authors made of it by hand (HapTune). The models here were trained "
    "without any stimulus of that door. Predicted is what they say of the profile, with an interval that holds 90 % "
    "of new ratings of stimuli like the others; recovered is what they say of the profile that the inverse makes of "
    "the predicted ratings; felt is what fresh simulated people say of that one."
)
SCALING = (
    "0 to 100 is the range of all mean ratings ({low:.2f} to {high:.2f} on the study's scale) and, for percent of "
    "the waveform, of all forces ({least:.1f} to {most:.1f} N), over the whole data set as in thesis 5.5.1."
)
UNROUNDED = (
    "Every number is unrounded in evaluation.json and in the folder tables; every prediction is in predictions.csv."
)
WORK_PRECISION = (
    "Each method's error against the time of its training (all folds) and of one answer from its exported file. "
    "Lower and farther left is better. Times were taken while other jobs ran; palpate bench doors takes them alone."
)
CURVES = "Loss against seconds of training, a colour for each fold; the point is the epoch whose weights were used."
PROFILES = (
    "For each door the stimulus whose profile was made with the median waveform error: grey the held-out profile "
    "that got the ratings, blue what {ours} makes of these ratings{network}. In brackets each one's waveform MAE in "
    "percent, and how far {judge} find its ratings from the wish."
)
