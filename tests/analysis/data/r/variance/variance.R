# Reference values of the ANOVA family. Run in this folder: Rscript variance.R
# It writes the generated tables (*.csv) and variance.json. The tests never run R.
suppressMessages({library(afex); library(car); library(jsonlite)})
options(digits = 17)
set.seed(20)

write_set <- function(d, name) write.csv(d, paste0(name, ".csv"), row.names = FALSE, quote = FALSE)

people <- function(sizes, levels) do.call(rbind, lapply(seq_along(sizes), function(i)
  levels[rep(i, sizes[i]), , drop = FALSE]))

table_of <- function(groups, within, offset = 0, digits = 1, spread = 5) {
  n <- nrow(groups)
  groups$subject <- sprintf("P%03d", sample(n))
  cells <- expand.grid(within, stringsAsFactors = FALSE)
  d <- merge(groups, cells)
  person <- setNames(rnorm(n, 0, 6), groups$subject)
  shift <- rnorm(nrow(unique(cells)), 0, 3)
  key <- match(do.call(paste, d[names(within)]), do.call(paste, cells))
  tilt <- if (ncol(groups) > 1) as.integer(factor(d[[names(groups)[1]]])) else 0
  d$y <- round(50 + person[d$subject] + shift[key] + 2 * tilt + 0.7 * tilt * key + rnorm(nrow(d), 0, spread), digits) + offset
  d[order(d$subject), ]
}

sets <- list(
  within_2x3x4 = list(data = table_of(data.frame(one = rep("a", 9)), list(A = c("a1", "a2"), B = paste0("b", 1:3), C = paste0("c", 1:4))),
                      within = c("A", "B", "C"), between = character(0)),
  unequal_groups = list(data = table_of(people(c(4, 9, 6), data.frame(group = c("x", "y", "z"))), list(A = paste0("a", 1:4))),
                        within = "A", between = "group"),
  two_by_two = list(data = table_of(people(c(3, 5, 7, 4), data.frame(g = c("u", "u", "v", "v"), h = c("m", "f", "m", "f"))),
                                    list(A = paste0("a", 1:3), B = c("b1", "b2"))),
                    within = c("A", "B"), between = c("g", "h")),
  between_3x2 = list(data = table_of(people(c(3, 6, 4, 5, 2, 7), expand.grid(g = c("u", "v", "w"), h = c("m", "f"))), list(one = "a")),
                     within = character(0), between = c("g", "h")),
  large_offset = list(data = table_of(people(c(5, 8), data.frame(group = c("x", "y"))), list(A = paste0("a", 1:5)),
                                      offset = 2^20, digits = 0), within = "A", between = "group")
)

anova_of <- function(s, type) {
  d <- s$data
  for (name in c("subject", s$within, s$between)) d[[name]] <- factor(d[[name]])
  fit <- suppressMessages(suppressWarnings(aov_ez("subject", "y", d, within = if (length(s$within)) s$within,
                between = if (length(s$between)) s$between, type = type)))
  ges <- anova(fit, es = c("ges", "pes"), correction = "none")
  own <- list()
  if (length(s$within)) {
    sum <- suppressWarnings(summary(fit$Anova, multivariate = FALSE))
    tab <- sum$univariate.tests; class(tab) <- "matrix"
    for (e in setdiff(rownames(tab), "(Intercept)")) own[[e]] <- list(
      SS = tab[e, "Sum Sq"], df1 = tab[e, "num Df"], SS_error = tab[e, "Error SS"], df2 = tab[e, "den Df"],
      F = tab[e, "F value"], p = tab[e, "Pr(>F)"], ges = ges[e, "ges"], pes = ges[e, "pes"])
    adj <- sum$pval.adjustments; m <- sum$sphericity.tests
    for (e in rownames(adj)) own[[e]] <- c(own[[e]], list(GG_eps = adj[e, "GG eps"], p_GG = adj[e, "Pr(>F[GG])"],
      HF_eps_raw = adj[e, "HF eps"], p_HF = adj[e, "Pr(>F[HF])"],
      mauchly_W = m[e, "Test statistic"], mauchly_p = m[e, "p-value"]))
  } else {
    tab <- as.data.frame(fit$Anova)
    for (e in setdiff(rownames(tab), c("(Intercept)", "Residuals"))) own[[e]] <- list(
      SS = tab[e, "Sum Sq"], df1 = tab[e, "Df"], SS_error = tab["Residuals", "Sum Sq"], df2 = tab["Residuals", "Df"],
      F = tab[e, "F value"], p = tab[e, "Pr(>F)"], ges = ges[e, "ges"], pes = ges[e, "pes"])
  }
  own
}

