/* One instruction set's vectors and elementary functions. Included once for each set, with LANES, ROWS and N(name). */

typedef float N(vec) __attribute__((vector_size(4 * LANES)));
typedef int32_t N(ivec) __attribute__((vector_size(4 * LANES)));
typedef float N(loose) __attribute__((vector_size(4 * LANES), aligned(4), may_alias));

INLINE N(vec) N(load)(const float *p) { return *(const N(loose) *)p; }
INLINE void N(store)(float *p, N(vec) v) { *(N(loose) *)p = v; }
INLINE N(vec) N(all)(float x) { return x - (N(vec)){0}; }
INLINE N(vec) N(pick)(N(ivec) mask, N(vec) yes, N(vec) no) {
#if LANES == 16
    return (N(vec))_mm512_mask_mov_ps((__m512)no, _mm512_movepi32_mask((__m512i)mask), (__m512)yes);
#elif LANES == 8
    return (N(vec))_mm256_blendv_ps((__m256)no, (__m256)yes, (__m256)mask);
#else
    return (N(vec))((mask & (N(ivec))yes) | (~mask & (N(ivec))no));
#endif
}
/* In these two, what is not a number stays so; the processor's maximum gives its second operand then. */
INLINE N(vec) N(relu)(N(vec) x) {
#if LANES == 16
    return (N(vec))_mm512_max_ps(_mm512_setzero_ps(), (__m512)x);
#elif LANES == 8
    return (N(vec))_mm256_max_ps(_mm256_setzero_ps(), (__m256)x);
#else
    return N(pick)(x < 0, (N(vec)){0}, x);
#endif
}
INLINE N(vec) N(greatest)(N(vec) x, N(vec) y) { return N(pick)(x != x, x, N(pick)(x > y, x, y)); }
INLINE N(vec) N(size_of)(N(vec) x) { return (N(vec))((N(ivec))x & 0x7fffffff); }
INLINE N(vec) N(signed_as)(N(vec) x, N(vec) sign) {
    return (N(vec))(((N(ivec))x & 0x7fffffff) | ((N(ivec))sign & (int32_t)0x80000000));
}

/* The first n numbers only. */
INLINE void N(store_part)(float *p, N(vec) v, int64_t n) {
    if (n >= LANES) {
        N(store)(p, v);
        return;
    }
#if LANES == 16
    _mm512_mask_storeu_ps(p, (__mmask16)((1u << n) - 1), (__m512)v);
#else
    float held[LANES];
    N(store)(held, v);
    memcpy(p, held, (size_t)n * sizeof(float));
#endif
}

/* The first n numbers, zeros beyond. */
INLINE N(vec) N(load_part)(const float *p, int64_t n) {
    if (n >= LANES) return N(load)(p);
#if LANES == 16
    return (N(vec))_mm512_maskz_loadu_ps((__mmask16)((1u << n) - 1), p);
#else
    float held[LANES] = {0};
    memcpy(held, p, (size_t)n * sizeof(float));
    return N(load)(held);
#endif
}

/* Zeros from the nth number on. */
INLINE N(vec) N(first)(N(vec) v, int64_t n) {
    if (n >= LANES) return v;
#if LANES == 16
    return (N(vec))_mm512_maskz_mov_ps((__mmask16)((1u << n) - 1), (__m512)v);
#else
    for (int64_t i = n; i < LANES; i++) v[i] = 0;
    return v;
#endif
}

INLINE float N(sum)(N(vec) v) {
#if LANES == 16
    return _mm512_reduce_add_ps((__m512)v);
#elif LANES == 8
    __m128 s = _mm_add_ps(_mm256_castps256_ps128((__m256)v), _mm256_extractf128_ps((__m256)v, 1));
    s = _mm_add_ps(s, _mm_movehl_ps(s, s));
    return _mm_cvtss_f32(_mm_add_ss(s, _mm_shuffle_ps(s, s, 1)));
#else
    return (v[0] + v[2]) + (v[1] + v[3]);
#endif
}

#define EXP_LOW -87.33654f
#define EXP_HIGH 88.72283f

/* The first of two that is above the second; the second where one is no number. */
INLINE N(vec) N(above)(N(vec) x, N(vec) y) {
#if LANES == 16
    return (N(vec))_mm512_max_ps((__m512)x, (__m512)y);
#elif LANES == 8
    return (N(vec))_mm256_max_ps((__m256)x, (__m256)y);
#else
    return N(pick)(x > y, x, y);
#endif
}

/* e^x for x <= 0: x = n ln 2 + r, a polynomial of r (Cephes expf), times 2^n; relative error below 1.2e-7.
   Far below, what is left is not 0 but 1e-38. */
INLINE N(vec) N(exp_below)(N(vec) x) {
    x = N(above)(N(all)(EXP_LOW), x);
    N(vec) n = (x * 1.44269504088896341f + 12582912.0f) - 12582912.0f;
    N(vec) r = x - n * 0.693359375f;
    r = r + n * 2.12194440e-4f;
    N(vec) y = r * 1.9875691500e-4f + 1.3981999507e-3f;
    y = y * r + 8.3334519073e-3f;
    y = y * r + 4.1665795894e-2f;
    y = y * r + 1.6666665459e-1f;
    y = y * r + 5.0000001201e-1f;
    y = y * (r * r) + (r + 1.0f);
    return y * (N(vec))((__builtin_convertvector(n, N(ivec)) + 127) << 23);
}

