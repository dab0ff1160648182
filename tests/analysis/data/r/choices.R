# Reference numbers for tests/analysis/choices, run from the repository's root: Rscript tests/analysis/data/r/choices.R
# R's version is written into choices.json. Baseball: American League East 1987, Agresti 2002, table 10.10 (facts); he
# gives 1.58 1.44 1.29 1.25 1.11 0.68 for the teams above Baltimore, and 0.302 for playing at home.
library(jsonlite)
here <- "tests/analysis/data/r"
exactly <- glm.control(epsilon = 1e-15, maxit = 200)
out <- list(made_with = list(R = R.version.string))
teams <- c("Milwaukee", "Detroit", "Toronto", "New York", "Boston", "Cleveland", "Baltimore")
home <- c(4,4,4,6,4,6, 3,4,4,6,6,4, 2,4,2,4,4,6, 3,5,2,4,4,6, 5,2,3,4,5,6, 2,3,3,4,4,2, 2,1,1,2,1,3)
away <- c(3,2,3,1,2,0, 3,2,3,0,1,3, 5,3,4,3,2,0, 3,1,5,3,2,1, 1,5,3,2,2,0, 5,3,4,3,2,4, 5,5,6,4,6,4)
games <- do.call(rbind, lapply(teams, function(h) data.frame(home = h, away = setdiff(teams, h))))
games$home_wins <- home; games$away_wins <- away
out$baseball <- games
design <- function(d, items = teams) { X <- sapply(items, function(t) (d[[1]] == t) - (d[[2]] == t)); colnames(X) <- items; X }
tell <- function(f) list(coefficients = as.list(coef(f)), se = as.list(sqrt(diag(vcov(f)))), vcov = unname(vcov(f)),
  deviance = deviance(f), df = df.residual(f), loglik_kernel = sum(f$weights * 0) - deviance(f) / 2)
X <- design(games)[, -7]
y <- cbind(games$home_wins, games$away_wins)
pool <- merge(games, games, by.x = c("home", "away"), by.y = c("away", "home"))
pool <- pool[as.character(pool$home) < as.character(pool$away), ]
yp <- cbind(pool$home_wins.x + pool$away_wins.y, pool$away_wins.x + pool$home_wins.y); Xp <- design(pool)[, -7]
out$bradley_terry <- tell(glm(yp ~ 0 + Xp, binomial, control = exactly))
out$bradley_terry_home <- tell(glm(y ~ 1 + X, binomial, control = exactly))
out$thurstone <- tell(glm(yp ~ 0 + Xp, binomial(probit), control = exactly))

# Davidson's ties as a Poisson model (Fienberg & Larntz 1976): pair + worths + tie
items <- c("a", "b", "c", "d", "e"); set.seed(11)
ties <- do.call(rbind, lapply(1:4, function(i) do.call(rbind, lapply((i + 1):5, function(j) {
  p <- exp(c(i * .4, j * .4, .2 + (i + j) * .2)); k <- rmultinom(1, 40, p / sum(p))
  data.frame(first = items[i], second = items[j], first_wins = k[1], second_wins = k[2], ties = k[3]) }))))
out$ties <- ties
long <- do.call(rbind, lapply(seq_len(nrow(ties)), function(r) { w <- function(a, b) setNames(a * (items == ties$first[r]) + b * (items == ties$second[r]), items)
  data.frame(n = c(ties$first_wins[r], ties$second_wins[r], ties$ties[r]), pair = r, tie = c(0, 0, 1), second = c(0, 1, 0),
    rbind(w(1, 0), w(0, 1), w(.5, .5))) }))
