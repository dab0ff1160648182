# Reference numbers for tests/analysis/reliability, with 17 digits. Run: Rscript reliability.R > reliability.json
suppressPackageStartupMessages({library(psych); library(vegan); library(jsonlite)})

iccs <- function(wide) {
  found <- ICC(as.matrix(wide), lmer = FALSE)$results
  lapply(seq_len(6), function(i) list(
    type = found$type[i], ICC = found$ICC[i], F = found$F[i], df1 = found$df1[i], df2 = found$df2[i], p = found$p[i],
    lower = found$`lower bound`[i], upper = found$`upper bound`[i]))
}

alphas <- function(wide) {
  capture.output(found <- suppressWarnings(alpha(as.data.frame(wide), check.keys = FALSE)))
  n <- nrow(wide); k <- ncol(wide)
  total <- found$total
  ci <- psych:::alpha.ci(as.numeric(total$raw_alpha), n, k)
  list(raw_alpha = total$raw_alpha, std_alpha = total$std.alpha, average_r = total$average_r,
    feldt_low = ci$lower.ci, feldt_high = ci$upper.ci,
    items = colnames(wide), alpha_if_dropped = found$alpha.drop$raw_alpha, item_total = found$item.stats$raw.r,
    item_rest = found$item.stats$r.drop, mean = found$item.stats$mean, sd = found$item.stats$sd)
}

concordance <- function(wide) {  # rows are targets, columns raters
  friedman <- friedman.test(t(as.matrix(wide)))
  kendall <- kendall.global(as.matrix(wide), nperm = 9)
  list(W = unname(kendall$Concordance_analysis[1, 1]), chi2 = unname(friedman$statistic),
    df = unname(friedman$parameter), p = friedman$p.value)
}

again <- function(first, second) {
  found <- cor.test(first, second)
  difference <- second - first
  test <- t.test(second, first, paired = TRUE)
  list(first = first, second = second, r = unname(found$estimate), r_low = found$conf.int[1],
    r_high = found$conf.int[2], p = found$p.value, bias = mean(difference), bias_low = test$conf.int[1],
    bias_high = test$conf.int[2], sd_difference = sd(difference), icc = iccs(cbind(first, second)))
}

all_of <- function(wide) list(
  wide = unname(lapply(seq_len(nrow(wide)), function(i) as.numeric(wide[i, ]))), items = colnames(wide),
  icc = iccs(wide), alpha = alphas(wide), kendall = concordance(wide))

set.seed(20)
disagreeing <- round(matrix(rnorm(40, 50, 10), 10, 4), 1); disagreeing[, 2] <- 100 - disagreeing[, 1] + round(rnorm(10), 1)
colnames(disagreeing) <- paste0("r", 1:4)
tied <- matrix(sample(1:4, 12 * 7, TRUE), 12, 7); colnames(tied) <- paste0("r", 1:7)
many <- round(outer(rnorm(50, 50, 15), rnorm(26, 0, 5), "+") + matrix(rnorm(1300, 0, 12), 50, 26))
colnames(many) <- sprintf("P%03d", 1:26)

exact <- function(x) if (is.numeric(x)) sprintf("%.17g", x) else x  # jsonlite writes 15 digits
written <- function(x) gsub('"(-?[0-9]+([.][0-9]+)?(e[+-]?[0-9]+)?)"', '\\1', toJSON(rapply(x, exact, how = "replace"), auto_unbox = TRUE))

cat(written(list(
  made_with = list(R = R.version.string, psych = as.character(packageVersion("psych")),
    vegan = as.character(packageVersion("vegan")), script = "reliability.R",
    data = "USJudgeRatings: R datasets (Hartigan 1977, Clustering Algorithms), GPL-2 | GPL-3; attitude, sleep: R datasets; others made here"),
  sets = list(
    USJudgeRatings = all_of(as.matrix(USJudgeRatings)), attitude = all_of(as.matrix(attitude)),
    disagreeing = all_of(disagreeing), tied = all_of(tied), many = all_of(many)),
  retest = list(sleep = again(sleep$extra[1:10], sleep$extra[11:20]),
    complaints_raises = again(attitude$complaints, attitude$raises))
)), "\n")
