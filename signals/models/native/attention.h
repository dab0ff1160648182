/* Attention over a short sequence. The queries lie along the vectors, so that softmax needs no sum within one. */

/* The queries of one head, turned: (depth, wide). */
static void N(turned_queries)(const float *q, const op_attention *o, int64_t wide, float *to) {
    for (int64_t d = 0; d < o->depth; d++)
        for (int64_t i = 0; i < o->asked; i++) to[d * wide + i] = q[i * o->q.rs + d];
}

static void N(hide_later)(const op_attention *o, int64_t wide, float *scores) {
    for (int64_t k = 0; k < o->known; k++)
        for (int64_t i = 0; i < k && i < o->asked; i++) scores[k * wide + i] = -__builtin_inff();
}

/* Softmax down the columns of (known, wide). What is no number makes its column so: its own power is none. */
static void N(softmax_down)(float *scores, int64_t known, int64_t wide) {
    for (int64_t col = 0; col < wide; col += LANES) {
        float *s = scores + col;
        N(vec) most = N(load)(s), sum = {0};
        for (int64_t k = 1; k < known; k++) most = N(above)(most, N(load)(s + k * wide));
        for (int64_t k = 0; k < known; k++) {
            N(vec) e = N(exp_below)(N(load)(s + k * wide) - most);
            sum += e;
            N(store)(s + k * wide, e);
        }
        N(vec) scale = 1.0f / sum;
        for (int64_t k = 0; k < known; k++) N(store)(s + k * wide, N(load)(s + k * wide) * scale);
    }
}

/* y (m, n) = a b for a plain b with rows ldb apart. */
static void N(product)(N(tile_of) t, int64_t m, int64_t n) {
    for (int64_t col = 0; col < n; col += 2 * LANES) {
        t.left = n - col;
        N(panel)(t, m);
        t.b += 2 * LANES;
        t.y += 2 * LANES;
    }
}

/* As many queries answer as have the largest max - mean of their scores; `chosen` is 1 for those (Zhou et al. 2021).
   A query whose scores overflowed answers too, with what is no number: nobody knows whether it would be chosen. */
static void N(choose)(const op_attention *o, int64_t wide, float *scores, float *chosen) {
    float *worth = chosen + (o->asked + LANES - 1) / LANES * LANES;
    for (int64_t i = 0; i < o->asked; i++) {
        float most = scores[i];
        double sum = 0;
        for (int64_t k = 0; k < o->known; k++) {
            most = scores[k * wide + i] > most ? scores[k * wide + i] : most;
            sum += scores[k * wide + i];
        }
        worth[i] = (float)(most - sum / (double)o->known);
        chosen[i] = worth[i] - worth[i] != 0;
        if (chosen[i] != 0) scores[i] = worth[i] - worth[i];
    }
    for (int64_t picked = 0; picked < o->most; picked++) {
        int64_t best = -1;
        for (int64_t i = 0; i < o->asked; i++)
            if (chosen[i] == 0 && (best < 0 || worth[i] > worth[best])) best = i;
        if (best >= 0) chosen[best] = 1;
    }
}

/* What the queries that were not chosen answer: the mean of the values, or where causal their sum so far. */
static void N(plain_answers)(const op_attention *o, const float *v, const float *chosen, float *y) {
    for (int64_t d = 0; d < o->depth; d++) {
        double sum = 0;
        for (int64_t k = 0; k < o->known; k++) sum += v[k * o->v.rs + d];
        double mean = sum / (double)o->known;
        sum = 0;
        for (int64_t i = 0; i < o->asked; i++) {
            if (i < o->known) sum += v[i * o->v.rs + d];
            if (chosen[i] == 0) y[i * o->y.rs + d] = (float)(o->causal ? sum : mean);
        }
    }
}

/* Scores of one head: a row for each key, a column for each query. */
static void N(ask)(const palpate_program *p, const op_attention *o, int64_t h, int64_t wide, float *scores) {
    const int64_t room = (o->asked + LANES - 1) / LANES * LANES, start = h * o->depth;
    float *queries = p->work + o->work, *mine = scores + h * o->asked;
    N(turned_queries)(p->work + o->q.at + start, o, room, queries);
    N(tile_of) t = {.a = p->work + o->k.at + start, .ars = o->k.rs, .step = 1, .b = queries, .ldb = room,
                    .k = o->depth, .y = mine, .yrs = wide};
    N(product)(t, o->known, o->asked);
    if (o->most) N(choose)(o, wide, mine, scores + o->known * wide + h * 2 * room);
    if (o->causal) N(hide_later)(o, wide, mine);
}

static void N(answer)(const palpate_program *p, const op_attention *o, int64_t h, int64_t wide, float *scores) {
    const int64_t room = (o->asked + LANES - 1) / LANES * LANES, start = h * o->depth;
    const float *v = p->work + o->v.at + start;
    float *y = p->work + o->y.at + start;
    N(tile_of) t = {.a = scores + h * o->asked, .ars = 1, .step = wide, .b = v, .ldb = o->v.rs, .k = o->known,
                    .y = y, .yrs = o->y.rs};
    N(product)(t, o->asked, o->depth);
    if (o->most) N(plain_answers)(o, v, scores + o->known * wide + h * 2 * room, y);
}

/* All heads' scores lie side by side, so that few lanes are idle in the powers. */
static void N(attention)(const palpate_program *p, const op_attention *o) {
    const int64_t room = (o->asked + LANES - 1) / LANES * LANES;
    const int64_t wide = (o->heads * o->asked + LANES - 1) / LANES * LANES;
    float *scores = p->work + o->work + o->depth * room;
    for (int64_t h = 0; h < o->heads; h++) N(ask)(p, o, h, wide, scores);
    N(softmax_down)(scores, o->known, wide);
    for (int64_t h = 0; h < o->heads; h++) N(answer)(p, o, h, wide, scores);
}
