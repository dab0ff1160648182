/* Between the input in double precision and single-precision values; between both ways of writing complex numbers. */

static void N(normalise)(const palpate_program *p, const op_normalise *o) {
    const double *gain = p->doubles + o->gain, *offset = p->doubles + o->offset, *from = p->doubles + o->from;
    for (int64_t i = 0; i < o->count; i++)
        p->work[o->y + i] = (float)(gain[i] * p->x[(int64_t)from[i]] + offset[i]);
}

static void N(linear)(const palpate_program *p, const op_linear *o) {
    double *y = p->work64 + o->y;
    memcpy(y, p->doubles + o->offset, (size_t)o->rows * sizeof(double));
    for (int64_t c = 0; c < o->count; c++) {
        const double *column = p->doubles + o->matrix + c * o->rows, x = p->x[o->first + c];
        for (int64_t r = 0; r < o->rows; r++) y[r] += column[r] * x;
    }
}

static void N(polar)(const palpate_program *p, const op_polar *o) {
    const double *re = p->work64 + o->x64, *im = re + o->n;
    const float *single = p->work + o->x.at;
    float *size = p->work + o->y.at, *phase = size + o->y.rs;
    for (int64_t i = 0; i < o->n; i++) {
        double a = o->wide ? re[i] : single[i], b = o->wide ? im[i] : single[o->x.rs + i];
        size[i] = (float)sqrt(a * a + b * b);
        phase[i] = (float)atan2(b, a);
    }
}

static void N(cartesian)(const palpate_program *p, const op_cartesian *o) {
    const float *size = p->work + o->x.at, *phase = size + o->x.rs;
    float *re = p->work + o->y.at, *im = re + o->y.rs;
    for (int64_t i = 0; i < o->n; i++) {
        re[i] = size[i] * cosf(phase[i]);
        im[i] = size[i] * sinf(phase[i]);
    }
}
