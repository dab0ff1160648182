/* A flat program of operations on float32 values in one workspace, and the call that runs it once.

   Everything is laid out beforehand by signals/models/native/program.py: an operation names where its values lie, as
   counts of numbers from the start of the workspace, and a step allocates nothing. All fields are int64, so that an
   operation is one row of an array. */
#ifndef PALPATE_KERNEL_H
#define PALPATE_KERNEL_H

#include <stdint.h>

#define PALPATE_VERSION 2
#define PALPATE_FIELDS 24
#define PALPATE_MOST_LANES 16

enum palpate_kind {
    OP_NORMALISE, OP_LINEAR, OP_POLAR, OP_CARTESIAN, OP_GEMM, OP_NORM, OP_ATTENTION, OP_FUNCTION, OP_AFFINE, OP_ADD,
    OP_COPY, OP_SOFTMAX, OP_POOL, OP_REPEAT, OP_LSTM, OP_AUTOREGRESSION, OP_CLIP
};
enum palpate_function {
    FN_RELU, FN_TANH, FN_SIGMOID, FN_GELU, FN_ELU, FN_LEAKY, FN_SOFTPLUS, FN_EXP, FN_LOG, FN_SQUARE, FN_ABS
};
enum palpate_status { ANSWERED, NOT_WITHIN, NOT_FINITE };

/* A matrix in the workspace: element (row, col) at `at + row * rs + col`. */
typedef struct { int64_t at, rs; } place;

/* y[i] = gain[i] * x[from[i]] + offset[i], from the input in double precision; gain, offset, from: in the doubles. */
typedef struct { int64_t kind, y, count, gain, offset, from; } op_normalise;
/* y = A x[first .. first + count) + c in double precision; A by columns, each `rows` long; y in the double workspace. */
typedef struct { int64_t kind, y, rows, first, count, matrix, offset; } op_linear;
/* Real and imaginary parts, at x64 in the double workspace if `wide`, else at x, to magnitudes at y, phases at y + rs. */
typedef struct { int64_t kind, x64; place x, y; int64_t n, wide; } op_polar;
typedef struct { int64_t kind; place x, y; int64_t n; } op_cartesian;
/* y = A W + bias (+ more), m x k times k x n; A's columns are `step` apart; W in panels; bias row r at bias + r * rs. */
typedef struct {
    int64_t kind; place a; int64_t step, m, k, n, weight, half, bias, bias_rs; place more; place y; int64_t relu;
} op_gemm;
/* Rows of `cols` numbers: (x - mean) / sqrt(variance + tiny) * weight + bias; tiny: in the doubles. */
typedef struct { int64_t kind; place x, y; int64_t rows, cols, weight, bias, tiny; } op_norm;
/* Softmax of the scaled queries' products with the keys, times the values, for each head; `work`: room for it. */
typedef struct {
    int64_t kind; place q, k, v, y; int64_t heads, depth, asked, known, causal, work, most;
} op_attention;
typedef struct { int64_t kind; place x, y; int64_t rows, cols, function; } op_function;
/* y = gain * x + offset; both as matrices among the weights, rows `rs` apart (0: the same for all). */
typedef struct { int64_t kind; place x, y; int64_t rows, cols; place gain, offset; } op_affine;
typedef struct { int64_t kind; place a, b, y; int64_t rows, cols, relu; } op_add;
/* y(row, col) = x at row * x.rs + col * step: a copy, or a transposition where step is not 1. */
typedef struct { int64_t kind; place x, y; int64_t rows, cols, step; } op_copy;
typedef struct { int64_t kind; place x, y; int64_t rows, cols; } op_softmax;
/* Rows are places: the greatest of `size` rows, or every row `size` times. */
typedef struct { int64_t kind; place x, y; int64_t rows, cols, size; } op_rows;
/* x: the gates' inputs (rows, 4 hidden); state: packed like a weight, hidden x 4 hidden; work: 6 hidden, padded. */
typedef struct { int64_t kind; place x, y; int64_t rows, hidden, state, reverse, work; } op_lstm;
/* From the input (3, length) itself; all but y in the doubles. shares: what turns (speed, force, 1) into the shares of
   the triangles' first, second, third corners (3 triangles, 3); full: their rows (triangles, 3); edges: start and
   length (rims, 4) of the outermost, rim: their rows; gain: of each of the accelerations; work: 3 order + 16 of the
   double workspace. Mean, log SD: at y, and at y64 of the double one. */
typedef struct {
    int64_t kind, y, y64, length, order, triangles, rims, shares, full, edges, rim, frequencies, log_sd, per, gain, work;
} op_autoregression;
typedef struct { int64_t kind; place x, y; int64_t rows, cols, bounds; } op_clip;

typedef union { int64_t kind; int64_t field[PALPATE_FIELDS]; op_normalise normalise; op_linear linear; op_polar polar;
    op_cartesian cartesian; op_gemm gemm; op_norm norm; op_attention attention; op_function function; op_affine affine;
    op_add add; op_copy copy; op_softmax softmax; op_rows rows; op_lstm lstm; op_autoregression autoregression;
    op_clip clip; } palpate_op;

typedef struct {
    int64_t set, ops, inputs, outputs; /* instruction set; how many */
    int64_t answer, answer64; /* where in the workspace the answer lies; in the double one, or -1 */
    const palpate_op *op;
    float *work;
    double *work64;
    const float *weights;
    const double *doubles;
    const double *within;     /* low, high */
    const double *out_affine; /* gains, then offsets, of the outputs */
    const double *x;
    double *y;
} palpate_program;

typedef struct {
    const char *name;
    int64_t lanes; /* numbers in a vector */
    void (*run)(const palpate_program *);
    float (*most_products)(int64_t);
    float (*most_numbers)(const float *, int64_t);
    int64_t products; /* added in one round of the first */
} palpate_set;

void palpate_autoregression(const palpate_program *p, const op_autoregression *o);

#endif
