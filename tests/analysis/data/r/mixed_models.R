# Reference values of linear mixed models, made once: Rscript mixed_models.R (in this folder).
# Needs lme4, lmerTest, numDeriv, MASS, jsonlite. lmm_penicillin, lmm_pastes, lmm_cake and lmm_insteval (a part) are data of
# the R package lme4, GPL (>= 2); the other tables are made here. lme4's optimum is refined by Newton steps on its own deviance function, so
# that the numbers are lme4's to more digits than its optimisers give.
suppressMessages({library(lme4); library(lmerTest); library(jsonlite)})
set.seed(20250117)
control <- lmerControl(optimizer = "bobyqa", optCtrl = list(rhoend = 1e-12, maxfun = 1e6), calc.derivs = FALSE,
                       check.conv.singular = "ignore")

refined <- function(formula, data, REML) {
  first <- lme4::lmer(formula, data, REML = REML, control = control)
  dev <- as.function(first)
  theta <- getME(first, "theta")
  free <- which(theta > 1e-5 | getME(first, "lower") < 0)
  theta[setdiff(seq_along(theta), free)] <- 0
  on <- function(x) { t <- theta; t[free] <- x; dev(t) }
  if (length(free)) for (i in 1:6) {
    g <- numDeriv::grad(on, theta[free]); h <- numDeriv::hessian(on, theta[free])
    theta[free] <- theta[free] - as.numeric(MASS::ginv(h) %*% g)
  }
  none <- lmerControl(optimizer = NULL, calc.derivs = FALSE, check.conv.singular = "ignore")
  do.call(lmerTest::lmer, list(formula = formula, data = data, REML = REML, control = none, start = list(theta = theta)))
}

numbers <- function(m) {
  test <- m
  co <- summary(test)$coefficients
  an <- as.data.frame(anova(test, type = 3, ddf = "Satterthwaite"))
  vc <- as.data.frame(VarCorr(m))
  X <- getME(m, "X"); b <- fixef(m)
  raw <- getME(m, "mmList"); covs <- VarCorr(m)
  means <- mapply(function(Z, s) mean(rowSums((Z %*% s) * Z)), raw, covs[seq_along(raw)])
  re <- ranef(m, condVar = FALSE)
  list(
    fixef = as.list(co[, "Estimate"]), names = rownames(co), estimate = unname(co[, "Estimate"]),
    se = unname(co[, "Std. Error"]), df = unname(co[, "df"]), t = unname(co[, "t value"]), p = unname(co[, "Pr(>|t|)"]),
    varcorr = vc, logLik = as.numeric(logLik(m)), AIC = AIC(m), BIC = BIC(m),
    criterion = if (isREML(m)) REMLcrit(m) else as.numeric(-2 * logLik(m)),
    effects = lapply(split(an, factor(rownames(an), rownames(an))), function(r)
      list(NumDF = r$NumDF, DenDF = r$DenDF, F = r$`F value`, p = r$`Pr(>F)`)),
    fixed_variance = var(as.numeric(X %*% b)), mean_variances = list(groups = names(covs), values = unname(means)),
    singular = isSingular(m),
    ranef = lapply(re, function(d) { d <- as.data.frame(d); list(levels = rownames(d), effects = names(d), values = unname(as.matrix(d))) }))
}

entry <- function(name, data, formula, REML = TRUE, call) {
  write.csv(data, paste0("lmm_", name, ".csv"), row.names = FALSE, quote = FALSE)
  data <- read.csv(paste0("lmm_", name, ".csv"), stringsAsFactors = TRUE)  # levels in alphabetical order
  m <- refined(formula, data, REML)
  c(list(csv = paste0("lmm_", name, ".csv"), call = paste0("lme4::lmer(", deparse1(formula), ", REML = ", REML, ")"),
         ours = call), numbers(m))
}

