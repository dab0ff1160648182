/* A long short-term memory: the gates' inputs are one product beforehand, each place then adds the state's. */

static void N(gates)(const float *z, int64_t hidden, float *state, float *cell) {
    for (int64_t i = 0; i < hidden; i += LANES) {
        N(vec) in = N(sigmoid)(N(load)(z + i)), forget = N(sigmoid)(N(load)(z + hidden + i));
        N(vec) fresh = N(tanh)(N(load)(z + 2 * hidden + i)), out = N(sigmoid)(N(load)(z + 3 * hidden + i));
        N(vec) held = N(first)(forget * N(load)(cell + i) + in * fresh, hidden - i);
        N(store)(cell + i, held);
        N(store)(state + i, N(first)(out * N(tanh)(held), hidden - i));
    }
}

static void N(lstm)(const palpate_program *p, const op_lstm *o) {
    const int64_t hidden = o->hidden, room = (hidden + LANES - 1) / LANES * LANES;
    float *state = p->work + o->work, *cell = state + room, *z = cell + room;
    memset(state, 0, (size_t)(2 * room) * sizeof(float));
    for (int64_t count = 0; count < o->rows; count++) {
        int64_t row = o->reverse ? o->rows - 1 - count : count;
        op_gemm step = {.a = {o->work, 0}, .step = 1, .m = 1, .k = hidden, .n = 4 * hidden, .weight = o->state,
                        .bias = -1, .more = {o->x.at + row * o->x.rs, 0}, .y = {z - p->work, 0}};
        N(gemm)(p, &step);
        N(gates)(z, hidden, state, cell);
        memcpy(p->work + o->y.at + row * o->y.rs, state, (size_t)hidden * sizeof(float));
    }
}
