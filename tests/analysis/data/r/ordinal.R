# Reference numbers for tests/analysis/ordinal, run from the repository's root: Rscript tests/analysis/data/r/ordinal.R
# R and package versions are written into ordinal.json. Data sets of the R package `ordinal` (GPL >= 2) and of MASS.
suppressMessages({library(ordinal); library(MASS); library(jsonlite); library(car); library(afex)})
here <- "tests/analysis/data/r"; ref <- "analysis/reference/csv"
out <- list(made_with = list(R = R.version.string, ordinal = as.character(packageVersion("ordinal")),
  MASS = as.character(packageVersion("MASS")), car = as.character(packageVersion("car")),
  afex = as.character(packageVersion("afex"))))

# --- data
write.csv(data.frame(judge = paste0("J", wine$judge), temp = wine$temp, contact = wine$contact,
  rating = as.integer(wine$rating), response = wine$response), file.path(here, "ordinal_wine.csv"), row.names = FALSE, quote = FALSE)
house <- housing[rep(seq_len(nrow(housing)), housing$Freq), c("Sat", "Infl", "Type", "Cont")]
write.csv(data.frame(Sat = as.integer(house$Sat), Infl = house$Infl, Type = house$Type, Cont = house$Cont),
  file.path(here, "ordinal_housing.csv"), row.names = FALSE, quote = FALSE)
few <- soup[soup$RESP %in% levels(soup$RESP)[1:60], ]
few <- data.frame(resp = paste0("R", few$RESP), prod = few$PROD, sureness = as.integer(few$SURENESS))
write.csv(few, file.path(here, "ordinal_soup.csv"), row.names = FALSE, quote = FALSE)

# --- Friedman and Nemenyi (no PMCMRplus: its formula by hand with R's ptukey)
wide <- function(file, factor, scale = 1) {
  d <- read.csv(file.path(ref, file)); d$y <- round(d$y * scale)
  m <- tapply(d$y, list(d$subject, d[[factor]]), mean); m
}
fr <- function(m) { t <- friedman.test(m); list(chi2 = unname(t$statistic), df = unname(t$parameter), p = t$p.value) }
nem <- function(m) {
  n <- nrow(m); k <- ncol(m); r <- colMeans(t(apply(m, 1, rank))); cn <- colnames(m); res <- list()
  for (i in 1:(k - 1)) for (j in (i + 1):k) {
    d <- r[i] - r[j]; q <- abs(d) / sqrt(k * (k + 1) / (12 * n))
    res[[length(res) + 1]] <- list(A = cn[i], B = cn[j], diff = unname(d), q = unname(q),
      p = unname(ptukey(q, k, Inf, lower.tail = FALSE)))
  }
  res
}
sets <- list(RoundingTimes = wide("RoundingTimes.csv", "method", 100), md_15.1 = wide("md_15.1.csv", "time"),
  ergoStool = wide("ergoStool.csv", "type"), shrout_fleiss = wide("shrout_fleiss_1979.csv", "rater"))
out$friedman <- lapply(sets, fr); out$nemenyi <- lapply(sets, nem)
out$range <- lapply(list(c(.5, 3), c(2, 3), c(3.5, 4), c(5, 5), c(4, 10), c(6, 20)), function(v)
  list(q = v[1], k = v[2], tail = ptukey(v[1], v[2], Inf, lower.tail = FALSE)))
out$range_quantile <- lapply(c(2, 3, 4, 5, 10, 20), function(k) list(k = k, q = qtukey(.95, k, Inf)))

# --- signed ranks
ht <- function(t) list(statistic = unname(t$statistic), p = t$p.value,
  estimate = if (is.null(t$estimate)) NULL else unname(t$estimate), ci = if (is.null(t$conf.int)) NULL else as.numeric(t$conf.int))
depression <- list(x = c(1.83, 0.50, 1.62, 2.48, 1.68, 1.88, 1.55, 3.06, 1.30),
  y = c(0.878, 0.647, 0.598, 2.05, 1.06, 1.29, 1.06, 3.14, 1.29))
