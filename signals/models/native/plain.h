/* Operations on every number, or on every row. */

static void N(norm)(const palpate_program *p, const op_norm *o) {
    const float *weight = p->weights + o->weight, *bias = p->weights + o->bias;
    const float share = 1.0f / (float)o->cols, tiny = (float)p->doubles[o->tiny];
    for (int64_t row = 0; row < o->rows; row++) {
        const float *x = p->work + o->x.at + row * o->x.rs;
        float *y = p->work + o->y.at + row * o->y.rs;
        N(vec) sum = {0}, square = {0};
        for (int64_t i = 0; i < o->cols; i += LANES) sum += N(load_part)(x + i, o->cols - i);
        float mean = N(sum)(sum) * share;
        for (int64_t i = 0; i < o->cols; i += LANES) {
            N(vec) far = N(first)(N(load_part)(x + i, o->cols - i) - mean, o->cols - i);
            square += far * far;
        }
        float variance = N(sum)(square) * share + tiny;
        float scale = sqrtf(variance) / variance; /* no number where it overflowed: 1 / sqrt would hide that */
        for (int64_t i = 0; i < o->cols; i += LANES) {
            N(vec) far = (N(load_part)(x + i, o->cols - i) - mean) * scale;
            N(store_part)(y + i, far * N(load)(weight + i) + N(load)(bias + i), o->cols - i);
        }
    }
}

static void N(functions)(const palpate_program *p, const op_function *o) {
    for (int64_t row = 0; row < o->rows; row++) {
        const float *x = p->work + o->x.at + row * o->x.rs;
        float *y = p->work + o->y.at + row * o->y.rs;
        for (int64_t i = 0; i < o->cols; i += LANES)
            N(store_part)(y + i, N(function)(o->function, N(load_part)(x + i, o->cols - i)), o->cols - i);
    }
}

static void N(affine)(const palpate_program *p, const op_affine *o) {
    for (int64_t row = 0; row < o->rows; row++) {
        const float *x = p->work + o->x.at + row * o->x.rs;
        const float *gain = p->weights + o->gain.at + row * o->gain.rs;
        const float *offset = p->weights + o->offset.at + row * o->offset.rs;
        float *y = p->work + o->y.at + row * o->y.rs;
        for (int64_t i = 0; i < o->cols; i++) y[i] = gain[i] * x[i] + offset[i];
    }
}

static void N(add)(const palpate_program *p, const op_add *o) {
    for (int64_t row = 0; row < o->rows; row++) {
        const float *a = p->work + o->a.at + row * o->a.rs, *b = p->work + o->b.at + row * o->b.rs;
        float *y = p->work + o->y.at + row * o->y.rs;
        for (int64_t i = 0; i < o->cols; i += LANES) {
            N(vec) sum = N(load_part)(a + i, o->cols - i) + N(load_part)(b + i, o->cols - i);
            N(store_part)(y + i, o->relu ? N(relu)(sum) : sum, o->cols - i);
        }
    }
}

static void N(copy)(const palpate_program *p, const op_copy *o) {
    for (int64_t row = 0; row < o->rows; row++) {
        const float *x = p->work + o->x.at + row * o->x.rs;
        float *y = p->work + o->y.at + row * o->y.rs;
        if (o->step == 1) memcpy(y, x, (size_t)o->cols * sizeof(float));
        else for (int64_t i = 0; i < o->cols; i++) y[i] = x[i * o->step];
    }
}

/* Along each row. */
static void N(softmax)(const palpate_program *p, const op_softmax *o) {
    for (int64_t row = 0; row < o->rows; row++) {
        const float *x = p->work + o->x.at + row * o->x.rs;
        float *y = p->work + o->y.at + row * o->y.rs, most = x[0];
        N(vec) sum = {0};
        for (int64_t i = 1; i < o->cols; i++) most = x[i] > most ? x[i] : most;
        for (int64_t i = 0; i < o->cols; i += LANES) {
            N(store_part)(y + i, N(exp)(N(load_part)(x + i, o->cols - i) - most), o->cols - i);
            sum += N(load_part)(y + i, o->cols - i);
        }
        float scale = 1.0f / N(sum)(sum);
        for (int64_t i = 0; i < o->cols; i++) y[i] *= scale;
    }
}

static void N(pool)(const palpate_program *p, const op_rows *o) {
    for (int64_t row = 0; row < o->rows; row++) {
        const float *x = p->work + o->x.at + row * o->size * o->x.rs;
        float *y = p->work + o->y.at + row * o->y.rs;
        for (int64_t i = 0; i < o->cols; i += LANES) {
            N(vec) most = N(load_part)(x + i, o->cols - i);
            for (int64_t s = 1; s < o->size; s++)
                most = N(greatest)(most, N(load_part)(x + s * o->x.rs + i, o->cols - i));
            N(store_part)(y + i, most, o->cols - i);
        }
    }
}

static void N(repeat)(const palpate_program *p, const op_rows *o) {
    for (int64_t row = 0; row < o->rows * o->size; row++)
        memcpy(p->work + o->y.at + row * o->y.rs, p->work + o->x.at + row / o->size * o->x.rs,
               (size_t)o->cols * sizeof(float));
}

static void N(clip)(const palpate_program *p, const op_clip *o) {
    const float low = (float)p->doubles[o->bounds], high = (float)p->doubles[o->bounds + 1];
    for (int64_t row = 0; row < o->rows; row++) {
        const float *x = p->work + o->x.at + row * o->x.rs;
        float *y = p->work + o->y.at + row * o->y.rs;
        for (int64_t i = 0; i < o->cols; i++) {
            float kept = x[i] < low ? low : (x[i] > high ? high : x[i]);
            y[i] = x[i] - x[i] == 0 ? kept : x[i] - x[i]; /* what is not finite is not made to look so */
        }
    }
}