anovas <- list()
for (name in names(sets)) {
  s <- sets[[name]]
  if (!is.null(s$data$one)) s$data$one <- NULL
  write_set(s$data, name)
  s$data <- read.csv(paste0(name, ".csv"))
  # R's own sums lose digits with an offset (4e-11 here): its answer to the same values without it, which is the same.
  if (name == "large_offset") s$data$y <- s$data$y - 2^20
  anovas[[name]] <- list(csv = paste0(name, ".csv"), within = I(s$within), between = I(s$between),
                         type2 = anova_of(s, 2), type3 = anova_of(s, 3))
}

# Noncentral F: the limits that effectsize (nc / (nc + df2)) and MBESS (nc / (nc + df1 + df2 + 1)) take; pf's own error
# is about 1e-9.
limits <- function(f, df1, df2, conf) {
  a <- (1 - conf) / 2
  root <- function(q) if (pf(f, df1, df2, 0) <= q) 0 else {
    high <- 10; while (pf(f, df1, df2, high) > q) high <- 2 * high
    uniroot(function(l) pf(f, df1, df2, l) - q, c(0, high), tol = 1e-12)$root }
  c(root(1 - a), root(a))
}
eta <- list()
for (case in list(c(64.97, 3, 33, .9), c(3.03, 3, 33, .9), c(.5, 2, 13, .9), c(12.5, 1.83, 20.11, .95), c(5, 8, 120, .9))) {
  nc <- limits(case[1], case[2], case[3], case[4])
  eta[[length(eta) + 1]] <- list(F = case[1], df1 = case[2], df2 = case[3], confidence = case[4], nc = nc,
    effectsize = nc / (nc + case[3]), mbess = nc / (nc + case[2] + case[3] + 1))
}

# Noncentral t: limits of dz and of g.
nct <- function(t, df, conf) {
  a <- (1 - conf) / 2; w <- 10 + 10 * abs(t) / sqrt(2 * df)
  sapply(c(1 - a, a), function(q) uniroot(function(l) pt(t, df, l) - q, c(t - w, t + w), tol = 1e-13)$root)
}
dz <- lapply(list(c(-.66, 12, .95), c(1.4, 40, .95), c(.05, 5, .9)), function(case)
  list(dz = case[1], n = case[2], confidence = case[3], limits = nct(case[1] * sqrt(case[2]), case[2] - 1, case[3]) / sqrt(case[2])))
g <- lapply(list(c(.5, 12, 8, .95), c(-1.2, 5, 11, .9)), function(case) {
  n <- case[2] + case[3]; J <- 1 - 3 / (4 * n - 9); k <- sqrt(case[2] * case[3] / n)
  list(g = case[1], n1 = case[2], n2 = case[3], confidence = case[4], limits = J * nct(case[1] / J * k, n - 2, case[4]) / k) })

# TOST by one-sided t.test: paired columns of md_15.1, then two groups of equal and of unequal size.
md <- read.csv("../../../../../analysis/reference/csv/md_15.1.csv")
wide <- reshape(md, direction = "wide", idvar = "subject", timevar = "time")
tost <- function(x, y, low, high, ...) {
  up <- t.test(x, y, mu = low, alternative = "greater", ...); down <- t.test(x, y, mu = high, alternative = "less", ...)
  ci <- t.test(x, y, conf.level = .9, ...)$conf.int
  list(low = low, high = high, T_low = unname(up$statistic), T_high = unname(down$statistic), dof = unname(up$parameter),
       p_low = up$p.value, p_high = down$p.value, ci = as.vector(ci))
}
x <- c(4.1, 5.3, 6.2, 5.5, 4.9, 6.6, 5.1); y <- c(5.0, 5.9, 4.4, 6.1, 5.2, 5.7, 4.8); z <- c(5.0, 5.9, 4.4, 6.1, 9.2)
d <- wide$y.m30 - wide$y.m36
sp <- function(a, b) sqrt(((length(a) - 1) * var(a) + (length(b) - 1) * var(b)) / (length(a) + length(b) - 2))
equivalence <- list(
  paired = tost(wide$y.m30, wide$y.m36, -10, 8, paired = TRUE),
  paired_dz = tost(wide$y.m30, wide$y.m36, -.5 * sd(d), .5 * sd(d), paired = TRUE),
  equal = c(list(x = x, y = y), tost(x, y, -1, 1.5, var.equal = TRUE)),
  welch = c(list(x = x, y = z), tost(x, z, -1, 1.5)),
  welch_d = c(list(x = x, y = z), tost(x, z, -.8 * sp(x, z), .8 * sp(x, z))))

# Families with a size fixed beforehand: p.adjust(n = family).
p <- c(.0004, .011, .03, .2)
families <- list(p = p, family = 10, bonf = p.adjust(p, "bonferroni", n = 10), holm = p.adjust(p, "holm", n = 10))

versions <- list(R = R.version.string, afex = as.character(packageVersion("afex")), car = as.character(packageVersion("car")))
write(toJSON(list(versions = versions, anova = anovas, eta = eta, dz = dz, g = g, equivalence = equivalence,
                  families = families), digits = I(17), auto_unbox = TRUE, pretty = TRUE), "variance.json")