set.seed(1); long <- list(x = sample(1:2000, 40) / 100, y = round(sample(2001:4000, 40) / 100 - 19.3, 2))
enumerate <- function(d, pratt) {
  r <- if (pratt) rank(abs(d))[d != 0] else rank(abs(d[d != 0])); s <- d[d != 0]
  v <- as.matrix(expand.grid(rep(list(0:1), length(r)))) %*% r; w <- sum(r[s > 0]); mu <- sum(r) / 2
  list(W = w, p = mean(abs(v - mu) >= abs(w - mu)))
}
likert_a <- c(5, 6, 4, 7, 3, 5, 6, 2, 4, 7, 5, 3, 6, 1); likert_b <- c(4, 4, 4, 5, 5, 3, 6, 1, 2, 4, 5, 1, 3, 2)
m <- sets$RoundingTimes
out$signed <- list(
  depression = c(depression, list(exact = ht(wilcox.test(depression$x, depression$y, paired = TRUE, exact = TRUE, conf.int = TRUE)),
    normal = ht(wilcox.test(depression$x, depression$y, paired = TRUE, exact = FALSE, correct = TRUE)))),
  long = c(long, list(exact = ht(wilcox.test(long$x, long$y, paired = TRUE, exact = TRUE, conf.int = TRUE)),
    normal = ht(wilcox.test(long$x, long$y, paired = TRUE, exact = FALSE, correct = TRUE)))),
  likert = list(x = likert_a, y = likert_b,
    normal = ht(suppressWarnings(wilcox.test(likert_a, likert_b, paired = TRUE, exact = FALSE, correct = TRUE))),
    wilcoxon = enumerate(likert_a - likert_b, FALSE), pratt = enumerate(likert_a - likert_b, TRUE)),
  rounding = lapply(list(c(1, 2), c(1, 3), c(2, 3)), function(p) c(list(A = colnames(m)[p[1]], B = colnames(m)[p[2]]),
    ht(suppressWarnings(wilcox.test(m[, p[1]], m[, p[2]], paired = TRUE, exact = FALSE, correct = TRUE))))))

# --- rank sums
set.seed(2); a <- sample(1:900, 17) / 10; b <- round(sample(901:1900, 12) / 10 - 60.05, 2)
ta <- c(5, 6, 4, 7, 7, 6); tb <- c(4, 4, 5, 3, 6, 2, 4)
sums <- function(a, b) {
  r <- rank(c(a, b)); w <- sum(r[seq_along(a)]); mu <- length(a) * mean(r)
  v <- combn(r, length(a), sum); list(W = w - length(a) * (length(a) + 1) / 2, p = mean(abs(v - mu) >= abs(w - mu) - 1e-9))
}
out$sums <- list(
  untied = list(a = a, b = b, exact = ht(wilcox.test(a, b, exact = TRUE, conf.int = TRUE)), normal = ht(wilcox.test(a, b, exact = FALSE, correct = TRUE))),
  tied = list(a = ta, b = tb, enumerated = sums(ta, tb), normal = ht(suppressWarnings(wilcox.test(ta, tb, exact = FALSE, correct = TRUE)))))

# --- aligned ranks: Wobbrock et al. 2011 written out, then aov / afex (type III) on the ranks
art <- function(d, factors) {
  cell <- ave(d$y, d[factors]); res <- list()
  for (size in seq_along(factors)) for (e in combn(factors, size, simplify = FALSE)) {
    effect <- 0
    for (s in 0:length(e)) for (part in if (s == 0) list(character(0)) else combn(e, s, simplify = FALSE)) {
      mean_part <- if (length(part)) ave(d$y, d[part]) else rep(mean(d$y), nrow(d))
      effect <- effect + (-1)^(length(e) - s) * mean_part
    }
    res[[paste(e, collapse = ":")]] <- list(aligned = d$y - cell + effect, rank = rank(round(d$y - cell + effect, 9)))
  }
  res
}
art_f <- function(d, within, between) {
  found <- list(); all <- art(d, c(between, within))
  for (e in names(all)) {
    d$r <- all[[e]]$rank
    a <- suppressMessages(suppressWarnings(aov_ez("subject", "r", d, within = if (length(within)) within, between = if (length(between)) between,
      type = 3, anova_table = list(correction = "none"))))$anova_table
    found[[e]] <- list(F = a[e, "F"], df1 = a[e, "num Df"], df2 = a[e, "den Df"], p = a[e, "Pr(>F)"],
      first_ranks = head(d$r, 5), sum = sum(all[[e]]$aligned))
  }
  found
}
fac <- function(d, names) { for (n in names) d[[n]] <- factor(d[[n]]); d }
obk <- fac(read.csv(file.path(ref, "obk_long.csv")), c("subject", "treatment", "gender", "phase", "hour"))
sk <- fac(read.csv(file.path(ref, "sk2011.1.csv")), c("subject", "instruction", "inference", "plausibility"))
out$aligned <- list(
  md_15.1 = art_f(fac(read.csv(file.path(ref, "md_15.1.csv")), c("subject", "time")), "time", NULL),
  obk_within = art_f(obk, c("phase", "hour"), NULL),
  sk_within = art_f(sk, c("inference", "plausibility"), NULL),
  sk_mixed = art_f(sk, c("inference", "plausibility"), "instruction"),
  obk_mixed = art_f(obk, c("phase", "hour"), c("treatment", "gender")))

