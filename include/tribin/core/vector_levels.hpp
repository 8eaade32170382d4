#pragma once

// Loops that run on wider vectors where the processor has them, lane by lane and never fused: each level gives the same
// bytes.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_THREAD__)
#define TRIBIN_VECTOR_LEVELS __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define TRIBIN_VECTOR_LEVELS
#endif
