# Reference numbers for tests/analysis/spaces, run from the repository's root: Rscript tests/analysis/data/r/spaces.R
# R's and the packages' versions are written into spaces.json. Sets: datasets::attitude, datasets::eurodist, the 14
# colours of Ekman 1954 (J. Psychol. 38, 467-474, table 1, similarities: published facts; every cell is equal to
# `ekman` of the R package smacof 2.1-7) and one generated here.
suppressMessages({library(MASS); library(vegan); library(jsonlite)})
here <- "tests/analysis/data/r"
out <- list(made_with = list(R = R.version.string, MASS = as.character(packageVersion("MASS")),
  vegan = as.character(packageVersion("vegan"))))
square <- function(d) { m <- as.matrix(d); list(labels = gsub("[ .]", "_", rownames(m)), values = unname(m)) }

ekman <- matrix(0, 14, 14)
ekman[upper.tri(ekman)] <- c(.86, .42, .50, .42, .44, .81, .18, .22, .47, .54, .06, .09, .17, .25, .61,
  .07, .07, .10, .10, .31, .62, .04, .07, .08, .09, .26, .45, .73, .02, .02, .02, .02, .07, .14, .22, .33,
  .07, .04, .01, .01, .02, .08, .14, .19, .58, .09, .07, .02, .00, .02, .02, .05, .04, .37, .74,
  .12, .11, .01, .01, .01, .02, .02, .03, .27, .50, .76, .13, .13, .05, .02, .02, .02, .02, .02, .20, .41, .62, .85,
  .16, .14, .03, .04, .00, .01, .00, .02, .23, .28, .55, .68, .76)
ekman <- ekman + t(ekman); diag(ekman) <- 1
dimnames(ekman) <- rep(list(c(434, 445, 465, 472, 490, 504, 537, 555, 584, 600, 610, 628, 651, 674)), 2)
set.seed(20261121)
made <- matrix(rnorm(24 * 4), 24, 4) %*% diag(c(3, 2, 1, .6)); rownames(made) <- sprintf("S%02d", 1:24)
made <- round(made, 2)
sets <- list(eurodist = eurodist, ekman = as.dist(1 - ekman), attitude = dist(as.matrix(attitude)), made = dist(made))
for (name in names(sets)) attr(sets[[name]], "Labels") <- gsub("[ .]", "_", as.character(if (is.null(attr(sets[[name]], "Labels"))) seq_len(attr(sets[[name]], "Size")) else attr(sets[[name]], "Labels")))
out$sets <- lapply(sets, square)
out$ekman_similarity <- square(ekman)
out$attitude <- as.matrix(attitude); out$attitude_columns <- colnames(attitude)
out$made <- unname(made)

p <- function(scale) { f <- prcomp(attitude, scale. = scale)
  list(sdev = f$sdev, rotation = unname(f$rotation), scores = unname(f$x)) }
out$prcomp <- list(covariance = p(FALSE), correlation = p(TRUE))

out$cmdscale <- lapply(sets, function(d) { f <- cmdscale(d, k = 2, eig = TRUE)
  list(eig = f$eig, GOF = f$GOF, points = unname(f$points)) })

best <- function(d, k) {
  iso <- isoMDS(d, y = cmdscale(d, k), k = k, maxit = 1000, tol = 1e-9, trace = FALSE)$stress / 100
  set.seed(1)
  runs <- sapply(1:60, function(i) monoMDS(d, k = k, maxit = 2000, sfgrmin = 1e-10, smin = 1e-10, sratmax = 1 - 1e-12)$stress)
  first <- monoMDS(d, y = cmdscale(d, k), k = k, maxit = 2000, sfgrmin = 1e-10, smin = 1e-10, sratmax = 1 - 1e-12)$stress
  strong <- min(c(sapply(1:60, function(i) monoMDS(d, k = k, weakties = FALSE, maxit = 2000, sfgrmin = 1e-10, smin = 1e-10, sratmax = 1 - 1e-12)$stress),
    monoMDS(d, y = cmdscale(d, k), k = k, weakties = FALSE, maxit = 2000, sfgrmin = 1e-10, smin = 1e-10, sratmax = 1 - 1e-12)$stress))
  list(isoMDS = iso, monoMDS_primary = min(runs, first), monoMDS_secondary = strong)
}
out$stress <- lapply(sets, function(d) lapply(1:3, function(k) best(d, k)))

x <- cmdscale(eurodist, 2); noise <- matrix(sin(1:42) * 300, 21, 2); y <- -0.5 * (x + noise)[, 2:1] + 40
out$procrustes <- list(x = unname(x), y = unname(y))
for (s in c(TRUE, FALSE)) { f <- procrustes(x, y, scale = s)
  out$procrustes[[if (s) "scaled" else "unscaled"]] <- list(ss = f$ss, rotation = unname(f$rotation), scale = f$scale,
    translation = as.vector(f$translation), fitted = unname(f$Yrot + matrix(colMeans(x), 21, 2, byrow = TRUE))) }
set.seed(3); t <- protest(x, y, permutations = 9999); out$procrustes$r <- t$t0; out$procrustes$m2 <- t$ss
weak <- cbind(cos(1:21 * 2.3), sin(1:21 * 1.7)) + scale(x) * .35
set.seed(4); t <- protest(x, weak, permutations = 99999)
out$procrustes$weak <- list(y = unname(weak), r = t$t0, p = t$signif, permutations = 99999)

z <- cmdscale(dist(scale(as.matrix(attitude))), 2); set.seed(5)
f <- envfit(z, attitude, permutations = 9999)$vectors
out$envfit <- list(points = unname(z), arrows = unname(f$arrows), r2 = unname(f$r), p = unname(f$pvals), permutations = 9999)
write_json(out, file.path(here, "spaces.json"), digits = I(17), auto_unbox = TRUE, matrix = "rowmajor")

# What `palpate bench statistics` needs of the above.
few <- out[c("made_with", "procrustes")]
few$procrustes <- few$procrustes[c("x", "y", "m2")]
few$sdev <- lapply(out$prcomp, function(f) f$sdev)
few$sets <- out$sets[c("eurodist", "ekman")]
few$eigenvalues <- lapply(out$cmdscale[c("eurodist", "ekman")], function(f) f$eig)
few$stress <- lapply(out$stress[c("eurodist", "ekman")], function(s) min(s[[2]]$isoMDS, s[[2]]$monoMDS_primary))
write_json(few, "analysis/spaces/bench_truth.json", digits = I(17), auto_unbox = TRUE, matrix = "rowmajor")
