"""Statistics of ranks and of ordered answers: Friedman, Nemenyi, Wilcoxon, aligned ranks, ordinal models, Likert."""
