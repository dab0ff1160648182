/* What the processor can do at best: products added, and numbers read. For the bench's count of the limit. */

/* So many rounds of products, each added to a sum of its own; the sums' total, so that none is left out. */
static float N(most_products)(int64_t rounds) {
    N(vec) sum[ROWS * 2], factor = N(all)(0.999f), more = N(all)(0.001f);
    UNROLL for (int i = 0; i < ROWS * 2; i++) sum[i] = N(all)((float)i);
    for (int64_t round = 0; round < rounds; round++) {
        UNROLL for (int i = 0; i < ROWS * 2; i++) sum[i] = sum[i] * factor + more;
    }
    UNROLL for (int i = 1; i < ROWS * 2; i++) sum[0] += sum[i];
    return N(sum)(sum[0]);
}

/* Their sum: count is a multiple of eight vectors. */
static float N(most_numbers)(const float *numbers, int64_t count) {
    N(vec) sum[8];
    UNROLL for (int v = 0; v < 8; v++) sum[v] = (N(vec)){0};
    for (int64_t i = 0; i < count; i += 8 * LANES) {
        UNROLL for (int v = 0; v < 8; v++) sum[v] += N(load)(numbers + i + v * LANES);
    }
    UNROLL for (int v = 1; v < 8; v++) sum[0] += sum[v];
    return N(sum)(sum[0]);
}