# --- cumulative link models
tight <- clm.control(gradTol = 1e-10, maxIter = 200L)
model <- function(m) {
  v <- vcov(m); k <- length(coef(m))
  list(call = paste(deparse(m$call), collapse = ""), names = names(coef(m)), estimate = unname(coef(m)), se = unname(sqrt(diag(v)))[1:k],
    logLik = as.numeric(logLik(m)), aic = AIC(m), n = nobs(m))
}
lr <- function(t) list(term = rownames(t), df = t$Df, lr = t$LRT, p = t[["Pr(>Chi)"]])
wine$rating <- factor(wine$rating, ordered = TRUE)
house <- read.csv(file.path(here, "ordinal_housing.csv")); house$Sat <- factor(house$Sat, ordered = TRUE)
house$Infl <- factor(house$Infl, c("Low", "Medium", "High")); house$Cont <- factor(house$Cont, c("Low", "High"))
house$Type <- factor(house$Type, c("Tower", "Apartment", "Atrium", "Terrace"))
soup2 <- read.csv(file.path(here, "ordinal_soup.csv")); soup2$sureness <- factor(soup2$sureness, ordered = TRUE)
soup2$prod <- factor(soup2$prod); soup2$resp <- factor(soup2$resp)
w1 <- clm(rating ~ temp + contact, data = wine, control = tight); w2 <- clm(rating ~ temp + contact, data = wine, link = "probit", control = tight)
w3 <- clm(rating ~ temp * contact, data = wine, control = tight)
h1 <- clm(Sat ~ Infl + Type + Cont, data = house, control = tight); h2 <- update(h1, link = "probit")
out$clm <- list(wine_logit = c(model(w1), list(drop = lr(drop1(w1, test = "Chisq")), nominal = lr(nominal_test(clm(rating ~ temp + contact, data = wine))))),
  wine_probit = model(w2), wine_interaction = c(model(w3), list(drop = lr(drop1(w3, test = "Chisq")))),
  housing_logit = c(model(h1), list(drop = lr(drop1(h1, test = "Chisq")), nominal = lr(nominal_test(clm(Sat ~ Infl + Type + Cont, data = house))))), housing_probit = model(h2))
mixed <- function(f, d, link = "logit", q = 25) { m <- clmm(f, data = d, link = link, nAGQ = q, Hess = TRUE, control = clmm.control(gradTol = 1e-7, maxIter = 500))
  c(model(m), list(sigma = unname(sqrt(unlist(VarCorr(m))))[1], nAGQ = q)) }
wine$judge <- factor(wine$judge)
out$clmm <- list(wine_logit = mixed(rating ~ temp + contact + (1 | judge), wine), wine_probit = mixed(rating ~ temp + contact + (1 | judge), wine, "probit"),
  soup_logit = mixed(sureness ~ prod + (1 | resp), soup2))
# jsonlite writes 15 digits; a double needs 17
exact <- rapply(out, function(x) paste0("@", sprintf("%.17g", x), "@"), classes = c("numeric", "integer"), how = "replace")
text <- as.character(toJSON(exact, auto_unbox = TRUE, na = "null", null = "null"))
text <- gsub('"@(NA|NaN)@"', "null", gsub('"@([-0-9.e+]+)@"', "\\1", text))
writeLines(gsub('("[A-Za-z_.0-9]+":\\{)', "\n\\1", text), file.path(here, "ordinal.json"))
