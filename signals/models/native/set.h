/* One instruction set: the same source, compiled for it. */
#include "vector.h"
#include "gemm.h"
#include "attention.h"
#include "plain.h"
#include "recurrence.h"
#include "spectral.h"
#include "rates.h"

static void N(run_one)(const palpate_program *p, const palpate_op *o) {
    switch (o->kind) {
    case OP_NORMALISE: N(normalise)(p, &o->normalise); break;
    case OP_LINEAR: N(linear)(p, &o->linear); break;
    case OP_POLAR: N(polar)(p, &o->polar); break;
    case OP_CARTESIAN: N(cartesian)(p, &o->cartesian); break;
    case OP_GEMM: N(gemm)(p, &o->gemm); break;
    case OP_NORM: N(norm)(p, &o->norm); break;
    case OP_ATTENTION: N(attention)(p, &o->attention); break;
    case OP_FUNCTION: N(functions)(p, &o->function); break;
    case OP_AFFINE: N(affine)(p, &o->affine); break;
    case OP_ADD: N(add)(p, &o->add); break;
    case OP_COPY: N(copy)(p, &o->copy); break;
    case OP_SOFTMAX: N(softmax)(p, &o->softmax); break;
    case OP_POOL: N(pool)(p, &o->rows); break;
    case OP_REPEAT: N(repeat)(p, &o->rows); break;
    case OP_LSTM: N(lstm)(p, &o->lstm); break;
    case OP_AUTOREGRESSION: palpate_autoregression(p, &o->autoregression); break;
    case OP_CLIP: N(clip)(p, &o->clip); break;
    default: break;
    }
}

static void N(run)(const palpate_program *p) {
    for (int64_t i = 0; i < p->ops; i++) N(run_one)(p, p->op + i);
}

#undef LANES
#undef ROWS
#undef N