# Participants x stimuli, unbalanced and with missing cells: a between-stimulus and a between-participant factor.
crossed <- expand.grid(participant = sprintf("P%02d", 1:24), stimulus = sprintf("S%02d", 1:15), time = 1:2)
crossed$texture <- factor(c("fine", "medium", "coarse"))[as.integer(crossed$stimulus) %% 3 + 1]
crossed$group <- factor(ifelse(as.integer(crossed$participant) <= 10, "expert", "novice"))
crossed$y <- round(50 + rnorm(24, 0, 9)[crossed$participant] + rnorm(15, 0, 5)[crossed$stimulus] +
  4 * (crossed$texture == "coarse") + 3 * (crossed$group == "novice") * (crossed$texture == "fine") + rnorm(720, 0, 7), 2)
crossed <- crossed[sample(720, 431), c("participant", "stimulus", "texture", "group", "y")]

# A slope that varies between participants, crossed with items.
sloped <- expand.grid(participant = 1:20, stimulus = 1:12)
sloped$speed <- round(10 + 3 * ((sloped$stimulus * 7) %% 12) + (sloped$participant %% 5) * 1.7, 1)
sloped$y <- round(30 + rnorm(20, 0, 8)[sloped$participant] + (0.8 + rnorm(20, 0, 0.35)[sloped$participant]) * sloped$speed +
  rnorm(12, 0, 4)[sloped$stimulus] + rnorm(240, 0, 5), 2)
sloped <- sloped[-sample(240, 31), ]

# Three levels, nested, unbalanced; a covariate in interaction with a factor.
nested <- data.frame(lab = rep(sprintf("L%d", 1:9), times = c(12, 20, 15, 31, 8, 26, 18, 22, 30)))
nested$participant <- paste0("p", ave(seq_len(nrow(nested)), nested$lab, FUN = function(i) (seq_along(i) - 1) %/% 4))
nested$kind <- sample(c("tool", "finger"), nrow(nested), TRUE)
nested$force <- round(runif(nrow(nested), 0.2, 2.5), 2)
key <- paste(nested$lab, nested$participant)
nested$y <- round(5 + rnorm(9, 0, 2)[factor(nested$lab)] + rnorm(length(unique(key)), 0, 1.5)[factor(key)] +
  1.2 * nested$force * (nested$kind == "tool") + rnorm(nrow(nested), 0, 1), 3)

# Fits on the border: no variance between participants, and intercept and slope perfectly correlated.
flat <- expand.grid(participant = 1:10, block = c("a", "b", "c"), time = 1:3)
flat$y <- round(20 + rnorm(90, 0, 3) + 2 * (flat$block == "b"), 2)
flat$y <- round(flat$y - ave(flat$y, flat$participant) + 20.5, 2)
flat <- flat[c("participant", "block", "y")]
tied <- expand.grid(participant = 1:16, x = 0:5)
u <- rnorm(16)
tied$y <- round(10 + 4 * u[tied$participant] + (2 + 1.5 * u[tied$participant]) * tied$x + rnorm(96, 0, 4), 2)

# A slope of a factor, and uncorrelated slopes.
device <- expand.grid(participant = sprintf("P%02d", 1:18), device = c("pen", "finger", "glove"), time = 1:4)
v <- matrix(rnorm(54, 0, 3), 18)
device$y <- round(40 + rnorm(18, 0, 6)[device$participant] + v[cbind(as.integer(device$participant), as.integer(device$device))] +
  2 * as.integer(device$device) + rnorm(216, 0, 2.5), 2)
device <- device[-sample(216, 20), c("participant", "device", "y")]

small <- subset(InstEval, as.integer(s) <= 120)
small <- data.frame(student = paste0("s", small$s), lecturer = paste0("d", small$d), service = paste0("v", small$service),
                    y = small$y)
cakes <- with(cake, data.frame(recipe, replicate = paste0("r", replicate), temperature = paste0("t", temperature), y = angle))
pastes <- with(Pastes, data.frame(batch, cask, y = strength))
penicillin <- with(Penicillin, data.frame(plate, sample, y = diameter))