f <- glm(n ~ 0 + factor(pair) + b + c + d + e + tie, poisson, long, control = exactly)
keep <- c("b", "c", "d", "e", "tie")
out$davidson <- list(coefficients = as.list(coef(f)[keep]), se = as.list(sqrt(diag(vcov(f)))[keep]), deviance = deviance(f), df = df.residual(f))
f <- glm(n ~ 0 + factor(pair) + b + c + d + e + tie + second, poisson, long, control = exactly); keep <- c(keep, "second")
out$davidson_order <- list(coefficients = as.list(coef(f)[keep]), se = as.list(sqrt(diag(vcov(f)))[keep]), deviance = deviance(f), df = df.residual(f))

# psychometric functions
sets <- list(
  yes_no = data.frame(level = c(1, 2, 3, 4, 5, 6, 7), n = 40, k = c(1, 4, 8, 21, 29, 37, 39)),
  uneven = data.frame(level = c(10, 14, 15, 18, 22, 30), n = c(20, 35, 12, 50, 44, 9), k = c(0, 5, 4, 21, 38, 9)),
  two_choice = data.frame(level = c(.5, 1, 2, 3, 4, 6), n = 60, k = c(31, 35, 42, 51, 57, 59)))
out$sets <- sets
plain <- list()
for (name in c("yes_no", "uneven")) for (link in c("logit", "probit", "cloglog")) {
  d <- sets[[name]]; d$x <- if (link == "cloglog") log(d$level) else d$level
  f <- glm(cbind(k, n - k) ~ x, binomial(link), d, control = exactly); b <- coef(f)
  low <- deviance(f)
  profiled <- function(v) deviance(glm(cbind(k, n - k) ~ 0 + I(x - v) + offset(rep(make.link(link)$linkfun(.5), nrow(d))), binomial(link), d, control = exactly)) - low - qchisq(.95, 1)
  at <- (make.link(link)$linkfun(.5) - b[1]) / b[2]
  span <- diff(range(d$x))
  sided <- function(v) deviance(glm(cbind(k, n - k) ~ 1 + offset(x * v), binomial(link), d, control = exactly)) - low - qchisq(.95, 1)
  plain[[paste(name, link)]] <- list(set = name, link = link, intercept = b[[1]], slope = b[[2]], deviance = low, df = df.residual(f),
    loglik = as.numeric(logLik(f)), half = at[[1]], half_ci = c(uniroot(profiled, c(at - span, at), tol = 1e-13)$root, uniroot(profiled, c(at, at + span), tol = 1e-13)$root),
    se = unname(sqrt(diag(vcov(f)))), slope_ci = c(uniroot(sided, c(b[2] * .3, b[2]), tol = 1e-13)$root, uniroot(sided, c(b[2], b[2] * 3), tol = 1e-13)$root))
}
out$plain <- plain
d <- sets$two_choice
afc <- function(F, lapse) { nll <- function(p) { P <- .5 + (.5 - lapse) * F((d$level - p[1]) / exp(p[2])); -sum(dbinom(d$k, d$n, P, log = TRUE)) }
  f <- optim(c(2, 0), nll, control = list(reltol = 1e-16, maxit = 5000)); f <- optim(f$par, nll, method = "BFGS", control = list(reltol = 1e-18, maxit = 5000))
  list(lapse = lapse, centre = f$par[1], spread = exp(f$par[2]), loglik = -f$value) }
out$two_choice <- list(logistic = afc(plogis, .02), gaussian = afc(pnorm, .02), logistic_none = afc(plogis, 0))
write_json(out, file.path(here, "choices.json"), digits = I(17), auto_unbox = TRUE, matrix = "rowmajor", dataframe = "columns")

# What `palpate bench statistics` needs of the above.
few <- out[c("made_with", "baseball", "sets")]
few$bradley_terry <- out$bradley_terry$coefficients; few$thurstone <- out$thurstone$coefficients
few$plain <- lapply(out$plain, function(f) f[c("set", "link", "intercept", "slope")])
write_json(few, "analysis/choices/bench_truth.json", digits = I(17), auto_unbox = TRUE, matrix = "rowmajor", dataframe = "columns")
