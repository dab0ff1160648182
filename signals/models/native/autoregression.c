/* A linear predictor whose line spectral frequencies lie between those of a triangle's corners. Double precision. */
#include "kernel.h"

#include <math.h>
#include <string.h>

#define EDGE -1e-9

typedef struct { int64_t row[3]; double share[3]; } corners;

static double clipped(double x) { return x < 0 ? 0 : x > 1 ? 1 : x; }

/* The triangle that the place lies deepest in; 0 where it lies outside all. */
static int inside(const palpate_program *p, const op_autoregression *o, double speed, double force, corners *found) {
    const double *shares = p->doubles + o->shares, *rows = p->doubles + o->full;
    double deepest = -HUGE_VAL;
    for (int64_t t = 0; t < o->triangles; t++) {
        double share[3], least = HUGE_VAL;
        for (int c = 0; c < 3; c++) {
            const double *of = shares + 3 * (c * o->triangles + t);
            share[c] = of[0] * speed + of[1] * force + of[2];
            least = share[c] < least || share[c] != share[c] ? share[c] : least; /* what is no number stays so */
        }
        if (!(least > deepest)) continue;
        deepest = least;
        for (int c = 0; c < 3; c++) {
            found->row[c] = (int64_t)rows[3 * t + c];
            found->share[c] = share[c] > 0 ? share[c] : 0;
        }
    }
    if (deepest < EDGE) return 0;
    double sum = found->share[0] + found->share[1] + found->share[2];
    for (int c = 0; c < 3; c++) found->share[c] /= sum;
    return 1;
}

/* The nearest place on the rim, by its edge's two points; shares are no numbers where all are too far to tell. */
static void nearest(const palpate_program *p, const op_autoregression *o, double speed, double force, corners *found) {
    double least = HUGE_VAL;
    *found = (corners){{0, 0, 0}, {NAN, NAN, NAN}};
    for (int64_t e = 0; e < o->rims; e++) {
        const double *edge = p->doubles + o->edges + 4 * e, *rows = p->doubles + o->rim + 2 * e;
        double dx = speed - edge[0], dy = force - edge[1], square = edge[2] * edge[2] + edge[3] * edge[3];
        double share = clipped((dx * edge[2] + dy * edge[3]) / (square > 1e-300 ? square : 1e-300));
        double rx = dx - share * edge[2], ry = dy - share * edge[3], far = rx * rx + ry * ry;
        if (!(far < least)) continue;
        least = far;
        *found = (corners){{(int64_t)rows[0], (int64_t)rows[1], (int64_t)rows[1]}, {1 - share, share, 0}};
    }
}

/* by (1 - 2 cos f z + z^2), a polynomial of so many coefficients. */
static void times_pair(double *of, int64_t count, double cosine) {
    for (int64_t i = count + 1; i >= 0; i--) {
        double here = i < count ? of[i] : 0, one = i >= 1 && i - 1 < count ? of[i - 1] : 0;
        of[i] = here - 2 * cosine * one + (i >= 2 ? of[i - 2] : 0);
    }
}

/* by (1 + sign z^by). */
static void times_end(double *of, int64_t count, double sign, int64_t by) {
    for (int64_t i = count + by - 1; i >= 0; i--) of[i] = (i < count ? of[i] : 0) + (i >= by ? sign * of[i - by] : 0);
}

/* The pairs of every second frequency, from both ends in turn: from one end alone, coefficients would grow far beyond
   what is left of them in the end, and their digits be lost. */
static int64_t times_all(double *of, const double *frequency, int64_t order, int64_t first) {
    int64_t pairs = (order - first + 1) / 2;
    for (int64_t i = 0; i < pairs; i++) {
        int64_t pair = i % 2 ? pairs - 1 - i / 2 : i / 2;
        times_pair(of, 1 + 2 * i, cos(frequency[first + 2 * pair]));
    }
    return 1 + 2 * pairs;
}

/* A = (P + Q) / 2, P and Q having every second frequency (Itakura 1975; Soong and Juang 1984). */
static void filter_of(const double *frequency, int64_t order, double *p, double *q) {
    memset(p, 0, (size_t)(order + 4) * sizeof *p);
    memset(q, 0, (size_t)(order + 4) * sizeof *q);
    p[0] = q[0] = 1;
    int64_t count = times_all(p, frequency, order, 0);
    if (order % 2 == 0) times_end(p, count, 1, 1);
    count = times_all(q, frequency, order, 1);
    times_end(q, count, -1, order % 2 ? 2 : 1);
}

void palpate_autoregression(const palpate_program *p, const op_autoregression *o) {
    const int64_t order = o->order, last = o->length - 1;
    const double *per = p->doubles + o->per, *log_sd = p->doubles + o->log_sd, *gain = p->doubles + o->gain;
    double speed = p->x[o->length + last] / per[0], force = p->x[2 * o->length + last] / per[1];
    double *frequency = p->work64 + o->work, *one = frequency + order, *two = one + order + 4, mean = 0, level = 0;
    corners at;
    if (!inside(p, o, speed, force, &at)) nearest(p, o, speed, force, &at);
    memset(frequency, 0, (size_t)order * sizeof *frequency);
    for (int c = 0; c < 3; c++) {
        const double *of = p->doubles + o->frequencies + at.row[c] * order;
        for (int64_t i = 0; i < order; i++) frequency[i] += at.share[c] * of[i];
        level += at.share[c] * log_sd[at.row[c]];
    }
    filter_of(frequency, order, one, two);
    for (int64_t i = 1; i <= order; i++) mean -= 0.5 * (one[i] + two[i]) * gain[last + 1 - i] * p->x[last + 1 - i];
    p->work64[o->y64] = mean;
    p->work64[o->y64 + 1] = level;
    p->work[o->y] = (float)mean;
    p->work[o->y + 1] = (float)level;
}
