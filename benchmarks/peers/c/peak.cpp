/* What the machine can do at most: independent fused multiply-adds, and independent divisions, in its widest registers. */
#ifdef __AVX512F__
#define BYTES 64
#else
#define BYTES 32
#endif
#define CHAINS 12
#define EACH(i) _Pragma("GCC unroll 16") for (int i = 0; i < CHAINS; i++)
typedef double reals __attribute__((vector_size(BYTES)));

/* rounds of CHAINS operations on whole registers; the sum is returned so that they are done */
extern "C" double multiply_add(long rounds)
{
    reals a[CHAINS], total = {};
    EACH(i) a[i] = reals{} + 1.0 + i;
    const reals factor = reals{} + 0.999999, term = reals{} + 1e-6;
    for (long round = 0; round < rounds; round++) EACH(i) a[i] = a[i] * factor + term;
    EACH(i) total += a[i];
    return total[0];
}

extern "C" double divide(long rounds)
{
    reals a[CHAINS], total = {};
    EACH(i) a[i] = reals{} + 1.5 + i;
    const reals one = reals{} + 1.000001;
    for (long round = 0; round < rounds; round++) EACH(i) a[i] = one / a[i];
    EACH(i) total += a[i];
    return total[0];
}

extern "C" int operations(void) { return CHAINS * BYTES / 8; }
