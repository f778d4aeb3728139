// Compiles functions a second time for AVX2; the loader picks the version. Only for arithmetic that gives the
// same bits either way: there are no fused operations (-ffp-contract=off). Tests that compare the two
// versions build once more with KILN_PLAIN.
#pragma once

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_THREAD__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(KILN_PLAIN)
#define KILN_WIDE __attribute__((target_clones("avx2", "default"), optimize("O3")))
#else
#define KILN_WIDE
#endif
#define KILN_INLINE [[gnu::always_inline]] inline
