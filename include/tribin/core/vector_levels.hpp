#pragma once

// Loops that run on wider vectors where the processor has them, lane by lane and never fused: each level gives the same
// bytes (tests/simd compares them). TRIBIN_ONE_LEVEL, a target's name, builds a loop for that level alone.
#if defined(TRIBIN_ONE_LEVEL)
#define TRIBIN_VECTOR_LEVELS __attribute__((target(TRIBIN_ONE_LEVEL)))
#elif defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_THREAD__)
#define TRIBIN_VECTOR_LEVELS __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define TRIBIN_VECTOR_LEVELS
#endif
