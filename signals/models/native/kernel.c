/* Instruction sets, the choice between them, and the calls that Python makes. */
#include "kernel.h"

#include <float.h>
#include <math.h>
#include <string.h>

#if defined(__x86_64__) || defined(__i386__)
#define ON_X86 1
#include <cpuid.h>
#include <immintrin.h>
#endif

#if !defined(__GNUC__)
#error "GCC or Clang is needed: the kernel uses their vector types"
#endif
#define INLINE static inline __attribute__((always_inline))
#define NOINLINE __attribute__((noinline))
#if defined(__clang__)
#define UNROLL _Pragma("clang loop unroll(full)")
#pragma clang diagnostic ignored "-Wpsabi"
#else
#define UNROLL _Pragma("GCC unroll 20")
#pragma GCC diagnostic ignored "-Wpsabi"
#endif

#define LANES 4
#define ROWS 5
#define N(name) any_##name
#include "set.h"

#ifdef ON_X86
#if defined(__clang__)
#pragma clang attribute push(__attribute__((target("avx2,fma,f16c"))), apply_to = function)
#else
#pragma GCC push_options
#pragma GCC target("avx2,fma,f16c")
#endif
#define LANES 8
#define ROWS 5
#define N(name) avx2_##name
#include "set.h"
#if defined(__clang__)
#pragma clang attribute pop
#pragma clang attribute push(__attribute__((target("avx512f,avx512dq,avx512vl,fma,f16c"))), apply_to = function)
#else
#pragma GCC pop_options
#pragma GCC push_options
#pragma GCC target("avx512f,avx512dq,avx512vl,fma,f16c")
#endif
#define LANES 16
#define ROWS 10
#define N(name) avx512_##name
#include "set.h"
#if defined(__clang__)
#pragma clang attribute pop
#else
#pragma GCC pop_options
#endif
#endif

static const palpate_set SETS[] = {
#ifdef ON_X86
    {"AVX-512", 16, avx512_run, avx512_most_products, avx512_most_numbers, 320},
    {"AVX2", 8, avx2_run, avx2_most_products, avx2_most_numbers, 80},
#endif
    {"plain", 4, any_run, any_most_products, any_most_numbers, 40},
};
#define COUNT ((int64_t)(sizeof SETS / sizeof *SETS))

#define CALL __attribute__((visibility("default")))

CALL int64_t palpate_version(void) { return PALPATE_VERSION; }
CALL int64_t palpate_sets(void) { return COUNT; }
CALL const char *palpate_set_name(int64_t set) { return SETS[set].name; }
CALL int64_t palpate_set_lanes(int64_t set) { return SETS[set].lanes; }

CALL int64_t palpate_set_products(int64_t set) { return SETS[set].products; }
CALL float palpate_most_products(int64_t set, int64_t rounds) { return SETS[set].most_products(rounds); }
CALL float palpate_most_numbers(int64_t set, const float *numbers, int64_t count) {
    return SETS[set].most_numbers(numbers, count);
}

/* Whether this processor, and its system, has the set. */
CALL int palpate_set_usable(int64_t set) {
#ifdef ON_X86
    unsigned a, b, c, d;
    __builtin_cpu_init();
    if (SETS[set].lanes == 4) return 1;
    if (!__get_cpuid(1, &a, &b, &c, &d) || !(c & bit_F16C)) return 0;
    if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma")) return 0;
    if (SETS[set].lanes == 8) return 1;
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
           __builtin_cpu_supports("avx512vl");
#else
    return SETS[set].lanes == 4;
#endif
}

/* Numbers too small to be normal ones take a hundred times as long: they count as zero while a step runs. */
#ifdef ON_X86
typedef unsigned int mode;
static mode flush_small(void) {
    mode was = _mm_getcsr();
    _mm_setcsr(was | 0x8040u);
    return was;
}
static void restore(mode was) { _mm_setcsr(was); }
#elif defined(__aarch64__)
typedef uint64_t mode;
static mode flush_small(void) {
    mode was;
    __asm__ volatile("mrs %0, fpcr" : "=r"(was));
    __asm__ volatile("msr fpcr, %0" : : "r"(was | (1u << 24)));
    return was;
}
static void restore(mode was) { __asm__ volatile("msr fpcr, %0" : : "r"(was)); }
#else
typedef int mode;
static mode flush_small(void) { return 0; }
static void restore(mode was) { (void)was; }
#endif

static int within(const palpate_program *p) {
    int good = 1;
    for (int64_t i = 0; i < p->inputs; i++) good &= p->x[i] >= p->within[0] && p->x[i] <= p->within[1];
    return good;
}

static int answered(const palpate_program *p) {
    int good = 1;
    for (int64_t i = 0; i < p->outputs; i++) {
        double found = p->answer64 < 0 ? (double)p->work[p->answer + i] : p->work64[p->answer64 + i];
        p->y[i] = p->out_affine[i] * found + p->out_affine[p->outputs + i];
        good &= p->y[i] - p->y[i] == 0;
    }
    return good;
}

/* One step: p->x to p->y. */
CALL int palpate_step(const palpate_program *p) {
    if (!within(p)) return NOT_WITHIN;
    mode was = flush_small();
    SETS[p->set].run(p);
    restore(was);
    return answered(p) ? ANSWERED : NOT_FINITE;
}

/* Many steps that have nothing to do with each other; how many were answered before one was not. */
CALL int64_t palpate_many(const palpate_program *p, int64_t count) {
    palpate_program one = *p;
    for (int64_t i = 0; i < count; i++) {
        if (palpate_step(&one) != ANSWERED) return i;
        one.x += p->inputs;
        one.y += p->outputs;
    }
    return count;
}
