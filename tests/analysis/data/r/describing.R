# Reference numbers for tests/analysis/ratings: run from the repository's root with
#   Rscript tests/analysis/data/r/describing.R
# Intervals are written from the papers' formulas (Cousineau 2005; Morey 2008; Loftus & Masson 1994), with aov for the
# mean square of the interaction; slopes are lm's, tests are t.test's, families p.adjust's.
suppressPackageStartupMessages(library(jsonlite))
here <- "analysis/reference/csv"
read <- function(name) read.csv(file.path(here, paste0(name, ".csv")), colClasses = c(subject = "character"))

# Morey (2008), eq. 2: subtract each participant's mean, add the grand mean; variance times M / (M - 1), within groups.
cousineau_morey <- function(y, subject, cell, conf = .95) {
  person <- ave(y, subject, FUN = mean)
  z <- y - person + mean(y)
  m <- length(unique(cell))
  out <- lapply(split(seq_along(y), cell), function(i) {
    n <- length(i)
    s <- sd(z[i]) * sqrt(m / (m - 1))
    list(n = n, mean = mean(y[i]), sd = sd(y[i]), sd_interval = s, half = qt((1 + conf) / 2, n - 1) * s / sqrt(n))
  })
  out
}
loftus_masson <- function(y, subject, cell, conf = .95) {
  d <- data.frame(y = y, s = factor(subject), c = factor(cell))
  table <- summary(aov(y ~ s + c, d))[[1]]
  ms <- table["Residuals", "Mean Sq"]; df <- table["Residuals", "Df"]
  n <- nlevels(d$s)
  qt((1 + conf) / 2, df) * sqrt(ms / n)
}
student <- function(y, cell) lapply(split(y, cell), function(v) diff(t.test(v)$conf.int)[1] / 2)

intervals <- list()
md <- read("md_15.1")
intervals$md_15.1 <- list(by = "time", between = list(), cells = list(all = cousineau_morey(md$y, md$subject, md$time)),
                          loftus_masson = list(all = loftus_masson(md$y, md$subject, md$time)),
                          student = list(all = student(md$y, md$time)))
grouped <- function(d, group, cell) {
  parts <- split(d, group)
  list(cells = lapply(parts, function(p) cousineau_morey(p$y, p$subject, p[[cell]])),
       loftus_masson = lapply(parts, function(p) loftus_masson(p$y, p$subject, p[[cell]])),
       student = lapply(parts, function(p) student(p$y, p[[cell]])))
}
sk <- read("sk2011.1"); sk$cell <- paste(sk$inference, sk$plausibility, sep = "|")
intervals$sk2011.1 <- c(list(by = c("inference", "plausibility"), between = list("instruction")),
                        grouped(sk, sk$instruction, "cell"))
obk <- read("obk_long"); obk$cell <- paste(obk$phase, obk$hour, sep = "|")
intervals$obk_long <- c(list(by = c("phase", "hour"), between = list("treatment")), grouped(obk, obk$treatment, "cell"))

# Trends: days 0 to 9 of sleepstudy, three families of three days and day 0 as the reference.
sl <- read("sleepstudy")
family <- c("reference", rep(c("early", "middle", "late"), each = 3))
test <- function(v) {
  t <- t.test(v)
  list(n = length(v), mean = mean(v), sd = sd(v), ci_low = t$conf.int[1], ci_high = t$conf.int[2],
       t = unname(t$statistic), df = unname(t$parameter), p = t$p.value)
}
slopes <- lapply(c(early = "early", middle = "middle", late = "late"), function(f) {
  part <- sl[family[sl$days + 1] == f, ]
  test(sapply(split(part, part$subject), function(p) coef(lm(y ~ days, p))[["days"]]))
})
wide <- function(k) { d <- sl[sl$days == k, ]; d$y[order(d$subject)] }
against <- lapply(setNames(1:9, paste0("d", 1:9)), function(k) test(wide(k) - wide(0)))
trends <- list(slopes = slopes, slopes_holm = as.list(p.adjust(sapply(slopes, `[[`, "p"), "holm")),
               slopes_bonferroni = as.list(p.adjust(sapply(slopes, `[[`, "p"), "bonferroni", n = 5)),
               against = against, against_holm = as.list(p.adjust(sapply(against, `[[`, "p"), "holm")))

# Two categories: phases pre and post against fup of obk_long; hours are the stimuli.
category <- ifelse(obk$phase == "fup", "emotional", "physical")
spread <- function(d, cat) {
  v <- sapply(split(d$y, paste(d$phase, d$hour)), var)
  of <- sapply(split(cat, paste(d$phase, d$hour)), `[`, 1)
  tapply(v, of, mean)
}
logratio <- function(d, cat) { s <- spread(d, cat); 0.5 * log(s[["emotional"]] / s[["physical"]]) }
all <- logratio(obk, category)
people <- unique(obk$subject); n <- length(people)
pseudo <- sapply(people, function(p) n * all - (n - 1) * logratio(obk[obk$subject != p, ], category[obk$subject != p]))
jack <- t.test(pseudo)
whole <- spread(obk, category)
means <- tapply(obk$y, list(obk$subject, obk$phase), mean)
difference <- means[, "fup"] - (means[, "pre"] + means[, "post"]) / 2
categories <- list(sd_physical = sqrt(whole[["physical"]]), sd_emotional = sqrt(whole[["emotional"]]), ratio = exp(all),
                   low = exp(jack$conf.int[1]), high = exp(jack$conf.int[2]), t = unname(jack$statistic), p = jack$p.value,
                   difference = test(difference))

# Order: 12 participants meet 8 stimuli in random orders; a drift of .3 a trial; stimuli and participants differ.
set.seed(20)
order_data <- do.call(rbind, lapply(1:12, function(p) {
  s <- sample(8)
  data.frame(participant = sprintf("P%02d", p), trial = 1:8, stimulus = paste0("s", s),
             value = round(50 + 6 * s + rnorm(1, 0, 5) + .3 * (1:8) + rnorm(8, 0, 2), 3))
}))
write.csv(order_data, "tests/analysis/data/r/describing_order.csv", row.names = FALSE, quote = FALSE)
fit <- lm(value ~ participant + stimulus + trial, order_data, contrasts = list(stimulus = "contr.sum"))
effects <- coef(fit)[paste0("stimulus", 1:7)]
effects <- c(effects, -sum(effects)); names(effects) <- levels(factor(order_data$stimulus))
order_data$rest <- order_data$value - effects[order_data$stimulus]
drift <- test(sapply(split(order_data, order_data$participant), function(p) coef(lm(rest ~ trial, p))[["trial"]]))
carried <- test(sapply(split(order_data, order_data$participant), function(p) {
  p <- p[order(p$trial), ]
  before <- effects[p$stimulus[-nrow(p)]]
  coef(lm(p$rest[-1] ~ before))[[2]]
}))
order <- list(effects = as.list(effects), common = coef(fit)[["trial"]], drift = drift, carried = carried,
              bins = local({
                b <- aggregate(rest ~ participant + bin, transform(order_data, bin = (trial + 1) %/% 2), mean)
                cousineau_morey(b$rest, b$participant, b$bin)
              }))

# z of each participant (R's scale) on ergoStool.
es <- read("ergoStool")
z <- as.vector(scale(es$y[es$subject == "1"]))
found <- list(software = list(R = R.version.string, jsonlite = as.character(packageVersion("jsonlite"))),
              intervals = intervals, trends = trends, categories = categories, order = order,
              z_of_subject_1 = z)
write_json(found, "tests/analysis/data/r/describing.json", digits = I(17), auto_unbox = TRUE, pretty = TRUE)