options(warn = 1)
out <- list(
  crossed = entry("crossed", crossed, y ~ texture * group + (1 | participant) + (1 | stimulus), TRUE,
    list(fixed = c("texture", "group"), interactions = I("texture:group"), random = list(participant = list(), stimulus = list()))),
  crossed_ml = entry("crossed", crossed, y ~ texture * group + (1 | participant) + (1 | stimulus), FALSE,
    list(fixed = c("texture", "group"), interactions = I("texture:group"), random = list(participant = list(), stimulus = list()))),
  sloped = entry("sloped", sloped, y ~ speed + (speed | participant) + (1 | stimulus), TRUE,
    list(fixed = I("speed"), numeric = I("speed"), random = list(participant = list("speed"), stimulus = list()))),
  sloped_uncorrelated = entry("sloped", sloped, y ~ speed + (speed || participant) + (1 | stimulus), FALSE,
    list(fixed = I("speed"), numeric = I("speed"), random = list(participant = list("speed"), stimulus = list()),
         uncorrelated = I("participant"))),
  nested = entry("nested", nested, y ~ kind * force + (1 | lab / participant), TRUE,
    list(fixed = c("kind", "force"), numeric = I("force"), interactions = I("kind:force"),
         random = list(lab = list(), `lab:participant` = list()))),
  flat = entry("flat", flat, y ~ block + (1 | participant), TRUE,
    list(fixed = I("block"), random = list(participant = list()))),
  tied = entry("tied", tied, y ~ x + (x | participant), TRUE,
    list(fixed = I("x"), numeric = I("x"), random = list(participant = list("x")))),
  device = entry("device", device, y ~ device + (device | participant), TRUE,
    list(fixed = I("device"), random = list(participant = list("device")))),
  insteval = entry("insteval", small, y ~ service + (1 | student) + (1 | lecturer), TRUE,
    list(fixed = I("service"), random = list(student = list(), lecturer = list()))),
  cake = entry("cake", cakes, y ~ recipe * temperature + (1 | recipe:replicate), TRUE,
    list(fixed = c("recipe", "temperature"), interactions = I("recipe:temperature"), random = list(`recipe:replicate` = list()))),
  pastes = entry("pastes", pastes, y ~ 1 + (1 | batch / cask), TRUE,
    list(fixed = list(), random = list(batch = list(), `batch:cask` = list()))),
  penicillin = entry("penicillin", penicillin, y ~ 1 + (1 | plate) + (1 | sample), TRUE,
    list(fixed = list(), random = list(plate = list(), sample = list())))
)
a <- refined(y ~ 1 + (1 | participant) + (1 | stimulus), crossed, FALSE)
b <- refined(y ~ texture * group + (1 | participant) + (1 | stimulus), crossed, FALSE)
lr <- anova(a, b)
prof <- function(formula, data) {
  m <- lme4::lmer(formula, data, REML = FALSE, control = control)
  ci <- confint(profile(m, which = "theta_", signames = FALSE, delta = 0.1))
  list(names = rownames(ci), low = unname(ci[, 1]), high = unname(ci[, 2]))
}
version <- function(p) as.character(packageVersion(p))
whole <- list(
  made_by = list(R = R.version.string, lme4 = version("lme4"), lmerTest = version("lmerTest"), numDeriv = version("numDeriv")),
  models = out,
  likelihood_ratio = list(csv = "lmm_crossed.csv", chi2 = lr$Chisq[2], df = lr$Df[2], p = lr$`Pr(>Chisq)`[2]),
  profile = list(penicillin = prof(y ~ 1 + (1 | plate) + (1 | sample), penicillin),
                 crossed_ml = prof(y ~ texture * group + (1 | participant) + (1 | stimulus), crossed))
)
write_json(whole, "lmm_reference.json", digits = I(17), auto_unbox = TRUE, null = "null", na = "null", pretty = 1)