INLINE N(vec) N(exp)(N(vec) x) {
    N(vec) size = N(exp_below)(-N(size_of)(x));
    N(vec) y = N(pick)(x < 0, size, 1.0f / size);
    y = N(pick)(x < EXP_LOW, (N(vec)){0}, y);
    return N(pick)(x > EXP_HIGH, N(all)(__builtin_inff()), y);
}

INLINE N(vec) N(sigmoid)(N(vec) x) { return 1.0f / (1.0f + N(exp)(-x)); }

/* Cephes tanhf: a polynomial below 0.625, 1 - 2 / (e^2x + 1) above. */
INLINE N(vec) N(tanh)(N(vec) x) {
    N(vec) size = N(size_of)(x), z = x * x;
    N(vec) near = z * -5.70498872745e-3f + 2.06390887954e-2f;
    near = near * z - 5.37397155531e-2f;
    near = near * z + 1.33314422036e-1f;
    near = near * z - 3.33332819422e-1f;
    near = near * z * x + x;
    N(vec) far = 1.0f - 2.0f / (N(exp)(size + size) + 1.0f);
    return N(pick)(size < 0.625f, near, N(signed_as)(far, x));
}

/* Natural logarithm of what is above 0 (Cephes logf). */
INLINE N(vec) N(log)(N(vec) x) {
    N(ivec) bits = (N(ivec))x;
    N(vec) e = __builtin_convertvector((bits >> 23) - 126, N(vec));
    N(vec) m = (N(vec))((bits & 0x007fffff) | 0x3f000000);
    N(ivec) small = m < 0.70710678f;
    e = e - N(pick)(small, N(all)(1.0f), (N(vec)){0});
    m = m + N(pick)(small, m, (N(vec)){0}) - 1.0f;
    N(vec) z = m * m, y = m * 7.0376836292e-2f - 1.1514610310e-1f;
    y = y * m + 1.1676998740e-1f;
    y = y * m - 1.2420140846e-1f;
    y = y * m + 1.4249322787e-1f;
    y = y * m - 1.6668057665e-1f;
    y = y * m + 2.0000714765e-1f;
    y = y * m - 2.4999993993e-1f;
    y = y * m + 3.3333331174e-1f;
    y = y * m * z + e * -2.12194440e-4f - 0.5f * z;
    y = m + y + e * 0.693359375f;
    return N(pick)(x - x == 0, y, x);
}

/* The error function: x P(x^2) below 1, 1 - e^-x^2 P(1 / (1 + x/2)) above; both minimax to below 3e-9. */
INLINE N(vec) N(erf)(N(vec) x) {
    N(vec) size = N(size_of)(x), held = N(pick)(size > 4.0f, N(all)(4.0f), size);
    N(vec) z = held * held, t = 1.0f / (1.0f + 0.5f * held);
    N(vec) near = z * 7.882497111e-05f - 8.018854993e-04f;
    near = near * z + 5.189311943e-03f;
    near = near * z - 2.685432880e-02f;
    near = near * z + 1.128359746e-01f;
    near = near * z - 3.761262690e-01f;
    near = near * z + 1.128379166e+00f;
    N(vec) far = t * -5.354061603e-02f - 5.733873558e-02f;
    far = far * t + 4.038383630e-01f;
    far = far * t + 1.012682446e-01f;
    far = far * t + 3.308406805e-01f;
    far = far * t + 2.736181535e-01f;
    far = 1.0f - (far * t + 6.064087403e-04f) * N(exp)(-z);
    N(vec) y = N(pick)(size < 1.0f, near * x, N(signed_as)(far, x));
    return N(pick)(x != x, x, y);
}

INLINE N(vec) N(softplus)(N(vec) x) {
    N(vec) u = N(exp)(-N(size_of)(x));
    N(vec) more = N(pick)(u < 1e-3f, u - 0.5f * u * u, N(log)(1.0f + u));
    return N(relu)(x) + more;
}

INLINE N(vec) N(elu)(N(vec) x) {
    N(vec) held = N(pick)(x > 0, (N(vec)){0}, x), z = held * held;
    N(vec) near = held + z * (0.5f + held * 1.66666672e-1f + z * (4.16666679e-2f + held * 8.33333377e-3f));
    N(vec) below = N(pick)(held > -0.1f, near, N(exp)(held) - 1.0f);
    return N(pick)(x > 0, x, below);
}

INLINE N(vec) N(function)(int64_t which, N(vec) x) {
    switch (which) {
    case FN_RELU: return N(relu)(x);
    case FN_TANH: return N(tanh)(x);
    case FN_SIGMOID: return N(sigmoid)(x);
    case FN_GELU: return 0.5f * x * (1.0f + N(erf)(x * 0.70710678118654752f));
    case FN_ELU: return N(elu)(x);
    case FN_LEAKY: return N(pick)(x < 0, x * 0.2f, x);
    case FN_SOFTPLUS: return N(softplus)(x);
    case FN_EXP: return N(exp)(x);
    case FN_LOG: return N(log)(N(pick)(x < 1e-10f, N(all)(1e-10f), x));
    case FN_SQUARE: return x * x;
    default: return N(size_of)(x);
    }
}
