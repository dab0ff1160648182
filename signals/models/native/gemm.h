/* Products of matrices: ROWS x 2 vectors of sums stay in registers while a panel of weights passes by. */

typedef struct {
    const float *a, *b, *bias, *more;
    float *y;
    int64_t ars, step, ldb, k, bias_rs, more_rs, yrs, left; /* left: columns of y from here on */
    int relu;
} N(tile_of);

/* The bias and what is added come last: sums of small products are not rounded as coarsely as those then are. What lies
   beyond the last column is not stored. */
INLINE void N(finish)(const int rows, const int vecs, const N(tile_of) * t, N(vec) *sum) {
    if (t->bias) {
        UNROLL for (int i = 0; i < rows * vecs; i++)
            sum[i] += N(load)(t->bias + i / vecs * t->bias_rs + i % vecs * LANES);
    }
    if (t->more) {
        UNROLL for (int i = 0; i < rows * vecs; i++)
            sum[i] += N(load)(t->more + i / vecs * t->more_rs + i % vecs * LANES);
    }
    if (t->relu) {
        UNROLL for (int i = 0; i < rows * vecs; i++) sum[i] = N(relu)(sum[i]);
    }
    if (t->left >= vecs * LANES) {
        UNROLL for (int i = 0; i < rows * vecs; i++)
            N(store)(t->y + i / vecs * t->yrs + i % vecs * LANES, sum[i]);
    } else {
        UNROLL for (int i = 0; i < rows * vecs; i++)
            if (t->left > i % vecs * LANES)
                N(store_part)(t->y + i / vecs * t->yrs + i % vecs * LANES, sum[i], t->left - i % vecs * LANES);
    }
}

/* rows x vecs sums; `across`: a's elements of one column lie side by side, so that rows are constant displacements. */
INLINE void N(tile)(const int rows, const int vecs, const int across, const N(tile_of) * t) {
    N(vec) sum[ROWS * 2];
    const float *a = t->a, *b = t->b;
    const int64_t ars = across ? 1 : t->ars, step = across ? t->step : 1, ldb = t->ldb;
    UNROLL for (int i = 0; i < rows * vecs; i++) sum[i] = (N(vec)){0};
    for (int64_t k = 0; k < t->k; k++) {
        N(vec) w[2];
        UNROLL for (int v = 0; v < vecs; v++) w[v] = N(load)(b + v * LANES);
        UNROLL for (int r = 0; r < rows; r++) {
            N(vec) x = N(all)(a[r * ars]);
            UNROLL for (int v = 0; v < vecs; v++) sum[r * vecs + v] += x * w[v];
        }
        a += step;
        b += ldb;
    }
    N(finish)(rows, vecs, t, sum);
}

#define TILES(name, rows, vecs, across) \
    static NOINLINE void N(name)(const N(tile_of) * t) { N(tile)(rows, vecs, across, t); }
TILES(most_two, ROWS, 2, 0)
TILES(most_one, ROWS, 1, 0)
TILES(few_two, 2, 2, 0)
TILES(few_one, 2, 1, 0)
TILES(one_two, 1, 2, 0)
TILES(one_one, 1, 1, 0)
TILES(across_most_two, ROWS, 2, 1)
TILES(across_most_one, ROWS, 1, 1)
TILES(across_one_two, 1, 2, 1)
TILES(across_one_one, 1, 1, 1)

/* All rows of one panel. */
static void N(panel)(N(tile_of) t, int64_t m) {
    const int two = t.left > LANES, across = t.step != 1;
    while (m > 0) {
        int64_t rows = m >= ROWS ? ROWS : (m >= 2 && !across ? 2 : 1);
        if (across && rows == ROWS) (two ? N(across_most_two) : N(across_most_one))(&t);
        else if (across) (two ? N(across_one_two) : N(across_one_one))(&t);
        else if (rows == ROWS) (two ? N(most_two) : N(most_one))(&t);
        else if (rows == 2) (two ? N(few_two) : N(few_one))(&t);
        else (two ? N(one_two) : N(one_one))(&t);
        t.a += rows * t.ars;
        t.y += rows * t.yrs;
        if (t.bias) t.bias += rows * t.bias_rs;
        if (t.more) t.more += rows * t.more_rs;
        m -= rows;
    }
}

INLINE N(vec) N(load_half)(const uint16_t *p) {
#if LANES == 16
    __m256 low = _mm256_cvtph_ps(_mm_loadu_si128((const __m128i *)p));
    __m256 high = _mm256_cvtph_ps(_mm_loadu_si128((const __m128i *)(p + 8)));
    return (N(vec))_mm512_insertf32x8(_mm512_castps256_ps512(low), high, 1); /* quicker than 16 at once on Zen 4 */
#elif LANES == 8
    return (N(vec))_mm256_cvtph_ps(_mm_loadu_si128((const __m128i *)p));
#else
    (void)p;
    return (N(vec)){0};
#endif
}

/* One row: four partial sums beside each other, since one alone would wait for itself. */
INLINE void N(line)(const int vecs, const int half, const N(tile_of) * t) {
    N(vec) sum[8];
    const float *a = t->a, *b = t->b;
    const uint16_t *h = (const uint16_t *)t->b;
    const int width = vecs * LANES;
    int64_t k = 0;
    UNROLL for (int i = 0; i < 8; i++) sum[i] = (N(vec)){0};
    for (; k + 4 <= t->k; k += 4) {
        UNROLL for (int u = 0; u < 4; u++) {
            N(vec) x = N(all)(a[k + u]);
            UNROLL for (int v = 0; v < vecs; v++) {
                int64_t place = (k + u) * width + v * LANES;
                sum[u * 2 + v] += x * (half ? N(load_half)(h + place) : N(load)(b + place));
            }
        }
    }
    for (; k < t->k; k++) {
        UNROLL for (int v = 0; v < vecs; v++) {
            int64_t place = k * width + v * LANES;
            sum[v] += a[k] * (half ? N(load_half)(h + place) : N(load)(b + place));
        }
    }
    N(vec) y[2] = {(sum[0] + sum[2]) + (sum[4] + sum[6]), (sum[1] + sum[3]) + (sum[5] + sum[7])};
    N(finish)(1, vecs, t, y);
}

static NOINLINE void N(line_two)(const N(tile_of) * t) { N(line)(2, 0, t); }
static NOINLINE void N(line_one)(const N(tile_of) * t) { N(line)(1, 0, t); }
static NOINLINE void N(half_two)(const N(tile_of) * t) { N(line)(2, 1, t); }
static NOINLINE void N(half_one)(const N(tile_of) * t) { N(line)(1, 1, t); }

static void N(gemm)(const palpate_program *p, const op_gemm *o) {
    float *work = p->work;
    for (int64_t col = 0; col < o->n; col += 2 * LANES) {
        int64_t left = o->n - col, wide = left > LANES ? 2 * LANES : LANES;
        int64_t skipped = o->half ? (o->k * col + 1) / 2 : o->k * col;
        N(tile_of) t = {
            .a = work + o->a.at, .ars = o->a.rs, .step = o->step, .k = o->k, .ldb = wide, .left = left,
            .b = p->weights + o->weight + skipped, .relu = (int)o->relu,
            .bias = o->bias < 0 ? 0 : p->weights + o->bias + col, .bias_rs = o->bias_rs,
            .more = o->more.at < 0 ? 0 : work + o->more.at + col, .more_rs = o->more.rs,
            .y = work + o->y.at + col, .yrs = o->y.rs,
        };
        if (o->m > 1 || o->step != 1) N(panel)(t, o->m);
        else if (o->half) (left > LANES ? N(half_two) : N(half_one))(&t);
        else (left > LANES ? N(line_two) : N(line_one))(&t);
    }
}
